#pragma once

#include <array>
#include <cstddef>

#include "btfield/experiment.hpp"
#include "host/base/names.hpp"
#include "host/experiment/jobs.hpp"
#include "host/model/model_names.hpp"

namespace btfield::detail {

template <>
struct Names<ExperimentModel> {
    static constexpr std::string_view what = "model";
    /// Those of the random fields, and more.
    static constexpr auto words = [] {
        constexpr auto fields = Names<ModelKind>::words;
        std::array<Word<ExperimentModel>, fields.size() + 3> all{};
        for (std::size_t i = 0; i < fields.size(); ++i)
            all[i] = {static_cast<ExperimentModel>(fields[i].value), fields[i].word};
        all[fields.size()] = {ExperimentModel::compound, "compound"};
        all[fields.size() + 1] = {ExperimentModel::roll, "roll"};
        all[fields.size() + 2] = {ExperimentModel::btf, "btf"};
        return all;
    }();
};
static_assert(static_cast<ExperimentModel>(ModelKind::car2d) == ExperimentModel::car2d &&
              static_cast<ExperimentModel>(ModelKind::pmrf3d) == ExperimentModel::pmrf3d);

template <>
struct Names<Family> {
    static constexpr std::string_view what = "family";
    static constexpr auto words = std::to_array<Word<Family>>({{Family::car, "car"},
                                                               {Family::ma, "ma"},
                                                               {Family::msar, "msar"},
                                                               {Family::mmrf, "mmrf"},
                                                               {Family::pmrf, "pmrf"}});
};

template <>
struct Names<MeasuredValues> {
    static constexpr std::string_view what = "values";
    static constexpr auto words = std::to_array<Word<MeasuredValues>>(
        {{MeasuredValues::stored, "stored"}, {MeasuredValues::eight_bit, "8-bit"}});
};

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
