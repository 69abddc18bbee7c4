// Completion scripts in real shells: keys are typed on a terminal, and what the shell then runs is looked at.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/cli_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;
using test::btfield;
using test::bytes_of;
using test::Ended;
using test::expect_failure;
using test::put_bytes;
using test::run_program;
using test::Surroundings;
using test::TemporaryFolder;
using test::Words;

/// A shell with a terminal of its own, into which keys are typed before it starts.
void type(const Words& shell, const std::string& keys, const fs::path& folder) {
    Words words = shell;
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const test::Terminal terminal;
    const int typing = ::open(terminal.child_side().c_str(), O_RDWR | O_NOCTTY);
    ASSERT_GE(typing, 0);
    terminal.type(keys);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        ::setsid();
        const int own = ::open(terminal.child_side().c_str(), O_RDWR);  // becomes the controlling terminal
        for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(own, descriptor);
        if (::chdir(folder.c_str()) == 0) ::execv(arguments[0], arguments.data());
        ::_exit(127);
    }
    ::close(typing);
    const std::string seen = terminal.read();
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status)) << seen;
}

/// A folder with files to complete, and the words that `btfield` is called with there.
class Typed {
  public:
    Typed() {
        fs::create_directory(folder_ / "best");
        for (const char* name : {"cork.png", "best.json", "two words.png"}) put_bytes(folder_ / name, "");
    }
    [[nodiscard]] const TemporaryFolder& folder() const { return folder_; }

    /// In the words of a shell: what `btfield` does there.
    [[nodiscard]] std::string command() const {
        return "btfield() { if [ \"$1\" = completion ]; then '" + test::command_path() +
               "' \"$@\"; else printf '<%s>' \"$@\" >>heard; printf '\\n' >>heard; fi; }\n";
    }

    /// Types each of the lines and compares what the shell made of them.
    void expect(const Words& shell, const std::vector<std::pair<std::string, std::string>>& lines) const {
        std::string keys, heard;
        for (const auto& [typed, made] : lines) {
            keys += "btfield " + typed + "\r";
            heard += made + "\n";
        }
        type(shell, keys + "exit\r", folder_.path());
        EXPECT_EQ(fs::exists(folder_ / "heard") ? bytes_of(folder_ / "heard") : "nothing", heard);
    }

  private:
    TemporaryFolder folder_;
};

/// What all shells complete alike.
const std::vector<std::pair<std::string, std::string>> lines{
    {"fi\t", "<fit>"},
    {"experiment ru\t", "<experiment><run>"},
    {"fit cor\t -o m.json", "<fit><cork.png><-o><m.json>"},
    {"fit two\t", "<fit><two words.png>"},
    {"fit --noi\t full", "<fit><--noise><full>"},
    {"fit --model 3d-c\t", "<fit><--model><3d-car>"},
    {"fit --model 2d-m\tsa\t", "<fit><--model><2d-msar>"},
    {"fit -o m.json --est\t aut\t", "<fit><-o><m.json><--estimator><auto>"},
    {"fit --neighbourhood cor\t12", "<fit><--neighbourhood><correlated:12>"},
    {"experiment run --synth-out bes\t", "<experiment><run><--synth-out><best/>"},
    {"experiment run best.j\t --out r.db", "<experiment><run><best.json><--out><r.db>"},
    {"synth --device cp\t", "<synth><--device><cpu>"},
    {"synth --device 0:\t best.j\t", "<synth><--device><0:0><best.json>"},
    {"fit --verb\t cork.p\t", "<fit><--verbose><cork.png>"},
    {"fit --model=3d-c\t", "<fit><--model=3d-car>"},
    {"synth --seed \t7", "<synth><--seed><7>"},
};

TEST(CliCompletion, Bash) {
    const Typed typed;
    put_bytes(typed.folder() / "rc", "PS1=\nunset HISTFILE\nbind 'set bell-style none'\n" + typed.command() +
                                         btfield({"completion", "bash"}).out);
    typed.expect({"/bin/bash", "--noprofile", "--rcfile", "rc", "-i"}, lines);
}

TEST(CliCompletion, BashOffers) {
    const TemporaryFolder folder;
    put_bytes(folder / "script", btfield({"completion", "bash"}).out + R"(
offers() { # offers LINE WORD...
    COMP_LINE=$1 COMP_POINT=${#1} COMP_WORDS=("${@:2}") COMP_CWORD=$(($# - 2))
    compopt() { :; }
    COMPREPLY=()
    _btfield
    echo "${COMPREPLY[*]}"
}
offers 'btfield f' btfield f
offers 'btfield experiment ' btfield experiment ''
offers 'btfield fit --noise ' btfield fit --noise ''
offers 'btfield fit --noise=' btfield fit --noise =
offers 'btfield fit --crop ' btfield fit --crop ''
offers 'btfield  fit   --neighbourhood correlated:' btfield fit --neighbourhood correlated :
offers 'btfield info --' btfield info --
offers 'btfield paint ' btfield paint ''
offers 'btfield --verbose inf' btfield --verbose inf
)");
    const Ended ended = run_program({"/bin/bash", "--norc", "script"}, {.folder = folder.path().string()});
    EXPECT_EQ(ended.err, "");
    EXPECT_EQ(ended.out,
              "fit\n"
              "run table merge report forget\n"
              "full diagonal\n"
              "full diagonal\n"
              "\n"
              "\n"
              "--json --help --verbose --quiet --threads --memory\n"
              "\n"
              "info\n");
}

TEST(CliCompletion, Devices) {
    const std::string words = btfield({"completion", "devices"}).out;
    EXPECT_EQ(words.rfind("auto\t", 0), 0U) << words;
    for (const auto& device : test::expect_object({"devices"})["devices"]) {
        const std::string line =
            device["spec"].get<std::string>() + "\t" + device["name"].get<std::string>() + "\n";
        EXPECT_NE(words.find("\n" + line), std::string::npos) << line << words;
    }
}

TEST(CliCompletion, FilesAndRefusals) {
    const TemporaryFolder folder;
    const Surroundings here{.folder = folder.path().string()};
    for (const std::string shell : {"bash", "zsh", "fish"}) {
        EXPECT_EQ(btfield({"completion", shell, "-o", shell}, here).code, 0);
        EXPECT_EQ(bytes_of(folder / shell), btfield({"completion", shell}).out);
    }
    put_bytes(folder / "a.png", "\x89PNG\r\n\x1a\n and more");
    expect_failure({"completion", "bash", "-o", "a.png"}, 1, "a picture is there", here);
    EXPECT_EQ(bytes_of(folder / "a.png"), "\x89PNG\r\n\x1a\n and more");
    expect_failure({"completion", "cmd"}, 2, "bash|zsh|fish");
    expect_failure({"completion"}, 2, "SHELL");
    expect_failure({"completion", "zsh", "-o", "absent/zsh"}, 1, "absent", here);
}

TEST(CliCompletionLong, Zsh) {
    const Typed typed;
    put_bytes(typed.folder() / ".zshrc",
              "PS1=\nunsetopt beep auto_remove_slash\nautoload -U compinit\ncompinit -u -D\n" +
                  typed.command() + "fpath=(. $fpath)\n" + "source ./_btfield\n");
    put_bytes(typed.folder() / "_btfield", btfield({"completion", "zsh"}).out);
    typed.expect(
        {"/usr/bin/env", "TERM=vt100", "ZDOTDIR=" + typed.folder().path().string(), "/usr/bin/zsh", "-i"},
        lines);
}

TEST(CliCompletionLong, Fish) {
    const Typed typed;
    const std::string script = (typed.folder() / "btfield.fish").string();
    put_bytes(script, btfield({"completion", "fish"}).out);
    fs::create_symlink(test::command_path(), typed.folder() / "btfield");
    for (const auto& [line, offered] : std::vector<std::pair<std::string, Words>>{
             {"fi", {"fit"}},
             {"experiment ", {"run", "table", "merge", "report", "forget"}},
             {"experiment ru", {"run"}},
             {"fit cor", {"cork.png"}},
             {"fit --noise ", {"full", "diagonal"}},
             {"fit -o m.json --model 3d-c", {"3d-car"}},
             {"fit --model=3d-c", {"--model=3d-car"}},
             {"fit --neighbourhood cor", {"correlated:"}},
             {"fit --noi", {"--noise"}},
             {"fit --verb", {"--verbose"}},
             {"experiment run --synth-out be", {"best/"}},
             {"synth --device 0", {"0:0"}},
             {"synth --seed ", {}}}) {
        SCOPED_TRACE(line);
        const Ended ended = run_program(
            {"/usr/bin/env", "HOME=" + typed.folder().path().string(), "/usr/bin/fish", "--no-config", "-c",
             "source btfield.fish; set -p PATH .; complete -C 'btfield " + line +
                 "' | string replace -r '\\t.*' ''"},
            {.folder = typed.folder().path().string()});
        EXPECT_EQ(ended.err, "");
        Words sorted = offered;
        std::sort(sorted.begin(), sorted.end());
        std::string expected;
        for (const std::string& word : sorted) expected += word + "\n";
        EXPECT_EQ(ended.out, expected);
    }
}

}  // namespace
}  // namespace btfield
