# Turns the .cl and .clh files of kernels/ into one C++ source, so that no file is looked up at run time.
#
# btfield_embed_kernels(OUTPUT FILE...): OUTPUT defines embedded_kernel(name). Includes are resolved
# here, from kernels/; #line directives make build logs point at the .cl file and line.

set(_BTFIELD_EMBED_SCRIPT ${CMAKE_CURRENT_LIST_FILE})

function(btfield_embed_kernels output)
    list(JOIN ARGN "," files)
    add_custom_command(
        OUTPUT ${output}
        COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DROOT=${CMAKE_CURRENT_SOURCE_DIR} -DFILES=${files} -P ${_BTFIELD_EMBED_SCRIPT}
        DEPENDS ${ARGN} ${_BTFIELD_EMBED_SCRIPT}
        COMMENT "Embedding kernels" VERBATIM)
endfunction()

if(CMAKE_SCRIPT_MODE_FILE STREQUAL CMAKE_CURRENT_LIST_FILE)
    cmake_minimum_required(VERSION 3.25)
    string(REPLACE "," ";" files "${FILES}")

    # Text of a file with its local includes in place, each once per program.
    function(expand file result)
        get_property(seen GLOBAL PROPERTY seen_files)
        if(file IN_LIST seen)
            set(${result} "" PARENT_SCOPE)
            return()
        endif()
        set_property(GLOBAL APPEND PROPERTY seen_files ${file})
        file(RELATIVE_PATH name ${ROOT} ${file})
        file(READ ${file} text)
        set(out "#line 1 \"${name}\"\n")
        set(line 1)
        while(text MATCHES "(^|\n)#include \"([^\"\n]+)\"")
            set(header ${CMAKE_MATCH_2})
            set(found "#include \"${header}\"")
            string(FIND "\n${text}" "\n${found}" at)  # at the start of a line: comments may quote an include
            string(SUBSTRING "${text}" 0 ${at} before)
            string(LENGTH "${found}" length)
            math(EXPR after "${at} + ${length}")
            string(SUBSTRING "${text}" ${after} -1 text)
            string(REGEX REPLACE "[^\n]" "" breaks "${before}")
            string(LENGTH "${breaks}" count)
            math(EXPR line "${line} + ${count}")
            expand(${ROOT}/kernels/${header} included)
            string(APPEND out "${before}" "${included}" "\n#line ${line} \"${name}\"\n")
        endwhile()
        string(APPEND out "${text}")
        set(${result} "${out}" PARENT_SCOPE)
    endfunction()

    set(code "// Generated from kernels/ by cmake/embed_kernels.cmake.\n#include \"host/cl/embedded_kernels.hpp\"\n\n")
    string(APPEND code "namespace btfield::detail {\n\nstd::string_view embedded_kernel(std::string_view name) {\n")
    foreach(file IN LISTS files)
        if(NOT file MATCHES "\\.cl$")
            continue()
        endif()
        set_property(GLOBAL PROPERTY seen_files "")
        get_filename_component(stem ${file} NAME_WE)
        expand(${file} text)
        string(APPEND code "    if (name == \"${stem}\")\n        return R\"btfield_cl(${text})btfield_cl\";\n")
    endforeach()
    string(APPEND code "    return {};\n}\n\n}  // namespace btfield::detail\n")
    file(WRITE ${OUTPUT} "${code}")
endif()
