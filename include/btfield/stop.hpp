#pragma once

/// \file
/// Ending long work before it is done.

#include <functional>

#include "btfield/api.hpp"

namespace btfield {

/// While it lives, whatever its thread asks of btfield can be ended: `stop` is asked now and then, and once
/// it is true, the function under way throws Stopped, and so does the next one. Scopes may stand inside of
/// each other: any of them ends the work. Short functions may not ask at all.
///
///     std::stop_token token = …;  // of a thread with a button, say
///     const btfield::StopScope scope([token] { return token.stop_requested(); });
///     const btfield::TextureModel model = btfield::fit(device, picture.image);
///
/// Work that threads share among them asks in each of them, several at a time.
class BTFIELD_API StopScope {
  public:
    /// \param stop throws nothing
    explicit StopScope(std::function<bool()> stop);
    ~StopScope();
    StopScope(const StopScope&) = delete;
    StopScope& operator=(const StopScope&) = delete;

    /// Whether this scope, or one around it, says so.
    [[nodiscard]] bool asked() const;
    /// The innermost scope of the calling thread, which threads that it starts may ask too; null without one.
    [[nodiscard]] static const StopScope* current();

  private:
    std::function<bool()> stop_;
    const StopScope* outer_;
};

}  // namespace btfield
