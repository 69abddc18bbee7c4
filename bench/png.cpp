// PNG files of grown textures, by two threads, as a batch of `btfield synth` writes them, without the disk.
#include <array>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/png.hpp"
#include "bench/report.hpp"
#include "btfield/image_io.hpp"
#include "btfield/synthesis.hpp"
#include "host/base/parallel.hpp"
#include "host/pictures/picture_format.hpp"
#include "host/pictures/stored_picture.hpp"

namespace btfield::bench {

using namespace detail;

namespace {

constexpr Size size{512, 512};
constexpr int count = 16;

std::vector<Image> textures() {
    Synthesiser synthesiser(device(), model(5, 5), size);
    std::vector<std::uint64_t> seeds(count);
    for (std::size_t i = 0; i < seeds.size(); ++i) seeds[i] = i;
    std::vector<Image> images = synthesiser.synthesise(seeds);
    for (Image& image : images) image.set_space(ColourSpace::srgb);
    return images;
}

/// Names in a folder that lies in memory, removed at the end.
class Names {
  public:
    Names() {
        std::filesystem::create_directories(folder_);
        for (int i = 0; i < count; ++i) files_.push_back(folder_ / (std::to_string(i) + ".png"));
    }
    ~Names() { std::filesystem::remove_all(folder_); }
    Names(const Names&) = delete;
    Names& operator=(const Names&) = delete;
    [[nodiscard]] const std::filesystem::path& operator[](int i) const {
        return files_[static_cast<std::size_t>(i)];
    }

  private:
    std::filesystem::path folder_ = "/dev/shm/btfield_bench";
    std::vector<std::filesystem::path> files_;
};

}  // namespace

void add_png() {
    const std::string name = "png of 16 textures 512 rgb";
    const Work work{.items = static_cast<double>(area(size)) * 3.0 * count};
    add(name, [=] {
        const auto images = std::make_shared<std::vector<Image>>(textures());
        const auto names = std::make_shared<Names>();
        return std::pair(work, std::function<void()>([images, names] {
                             for_each_block(count, [&](int i) {
                                 const Storage storage = storage_for((*names)[i], 3, PixelType::uint8, {},
                                                                     "write a benchmark's picture");
                                 store_picture((*names)[i], (*images)[static_cast<std::size_t>(i)], storage,
                                               "write a benchmark's picture");
                             });
                         }));
    });
    // What programs that want speed ask of libpng: level 1, the filters that it chooses.
    add(name + peer_suffix, [=] {
        const auto images = std::make_shared<std::vector<Image>>(textures());
        return std::pair(
            work, std::function<void()>([images] {
                for_each_block(count, [&](int i) {
                    benchmark::DoNotOptimize(peer::png_bytes((*images)[static_cast<std::size_t>(i)]).size());
                });
            }));
    });
}

}  // namespace btfield::bench
