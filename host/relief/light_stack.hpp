#pragma once

// Values of one view under many lights, from files or from memory, as far as memory goes.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "btfield/relief.hpp"

namespace btfield::detail {

/// From a file's numbers to linear light of a light of intensity 1.
class LightDecoder {
  public:
    /// \param integers  whether numbers are fractions of a type's largest
    LightDecoder(LightCoding coding, double gamma, bool integers);
    /// Below 0 where the number is the largest of its type.
    [[nodiscard]] float operator()(float value, float gain) const;
    void decode(std::span<const float> values, float gain, float* to) const;

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
    LightStack(const LightSet& lights, const ReliefOptions& options, double most_bytes);
    /// Pictures that are there already, and stay.
    LightStack(std::span<const Image> pictures, const ReliefOptions& options);

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
    /// [light][plane][pixel of the list], numbers as the files have them.
    [[nodiscard]] const std::vector<float>& samples() const { return samples_; }
    [[nodiscard]] const std::vector<std::size_t>& sampled() const { return sampled_; }
    [[nodiscard]] const std::vector<std::uint8_t>& inside() const { return inside_; }
    [[nodiscard]] bool covers(std::size_t pixel) const { return inside_.empty() || inside_[pixel] != 0; }

  private:
    void read_mask(const std::filesystem::path& mask);
    void choose_samples();
    void take(int light, const Image& picture);

    const LightSet* set_ = nullptr;
    std::span<const Image> pictures_;
    ReliefOptions options_;
    Size size_;
    int planes_ = 0, lights_ = 0, rows_of_strip_ = 1;
    PixelType type_ = PixelType::float32;
    bool kept_ = false;
    std::vector<float> values_;  ///< all, where they are kept
    std::vector<float> samples_;
    std::vector<std::size_t> sampled_;
    std::vector<std::uint8_t> inside_;
};

}  // namespace btfield::detail
