#pragma once

/// \file
/// Bidirectional texture functions: pictures of one plane surface, each seen from one direction under light
/// from another, as sets of files or as programs make them. Pictures are read when they are asked for.

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/image.hpp"
#include "btfield/image_io.hpp"

namespace btfield {

/// A direction above the surface, to the viewer or to the light. Radians: theta from the normal, phi
/// counter-clockwise from the right as seen from above.
struct BtfDirection {
    double theta = 0.0, phi = 0.0;
    /// Of length 1: x right, y up, z along the normal.
    [[nodiscard]] BTFIELD_API std::array<double, 3> vector() const;
    friend bool operator==(const BtfDirection&, const BtfDirection&) = default;
};

/// The 81 directions of the Bonn 2003, ATRIUM and UTIA sets, ring by ring from above.
[[nodiscard]] BTFIELD_API std::vector<BtfDirection> btf_directions_81();
/// The 151 directions of the UBO2014 sets.
[[nodiscard]] BTFIELD_API std::vector<BtfDirection> btf_directions_151();
/// The angle between two directions, in radians; phi counts modulo a turn.
[[nodiscard]] BTFIELD_API double angle_between(const BtfDirection& a, const BtfDirection& b);

/// A picture of a set, by the indices of its view and its light.
struct BtfPair {
    int view = 0, light = 0;
    friend bool operator==(const BtfPair&, const BtfPair&) = default;
};

/// What is known of a set before any picture is read.
struct BtfDescription {
    /// "ubo2003", "atrium", "utia", "spectral", "pictures", "made", …
    std::string format;
    Size size;
    int planes = 0;
    ColourSpace space =
        ColourSpace::linear;         ///< linear or xyz; of one plane, or more than three, unspecified
    std::vector<std::string> names;  ///< of planes, empty or one each
    /// The value of a white diffuse surface: 1; 100 for XYZ of UTIA.
    double white = 1.0;
    std::vector<BtfDirection> views;
    /// Nominal lights, those of all views together.
    std::vector<BtfDirection> lights;
    /// [view][light] where light really came from; where sets moved it out of the viewer's way this is not
    /// the nominal direction. Empty: nominal everywhere.
    std::vector<BtfDirection> true_lights;
    /// [view][light] whether there is a picture. Empty: everywhere.
    std::vector<std::uint8_t> present;
    /// Whether values are what a camera sees, so that they have the cosine of the light's theta in them. A
    /// .btf may say that they have not: they are reflectances then, and taken as they are.
    bool light_cosine = true;
    std::uintmax_t bytes = 0;  ///< of all files; 0 where there are none
    /// What may surprise, one sentence each, without capital and full stop.
    std::vector<std::string> remarks;
    /// One plane, in pixels, mean 0: the range map that a file holds. Empty: it has none.
    Image height;
};

/// Where pictures come from. Programs derive from it to give sets of their own.
class BTFIELD_API BtfSource {
  public:
    virtual ~BtfSource();
    /// The same at every call.
    [[nodiscard]] virtual const BtfDescription& description() const = 0;
    /// Linear light, of the described size, planes and space. Called from any number of threads at a time,
    /// for pictures that are present.
    [[nodiscard]] virtual Image picture(int view, int light) const = 0;
    /// Of a picture that is present, what is another text once its values may be others: size and times of
    /// its file. Empty: not known.
    [[nodiscard]] virtual std::string stamp(int view, int light) const;

  protected:
    BtfSource() = default;
    BtfSource(const BtfSource&) = default;
    BtfSource& operator=(const BtfSource&) = default;
};

/// What the numbers of a set's files mean.
enum class BtfCoding {
    automatic,  ///< JPEG: gamma 2.2; other files of whole numbers: sRGB; floats: linear
    srgb,
    gamma,  ///< the power 2.2
    linear,
};

/// How a set is read.
struct BtfOptions {
    BtfCoding coding = BtfCoding::automatic;
    /// What three planes of floats are, where that is not what the files say.
    std::optional<ColourSpace> space;
    /// Of all pictures.
    std::optional<Crop> crop;
    /// Every n-th row and column of that, from the first on, unfiltered.
    int pixel_stride = 1;
    /// Every n-th view and light, from the first on.
    int view_stride = 1, light_stride = 1;
};

/// A BTF: V views times L lights, some of which may be missing. A handle: copies are the same set, and one
/// may be used by any number of threads at a time. Takes no memory that grows with the number of pictures but
/// a few bytes for each.
class BTFIELD_API BtfSet {
  public:
    /// Opens a set of files (docs/btf.md). A folder: pictures whose names, or those of the folders that they
    /// are in, have tl, pl, tv and pv with degrees behind, in any order. The first picture is read, to know
    /// size and planes; others are looked at when they are read. A file: a zip archive of such pictures, .btf
    /// of UBO2014, TBIG 2, BIG 3, MIF.
    /// \throws InputError when nothing such is there, two pictures have the same directions, a direction is
    ///     not above the surface, the crop leaves the pictures, or what read_picture() refuses
    [[nodiscard]] static BtfSet open(const std::filesystem::path& path, const BtfOptions& options = {});
    /// Of these pictures, some of them perhaps: of the options, crop and strides count.
    /// \throws InputError when the description contradicts itself
    explicit BtfSet(std::shared_ptr<const BtfSource> source, const BtfOptions& options = {});

    /// With crop and strides applied.
    [[nodiscard]] const BtfDescription& description() const { return description_; }
    [[nodiscard]] const std::string& format() const { return description_.format; }
    [[nodiscard]] Size size() const { return description_.size; }
    [[nodiscard]] int planes() const { return description_.planes; }
    [[nodiscard]] ColourSpace space() const { return description_.space; }
    [[nodiscard]] double white() const { return description_.white; }
    [[nodiscard]] const std::vector<BtfDirection>& views() const { return description_.views; }
    [[nodiscard]] const std::vector<BtfDirection>& lights() const { return description_.lights; }
    /// Where light really comes from in a picture.
    [[nodiscard]] BtfDirection light(int view, int light) const;
    [[nodiscard]] bool has(int view, int light) const;
    /// Those that are there, view by view.
    [[nodiscard]] std::vector<BtfPair> pictures() const;
    /// Those that are not.
    [[nodiscard]] std::vector<BtfPair> missing() const;
    /// Of the files.
    [[nodiscard]] std::uintmax_t bytes() const { return description_.bytes; }

    /// Reads, decodes and crops one picture: linear light.
    /// \throws InputError when it is missing, has another size or number of planes than the first, or what
    ///     read_picture() refuses
    [[nodiscard]] Image picture(int view, int light) const;
    /// BtfSource::stamp() of one that is there.
    [[nodiscard]] std::string stamp(int view, int light) const;

  private:
    std::shared_ptr<const BtfSource> source_;
    BtfOptions options_;
    BtfDescription description_;
};

}  // namespace btfield
