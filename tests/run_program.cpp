#include "tests/run_program.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <memory>
#include <stdexcept>

#include "tests/temporary_folder.hpp"

namespace btfield::test {

Terminal::Terminal() : descriptor_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    if (descriptor_ < 0 || ::grantpt(descriptor_) != 0 || ::unlockpt(descriptor_) != 0) {
        throw std::runtime_error("no terminal");
    }
    child_side_ = ::ptsname(descriptor_);
}

Terminal::~Terminal() {
    ::close(descriptor_);
}

void Terminal::type(const std::string& keys) const {
    if (::write(descriptor_, keys.data(), keys.size()) != static_cast<ssize_t>(keys.size()))
        throw std::runtime_error("a terminal that takes no keys");
}

std::string Terminal::read() const {
    std::string text;
    char buffer[4096];
    for (;;) {
        const ssize_t got = ::read(descriptor_, buffer, sizeof buffer);
        if (got <= 0) return text;
        text.append(buffer, static_cast<std::size_t>(got));
    }
}

[[noreturn]] void become(char* const* arguments, const Surroundings& around, const char* out,
                         const char* err) {
    const auto redirect = [](const char* path, int descriptor) {
        const int file = ::open(path, O_WRONLY | O_CREAT | O_NOCTTY, 0666);
        if (file < 0 || ::dup2(file, descriptor) < 0) ::_exit(126);
        if (file != descriptor) ::close(file);
    };
    if (!around.folder.empty() && ::chdir(around.folder.c_str()) != 0) ::_exit(126);
    redirect(err, STDERR_FILENO);
    if (around.close_out) {
        ::close(STDOUT_FILENO);
    } else {
        redirect(out, STDOUT_FILENO);
    }
    ::signal(SIGXFSZ,
             SIG_DFL);  // an ignored signal would stay ignored, and hide that the program must do that
    const rlimit limit{around.file_limit, around.file_limit};
    if (around.file_limit != RLIM_INFINITY && ::setrlimit(RLIMIT_FSIZE, &limit) != 0) ::_exit(126);
    ::execv(arguments[0], arguments);
    ::_exit(127);
}

Running::Running(std::vector<std::string> words, const std::filesystem::path& folder,
                 const Surroundings& around)
    : words_(std::move(words)), out_((folder / "child-out").string()), err_((folder / "child-err").string()) {
    std::vector<char*> arguments;
    for (std::string& word : words_) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    child_ = ::fork();
    if (child_ != 0) return;
    for (const int signal : {SIGINT, SIGQUIT}) ::signal(signal, SIG_DFL);  // a shell's `&` ignores them
    become(arguments.data(), around, out_.c_str(), err_.c_str());
}

void Running::kill(int signal) const {
    ::kill(child_, signal);
}

int Running::wait() {
    int status = 0;
    ::waitpid(child_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string Running::err() const {
    return bytes_of(err_);
}

Ended run_program(std::vector<std::string> words, const Surroundings& around) {
    const TemporaryFolder folder;
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const std::string out = around.out.empty() ? (folder / "out").string() : around.out;
    const std::unique_ptr<Terminal> terminal = around.terminal ? std::make_unique<Terminal>() : nullptr;
    const std::string err = terminal ? terminal->child_side() : (folder / "err").string();

    const pid_t child = ::fork();
    if (child < 0) throw std::runtime_error("fork");
    if (child == 0) become(arguments.data(), around, out.c_str(), err.c_str());
    Ended ended;
    if (terminal) ended.err = terminal->read();
    int status = 0;
    if (::waitpid(child, &status, 0) != child) throw std::runtime_error("waitpid");
    ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    if (around.out.empty() && !around.close_out) ended.out = bytes_of(out);
    if (!terminal) ended.err = bytes_of(err);
    return ended;
}

}  // namespace btfield::test
