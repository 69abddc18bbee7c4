#pragma once

/// \file
/// What textures of a picture come from: a random field, a compound model, the picture's own pixels, or a
/// model of the BTF that it is of.

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "btfield/btf_model.hpp"
#include "btfield/device.hpp"
#include "btfield/fit.hpp"
#include "btfield/image.hpp"
#include "host/experiment/jobs.hpp"

namespace btfield::detail {

class TextureSource {
  public:
    TextureSource() = default;
    virtual ~TextureSource() = default;
    TextureSource(const TextureSource&) = delete;
    TextureSource& operator=(const TextureSource&) = delete;

    /// Fills in what the model says about itself; nothing where there is no model.
    virtual void describe(JobResult& result) const = 0;
    /// Once, before synthesise().
    /// \throws InputError when the model is not certified and that is not allowed
    virtual void prepare() = 0;
    /// Seeds that are best grown at once.
    [[nodiscard]] virtual std::size_t batch() const { return 1; }
    [[nodiscard]] virtual std::vector<Image> synthesise(std::span<const std::uint64_t> seeds) = 0;
};

/// BTF models as they were last grown: pictures of all directions come from the same surfaces.
class GrownBtfs {
  public:
    /// \param device is to outlive it
    GrownBtfs(Device& device, bool allow_invalid) : device_(device), allow_invalid_(allow_invalid) {}

    /// \throws std::runtime_error when the file cannot be read any more or has changed
    [[nodiscard]] const BtfModel& model(const DirectionSource& direction);
    /// Of the model that was asked for last.
    /// \throws InputError as BtfSynthesiser
    [[nodiscard]] const BtfSynthesiser& grown(Size size, std::uint64_t seed);

  private:
    Device& device_;
    bool allow_invalid_;
    std::string content_;
    std::optional<BtfModel> model_;
    Size size_;
    std::map<std::uint64_t, BtfSynthesiser> grown_;  ///< by seed
};

/// Fits what the settings ask for.
/// \param device, picture, btfs are to outlive it
/// \throws InputError when the picture has no such model
[[nodiscard]] std::unique_ptr<TextureSource> texture_source(Device& device, Analysis& picture,
                                                            const ExperimentConfig& config,
                                                            const JobSettings& settings,
                                                            const PictureSource& source, GrownBtfs& btfs);

}  // namespace btfield::detail
