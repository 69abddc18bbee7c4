#include "host/btf/each_part.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "host/base/strict_json.hpp"
#include "host/base/text.hpp"
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

struct ShardNumber {
    int shard = 0, shards = 0;
};

/// Of a name that shard_part() makes, behind that of the part.
std::optional<ShardNumber> shard_number(const std::string& behind) {
    ShardNumber number;
    if (std::sscanf(behind.c_str(), "-%9d-of-%9d", &number.shard, &number.shards) != 2) return std::nullopt;
    return number;
}

std::string list_text(const std::vector<int>& numbers) {
    constexpr std::size_t most = 12;
    std::string text;
    for (std::size_t i = 0; i < numbers.size() && i < most; ++i)
        text += (i == 0 ? "" : ", ") + std::to_string(numbers[i]);
    return text + (numbers.size() > most ? ", ..." : "");
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
        if (!name.starts_with(begin)) continue;
        const auto number = shard_number(name.substr(begin.size() - 1));
        if (!number) continue;
        const std::filesystem::path own = shard_part(part, number->shard, number->shards);
        if (own.filename() == name) found.push_back(own);
    }
    std::ranges::sort(found);
    return found;
}

std::string missing_text(const std::vector<std::filesystem::path>& shards,
                         const std::vector<std::size_t>& missing) {
    if (shards.empty() || missing.empty()) return {};
    std::set<int> there, counts;
    for (const std::filesystem::path& part : shards) {
        const std::string name = part.filename().string();
        const std::size_t of = name.rfind("-of-");
        const auto number = shard_number(name.substr(name.rfind('-', of - 1)));
        there.insert(number->shard);
        counts.insert(number->shards);
    }
    std::string text = counted(missing.size(), "picture");
    text += missing.size() == 1 ? " that no shard has is" : " that no shard has are";
    text += " fitted now";
    if (counts.size() > 1) return text;
    const auto count = static_cast<std::size_t>(*counts.begin());
    std::set<int> lacking;
    for (const std::size_t picture : missing) lacking.insert(static_cast<int>(picture % count) + 1);
    std::vector<int> absent, partial;
    for (const int shard : lacking) (there.contains(shard) ? partial : absent).push_back(shard);
    std::string which;
    const auto add = [&](const std::vector<int>& numbers, const char* one, const char* several) {
        if (numbers.empty()) return;
        which += (which.empty() ? "" : ", ") + std::string(numbers.size() == 1 ? "shard " : "shards ") +
                 list_text(numbers) + (numbers.size() == 1 ? one : several);
    };
    add(absent, " left no part", " left no parts");
    add(partial, " has not all of its pictures", " have not all of theirs");
    return "of " + std::to_string(count) + " shards " + which + ": " + text;
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
