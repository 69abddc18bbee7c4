#include "host/experiment/messages.hpp"

#include <limits>
#include <nlohmann/json.hpp>

#include "btfield/error.hpp"
#include "host/experiment/experiment_names.hpp"
#include "host/experiment/set_pictures.hpp"
#include "host/fit/fit_names.hpp"

namespace btfield::detail {
namespace {

using nlohmann::json;

template <class Value>
json optional_json(const std::optional<Value>& value) {
    return value ? json(*value) : json(nullptr);
}

template <class Value>
void read_optional(const json& value, std::optional<Value>& target) {
    if (!value.is_null()) target = value.get<Value>();
}

json settings_json(const JobSettings& s) {
    return json::array(
        {name(s.model), s.order, s.levels, name(s.estimator), name(s.marginals), s.seed, s.btf_models});
}

JobSettings settings_of(const json& value) {
    JobSettings s;
    s.model = value_of<ExperimentModel>(value.at(0).get<std::string>());
    s.order = value.at(1).get<int>();
    s.levels = value.at(2).get<int>();
    s.estimator = value_of<EstimatorChoice>(value.at(3).get<std::string>());
    s.marginals = value_of<MarginalMode>(value.at(4).get<std::string>());
    s.seed = value.at(5).get<std::uint64_t>();
    s.btf_models = value.at(6).get<std::string>();
    return s;
}

json unit_json(const WorkUnit& unit) {
    const PictureSource& source = unit.source;
    json object;
    object["source"] = {source.name,  source.file.string(), source.material,
                        source.white, source.content,       source.picture};
    if (source.crop)
        object["crop"] = {source.crop->x, source.crop->y, source.crop->width, source.crop->height};
    if (const std::optional<DirectionSource>& direction = source.direction) {
        const auto [view, light] = direction->at;
        object["direction"] = {direction->set_name,
                               reading_text(direction->reading),
                               view.theta,
                               view.phi,
                               light.theta,
                               light.phi,
                               direction->true_light.theta,
                               direction->true_light.phi,
                               direction->model.string(),
                               direction->model_content};
    }
    object["jobs"] = json::array();
    for (const JobSettings& job : unit.jobs) object["jobs"].push_back(settings_json(job));
    object["keep"] = unit.keep;
    return object;
}

WorkUnit unit_of(const json& object) {
    WorkUnit unit;
    PictureSource& source = unit.source;
    const json& from = object.at("source");
    source.name = from.at(0).get<std::string>();
    source.file = from.at(1).get<std::string>();
    source.material = from.at(2).get<std::string>();
    source.white = from.at(3).get<double>();
    source.content = from.at(4).get<std::string>();
    source.picture = from.at(5).get<std::string>();
    if (object.contains("crop")) {
        const auto sides = object["crop"].get<std::vector<int>>();
        source.crop = Crop{sides.at(0), sides.at(1), sides.at(2), sides.at(3)};
    }
    if (object.contains("direction")) {
        const json& direction = object["direction"];
        const auto angle = [&](std::size_t i) { return direction.at(i).get<double>(); };
        source.direction = DirectionSource{
            direction.at(0).get<std::string>(),           reading_of(direction.at(1).get<std::string>()),
            {{angle(2), angle(3)}, {angle(4), angle(5)}}, {angle(6), angle(7)},
            direction.at(8).get<std::string>(),           direction.at(9).get<std::string>()};
    }
    for (const json& job : object.at("jobs")) unit.jobs.push_back(settings_of(job));
    unit.keep = object.at("keep").get<bool>();
    return unit;
}

json result_json(const JobResult& r) {
    return json::array({r.key,
                        r.picture,
                        settings_json(r.settings),
                        r.metric,
                        r.settings_text,
                        name(r.status),
                        r.reason,
                        optional_json(r.valid),
                        optional_json(r.min_singular),
                        optional_json(r.zeros),
                        optional_json(r.lowest_ratio),
                        optional_json(r.highest_ratio),
                        optional_json(r.estimators),
                        optional_json(r.fitted_levels),
                        optional_json(r.parameters),
                        optional_json(r.memd),
                        optional_json(r.memd_star),
                        optional_json(r.variance_ratio),
                        optional_json(r.lag_covariance_error),
                        optional_json(r.spectral_covariance_error),
                        optional_json(r.clamped_pixels),
                        r.fit_seconds,
                        r.synthesis_seconds,
                        r.memd_seconds,
                        r.device});
}

JobResult result_of(const json& value) {
    JobResult r;
    std::size_t i = 0;
    const auto next = [&]() -> const json& { return value.at(i++); };
    r.key = next().get<std::string>();
    r.picture = next().get<std::string>();
    r.settings = settings_of(next());
    r.metric = next().get<std::string>();
    r.settings_text = next().get<std::string>();
    r.status = job_status(next().get<std::string>());
    r.reason = next().get<std::string>();
    read_optional(next(), r.valid);
    read_optional(next(), r.min_singular);
    read_optional(next(), r.zeros);
    read_optional(next(), r.lowest_ratio);
    read_optional(next(), r.highest_ratio);
    read_optional(next(), r.estimators);
    read_optional(next(), r.fitted_levels);
    read_optional(next(), r.parameters);
    read_optional(next(), r.memd);
    read_optional(next(), r.memd_star);
    read_optional(next(), r.variance_ratio);
    read_optional(next(), r.lag_covariance_error);
    read_optional(next(), r.spectral_covariance_error);
    read_optional(next(), r.clamped_pixels);
    r.fit_seconds = next().get<double>();
    r.synthesis_seconds = next().get<double>();
    r.memd_seconds = next().get<double>();
    r.device = next().get<std::string>();
    return r;
}

json report_json(const WorkReport& report) {
    json object;
    if (report.facts) {
        const PictureFacts& facts = *report.facts;
        object["facts"] = {facts.picture, facts.kappa, facts.size.width, facts.size.height, facts.planes};
    }
    object["results"] = json::array();
    for (const JobResult& result : report.results) object["results"].push_back(result_json(result));
    object["kept"] = json::array();
    for (const KeptTexture& kept : report.kept) {
        object["kept"].push_back(
            {kept.picture, kept.model, kept.marginals, kept.metric, kept.key, kept.file});
    }
    object["trouble"] = report.trouble;
    return object;
}

WorkReport report_of(const json& object) {
    WorkReport report;
    if (object.contains("facts")) {
        const json& facts = object["facts"];
        report.facts = PictureFacts{facts.at(0).get<std::string>(),
                                    facts.at(1).get<double>(),
                                    {facts.at(3).get<int>(), facts.at(2).get<int>()},
                                    facts.at(4).get<int>()};
    }
    for (const json& result : object.at("results")) report.results.push_back(result_of(result));
    for (const json& kept : object.at("kept")) {
        const auto texts = kept.get<std::vector<std::string>>();
        report.kept.push_back({texts.at(0), texts.at(1), texts.at(2), texts.at(3), texts.at(4), texts.at(5)});
    }
    report.trouble = object.at("trouble").get<std::string>();
    return report;
}

}  // namespace

std::string to_bytes(const RankMessage& message) {
    json object;
    object["kind"] = static_cast<int>(message.kind);
    object["thread"] = message.thread;
    if (!message.text.empty()) object["text"] = message.text;
    if (message.kind == MessageKind::welcome) {
        object["folder"] = message.folder;
        object["textures"] = message.textures;
    }
    if (message.unit) object["unit"] = unit_json(*message.unit);
    if (message.kind == MessageKind::report) object["report"] = report_json(message.report);
    // CBOR: doubles keep every bit, NaN included, and file names need not be UTF-8.
    std::string bytes;
    json::to_cbor(object, bytes);
    return bytes;
}

RankMessage rank_message(const std::string& bytes) {
    try {
        const json object = json::from_cbor(bytes);
        RankMessage message;
        message.kind = static_cast<MessageKind>(object.at("kind").get<int>());
        message.thread = object.at("thread").get<int>();
        message.text = object.value("text", std::string());
        message.folder = object.value("folder", std::string());
        message.textures = object.value("textures", std::string());
        if (object.contains("unit")) message.unit = unit_of(object["unit"]);
        if (object.contains("report")) message.report = report_of(object["report"]);
        return message;
    } catch (const json::exception&) {
        throw InputError("read a message of another rank", "it is damaged",
                         "run the same btfield on every rank");
    }
}

}  // namespace btfield::detail
