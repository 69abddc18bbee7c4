#pragma once

// Views of a set that a fit has reduced, kept on disk until its model is written (theory 21.2).

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>

#include "btfield/btf_measured.hpp"
#include "host/btf/part_file.hpp"
#include "host/btf/reduced_view.hpp"

namespace btfield::detail {

/// A part of which each record is a view. What it holds of a view is mapped, not read: the system keeps as
/// much of it in memory as there is room.
class ViewsPart {
  public:
    /// \param path  empty: nothing is kept
    /// \param rank  of the views at most
    /// \throws InputError as PartFile
    ViewsPart(const std::filesystem::path& path, const BtfSet& set, const BtfLeaveOut& leave_out, int rank);

    /// What the file holds of a view, if it fits so many rows.
    [[nodiscard]] std::optional<ReducedView> find(std::size_t view, std::size_t rows) const;
    /// The same view, of the file where there is one.
    /// \throws InputError
    [[nodiscard]] ReducedView kept(std::size_t view, ReducedView reduced);

  private:
    [[nodiscard]] std::optional<ReducedView> read(const PartRecord& record, std::size_t rows) const;

    PartFile file_;
    std::size_t pixels_;
    int rank_;
    std::map<std::size_t, PartRecord> records_;  ///< by view, the last of each
};

}  // namespace btfield::detail
