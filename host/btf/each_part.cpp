#include "host/btf/each_part.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/base/strict_json.hpp"
#include "host/btf/texture_code.hpp"
#include "host/model/json_reading.hpp"

namespace btfield::detail {

using namespace json_reading;
using nlohmann::ordered_json;

namespace {

ordered_json fingerprint(const BtfTexturesOptions& options) {
    const FitOptions& field = options.field;
    ordered_json value;
    value["method"] = name(options.method);
    value["leave_out"] = {options.leave_out.pairs, options.leave_out.views, options.leave_out.lights};
    value["model"] = field.choose_model ? "auto" : std::string(name(field.model));
    value["order"] = field.order;
    value["neighbourhood"] =
        field.neighbourhood ? std::to_string(static_cast<int>(*field.neighbourhood)) : "default";
    ordered_json offsets = ordered_json::array();
    for (const Offset& offset : field.offsets) offsets.push_back({offset.row, offset.column});
    value["offsets"] = offsets;
    value["correlated"] = field.correlated;
    value["active"] = field.active;
    value["levels"] = field.levels;
    value["choose_levels"] = field.choose_levels;
    value["factor"] = field.factor;
    value["estimator"] = name(field.estimator);
    value["noise"] = name(field.noise);
    value["gains"] = name(field.gains);
    value["marginals"] = name(field.marginals);
    value["prior"] = {field.prior.strength, field.prior.beta0};
    value["moving_average"] = {field.moving_average.threshold, static_cast<int>(field.moving_average.rule)};
    return value;
}

}  // namespace

EachPart::EachPart(const std::filesystem::path& path, const BtfSet& set, const BtfTexturesOptions& options)
    : file_(path, set, fingerprint(options)) {
    for (const PartRecord& record : file_.records()) {
        const MappedBytes bytes = file_.mapped(record);
        const std::string_view payload(reinterpret_cast<const char*>(bytes.first.get()), bytes.size);
        const json value = parse_strictly(payload, file_.asked());
        const Context context{file_.asked()};
        Object object(value, "record", context);
        PictureTexture texture;
        const std::uint64_t pair = object.get("pair", natural);
        texture.moments.mean = object.get_list("mean", real);
        texture.moments.deviation = object.get_list("deviation", real);
        texture.texture = texture_from(object.member("texture"), "texture", context);
        done_.insert_or_assign(pair, std::move(texture));
    }
}

void EachPart::add(std::size_t pair, const PictureTexture& texture) {
    if (!file_.keeps()) return;
    ordered_json value;
    value["pair"] = pair;
    value["mean"] = texture.moments.mean;
    value["deviation"] = texture.moments.deviation;
    value["texture"] = texture_value(texture.texture);
    const std::vector<std::uint8_t> payload = ordered_json::to_cbor(value);
    file_.append({std::as_bytes(std::span(payload))});
}

}  // namespace btfield::detail
