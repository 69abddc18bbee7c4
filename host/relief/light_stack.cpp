#include "host/relief/light_stack.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/parallel.hpp"
#include "host/base/srgb_curve.hpp"
#include "host/base/text.hpp"
#include "host/base/work_part.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Pixels at which rules and codings are judged.
constexpr size_t sample_count = 1000;

double linear_of(double value, LightCoding coding, double gamma) {
    if (coding == LightCoding::srgb) return srgb_decoded(value);
    if (coding == LightCoding::gamma) return std::pow(std::max(value, 0.0), gamma);
    return value;
}

ReadOptions reading_of(const ReliefOptions& options) {
    ReadOptions reading;
    reading.crop = options.crop;
    reading.keep_values = true;
    return reading;
}

/// Numbers of a file, as fractions of their type's largest, as they are stored.
void store(std::span<const float> values, StackForm form, std::byte* to) {
    const auto whole = [&]<class Number>(Number* numbers, float largest) {
        for (size_t i = 0; i < values.size(); ++i)
            numbers[i] = static_cast<Number>(std::lrint(values[i] * largest));
    };
    if (form == StackForm::bytes)
        whole(reinterpret_cast<std::uint8_t*>(to), 255.0F);
    else if (form == StackForm::shorts)
        whole(reinterpret_cast<std::uint16_t*>(to), 65535.0F);
    else
        std::memcpy(to, values.data(), values.size_bytes());
}

/// And back.
void restore(const std::byte* from, StackForm form, std::span<float> values) {
    const auto whole = [&]<class Number>(const Number* numbers, float largest) {
        for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(numbers[i]) / largest;
    };
    if (form == StackForm::bytes)
        whole(reinterpret_cast<const std::uint8_t*>(from), 255.0F);
    else if (form == StackForm::shorts)
        whole(reinterpret_cast<const std::uint16_t*>(from), 65535.0F);
    else
        std::memcpy(values.data(), from, values.size_bytes());
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

std::vector<float> LightDecoder::table(int largest) const {
    std::vector<float> table(static_cast<size_t>(largest) + 1);
    for (size_t i = 0; i < table.size(); ++i) table[i] = table_[i * 65535 / static_cast<size_t>(largest)];
    return table;
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
        if (kept_) store(values, form(), values_.data() + plane * area(size_) * bytes_of(form()));
    }
}

StackForm LightStack::form() const {
    return type_ == PixelType::uint8    ? StackForm::bytes
           : type_ == PixelType::uint16 ? StackForm::shorts
                                        : StackForm::floats;
}

void LightStack::choose_strips(size_t strip_values, double most_bytes) {
    const double row = static_cast<double>(lights_) * planes_ * size_.width;
    double rows = static_cast<double>(strip_values) / row;
    // What is read again passes through floats.
    if (!kept_ && set_ != nullptr) rows = std::min(rows, most_bytes / (4.0 * row));
    constexpr auto rows_of_group = static_cast<int>(group_rows);
    // Whole groups, whatever they take: the result does not depend on strips.
    rows_of_strip_ =
        std::max(static_cast<int>(std::min<double>(rows, size_.height)) / rows_of_group, 1) * rows_of_group;
}

LightStack::LightStack(const LightSet& lights, const ReliefOptions& options, double most_bytes,
                       size_t strip_values)
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
    const double all = static_cast<double>(lights_) * planes_ * static_cast<double>(area(size_)) *
                       static_cast<double>(bytes_of(form()));
    kept_ = all <= most_bytes;
    choose_strips(strip_values, most_bytes);
    if (kept_) values_.resize(static_cast<size_t>(all));
    const Stage stage("read");
    for_each_part(lights_, [&](int k) {
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

LightStack::LightStack(std::span<const Image> pictures, const ReliefOptions& options, size_t strip_values)
    : pictures_(pictures), options_(options), lights_(static_cast<int>(pictures.size())) {
    size_ = pictures.front().size();
    planes_ = pictures.front().planes();
    for (const Image& picture : pictures)
        if (picture.size() != size_ || picture.planes() != planes_)
            throw InputError("fit a relief", "pictures differ in size or planes",
                             "give pictures of one kind");
    if (!options.ignore_mask) read_mask(options.mask);
    choose_samples();
    choose_strips(strip_values, std::numeric_limits<double>::infinity());
    for (int k = 0; k < lights_; ++k) take(k, pictures[static_cast<size_t>(k)]);
}

void LightStack::copy(int light, size_t first, size_t count, std::byte* to, size_t pitch) const {
    const size_t bytes = bytes_of(form());
    const auto begin = static_cast<size_t>(light) * static_cast<size_t>(planes_);
    Image strip;
    if (!kept_ && set_ != nullptr) {
        ReadOptions reading = reading_of(options_);
        const Crop crop = options_.crop.value_or(Crop{0, 0, size_.width, size_.height});
        reading.crop = Crop{crop.x, crop.y + static_cast<int>(first) / size_.width, size_.width,
                            static_cast<int>(count) / size_.width};
        strip = read_picture(set_->lights[static_cast<size_t>(light)].picture, reading).image;
    }
    for (int p = 0; p < planes_; ++p) {
        std::byte* plane = to + static_cast<size_t>(p) * pitch;
        if (kept_)
            std::memcpy(plane,
                        values_.data() + ((begin + static_cast<size_t>(p)) * area(size_) + first) * bytes,
                        count * bytes);
        else if (set_ != nullptr)
            store(strip.plane(p), form(), plane);
        else
            std::memcpy(plane, pictures_[static_cast<size_t>(light)].plane(p).data() + first, count * bytes);
    }
}

void LightStack::rows(int first, int count, const LightDecoder& decoder, std::vector<float>& values) const {
    const PixelStack stored = strip(first, count, decoder);
    const size_t part = stored.pixels, planes = static_cast<size_t>(planes_);
    values.resize(static_cast<size_t>(lights_) * planes * part);
    for_each_block(lights_, [&](int k) {
        float* to = values.data() + static_cast<size_t>(k) * planes * part;
        if (stored.form == StackForm::light) {
            stored.copy(k, reinterpret_cast<std::byte*>(to), part * sizeof(float));
            return;
        }
        const size_t pitch = part * bytes_of(stored.form);
        std::vector<std::byte> raw(planes * pitch);
        std::vector<float> numbers(part);
        stored.copy(k, raw.data(), pitch);
        for (size_t p = 0; p < planes; ++p) {
            restore(raw.data() + p * pitch, stored.form, numbers);
            decoder.decode(numbers, gain(k, static_cast<int>(p)), to + p * part);
        }
    });
}

PixelStack LightStack::strip(int first, int count, const LightDecoder& decoder) const {
    const auto width = static_cast<size_t>(size_.width), begin = static_cast<size_t>(first) * width;
    PixelStack result;
    result.form = form();
    result.pixels = width * static_cast<size_t>(count);
    result.width = width;
    result.planes = planes_;
    const int largest = type_ == PixelType::uint8 ? 255 : 65535;
    for (int k = 0; k < lights_; ++k)
        for (int p = 0; p < planes_; ++p)
            result.gains.push_back(integers() && decoder.linear() ? gain(k, p) / static_cast<float>(largest)
                                                                  : gain(k, p));
    if (integers() && !decoder.linear()) result.table = decoder.table(largest);
    result.copy = [this, begin, pixels = result.pixels](int light, std::byte* to, size_t pitch) {
        copy(light, begin, pixels, to, pitch);
    };
    if (integers() || decoder.linear()) return result;
    result.form = StackForm::light;
    result.copy = [this, begin, pixels = result.pixels, &decoder](int light, std::byte* to, size_t pitch) {
        copy(light, begin, pixels, to, pitch);
        for (int p = 0; p < planes_; ++p) {
            auto* values = reinterpret_cast<float*>(to + static_cast<size_t>(p) * pitch);
            decoder.decode({values, pixels}, gain(light, p), values);
        }
    };
    return result;
}

}  // namespace btfield::detail
