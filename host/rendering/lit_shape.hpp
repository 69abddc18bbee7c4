#pragma once

// Planes of a surface on a plane or a sphere, as a camera sees them (theory 23.1).

#include <memory>
#include <mutex>
#include <vector>

#include "btfield/btf_renderer.hpp"
#include "btfield/image.hpp"
#include "host/btf/direction_table.hpp"
#include "host/btf/view_rays.hpp"
#include "host/rendering/sphere_frame.hpp"

namespace btfield::detail {

/// Entries of a table: of each colour log(μ / l_z), offset, background, and U.
struct LitTable {
    /// [latitude from −90 to 90 degrees][longitude from 0 on] of a sphere; 1 × 1 of a plane.
    int longitudes = 1, latitudes = 1;
    /// Mean over l_z in place of its logarithm.
    std::vector<PictureWeights> entries;
    /// Of a sphere, [colour].
    std::vector<double> background{};
};

/// The camera and what light does beside the table.
struct LitView {
    CameraFrame camera;
    Vector3 light;
    double steepest_view = 0.0;  ///< theta of the steepest ray
};

/// For any number of threads.
class LitShape {
  public:
    /// \param surface  height in pixels, then planes
    LitShape(DeviceImpl& device, const Image& surface, int colours);
    /// \param table  of one entry
    [[nodiscard]] Image plane(const BtfScene& scene, const LitView& view, const LitTable& table) const;
    [[nodiscard]] Image sphere(const BtfScene& scene, const LitView& view, const LitTable& table) const;

  private:
    [[nodiscard]] Buffer upload(const LitTable& table) const;
    [[nodiscard]] Kernel kernel(const char* name) const;
    /// Places of the surface that a plane shows, whatever the light.
    struct Met {
        Size size;
        double scale = 0.0;
        Vector3 to{};
        std::shared_ptr<const Buffer> places;
    };
    /// Band by band: place(places, rays, first row, rows), rays to the relief, show(picture, places, first
    /// row, rows).
    /// \param met  places of a picture that is one band, to be shown as they are; without them, to be left
    ///     there
    template <class Place, class Show>
    [[nodiscard]] Image picture(Size size, int samples, std::shared_ptr<const Buffer>& met,
                                const Place& place, const Show& show) const;

    DeviceImpl* device_;
    Size size_;
    int colours_, planes_, padded_;
    float lowest_, highest_;
    Buffer relief_, planes_of_pixels_;
    mutable std::mutex mutex_;  ///< of what follows
    mutable Met met_;           ///< of the last plane
};

}  // namespace btfield::detail
