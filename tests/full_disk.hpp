#pragma once

#include <sys/resource.h>

#include <csignal>
#include <stdexcept>

namespace btfield::test {

/// While it lives no file of this process can grow beyond `bytes`: what a full disk does, without rights or
/// mounts.
class FullDisk {
  public:
    explicit FullDisk(rlim_t bytes) {
        // Writes shall fail as on a full disk; the signal would end the process.
        if (::getrlimit(RLIMIT_FSIZE, &before_) != 0) throw std::runtime_error("getrlimit");
        handler_ = std::signal(SIGXFSZ, SIG_IGN);
        rlimit limit = before_;
        limit.rlim_cur = bytes;
        if (::setrlimit(RLIMIT_FSIZE, &limit) != 0) throw std::runtime_error("setrlimit");
    }
    ~FullDisk() {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }
    FullDisk(const FullDisk&) = delete;
    FullDisk& operator=(const FullDisk&) = delete;

  private:
    rlimit before_{};
    void (*handler_)(int) = nullptr;
};

}  // namespace btfield::test
