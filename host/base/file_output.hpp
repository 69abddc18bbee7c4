#pragma once

/// \file
/// Output files that are complete or absent.

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

namespace btfield::detail {

/// An open file, closed on every way out; close() reports what a destructor could not.
class Descriptor {
  public:
    explicit Descriptor(int value = -1) : value_(value) {}
    Descriptor(Descriptor&& other) noexcept : value_(std::exchange(other.value_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        std::swap(value_, other.value_);
        return *this;
    }
    ~Descriptor();
    [[nodiscard]] int get() const { return value_; }
    [[nodiscard]] bool close();

  private:
    int value_;
};

/// A file under construction. The bytes go to temporary() or descriptor(), and commit() moves them to the
/// target; without commit() the target stays as it was and nothing is left.
///
/// The file has no name until then, so that nothing is left even of a process that is killed; where the file
/// system cannot do that, it has a hidden one in the target's folder, noted for remove_temporaries().
/// temporary() is a name under /proc that no writer can make again once the file is removed.
///
/// A symbolic link as target stays a link: the file it points to is replaced. A replaced file keeps its
/// permission bits. A character device or FIFO as target (/dev/null) is never replaced, nor is an open file
/// of this process (/dev/stdout, /dev/fd/3), whatever it leads to: commit() copies the bytes into it.
class FileOutput {
  public:
    /// Opens the empty file. The target's type decides nothing else: any extension is kept.
    /// \param asked  first part of the messages, such as "write 'bark.png'"
    /// \param hidden  whether the file has a hidden name in any case
    /// \throws InputError when the folder does not exist or cannot be written, or the target is a folder, a
    ///     block device, a socket or a file without write permission.
    FileOutput(const std::filesystem::path& target, std::string asked, bool hidden = false);
    ~FileOutput() noexcept;
    FileOutput(const FileOutput&) = delete;
    FileOutput& operator=(const FileOutput&) = delete;

    /// Where to write; its extension says nothing.
    [[nodiscard]] const std::filesystem::path& temporary() const noexcept { return temporary_; }
    /// The same file, for writing from the start.
    [[nodiscard]] int descriptor() const noexcept { return file_.get(); }

    /// Whether the target is not a file: commit() copies into it.
    [[nodiscard]] bool special() const noexcept { return special_; }
    /// Tells the disk to begin with what was written, and does not wait. A hint: failures are flush()'s.
    void begin_flush() const noexcept;
    /// Waits until the bytes are on the disk.
    /// \throws InputError when that fails, such as for a full disk
    void flush() const;

    /// Moves the file to the target. Call once, after the writer has closed it.
    /// \param flushed  to the disk before, as flush() does: a crash then never leaves an empty file
    /// \throws InputError when that fails
    void commit(bool flushed = true);

  private:
    void open_in_memory();
    void open_in(const std::filesystem::path& folder, bool hidden);
    void copy_to_target();

    std::string asked_;
    std::filesystem::path target_, temporary_;
    std::filesystem::path hidden_;  ///< a noted name of the file; empty where it has none
    Descriptor file_, sink_;
    bool special_ = false;   ///< target is copied into, not replaced
    bool replaces_ = false;  ///< target is a file that exists
};

/// Puts the bytes into the file, completely or not at all.
/// \throws InputError as FileOutput, and on a full disk.
void write_file(const std::filesystem::path& target, std::string_view bytes, const std::string& asked,
                bool flushed = true);

/// Throws what FileOutput would throw for this target, and leaves nothing behind.
void check_output(const std::filesystem::path& target, const std::string& asked);

}  // namespace btfield::detail
