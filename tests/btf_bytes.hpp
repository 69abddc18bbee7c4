#pragma once

// Files of BTFs, byte by byte as docs/btf.md describes them. Small: every value is known.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "btfield/btf_set.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield::test {

/// Opens bytes as a file of this name.
class BtfFile {
  public:
    explicit BtfFile(std::string name) : name_(std::move(name)) {}
    [[nodiscard]] BtfSet open(const std::string& bytes) const;
    /// What is said against reading all of it; empty: nothing.
    [[nodiscard]] std::string refusal(const std::string& bytes) const;

  protected:
    TemporaryFolder folder_;

  private:
    std::string name_;
};

/// Little-endian numbers, one after the other.
class Bytes {
  public:
    template <typename Value>
    Bytes& put(Value value) {
        text_.append(reinterpret_cast<const char*>(&value), sizeof value);
        return *this;
    }
    Bytes& text(std::string_view text) {
        text_ += text;
        return *this;
    }
    [[nodiscard]] const std::string& str() const { return text_; }
    [[nodiscard]] std::size_t size() const { return text_.size(); }

  private:
    std::string text_;
};

/// Halves of whole numbers of up to 2048 and of their quarters, without the reader's code.
[[nodiscard]] std::uint16_t half(double value);

/// What a .btf of UBO2014 is to hold: 2 views of 3 and 2 lights, 3 x 2 pixels.
struct Ubo2014Case {
    std::string signature = "!FMF06FC";
    std::uint32_t version = 1, channels = 3;
    bool by_pixel = false;    ///< the second of both transposes
    bool old_pvf = false;     ///< 301074
    std::uint8_t extras = 2;  ///< of FMF12: logarithms and a height map
    std::uint32_t logarithms = 0;
    int scalar = 2;  ///< bytes: 2, 4, 8
    std::int32_t colour_model = 0;
    std::uint8_t compression = 0;  ///< of BDI
};
inline constexpr std::array<std::uint32_t, 2> ubo2014_lights{3, 2};
/// What factors are made of: channel c of picture n (of all, view by view) at pixel x.
[[nodiscard]] double ubo2014_value(std::uint32_t c, std::uint32_t n, std::uint32_t x);
[[nodiscard]] std::string ubo2014_bytes(const Ubo2014Case& what = {});

/// TBIG and BIG of 2 x 2 directions (angles in degrees) and 3 x 2 pixels of 3 planes; MIF of the same, whose
/// pictures have no angles but in our marks.
[[nodiscard]] std::string tbig_bytes(int scalar = 2, int tiles = 1);
[[nodiscard]] std::string big_bytes(int scalar = 4);
[[nodiscard]] std::string mif_bytes(int scalar = 2);
/// Value of a plane of picture i, tile t, at row y and column x.
[[nodiscard]] double container_value(int i, int t, int y, int x, int plane);

}  // namespace btfield::test
