#pragma once

// The colour models of DFMF files.

#include <array>

#include "btfield/image.hpp"
#include "host/btf/byte_file.hpp"

namespace btfield::detail {

/// What logarithms of light have added.
inline constexpr float least_light = 1e-5F;

class ColourModel {
  public:
    /// \param numbers  mean and matrix, of model 3
    /// \throws InputError when the model is not known, or needs three channels
    ColourModel(int model, const std::array<float, 12>& numbers, int channels, const ByteFile& file);
    /// Makes linear light of what was factorised.
    void decode(Image& image) const;

  private:
    int model_;
    std::array<float, 12> numbers_;
};

}  // namespace btfield::detail
