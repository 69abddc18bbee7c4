#pragma once

// BTFs as folders or zip archives of pictures whose names tell directions.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "btfield/btf_set.hpp"

namespace btfield::detail {

/// What a name says, in degrees.
struct NamedAngles {
    std::optional<double> tl, pl, tv, pv;
    bool light_first = false;  ///< tl stands before tv
    bool numbered = false;     ///< a number stands before the keys
    bool spaced = false;       ///< blanks part them
    [[nodiscard]] bool complete() const { return tl && pl && tv && pv; }
};

/// Reads tl, pl, tv and pv with a number behind each, in any order and any case; what parts them is any
/// character but letters and digits, and a minus between key and number is its sign.
[[nodiscard]] NamedAngles angles_of_name(std::string_view stem);

/// \throws InputError as BtfSet::open()
[[nodiscard]] std::shared_ptr<const BtfSource> open_picture_folder(const std::filesystem::path& path,
                                                                   const BtfOptions& options);

}  // namespace btfield::detail
