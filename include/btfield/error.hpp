#pragma once

/// \file
/// Exceptions of the library. Nothing else is thrown on purpose, and nothing is printed.

#include <stdexcept>
#include <string>

#include "btfield/api.hpp"

namespace btfield {

/// Base of every error. `what()` is one line of UTF-8, "ASKED: FOUND; REMEDY": line breaks in the parts
/// become spaces, other control characters '?', bytes that are no UTF-8 U+FFFD.
class BTFIELD_API Error : public std::runtime_error {
  public:
    /// \param asked   what the caller wanted ("read 'cork.png'")
    /// \param found   what stood in the way ("the file ends after 120 of 65536 pixels")
    /// \param remedy  what to do about it ("use a complete file")
    Error(const std::string& asked, const std::string& found, const std::string& remedy);
    [[nodiscard]] const std::string& asked() const noexcept { return asked_; }
    [[nodiscard]] const std::string& found() const noexcept { return found_; }
    [[nodiscard]] const std::string& remedy() const noexcept { return remedy_; }

  private:
    std::string asked_, found_, remedy_;
};

/// The request cannot be met: bad picture, invalid model, impossible size, unwritable file (exit code 1).
class BTFIELD_API InputError : public Error {
  public:
    using Error::Error;
};

/// A StopScope of the caller's (btfield/stop.hpp) ended the work: nothing is wrong.
class BTFIELD_API Stopped : public Error {
  public:
    using Error::Error;
};

/// An OpenCL call, kernel build or allocation failed, or no such device exists (exit code 3).
class BTFIELD_API DeviceError : public Error {
  public:
    DeviceError(const std::string& asked, const std::string& found, const std::string& remedy,
                std::string log = {});
    /// Whole build log of a kernel that did not compile, with .cl file names and lines; empty otherwise.
    [[nodiscard]] const std::string& log() const noexcept { return log_; }

  private:
    std::string log_;
};

}  // namespace btfield
