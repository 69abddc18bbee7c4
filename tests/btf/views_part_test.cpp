// host/btf/views_part.cpp, part_file.cpp, and fits that have a part.

#include "host/btf/views_part.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <string>

#include "btfield/btf_model.hpp"
#include "btfield/btf_textures.hpp"
#include "btfield/error.hpp"
#include "host/base/checksum.hpp"
#include "host/btf/joint_planes.hpp"
#include "tests/device_cases.hpp"
#include "tests/full_disk.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

namespace fs = std::filesystem;

constexpr Size side{24, 32};
constexpr std::size_t views = 6, lights = 5, colours = 2;
constexpr int rank = 7;

/// Pictures of noise that sees the light, and how many were read.
class CountedPictures : public BtfSource {
  public:
    explicit CountedPictures(std::uint32_t salt = 0) : salt_(salt) {
        description_.format = "made";
        description_.size = side;
        description_.planes = static_cast<int>(colours);
        for (std::size_t v = 0; v < views; ++v)
            description_.views.push_back({0.2 * static_cast<double>(v), static_cast<double>(v)});
        for (std::size_t l = 0; l < lights; ++l)
            description_.lights.push_back({0.2 * static_cast<double>(l), static_cast<double>(l)});
        description_.height = Image(side, 1);
        for (int r = 0; r < side.height; ++r)
            for (int c = 0; c < side.width; ++c)
                description_.height.at(0, r, c) = static_cast<float>(std::cos(0.4 * r) + std::sin(0.5 * c));
    }
    [[nodiscard]] const BtfDescription& description() const override { return description_; }
    [[nodiscard]] Image picture(int view, int light) const override {
        ++read;
        Image image(side, description_.planes);
        std::mt19937 engine(salt_);
        const auto next = [&] { return static_cast<double>(engine()) / 4294967296.0; };
        for (int p = 0; p < image.planes(); ++p)
            for (float& value : image.plane(p)) {
                const double one = next(), other = next();
                value = static_cast<float>(0.2 + 0.05 * p + 0.3 * one + 0.1 * light * other +
                                           0.02 * view * one * other);
            }
        if (view == black_view) std::ranges::fill(image.values(), 0.0F);
        return image;
    }
    BtfDescription& described() { return description_; }
    mutable std::atomic<int> read{0};
    int black_view = -1;

  private:
    BtfDescription description_;
    std::uint32_t salt_;
};

BtfFitOptions quick() {
    BtfFitOptions options;
    options.planes = 3;
    options.periodic = true;
    options.field.order = 1;
    options.field.levels = 1;
    return options;
}

/// What a progress callback ends a fit with.
struct Enough {};

class BtfPart : public testing::Test {
  protected:
    BtfPart() : source_(std::make_shared<CountedPictures>()), set_(source_) {}
    [[nodiscard]] std::string bytes(const BtfModel& model) const {
        write_btf_model(folder_ / "x.btfm", model);
        return test::bytes_of(folder_ / "x.btfm");
    }
    /// Pictures that are read until it is done.
    [[nodiscard]] int read_by(const BtfFitOptions& options, const std::string& whole, std::size_t resumed) {
        source_->read = 0;
        const BtfFit fit = fit_btf(device_, set_, options);
        EXPECT_EQ(bytes(fit.model), whole);
        EXPECT_EQ(fit.resumed, resumed);
        return source_->read;
    }
    void refused(const BtfSet& set, const BtfFitOptions& options, const std::string& why) {
        try {
            static_cast<void>(fit_btf(device_, set, options));
            ADD_FAILURE() << why;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
        }
    }
    [[nodiscard]] ReducedView reduced(int view) const {
        return reduce_view(static_cast<int>(lights), static_cast<int>(colours), area(side), rank,
                           [&](int light, std::span<float> to) {
                               const Image image = set_.picture(view, light);
                               std::ranges::copy(image.values(), to.begin());
                           });
    }
    Device device_ = test::device_of_width(8);
    std::shared_ptr<CountedPictures> source_;
    BtfSet set_;
    test::TemporaryFolder folder_;
    const fs::path part_ = folder_ / "x.part";
};

bool same(const ReducedView& a, const ReducedView& b) {
    const auto bits = [](std::span<const double> x, std::span<const double> y) {
        return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size_bytes()) == 0;
    };
    const auto all = [](const RowMajorMatrix& m) {
        return std::span(m.data(), static_cast<std::size_t>(m.size()));
    };
    return bits(a.mean, b.mean) && bits(a.contrast, b.contrast) && bits(a.offset, b.offset) &&
           a.basis.cols() == b.basis.cols() && bits(all(a.basis), all(b.basis)) && bits(a.units, b.units) &&
           bits({&a.energy, 1}, {&b.energy, 1}) && bits({&a.lost, 1}, {&b.lost, 1}) &&
           std::ranges::equal(a.values.span(), b.values.span());
}

TEST_F(BtfPart, FitsThatEndedEarlyGoOn) {
    BtfFitOptions options = quick();
    options.leave_out.pairs = 5;
    const std::string whole = bytes(fit_btf(device_, set_, options).model);
    options.part = part_;
    // One picture tells the part what set it is of, those left out are compared in the end.
    const int left_out = static_cast<int>(views);
    for (const auto& [stage, least, there] :
         {std::tuple("pictures", 0.3, 2), std::tuple("pictures", 0.7, 5), std::tuple("planes", 0.0, 6)}) {
        options.progress = [&, stage = std::string(stage), least = least](std::string_view now,
                                                                          double share) {
            if (now == stage && share >= least) throw Enough();
        };
        EXPECT_THROW(static_cast<void>(fit_btf(device_, set_, options)), Enough);
        ViewsPart part(part_, set_, {.pairs = 5}, 2 * options.planes + 16);
        int found = 0;
        for (std::size_t v = 0; v < views; ++v) found += part.find(v, (lights - 1) * colours).has_value();
        EXPECT_EQ(found, there) << stage << " " << least;
    }
    options.progress = {};
    // As a process leaves it that is killed while it writes the last view.
    fs::resize_file(part_, fs::file_size(part_) - 11);
    const int compared =
        read_by(options, whole, (views - 1) * (lights - 1)) - 1 - static_cast<int>(lights - 1);
    // And when all is there, nothing is left to read.
    EXPECT_EQ(read_by(options, whole, views * (lights - 1)), 1 + compared);
    EXPECT_GE(compared, left_out);
    // What does not matter to views may change.
    options.table_error = 0.0;
    options.scale = 0.5;
    options.periodic = false;
    EXPECT_EQ(fit_btf(device_, set_, options).resumed, views * (lights - 1));
}

TEST_F(BtfPart, DamagedViewsAreReadAgain) {
    BtfFitOptions options = quick();
    const std::string whole = bytes(fit_btf(device_, set_, options).model);
    options.part = part_;
    EXPECT_EQ(read_by(options, whole, 0), static_cast<int>(views * lights) + 1);
    std::string damaged = test::bytes_of(part_);
    damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 1);
    test::put_bytes(part_, damaged);
    EXPECT_EQ(read_by(options, whole, (views - 1) * lights), static_cast<int>(lights) + 1);
    EXPECT_EQ(read_by(options, whole, views * lights), 1);
}

TEST_F(BtfPart, ViewsWithoutDetailAndWithoutPicturesAreKeptToo) {
    source_->black_view = 2;
    source_->described().present.assign(views * lights, 1);
    for (std::size_t l = 0; l < lights; ++l) source_->described().present[4 * lights + l] = 0;
    source_->described().present[1] = 0;
    const BtfSet set(source_);
    BtfFitOptions options = quick();
    const std::string whole = bytes(fit_btf(device_, set, options).model);
    options.part = part_;
    EXPECT_EQ(bytes(fit_btf(device_, set, options).model), whole);
    source_->read = 0;
    const BtfFit again = fit_btf(device_, set, options);
    EXPECT_EQ(again.resumed, views * lights - lights - 1);
    EXPECT_EQ(bytes(again.model), whole);
    EXPECT_EQ(source_->read, 1);
}

TEST_F(BtfPart, PartsOfOtherFitsAreRefused) {
    BtfFitOptions options = quick();
    options.part = part_;
    static_cast<void>(fit_btf(device_, set_, options));
    const std::string kept = test::bytes_of(part_);
    BtfFitOptions other = options;
    other.planes = 4;
    refused(set_, other, "other options");
    other = options;
    other.leave_out.pairs = 4;
    refused(set_, other, "other options");
    // The same directions, other pictures.
    refused(BtfSet(std::make_shared<CountedPictures>(7)), options, "another set");
    BtfOptions some;
    some.pixel_stride = 2;
    refused(BtfSet(source_, some), options, "another set");
    {
        const ViewsPart open(part_, set_, {}, 2 * options.planes + 16);
        refused(set_, options, "another fit is at it");
    }
    BtfTexturesOptions textures(BtfMethod::each);
    textures.part = part_;
    EXPECT_THROW(static_cast<void>(fit_btf_textures(device_, set_, textures)), InputError);
    EXPECT_EQ(test::bytes_of(part_), kept);
    for (const char* text : {"{}\nnothing", "a letter", R"({"format":"btfield-btf-part","software":"x"})"}) {
        test::put_bytes(part_, text);
        refused(set_, options, "");
        EXPECT_EQ(test::bytes_of(part_), text);
    }
    options.part = "/nowhere/x.part";
    refused(set_, options, "No such file");
    options.part = folder_.path();
    refused(set_, options, "Is a directory");
    options.part = "/dev/null";
    refused(set_, options, "it is no file");
}

TEST_F(BtfPart, FullDisksLoseNothing) {
    BtfFitOptions options = quick();
    const std::string whole = bytes(fit_btf(device_, set_, options).model);
    options.part = part_;
    static_cast<void>(fit_btf(device_, set_, options));
    const std::uintmax_t all = fs::file_size(part_);
    for (const std::uintmax_t room : {all * 3 / 4, all / 2, std::uintmax_t{100}}) {
        fs::remove(part_);
        {
            const test::FullDisk disk(room);
            refused(set_, options, "make room, and run the fit again");
        }
        EXPECT_LE(fs::file_size(part_), room);
        const BtfFit fit = fit_btf(device_, set_, options);
        EXPECT_EQ(fit.resumed, room > all / 2 ? 4 * lights : room == all / 2 ? 2 * lights : 0);
        EXPECT_EQ(bytes(fit.model), whole);
    }
}

TEST_F(BtfPart, LittleMemoryIsEnough) {
    BtfFitOptions options = quick();
    const std::string whole = bytes(fit_btf(device_, set_, options).model);
    const int most = 2 * options.planes + 16;
    const double kept = static_cast<double>(views) * reduced_bytes(lights * colours, area(side), most);
    EXPECT_EQ(kept, views * lights * colours * area(side) * sizeof(std::int16_t));
    const double work = std::max(reduction_bytes(lights * colours, area(side), most),
                                 joint_planes_bytes(area(side), views, options.planes, most));
    const auto device_of = [](double memory) {
        DeviceOptions little;
        little.vector_width = 8;  // as device_, or last bits may differ
        little.fft = FftBackend::lanes;
        little.memory_bytes = static_cast<std::uint64_t>(memory);
        return Device({}, little);
    };
    Device enough = device_of(work + kept + 1.0), little = device_of(work + 1.0),
           too_little = device_of(work - 1.0);
    const auto refused_by = [&](Device& device, const std::string& why) {
        try {
            static_cast<void>(fit_btf(device, set_, options));
            ADD_FAILURE() << why;
        } catch (const InputError& error) {
            EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
        }
    };
    EXPECT_EQ(bytes(fit_btf(enough, set_, options).model), whole);
    refused_by(little, "keep views in a part, crop");
    refused_by(too_little, "and work on them");
    options.part = part_;
    EXPECT_EQ(bytes(fit_btf(little, set_, options).model), whole);
    refused_by(too_little, "read one at a time");
}

/// What can become of a file.
std::string damaged(std::string bytes, std::mt19937& random) {
    const auto below = [&](std::size_t count) { return static_cast<std::size_t>(random()) % count; };
    const std::size_t at = below(bytes.size());
    switch (below(6)) {
        case 0:
            bytes[at] = static_cast<char>(bytes[at] ^ static_cast<char>(1U << below(8)));
            break;
        case 1:
            bytes.resize(at);
            break;
        case 2:
            bytes.erase(at, 1 + below(100));
            break;
        case 3:
            bytes.insert(at, 1 + below(100), static_cast<char>(random()));
            break;
        case 4:
            std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end(), '\0');
            break;
        default:
            for (std::size_t i = at; i < std::min(at + 8, bytes.size()); ++i)
                bytes[i] = static_cast<char>(random());
    }
    return bytes;
}

TEST_F(BtfPart, DamageNeverShows) {
    std::vector<ReducedView> truth;
    {
        ViewsPart part(part_, set_, {}, rank);
        for (std::size_t v = 0; v < views; ++v) {
            truth.push_back(reduced(static_cast<int>(v)));
            EXPECT_TRUE(same(part.kept(v, truth[v]), truth[v]));
            EXPECT_FALSE(part.find(v, lights * colours).has_value());
        }
    }
    const std::string good = test::bytes_of(part_);
    std::mt19937 random(11);
    std::size_t found = 0, opened = 0;
    for (int round = 0; round < 300; ++round) {
        test::put_bytes(part_, damaged(good, random));
        try {
            ViewsPart part(part_, set_, {}, rank);
            ++opened;
            for (std::size_t v = 0; v < views; ++v) {
                const auto view = part.find(v, lights * colours);
                EXPECT_TRUE(!view || same(*view, truth[v])) << round << " " << v;
                found += view.has_value();
            }
            static_cast<void>(part.kept(0, truth[0]));
        } catch (const InputError&) {
            continue;
        }
        // What is written after damage is there the next time.
        const ViewsPart part(part_, set_, {}, rank);
        const auto view = part.find(0, lights * colours);
        ASSERT_TRUE(view.has_value()) << round;
        EXPECT_TRUE(same(*view, truth[0]));
    }
    EXPECT_GE(opened, 150U);
    EXPECT_GE(found, opened * views / 3);
    EXPECT_LT(found, opened * views);
}

TEST_F(BtfPart, RecordsThatTellNonsenseAreNoViews) {
    {
        ViewsPart part(part_, set_, {}, rank);
        static_cast<void>(part.kept(0, reduced(0)));
    }
    const std::string good = test::bytes_of(part_);
    const std::size_t head = good.find('\n') + 1, record = head + 16;
    std::uint64_t length = 0;
    std::memcpy(&length, good.data() + head, 8);
    ASSERT_EQ(record + (length + 7) / 8 * 8, good.size());
    const auto is_view = [&](const std::string& payload) {
        std::string bytes = good.substr(0, head);
        const std::uint64_t size = payload.size();
        std::string summed(8, '\0');
        std::memcpy(summed.data(), &size, 8);
        summed += payload;
        const std::uint64_t sum = checksum(std::as_bytes(std::span(summed)));
        bytes.append(summed, 0, 8).append(reinterpret_cast<const char*>(&sum), 8).append(payload);
        bytes.append((8 - payload.size() % 8) % 8, '\0');
        test::put_bytes(part_, bytes);
        const ViewsPart part(part_, set_, {}, rank);
        return part.find(0, lights * colours).has_value();
    };
    const std::string payload = good.substr(record, length);
    EXPECT_TRUE(is_view(payload));
    for (std::size_t field = 0; field < 4; ++field)
        for (const std::uint64_t value : {std::uint64_t{1}, std::uint64_t{8}, std::uint64_t{1} << 32,
                                          std::uint64_t{1} << 61, ~std::uint64_t{0}}) {
            std::string other = payload;
            std::memcpy(other.data() + 8 * field, &value, 8);
            EXPECT_FALSE(is_view(other)) << field << " " << value;
        }
    std::string other = payload;
    const double nothing = std::nan("");
    std::memcpy(other.data() + 32 + 16 + 8 * 3, &nothing, 8);
    EXPECT_FALSE(is_view(other));
    EXPECT_FALSE(is_view(""));
    EXPECT_FALSE(is_view(payload.substr(0, 31)));
    EXPECT_FALSE(is_view(payload.substr(0, 32)));
    EXPECT_FALSE(is_view(payload + "ab"));
}

}  // namespace
}  // namespace btfield
