#pragma once

/// \file
/// How far long work is.

#include <functional>
#include <string_view>

#include "btfield/api.hpp"

namespace btfield {

/// While it lives, fits, compound fits and tiles that its thread asks for tell `told` which stage they are in
/// and which share of that stage is done, also within stages that take minutes:
///
///     const btfield::ProgressScope scope([](std::string_view stage, double share) { … });
///     const btfield::CompoundModel model = btfield::fit_compound(device, picture.image);
///
/// Stages are named as `progress` of their options names them, and come with a share of 0 first; shares do
/// not fall within a stage, and where only the end tells how much there was to do they are estimates. `told`
/// is called in any of the threads that share the work, one at a time; what it throws ends the work. Of
/// scopes inside of each other the inner one is told.
class BTFIELD_API ProgressScope {
  public:
    explicit ProgressScope(std::function<void(std::string_view stage, double share)> told);
    ~ProgressScope();
    ProgressScope(const ProgressScope&) = delete;
    ProgressScope& operator=(const ProgressScope&) = delete;

    /// The innermost scope of the calling thread; null without one.
    [[nodiscard]] static const ProgressScope* current();
    void tell(std::string_view stage, double share) const;

  private:
    std::function<void(std::string_view stage, double share)> told_;
    const ProgressScope* outer_;
};

}  // namespace btfield
