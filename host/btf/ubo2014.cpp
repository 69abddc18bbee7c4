#include "host/btf/ubo2014.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "btfield/error.hpp"
#include "host/base/half.hpp"
#include "host/btf/byte_file.hpp"
#include "host/btf/colour_models.hpp"
#include "host/btf/direction_grid.hpp"
#include "host/btf/ubo2014_header.hpp"

namespace btfield::detail {
namespace {

using std::size_t;
using std::uint64_t;

/// Rows of numbers in a file, row-major.
struct Matrix {
    uint64_t at = 0, rows = 0, columns = 0;
    Scalar scalar = Scalar::half;

    void read_row(const ByteFile& file, uint64_t row, float* to) const {
        read_scalars(file, at + row * columns * static_cast<uint64_t>(scalar), scalar, to, columns);
    }
    [[nodiscard]] std::vector<float> all(const ByteFile& file) const {
        std::vector<float> values(static_cast<size_t>(rows * columns));
        read_scalars(file, at, scalar, values.data(), rows * columns);
        return values;
    }
};

/// A matrix that comes next.
Matrix next_matrix(ByteCursor& cursor, uint64_t rows, uint64_t columns, Scalar scalar, const char* what) {
    const Matrix matrix{cursor.at(), rows, columns, scalar};
    if (columns > 0) {
        if (rows > cursor.left() / columns) cursor.skip(cursor.left() + 1, what);
        cursor.skip(rows * columns, static_cast<uint64_t>(scalar), what);
    }
    return matrix;
}

float product(const float* a, const float* b, uint64_t n) {
    float sum = 0.0F;
    for (uint64_t k = 0; k < n; ++k) sum += a[k] * b[k];
    return sum;
}

/// What all kinds have: directions, and pictures of them by number.
class Ubo2014 : public BtfSource {
  public:
    [[nodiscard]] const BtfDescription& description() const override { return description_; }
    [[nodiscard]] std::string stamp(int, int) const override { return file_.stamp(); }
    [[nodiscard]] Image picture(int view, int light) const override {
        const size_t at = static_cast<size_t>(view) * description_.lights.size() + static_cast<size_t>(light);
        const auto number = static_cast<uint64_t>(picture_of_[at]);
        const auto next = std::upper_bound(header_.first.begin(), header_.first.end(), number);
        const auto own_view = static_cast<uint64_t>(next - header_.first.begin()) - 1;
        Image image(description_.size, description_.planes, description_.space);
        image.set_names(description_.names);
        fill(number, own_view, number - header_.first[own_view], image);
        for (const float value : image.values())
            if (!std::isfinite(value)) file_.refuse("a pixel is not a finite number");
        return image;
    }

  protected:
    Ubo2014(ByteFile file, Ubo2014Header header, const char* format)
        : file_(std::move(file)), header_(std::move(header)) {
        description_.format = format;
        description_.size = {static_cast<int>(header_.height), static_cast<int>(header_.width)};
        description_.planes = static_cast<int>(header_.channels.size());
        description_.space = description_.planes == 3 ? ColourSpace::linear : ColourSpace::unspecified;
        if (description_.planes != 3 &&
            std::ranges::none_of(header_.channels, [](const std::string& name) { return name.empty(); }))
            description_.names = header_.channels;
        description_.light_cosine = header_.cosine || header_.version < 2;
        if (!description_.light_cosine)
            description_.remarks.emplace_back(
                "it says that its values lack the cosine of the light's angle, as reflectances do; they are "
                "taken as "
                "they are, and pictures of low lights are too bright");
        description_.bytes = file_.size();
        std::vector<MeasuredPair> pairs;
        for (size_t v = 0; v < header_.views.size(); ++v)
            for (size_t l = 0; l < header_.lights[v].size(); ++l)
                pairs.push_back(
                    {header_.views[v], header_.lights[v][l], "picture " + std::to_string(pairs.size())});
        picture_of_ = arrange(pairs, file_.asked(), description_);
    }
    /// Linear light, all planes.
    virtual void fill(uint64_t number, uint64_t view, uint64_t light, Image& image) const = 0;

    ByteFile file_;
    Ubo2014Header header_;
    BtfDescription description_;
    std::vector<int> picture_of_;
};

/// A picture or a channel of it as U (S V)ᵀ, in either of two arrangements: rows of U are directions, or
/// pixels.
class Factors {
  public:
    /// \param channels  that rows of the first have, one after the other
    Factors(ByteCursor& cursor, const ByteFile& file, const Ubo2014Header& header, uint64_t channels)
        : channels_(channels) {
        const Scalar scalar = scalar_of_bytes(cursor.take<std::uint8_t>("its factors"), file);
        const uint64_t n = cursor.take<std::uint32_t>("its factors"),
                       rows = cursor.take<std::uint32_t>("its factors"),
                       columns = cursor.take<std::uint32_t>("its factors");
        const uint64_t directions = header.pictures(), pixels = header.pixels();
        if (n < 1) file.refuse("its factors have no columns");
        const bool by_direction = rows == channels * directions && columns == pixels;
        if (!by_direction && !(rows == channels * pixels && columns == directions))
            file.refuse("its factors have " + std::to_string(rows) + " and " + std::to_string(columns) +
                        " rows for " + std::to_string(directions) + " pictures of " + std::to_string(pixels) +
                        " pixels and " + std::to_string(channels) + " channels");
        by_pixel_ = !by_direction;
        cursor.skip(n, static_cast<uint64_t>(scalar), "its factors");
        u_ = next_matrix(cursor, rows, n, scalar, "its factors");
        v_ = next_matrix(cursor, columns, n, scalar, "its factors");
        // What belongs to pixels is wanted for every picture.
        pixels_ = (by_pixel_ ? u_ : v_).all(file);
    }

    /// Values of these channels, the first plane of which is `plane`.
    void fill(const ByteFile& file, uint64_t number, int plane, Image& image) const {
        const uint64_t n = u_.columns;
        std::vector<float> own(static_cast<size_t>(std::max<uint64_t>(n, 1)) *
                               static_cast<size_t>(by_pixel_ ? 1 : channels_));
        if (by_pixel_)
            v_.read_row(file, number, own.data());
        else
            for (uint64_t c = 0; c < channels_; ++c)
                u_.read_row(file, c + channels_ * number, own.data() + c * n);
        for (uint64_t c = 0; c < channels_; ++c) {
            const std::span<float> to = image.plane(plane + static_cast<int>(c));
            for (size_t x = 0; x < to.size(); ++x)
                to[x] = by_pixel_ ? product(pixels_.data() + (c + channels_ * x) * n, own.data(), n)
                                  : product(own.data() + c * n, pixels_.data() + x * n, n);
        }
    }

  private:
    uint64_t channels_;
    bool by_pixel_ = false;
    Matrix u_, v_;
    std::vector<float> pixels_;
};

/// One factorisation of everything.
class FullFactorisation : public Ubo2014 {
  public:
    FullFactorisation(ByteFile file, Ubo2014Header header, ByteCursor cursor)
        : Ubo2014(std::move(file), std::move(header), "ubo2014-fmf") {
        cursor = ByteCursor(file_, cursor.at());
        if (header_.kind == Ubo2014Kind::fmf12) read_extras(cursor);
        static_cast<void>(cursor.take<std::uint32_t>("its factors"));
        factors_.emplace(cursor, file_, header_, header_.channels.size());
    }

  private:
    void read_extras(ByteCursor& cursor) {
        const auto extras = cursor.take<std::uint8_t>("its header");
        if (extras >= 1) logarithms_ = cursor.take<std::uint32_t>("its header") != 0;
        if (extras < 2) return;
        const uint64_t width = cursor.take<std::uint32_t>("its height map"),
                       height = cursor.take<std::uint32_t>("its height map");
        if (width == 0 || height == 0) return;
        if (width != header_.width || height != header_.height)
            file_.refuse("its height map claims " + std::to_string(width) + " x " + std::to_string(height) +
                         " pixels");
        const Matrix map = next_matrix(cursor, height, width, Scalar::half, "its height map");
        description_.height = Image(description_.size, 1);
        read_scalars(file_, map.at, map.scalar, description_.height.values().data(), width * height);
    }
    void fill(uint64_t number, uint64_t, uint64_t, Image& image) const override {
        factors_->fill(file_, number, 0, image);
        if (logarithms_)
            for (float& value : image.values()) value = std::exp(value) - least_light;
    }

    bool logarithms_ = false;
    std::optional<Factors> factors_;
};

/// One factorisation for each channel of a colour model.
class ChannelFactorisation : public Ubo2014 {
  public:
    ChannelFactorisation(ByteFile file, Ubo2014Header header, ByteCursor cursor)
        : Ubo2014(std::move(file), std::move(header), "ubo2014-dfmf") {
        cursor = ByteCursor(file_, cursor.at());
        static_cast<void>(cursor.take<std::uint32_t>("its colour model"));
        const auto model = cursor.take<std::int32_t>("its colour model");
        std::array<float, 12> numbers{};
        for (float& x : numbers) x = cursor.take<float>("its colour model");
        model_.emplace(model, numbers, description_.planes, file_);
        for (int c = 0; c < description_.planes; ++c) factors_.emplace_back(cursor, file_, header_, 1);
    }

  private:
    void fill(uint64_t number, uint64_t, uint64_t, Image& image) const override {
        for (int c = 0; c < description_.planes; ++c)
            factors_[static_cast<size_t>(c)].fill(file_, number, c, image);
        model_->decode(image);
    }

    std::optional<ColourModel> model_;
    std::vector<Factors> factors_;
};

/// Means and components of each view.
class ViewFactorisation : public Ubo2014 {
  public:
    ViewFactorisation(ByteFile file, Ubo2014Header header, ByteCursor cursor)
        : Ubo2014(std::move(file), std::move(header), "ubo2014-pvf") {
        cursor = ByteCursor(file_, cursor.at());
        uint64_t slots = header_.view_slots;
        if (!header_.old) {
            static_cast<void>(cursor.take<std::uint32_t>("its factors"));
            slots = cursor.take<std::uint32_t>("its factors");
        }
        if (slots != header_.views.size())
            file_.refuse("it has factors of " + std::to_string(slots) + " views, not " +
                         std::to_string(header_.views.size()));
        for (uint64_t v = 0; v < slots; ++v) views_.push_back(next_view(cursor, header_.lights[v].size()));
    }

  private:
    struct View {
        Matrix mean, components, weights;
        bool by_pixel = false;  ///< components are pixels, weights are lights
    };
    /// Of the view that was wanted last, the factor that belongs to pixels.
    struct Kept {
        uint64_t view = 0;
        std::vector<float> pixels;
    };

    View next_view(ByteCursor& cursor, uint64_t lights) const {
        const char* what = "the factors of a view";
        const Scalar scalar = scalar_of_bytes(cursor.take<std::uint8_t>(what), file_);
        const uint64_t n = cursor.take<std::uint32_t>(what), weights = cursor.take<std::uint32_t>(what),
                       dim = cursor.take<std::uint32_t>(what), channels = header_.channels.size();
        if (n < 1) file_.refuse("the factors of a view have no columns");
        View view;
        const bool by_light = dim == channels * lights && weights == header_.pixels();
        view.by_pixel = !by_light && dim == channels * header_.pixels() && weights == lights;
        if (!by_light && !view.by_pixel)
            file_.refuse("the factors of a view have " + std::to_string(dim) + " and " +
                         std::to_string(weights) + " rows for " + std::to_string(lights) + " lights and " +
                         std::to_string(header_.pixels()) + " pixels");
        cursor.skip(n, static_cast<uint64_t>(scalar), what);
        view.mean = next_matrix(cursor, dim, 1, scalar, what);
        view.components = next_matrix(cursor, dim, n, scalar, what);
        view.weights = next_matrix(cursor, weights, n, scalar, what);
        return view;
    }

    [[nodiscard]] std::shared_ptr<const Kept> kept(uint64_t view) const {
        const std::lock_guard lock(mutex_);
        if (!kept_ || kept_->view != view) {
            const View& own = views_[view];
            kept_ = std::make_shared<const Kept>(
                Kept{view, (own.by_pixel ? own.components : own.weights).all(file_)});
        }
        return kept_;
    }

    void fill(uint64_t, uint64_t view, uint64_t light, Image& image) const override {
        const View& own = views_[view];
        const std::shared_ptr<const Kept> pixels = kept(view);
        const uint64_t n = own.components.columns, channels = header_.channels.size();
        std::vector<float> row(static_cast<size_t>(std::max<uint64_t>(n, 1)));
        std::vector<float> means = own.by_pixel ? own.mean.all(file_) : std::vector<float>();
        if (own.by_pixel) own.weights.read_row(file_, light, row.data());
        for (uint64_t c = 0; c < channels; ++c) {
            float mean = 0.0F;
            if (!own.by_pixel) {
                own.components.read_row(file_, c + channels * light, row.data());
                own.mean.read_row(file_, c + channels * light, &mean);
            }
            const std::span<float> to = image.plane(static_cast<int>(c));
            for (size_t x = 0; x < to.size(); ++x) {
                const uint64_t at = own.by_pixel ? c + channels * x : x;
                to[x] = product(pixels->pixels.data() + at * n, row.data(), n) +
                        (own.by_pixel ? means[static_cast<size_t>(at)] : mean);
            }
        }
    }

    std::vector<View> views_;
    mutable std::mutex mutex_;
    mutable std::shared_ptr<const Kept> kept_;
};

/// Everything as it was measured: all directions of a texel together, texels in chunks.
class Texels : public Ubo2014 {
  public:
    Texels(ByteFile file, Ubo2014Header header, ByteCursor cursor)
        : Ubo2014(std::move(file), std::move(header), "ubo2014-bdi") {
        cursor = ByteCursor(file_, cursor.at());
        const uint64_t lines = cursor.take<std::uint32_t>("its header");
        const auto compression = cursor.take<std::uint8_t>("its header");
        if (compression == 1)
            throw InputError(file_.asked(), "its data are packed by bzip", "unpack it with another program");
        if (compression > 2 || lines < 1)
            file_.refuse("it has the compression " + std::to_string(compression) + " and chunks of " +
                         std::to_string(lines) + " lines");
        const std::vector<std::uint8_t> mask = cursor.take<std::uint8_t>(header_.pixels(), "its mask");
        skip_rotations(cursor);
        uint64_t stored = 0;
        for (const std::uint8_t there : mask)
            place_.push_back(compression == 2 && there == 0 ? no_place : stored++);
        find_chunks(cursor, stored, std::min(lines, uint64_t{header_.height}) * header_.width);
    }

  private:
    static constexpr uint64_t no_place = ~uint64_t{0};
    /// Bytes of one view's lights that are kept.
    static constexpr uint64_t most_kept = 1U << 29U;
    struct Kept {
        uint64_t view = 0, lights = 0;
        std::vector<std::uint16_t> values;
    };

    void find_chunks(ByteCursor& cursor, uint64_t stored, uint64_t texels) {
        texels_ = texels;
        const uint64_t texel = header_.pictures() * header_.channels.size() * sizeof(std::uint16_t);
        for (uint64_t first = 0; first < stored; first += texels) {
            const uint64_t count = std::min(texels, stored - first);
            const uint64_t bytes = cursor.take<std::uint32_t>("a chunk");
            // Claimed and stored in 32 bits.
            if (count > cursor.left() / texel || bytes != ((count * texel) & 0xffffffffU))
                file_.refuse("a chunk claims " + std::to_string(bytes) + " bytes for " +
                             std::to_string(count) + " texels of " + std::to_string(texel));
            chunks_.push_back(cursor.at());
            cursor.skip(count * texel, "a chunk");
        }
    }

    /// Values of some lights of a view, texel by texel.
    [[nodiscard]] std::vector<std::uint16_t> read(uint64_t view, uint64_t light, uint64_t lights) const {
        const uint64_t channels = header_.channels.size(), count = channels * lights;
        const uint64_t texel = header_.pictures() * channels * 2,
                       within = (header_.first[view] + light) * channels * 2;
        std::vector<std::uint16_t> values(static_cast<size_t>(header_.pixels() * count));
        for (uint64_t x = 0; x < header_.pixels(); ++x) {
            if (place_[x] == no_place) continue;
            const uint64_t at = chunks_[place_[x] / texels_] + place_[x] % texels_ * texel + within;
            file_.read(at, values.data() + x * count, count * 2);
        }
        return values;
    }

    [[nodiscard]] std::shared_ptr<const Kept> kept(uint64_t view) const {
        const std::lock_guard lock(mutex_);
        if (!kept_ || kept_->view != view) {
            const uint64_t lights = header_.lights[view].size();
            kept_ = std::make_shared<const Kept>(Kept{view, lights, read(view, 0, lights)});
        }
        return kept_;
    }

    void fill(uint64_t, uint64_t view, uint64_t light, Image& image) const override {
        const uint64_t channels = header_.channels.size(), lights = header_.lights[view].size();
        std::shared_ptr<const Kept> all;
        if (header_.pixels() * channels * lights * 2 <= most_kept)
            all = kept(view);
        else
            all = std::make_shared<const Kept>(Kept{view, 1, read(view, light, 1)});
        const uint64_t own = all->lights == 1 ? 0 : light;
        for (uint64_t c = 0; c < channels; ++c) {
            const std::span<float> to = image.plane(static_cast<int>(c));
            for (size_t x = 0; x < to.size(); ++x)
                to[x] = float_of_half(all->values[(x * all->lights + own) * channels + c]);
        }
    }

    std::vector<uint64_t> place_, chunks_;
    uint64_t texels_ = 1;
    mutable std::mutex mutex_;
    mutable std::shared_ptr<const Kept> kept_;
};

}  // namespace

std::shared_ptr<const BtfSource> open_ubo2014(const std::filesystem::path& path) {
    ByteFile file(path, "read '" + path.string() + "'");
    ByteCursor cursor(file);
    Ubo2014Header header = read_ubo2014_header(cursor, file);
    switch (header.kind) {
        case Ubo2014Kind::fmf06:
        case Ubo2014Kind::fmf12:
            return std::make_shared<FullFactorisation>(std::move(file), std::move(header), cursor);
        case Ubo2014Kind::dfmf:
            return std::make_shared<ChannelFactorisation>(std::move(file), std::move(header), cursor);
        case Ubo2014Kind::pvf:
            return std::make_shared<ViewFactorisation>(std::move(file), std::move(header), cursor);
        case Ubo2014Kind::bdi:
            break;
    }
    return std::make_shared<Texels>(std::move(file), std::move(header), cursor);
}

}  // namespace btfield::detail
