#pragma once

// Values of one view under many lights, from files or from memory, as far as memory goes.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "btfield/relief.hpp"
#include "host/relief/pixel_fit.hpp"

namespace btfield::detail {

/// From a file's numbers to linear light of a light of intensity 1.
class LightDecoder {
  public:
    /// \param integers  whether numbers are fractions of a type's largest
    LightDecoder(LightCoding coding, double gamma, bool integers);
    /// Below 0 where the number is the largest of its type.
    [[nodiscard]] float operator()(float value, float gain) const;
    void decode(std::span<const float> values, float gain, float* to) const;
    [[nodiscard]] bool linear() const { return coding_ == LightCoding::linear; }
    /// Of whole numbers from 0 to `largest`, 255 or 65535.
    [[nodiscard]] std::vector<float> table(int largest) const;

  private:
    bool integers_;
    LightCoding coding_;
    double gamma_;
    std::vector<float> table_;  ///< of whole numbers: by 1/65535
};

/// Pictures of a light set. Opens each once; keeps all where they fit, else reads rows again.
class LightStack {
  public:
    /// \param most_bytes  that may be kept
    /// \param strip_values  that are worked on together
    LightStack(const LightSet& lights, const ReliefOptions& options, double most_bytes,
               std::size_t strip_values);
    /// Pictures that are there already, and stay.
    LightStack(std::span<const Image> pictures, const ReliefOptions& options, std::size_t strip_values);

    [[nodiscard]] Size size() const { return size_; }
    [[nodiscard]] int planes() const { return planes_; }
    [[nodiscard]] int lights() const { return lights_; }
    [[nodiscard]] PixelType type() const { return type_; }
    [[nodiscard]] bool integers() const { return type_ == PixelType::uint8 || type_ == PixelType::uint16; }
    /// What values of a plane of a light are multiplied by.
    [[nodiscard]] float gain(int light, int plane) const;
    /// Rows that are worked on together.
    [[nodiscard]] int rows_of_strip() const { return rows_of_strip_; }
    /// [light][plane][row][column] of rows, decoded.
    void rows(int first, int count, const LightDecoder& decoder, std::vector<float>& values) const;
    /// Rows as they are stored; floats that are not linear are decoded. The stack and the decoder have to
    /// outlive it.
    [[nodiscard]] PixelStack strip(int first, int count, const LightDecoder& decoder) const;
    /// [light][plane][pixel of the list], numbers as the files have them.
    [[nodiscard]] const std::vector<float>& samples() const { return samples_; }
    [[nodiscard]] const std::vector<std::size_t>& sampled() const { return sampled_; }
    [[nodiscard]] const std::vector<std::uint8_t>& inside() const { return inside_; }
    [[nodiscard]] bool covers(std::size_t pixel) const { return inside_.empty() || inside_[pixel] != 0; }

  private:
    void read_mask(const std::filesystem::path& mask);
    void choose_samples();
    void take(int light, const Image& picture);
    void choose_strips(std::size_t strip_values, double most_bytes);
    /// What values are kept as.
    [[nodiscard]] StackForm form() const;
    /// Stored values of pixels [first, first + count) of a light, to planes `pitch` bytes apart.
    void copy(int light, std::size_t first, std::size_t count, std::byte* to, std::size_t pitch) const;

    const LightSet* set_ = nullptr;
    std::span<const Image> pictures_;
    ReliefOptions options_;
    Size size_;
    int planes_ = 0, lights_ = 0, rows_of_strip_ = 1;
    PixelType type_ = PixelType::float32;
    bool kept_ = false;
    std::vector<std::byte> values_;  ///< all, where they are kept: [light][plane][pixel]
    std::vector<float> samples_;
    std::vector<std::size_t> sampled_;
    std::vector<std::uint8_t> inside_;
};

}  // namespace btfield::detail
