#include "host/btf/picture_store.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/strict_json.hpp"
#include "host/btf/file_stamp.hpp"
#include "host/btf/memory_file.hpp"
#include "host/pictures/picture_codec.hpp"
#include "host/pictures/picture_format.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;
using std::size_t;

/// How deep pictures may lie: SET/MATERIAL/VIEW/PICTURE.
constexpr int deepest = 4;

class FolderStore : public PictureStore {
  public:
    FolderStore(const fs::path& folder, const std::string& asked) {
        std::error_code error;
        fs::recursive_directory_iterator at(folder, error);
        for (const fs::recursive_directory_iterator end; !error && at != end; at.increment(error)) {
            if (at.depth() >= deepest) at.disable_recursion_pending();
            std::error_code ignored;
            if (!at->is_regular_file(ignored)) continue;
            const std::uintmax_t bytes = at->file_size(ignored);
            files_.push_back({at->path(), ignored ? 0 : bytes});
        }
        if (error)
            throw InputError(asked, "it cannot be listed: " + error.message(), "check its permissions");
        std::ranges::sort(files_, {}, &StoredFile::name);
    }
    [[nodiscard]] Picture read(size_t file, const ReadOptions& options) const override {
        return read_picture(files_[file].name, options);
    }
    [[nodiscard]] std::string content(size_t file) const override { return file_content(files_[file].name); }
    [[nodiscard]] std::string stamp(size_t file) const override { return file_stamp(files_[file].name); }
};

class ZipStore : public PictureStore {
  public:
    ZipStore(const fs::path& path, const std::string& asked)
        : path_(path),
          stamp_(file_stamp(path)),
          archive_(picture_codec(asked).open_archive(path, asked)),
          entries_(archive_->entries()) {
        std::ranges::sort(entries_, {}, &ZipEntry::name);
        for (const ZipEntry& entry : entries_) files_.push_back({entry.name, entry.bytes});
    }
    [[nodiscard]] Picture read(size_t file, const ReadOptions& options) const override {
        const std::string asked = asked_of(file);
        const MemoryFile unpacked(asked, content(file));
        try {
            return read_picture(unpacked.path(), options);
        } catch (const InputError& error) {
            throw InputError(asked, error.found(), error.remedy());
        }
    }
    [[nodiscard]] std::string content(size_t file) const override {
        return archive_->read(entries_[file], asked_of(file));
    }
    [[nodiscard]] std::string stamp(size_t) const override { return stamp_; }

  private:
    [[nodiscard]] std::string asked_of(size_t file) const {
        return "read '" + printable(entries_[file].name) + "' in '" + path_.string() + "'";
    }

    fs::path path_;
    std::string stamp_;
    std::unique_ptr<ZipArchive> archive_;
    std::vector<ZipEntry> entries_;
};

}  // namespace

int PictureStore::find(const std::string& file_name) const {
    int found = -1;
    std::ptrdiff_t depth = 0;
    for (size_t i = 0; i < files_.size(); ++i) {
        const fs::path& name = files_[i].name;
        const std::ptrdiff_t own = std::distance(name.begin(), name.end());
        if (name.filename() != file_name || (found >= 0 && own >= depth)) continue;
        found = static_cast<int>(i);
        depth = own;
    }
    return found;
}

std::unique_ptr<PictureStore> open_store(const fs::path& path, const std::string& asked) {
    std::error_code error;
    if (fs::is_directory(path, error)) return std::make_unique<FolderStore>(path, asked);
    return std::make_unique<ZipStore>(path, asked);
}

}  // namespace btfield::detail
