#pragma once

#include "btfield/experiment.hpp"
#include "host/base/names.hpp"
#include "host/experiment/jobs.hpp"

namespace btfield::detail {

template <>
struct Names<JobStatus> {
    static constexpr std::string_view what = "status of a job";
    static constexpr auto words = std::to_array<Word<JobStatus>>(
        {{JobStatus::done, "done"}, {JobStatus::refused, "refused"}, {JobStatus::failed, "failed"}});
};

template <>
struct Names<TableFormat> {
    static constexpr std::string_view what = "table format";
    static constexpr auto words = std::to_array<Word<TableFormat>>({{TableFormat::text, "text"},
                                                                    {TableFormat::markdown, "md"},
                                                                    {TableFormat::csv, "csv"},
                                                                    {TableFormat::latex, "latex"}});
};

}  // namespace btfield::detail
