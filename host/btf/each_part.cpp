#include "host/btf/each_part.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
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

std::filesystem::path shard_part(const std::filesystem::path& part, int shard, int shards) {
    std::filesystem::path own = part;
    own += "-" + std::to_string(shard) + "-of-" + std::to_string(shards);
    return own;
}

std::vector<std::filesystem::path> shard_parts(const std::filesystem::path& part) {
    std::vector<std::filesystem::path> found;
    if (part.empty()) return found;
    const std::string begin = part.filename().string() + "-";
    std::error_code error;
    std::filesystem::directory_iterator at(part.has_parent_path() ? part.parent_path() : ".", error);
    for (const std::filesystem::directory_iterator end; !error && at != end; at.increment(error)) {
        const std::string name = at->path().filename().string();
        int shard = 0, shards = 0, length = 0;
        if (!name.starts_with(begin) ||
            std::sscanf(name.c_str() + begin.size(), "%9d-of-%9d%n", &shard, &shards, &length) != 2)
            continue;
        const std::filesystem::path own = shard_part(part, shard, shards);
        if (own.filename() == name) found.push_back(own);
    }
    std::ranges::sort(found);
    return found;
}

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
