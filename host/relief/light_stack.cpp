#include "host/relief/light_stack.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/parallel.hpp"
#include "host/base/text.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Pixels at which rules and codings are judged.
constexpr size_t sample_count = 1000;
/// Values that are decoded and sent to the device together.
constexpr size_t strip_values = size_t{1} << 23U;

double linear_of(double value, LightCoding coding, double gamma) {
    if (coding == LightCoding::srgb)
        return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
    if (coding == LightCoding::gamma) return std::pow(std::max(value, 0.0), gamma);
    return value;
}

ReadOptions reading_of(const ReliefOptions& options) {
    ReadOptions reading;
    reading.crop = options.crop;
    reading.keep_values = true;
    return reading;
}

std::string asked_of(const LightPicture& light) {
    return "take '" + light.picture.string() + "' for the view under a light";
}

}  // namespace

LightDecoder::LightDecoder(LightCoding coding, double gamma, bool integers)
    : integers_(integers), coding_(coding), gamma_(gamma) {
    if (!integers || coding == LightCoding::linear) return;
    for (int i = 0; i < 65536; ++i)
        table_.push_back(static_cast<float>(linear_of(i / 65535.0, coding, gamma)));
}

float LightDecoder::operator()(float value, float gain) const {
    if (!integers_ && coding_ == LightCoding::linear) return std::max(0.0F, value) * gain;
    if (!integers_)
        return std::max(0.0F, static_cast<float>(linear_of(static_cast<double>(value), coding_, gamma_))) *
               gain;
    if (coding_ == LightCoding::linear) return (value < 1.0F ? gain : -gain) * value;
    const auto at = static_cast<size_t>(std::lround(std::clamp(value, 0.0F, 1.0F) * 65535.0F));
    return at == 65535 ? -gain * table_[at] : gain * table_[at];
}

void LightDecoder::decode(std::span<const float> values, float gain, float* to) const {
    if (coding_ != LightCoding::linear) {
        for (size_t i = 0; i < values.size(); ++i) to[i] = (*this)(values[i], gain);
    } else if (integers_) {
        // What (*this)(value, gain) gives.
        for (size_t i = 0; i < values.size(); ++i) to[i] = (values[i] < 1.0F ? gain : -gain) * values[i];
    } else {
        for (size_t i = 0; i < values.size(); ++i) to[i] = std::max(0.0F, values[i]) * gain;
    }
}

float LightStack::gain(int light, int plane) const {
    if (set_ == nullptr) return 1.0F;
    const std::vector<double>& intensity = set_->lights[static_cast<size_t>(light)].intensity;
    if (intensity.empty()) return 1.0F;
    return static_cast<float>(1.0 / intensity[intensity.size() == 1 ? 0 : static_cast<size_t>(plane)]);
}

void LightStack::choose_samples() {
    std::vector<size_t> surface;
    for (size_t i = 0; i < area(size_); ++i)
        if (covers(i)) surface.push_back(i);
    if (surface.empty())
        throw InputError("fit a relief", "the mask leaves no pixel of the surface",
                         "mark it above half of white");
    // By the golden section, neither a grid nor at random.
    const size_t count = std::min(sample_count, surface.size());
    double at = 0.0;
    for (size_t i = 0; i < count; ++i) {
        sampled_.push_back(count == surface.size()
                               ? surface[i]
                               : surface[static_cast<size_t>(at * static_cast<double>(surface.size()))]);
        at += 0.6180339887498949;
        at -= std::floor(at);
    }
    samples_.resize(static_cast<size_t>(lights_) * static_cast<size_t>(planes_) * count);
}

void LightStack::read_mask(const std::filesystem::path& mask) {
    if (mask.empty()) return;
    const Picture picture = read_picture(mask, reading_of(options_));
    if (picture.image.size() != size_)
        throw InputError(
            "take '" + mask.string() + "' for the mask",
            "it has " + text_of(picture.image.size()) + " pixels, the pictures " + text_of(size_),
            "give a mask of their size");
    inside_.resize(area(size_));
    for (size_t i = 0; i < inside_.size(); ++i) inside_[i] = picture.image.plane(0)[i] > 0.5F ? 1 : 0;
}

void LightStack::take(int light, const Image& picture) {
    const size_t first = static_cast<size_t>(light) * static_cast<size_t>(planes_);
    for (int p = 0; p < planes_; ++p) {
        const auto plane = first + static_cast<size_t>(p);
        const std::span<const float> values = picture.plane(p);
        for (size_t i = 0; i < sampled_.size(); ++i)
            samples_[plane * sampled_.size() + i] = values[sampled_[i]];
        if (kept_)
            std::ranges::copy(values, values_.begin() + static_cast<std::ptrdiff_t>(plane * area(size_)));
    }
}

LightStack::LightStack(const LightSet& lights, const ReliefOptions& options, double most_bytes)
    : set_(&lights), options_(options), lights_(static_cast<int>(lights.lights.size())) {
    const Picture front = read_picture(lights.lights.front().picture, reading_of(options));
    size_ = front.image.size();
    planes_ = front.image.planes();
    type_ = front.type;
    for (const LightPicture& light : lights.lights)
        if (light.intensity.size() > 1 && light.intensity.size() != static_cast<size_t>(planes_))
            throw InputError(asked_of(light),
                             "it has " + counted(planes_, "plane") + " and " +
                                 std::to_string(light.intensity.size()) + " intensities",
                             "give one intensity, or one for each plane");
    if (!options.ignore_mask) read_mask(options.mask.empty() ? lights.mask : options.mask);
    choose_samples();
    const double row = 4.0 * lights_ * planes_ * size_.width;
    rows_of_strip_ =
        std::clamp(static_cast<int>(4.0 * static_cast<double>(strip_values) / row), 1, size_.height);
    kept_ = row * size_.height <= most_bytes;
    if (!kept_) rows_of_strip_ = std::clamp(static_cast<int>(most_bytes / row), 1, rows_of_strip_);
    if (kept_) values_.resize(static_cast<size_t>(lights_) * static_cast<size_t>(planes_) * area(size_));
    for_each_block(lights_, [&](int k) {
        const LightPicture& light = lights.lights[static_cast<size_t>(k)];
        const Picture picture = k == 0 ? front : read_picture(light.picture, reading_of(options));
        if (picture.image.size() != size_)
            throw InputError(asked_of(light),
                             "it has " + text_of(picture.image.size()) + " pixels and '" +
                                 lights.lights.front().picture.string() + "' " + text_of(size_),
                             "give pictures of one size");
        if (picture.image.planes() != planes_)
            throw InputError(asked_of(light),
                             "it has " + counted(picture.image.planes(), "plane") + " and '" +
                                 lights.lights.front().picture.string() + "' " + std::to_string(planes_),
                             "give pictures of one kind");
        take(k, picture.image);
    });
}

LightStack::LightStack(std::span<const Image> pictures, const ReliefOptions& options)
    : pictures_(pictures), options_(options), lights_(static_cast<int>(pictures.size())) {
    size_ = pictures.front().size();
    planes_ = pictures.front().planes();
    for (const Image& picture : pictures)
        if (picture.size() != size_ || picture.planes() != planes_)
            throw InputError("fit a relief", "pictures differ in size or planes",
                             "give pictures of one kind");
    if (!options.ignore_mask) read_mask(options.mask);
    choose_samples();
    const double row = 4.0 * lights_ * planes_ * size_.width;
    rows_of_strip_ =
        std::clamp(static_cast<int>(4.0 * static_cast<double>(strip_values) / row), 1, size_.height);
    for (int k = 0; k < lights_; ++k) take(k, pictures[static_cast<size_t>(k)]);
}

void LightStack::rows(int first, int count, const LightDecoder& decoder, std::vector<float>& values) const {
    const auto width = static_cast<size_t>(size_.width), part = width * static_cast<size_t>(count);
    const size_t begin = static_cast<size_t>(first) * width;
    values.resize(static_cast<size_t>(lights_) * static_cast<size_t>(planes_) * part);
    for_each_block(lights_, [&](int k) {
        Image strip;
        const auto light = static_cast<size_t>(k);
        if (!kept_ && set_ != nullptr) {
            ReadOptions reading = reading_of(options_);
            const Crop crop = options_.crop.value_or(Crop{0, 0, size_.width, size_.height});
            reading.crop = Crop{crop.x, crop.y + first, size_.width, count};
            strip = read_picture(set_->lights[light].picture, reading).image;
        }
        for (int p = 0; p < planes_; ++p) {
            const size_t plane = light * static_cast<size_t>(planes_) + static_cast<size_t>(p);
            const float* from = kept_             ? values_.data() + plane * area(size_) + begin
                                : set_ != nullptr ? strip.plane(p).data()
                                                  : pictures_[light].plane(p).data() + begin;
            decoder.decode({from, part}, gain(k, p), values.data() + plane * part);
        }
    });
}

}  // namespace btfield::detail
