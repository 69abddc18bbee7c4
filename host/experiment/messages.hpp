#pragma once

/// \file
/// What ranks tell each other, as bytes.

#include <string>

#include "host/experiment/jobs.hpp"

namespace btfield::detail {

enum class MessageKind {
    welcome,  ///< 0 to r: the experiment's text, its folder and that of textures
    request,  ///< rank r to 0: thread `thread` wants a unit
    unit,     ///< 0 to r: here it is, or none is left
    report,   ///< r to 0: results
    ended,    ///< r to 0: a unit has been worked off
    lost,     ///< r to 0: this thread cannot work, `text` says why
    left,     ///< r to 0: all threads have ended
    stop,     ///< 0 to r: end after the fits under way
};

struct RankMessage {
    MessageKind kind = MessageKind::request;
    int thread = 0;
    std::string text, folder, textures;
    std::optional<WorkUnit> unit;
    WorkReport report;
};

[[nodiscard]] std::string to_bytes(const RankMessage& message);
/// \throws InputError for bytes that to_bytes did not write: ranks of different versions.
[[nodiscard]] RankMessage rank_message(const std::string& bytes);

}  // namespace btfield::detail
