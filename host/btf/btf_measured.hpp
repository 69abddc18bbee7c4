#pragma once

// What models keep of the sets that they are fitted to, and which pictures a fit is shown.

#include "btfield/btf_measured.hpp"
#include "btfield/btf_set.hpp"

namespace btfield::detail {

/// All but pairs and true lights.
void describe(BtfMeasured& model, const BtfSet& set);

/// Whether a pair is kept from a fit.
[[nodiscard]] bool is_left_out(const BtfPair& pair, const BtfLeaveOut& leave_out);

/// \throws InputError where leave_out leaves nothing
void check_leave_out(const BtfLeaveOut& leave_out);

/// Pairs are numbered view by view.
[[nodiscard]] std::size_t place_of(const BtfMeasured& model, const BtfPair& pair);

/// \throws InputError naming the first defect
void check_measured(const BtfMeasured& model);
/// \throws InputError
[[noreturn]] void refuse_model(const std::string& found);

inline constexpr int most_btf_colours = 64;
inline constexpr std::size_t most_btf_pairs = std::size_t{1} << 22, most_btf_textures = 65536;
/// Views times lights.
inline constexpr std::size_t most_possible_btf_pairs = std::size_t{1} << 26;

}  // namespace btfield::detail
