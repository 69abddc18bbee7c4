#pragma once

/// \file
/// What textures of a picture come from: a random field, a compound model, or the picture's own pixels.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

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

/// Fits what the settings ask for.
/// \param device, picture are to outlive it
/// \throws InputError when the picture has no such model
[[nodiscard]] std::unique_ptr<TextureSource> texture_source(Device& device, Analysis& picture,
                                                            const ExperimentConfig& config,
                                                            const JobSettings& settings);

}  // namespace btfield::detail
