# What no compiler sees: awk -f tests/check_sources.awk FILE..., from the root of the repository. One line per defect,
# FILE:LINE: WHAT: WHY; the exit status is 1 when there is any. Bytes, not characters: run it with LC_ALL=C.
#   - a "theory N.M" is a heading of docs/theory.md, and every document that is mentioned exists;
#   - rooms include rooms that stand before them in BTFIELD_ROOMS of CMakeLists.txt, or themselves: see CONTRIBUTING.md;
#   - the room cl alone speaks OpenCL; commands and experiments leave the code of pictures, and what uses it, in the library;
#   - \param, \return and \throws begin their lines; comments end at column 110 at the latest, in kernels at 128.

BEGIN {
    rooms = ""
    while ((getline line <"CMakeLists.txt") > 0) {
        if (line ~ /^set\(BTFIELD_ROOMS/) reading = 1
        if (reading) rooms = rooms " " line
        if (line ~ /\)/) reading = 0
    }
    gsub(/set\(BTFIELD_ROOMS|\).*/, "", rooms)
    count = split(rooms, room_list)
    if (count == 0) defect("CMakeLists.txt", 1, "no BTFIELD_ROOMS", "the order of the rooms is read from there")
    for (k = 1; k <= count; ++k) rank[room_list[k]] = k

    # The room of btfield/X.hpp is that of the X.cpp which includes it, or that of its name. A header without either
    # includes nothing but such headers, and all may include it.
    while (("grep -H '^#include \"btfield/' host/*/*.cpp" | getline line) > 0) {
        split(line, part, /[\/:".]+/)  # host ROOM X cpp #include btfield HEADER hpp
        if (part[2] != "cli" && part[3] == part[7]) room_of_header[part[3]] = part[2]
    }
    for (k in rank) if (k != "cli") room_of_header[k] = k

    while ((getline line <"docs/theory.md") > 0) {
        if (line ~ /^##+ [0-9]+(\.[0-9]+)?[. ]/) {
            split(line, part, " ")
            sub(/\.$/, "", part[2])
            heading[part[2]] = 1
        }
    }
}

function defect(file, line, what, why) {
    print file ":" line ": " what ": " why
    failed = 1
}

function exists(file,    line, found) {
    if (!(file in known)) {
        known[file] = (getline line <file) >= 0
        close(file)
    }
    return known[file]
}

function check_citations(text,    number) {
    while (match(text, /(^|[^A-Za-z])[Tt]heory [0-9]/)) {
        text = substr(text, RSTART + RLENGTH - 1)
        while (match(text, /^[0-9]+(\.[0-9]+)?/)) {
            number = substr(text, 1, RLENGTH)
            if (!(number in heading))
                defect(FILENAME, FNR, "cites theory " number, "docs/theory.md has no section of that number")
            text = substr(text, RLENGTH + 1)
            if (!match(text, /^(, | to | and )[0-9]/)) break
            text = substr(text, RLENGTH)
        }
    }
}

function check_documents(text,    name, folder) {
    folder = FILENAME
    if (!sub(/\/[^\/]*$/, "/", folder)) folder = ""
    while (match(text, /[A-Za-z0-9_.\/-]+\.md($|[^A-Za-z0-9_])/)) {
        name = substr(text, RSTART, RLENGTH)
        text = substr(text, RSTART + RLENGTH)
        sub(/\.md.*/, ".md", name)
        if (!exists(name) && !exists(folder name) && !exists("docs/" name))
            defect(FILENAME, FNR, "mentions " name, "the repository has no such document")
    }
}

# Rank of what a file may include: that of its own room, none where there is no rule.
function own_rank(    part, stem) {
    split(FILENAME, part, "/")
    if (part[1] == "host" || part[1] == "kernels" || part[1] == "tests") return rank[part[2]]
    if (FILENAME !~ /^include\/btfield\//) return 0
    stem = part[3]
    sub(/\.hpp$/, "", stem)
    if (stem == "btfield") return 0  # includes all others
    return stem in room_of_header ? rank[room_of_header[stem]] : 1
}

function check_include(text,    part, stem, room) {
    sub(/^# *include *["<]/, "", text)
    if (text ~ /^Eigen\// && FILENAME ~ /^host\// && FILENAME !~ /^host\/base\/(eigen\.hpp|decompositions\.cpp)$/)
        defect(FILENAME, FNR, "includes " text, "what it compiles anew stands for what eigen.cpp compiles once, and brings its whole room into the command")
    sub(/[">].*/, "", text)
    split(text, part, "/")
    stem = part[2]
    sub(/\.hpp$/, "", stem)
    if (part[1] == "host") room = part[2]
    else if (part[1] == "btfield") room = room_of_header[stem]
    else if (FILENAME ~ /^kernels\//) room = part[1]
    if (part[1] != "host" && FILENAME ~ /^tests\//) return  # tests may use whatever is public
    if (FILENAME ~ /^host\/(cli|experiment)\// && text ~ /^host\/(pictures|compound|relief|btf|rendering)\// && text !~ /(_names|pixel_values)\.hpp$/)
        defect(FILENAME, FNR, "includes " text, "with it a program gets a second copy of the room pictures, whose module is not beside it")
    own = own_rank()
    if (own > 0 && room in rank && rank[room] > own)
        defect(FILENAME, FNR, "includes " text ", of the room " room,
               room_list[own] " stands before " room " in BTFIELD_ROOMS and includes only what stands before itself")
}

function check_comment(text, widest) {
    gsub(/[\200-\277]/, "", text)  # all bytes of a character but the first
    if (length(text) > widest)
        defect(FILENAME, FNR, "a comment of " length(text) " columns", "comments end at column " widest " at the latest")
    sub(/^ *\/\/+<? *(\\[a-z]+)?/, "", text)
    if (match(text, /\\(param|tparam|return|throws)( |$)/))
        defect(FILENAME, FNR, "a \\param, \\return or \\throws inside a line", "each begins a line of its own")
}

# Names of OpenCL and clFFT, and the headers that bring them. Error codes may be read in tests of messages.
function check_opencl() {
    if (FILENAME !~ /\.(cpp|hpp|inc)$/ || FILENAME ~ /^(host|tests)\/cl\//) return
    if (FILENAME ~ /^tests\// && $0 ~ /"CL_/) return
    if (FILENAME ~ /^(include\/btfield\/device_opencl\.hpp|examples\/opencl_program\.cpp)$/) return  # for who does
    defect(FILENAME, FNR, "speaks OpenCL", "only the room cl does; other rooms ask a DeviceImpl")
}

/theory [0-9]|Theory [0-9]/ { check_citations($0) }
/\.md/ && FILENAME !~ /^docs\/site\// { check_documents($0) }  # the site has pages of its own
/(^|[^A-Z_])(MODEL[S]|DESIG[N]|LAYOU[T])([^A-Z_]|$)/ {
    defect(FILENAME, FNR, "cites a document that the repository lacks", "docs/theory.md is cited as theory N.M")
}
/^# *include/ { check_include($0) }
/^ *\/\// && FILENAME ~ /\.[hc]pp$/ { check_comment($0, 110) }
/^ *\/\// && FILENAME ~ /\.clh?$/ { check_comment($0, 128) }
/(^|[^A-Za-z0-9_])(cl::|cl_[a-z]|CL_[A-Z]|clfft[A-Z]|CL\/|clFFT\.h|host\/cl\/(api|program)\.hpp)/ { check_opencl() }
END { exit failed }
