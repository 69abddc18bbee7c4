#pragma once

// Compound models as values of files (docs/model-file.md).

#include <nlohmann/json.hpp>

#include "btfield/compound.hpp"
#include "host/model/json_reading.hpp"

namespace btfield::detail {

[[nodiscard]] nlohmann::ordered_json compound_value(const CompoundModel& model, bool binary);
/// \throws InputError
[[nodiscard]] CompoundModel compound_from(const nlohmann::json& value, json_reading::Context context);

}  // namespace btfield::detail
