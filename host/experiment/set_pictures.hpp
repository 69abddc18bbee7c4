#pragma once

/// \file
/// Pictures of BTFs as pictures of an experiment: which there are, what they are called, how they are read.

#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/btf_set.hpp"
#include "host/experiment/jobs.hpp"

namespace btfield::detail {

/// Sets that are open, each once, for all threads.
class OpenSets {
  public:
    /// \throws InputError as BtfSet::open()
    [[nodiscard]] BtfSet open(const std::filesystem::path& path, const BtfOptions& options);

  private:
    std::mutex mutex_;
    std::map<std::string, BtfSet> sets_;
};

/// Those that the entry asks for, view by view.
/// \throws InputError when the set cannot be opened or lacks one, or its model, where that is asked for,
///     cannot be read or is of other planes
[[nodiscard]] std::vector<PictureSource> set_pictures(const ExperimentPictures& entry,
                                                      const ExperimentConfig& config, OpenSets& sets);

/// \throws InputError when BTF models are compared and pictures have none
void check_models_of_btfs(const ExperimentConfig& config);

/// SHA-256 of the contents of all BTF models of the configuration, one after the other.
/// \throws InputError when one cannot be read
[[nodiscard]] std::string btf_models_content(const ExperimentConfig& config);

/// A number of the pictures that a set has, spread evenly over views and lights in the order of their rings:
/// at the points of Halton's sequence, shifted by the seed, and where a picture is missing or taken the next
/// that is not. A larger number of the same seed holds the smaller one.
[[nodiscard]] std::vector<BtfPair> sampled_pairs(const BtfSet& set, int number, std::uint64_t seed);

/// \param file the set
/// \throws InputError when it cannot be opened, has no such picture, or that cannot be read
[[nodiscard]] Image read_direction(OpenSets& sets, const std::filesystem::path& file,
                                   const DirectionSource& direction, const std::optional<Crop>& crop);

/// BtfSet::stamp() of that picture.
[[nodiscard]] std::string stamp_of_direction(OpenSets& sets, const std::filesystem::path& file,
                                             const DirectionSource& direction,
                                             const std::optional<Crop>& crop);

/// SHA-256 of size, planes and values.
[[nodiscard]] std::string sha256_of_values(const Image& image);

/// "view 30,45 light 60,200", in degrees.
[[nodiscard]] std::string directions_text(const ExperimentDirections& at);

/// Coding, colours and strides as text that gives them back.
[[nodiscard]] std::string reading_text(const BtfOptions& reading);
[[nodiscard]] BtfOptions reading_of(std::string_view text);

}  // namespace btfield::detail
