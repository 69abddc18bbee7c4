#pragma once

// What a fit of a BTF has done so far, in a file that outlives the process (theory 21.2, 22.3).

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "btfield/btf_set.hpp"
#include "host/base/file_output.hpp"

namespace btfield::detail {

/// Where the bytes of a record are. Places of records are multiples of 8.
struct PartRecord {
    std::uint64_t at = 0, bytes = 0;
};

/// Bytes of a file as memory that cannot be written; copies share them, and the last one lets them go.
struct MappedBytes {
    std::shared_ptr<const std::byte> first;
    std::size_t size = 0;
    [[nodiscard]] std::span<const std::byte> span() const { return {first.get(), size}; }
};

/// A line of JSON that tells what the file is a part of, and records, each with its length and a checksum:
/// whenever a process ends, at most the record that it was writing is lost. Locked while it is open.
class PartFile {
  public:
    /// Checks what the file holds, reading it once, and cuts off a record that is not complete. One that is
    /// damaged is passed over.
    /// \param path  empty: nothing is kept
    /// \param options  what matters to the records beside the set
    /// \throws InputError when the file is of another set or other options, in use, or cannot be written
    PartFile(const std::filesystem::path& path, const BtfSet& set, const nlohmann::ordered_json& options);

    /// Whether there is a file.
    [[nodiscard]] bool keeps() const { return file_.get() >= 0; }
    /// Those that were there when it was opened.
    [[nodiscard]] const std::vector<PartRecord>& records() const { return records_; }
    /// \throws InputError
    [[nodiscard]] MappedBytes mapped(const PartRecord& record) const;
    /// Writes the pieces as one record, at the end. Any number of threads at a time.
    /// \throws InputError where that fails; what it had written is taken back
    PartRecord append(std::initializer_list<std::span<const std::byte>> pieces);
    /// For messages.
    [[nodiscard]] const std::string& asked() const { return asked_; }

  private:
    void open(const std::filesystem::path& path);
    void read(const std::string& header);
    void check_header(const std::string& header, std::uint64_t size) const;
    [[nodiscard]] std::uint64_t sum_of(const PartRecord& record) const;
    void read_at(std::uint64_t at, std::span<std::byte> to) const;
    /// \return whether all is written; errno tells why not
    [[nodiscard]] bool write_at(std::uint64_t at, std::span<const std::byte> bytes) const;
    void cut(std::uint64_t size) const;

    std::string asked_;
    Descriptor file_;
    std::mutex writing_;
    std::uint64_t end_ = 0;
    std::vector<PartRecord> records_;
};

}  // namespace btfield::detail
