#pragma once

/// \file
/// Output files that are complete or absent.

#include <filesystem>
#include <string>
#include <string_view>

namespace btfield::detail {

/// A file under construction. The bytes go to temporary(), a hidden name in the target's folder, and commit()
/// renames it over the target; without commit() the destructor removes it and the target stays as it was.
///
/// A symbolic link as target stays a link: the file it points to is replaced. A replaced file keeps its
/// permission bits. A character device or FIFO as target (/dev/null, /dev/stdout) is never replaced:
/// temporary() then lies in the system's folder for temporary files and commit() copies its bytes into the
/// target.
class FileOutput {
  public:
    /// Creates the empty temporary file. The target's type decides nothing else: any extension is kept.
    /// \param asked  first part of the messages, such as "write 'bark.png'"
    /// \throws InputError when the folder does not exist or cannot be written, or the target is a folder, a
    ///     block device, a socket or a file without write permission.
    FileOutput(const std::filesystem::path& target, std::string asked);
    ~FileOutput() noexcept;
    FileOutput(const FileOutput&) = delete;
    FileOutput& operator=(const FileOutput&) = delete;

    /// Where to write; has the extension of the target.
    [[nodiscard]] const std::filesystem::path& temporary() const noexcept { return temporary_; }

    /// Flushes the temporary file to the disk and moves it to the target. Call once, after the writer has
    /// closed it.
    /// \throws InputError when that fails; the temporary file is removed by the destructor.
    void commit();

  private:
    std::string asked_;
    std::filesystem::path target_;
    std::filesystem::path temporary_;
    bool special_ = false;  ///< target is a device or FIFO: copied into, not replaced
};

/// Puts the bytes into the file, completely or not at all.
/// \throws InputError as FileOutput, and on a full disk.
void write_file(const std::filesystem::path& target, std::string_view bytes, const std::string& asked);

/// Throws what FileOutput would throw for this target, and leaves nothing behind.
void check_output(const std::filesystem::path& target, const std::string& asked);

}  // namespace btfield::detail
