#pragma once

/// \file
/// The work on one picture, in the order that spares most: read once, planes, pyramids and lag covariances
/// once, all models from them, all textures of a model from one TextureSource, the picture's colours kept on
/// the device.

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "btfield/device.hpp"
#include "host/experiment/jobs.hpp"
#include "host/experiment/texture_source.hpp"

namespace btfield::detail {

class PictureWork {
  public:
    /// \param textures folder of textures that are kept
    /// \throws DeviceError when the device does not open
    PictureWork(const ExperimentConfig& config, const std::string& device, std::filesystem::path textures,
                OpenSets& sets);

    /// Whatever goes wrong becomes results of the jobs that it befell. Reports fit by fit.
    /// \param stop asked before every fit; true leaves the jobs that follow undone
    /// \throws Stopped when a StopScope of this thread ends the fit under way, of which nothing is reported
    void run(const WorkUnit& unit, const std::function<void(WorkReport)>& report,
             const std::function<bool()>& stop);

  private:
    class Picture;
    /// The jobs of one fit.
    [[nodiscard]] WorkReport measure(Picture& picture, const PictureSource& source,
                                     std::span<const JobSettings> jobs);
    [[nodiscard]] WorkReport keep(Picture& picture, const PictureSource& source,
                                  std::span<const JobSettings> jobs);
    /// Holds a texture against the picture.
    static void hold(Picture& picture, const Image& texture, JobResult& result);
    /// Results with names and nothing else.
    [[nodiscard]] std::vector<JobResult> blanks(const PictureSource& source,
                                                std::span<const JobSettings> jobs) const;

    const ExperimentConfig& config_;
    Device device_;
    std::filesystem::path textures_;
    OpenSets& sets_;
    GrownBtfs btfs_;
};

/// The picture as an 8-bit file would give it back whose 255 is white: rounded and clamped, in its own unit.
[[nodiscard]] Image as_eight_bit(const Image& image, double white);

/// The picture as a file of this type would give it back: 8-bit and 16-bit values are rounded and clamped,
/// others stay.
[[nodiscard]] Image as_stored(const Image& image, PixelType type);

}  // namespace btfield::detail
