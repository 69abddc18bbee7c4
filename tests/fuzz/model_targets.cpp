// Models, control fields and experiments: JSON, CBOR and the code of labels.

#include <nlohmann/json.hpp>
#include <span>

#include "btfield/compound.hpp"
#include "btfield/device.hpp"
#include "btfield/error.hpp"
#include "btfield/model_file.hpp"
#include "host/base/strict_json.hpp"
#include "host/compound/label_code.hpp"
#include "host/experiment/config_text.hpp"
#include "tests/example_model.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/label_cases.hpp"
#include "tests/places.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield::test {
namespace {

constexpr std::string_view asked = "read the bytes";

/// JSON begins otherwise.
bool is_cbor(std::string_view bytes) {
    return !bytes.empty() && (static_cast<unsigned char>(bytes[0]) & 0xe0U) == 0xa0U;
}

void read_texture_model(std::string_view bytes) {
    const TextureModel model = from_json(std::string(bytes));
    const std::string text = to_json(model);
    demand(to_json(from_json(text)) == text, "a model that was read changes when it is read again");
}

void read_json_model(std::string_view bytes) {
    if (!is_cbor(bytes)) read_texture_model(bytes);
}

void read_cbor_model(std::string_view bytes) {
    if (is_cbor(bytes)) read_texture_model(bytes);
}

std::vector<TextureModel> example_models() {
    std::vector<TextureModel> models;
    for (const ModelKind kind :
         {ModelKind::car2d, ModelKind::ma3d, ModelKind::msar3d, ModelKind::mmrf2d, ModelKind::pmrf3d}) {
        models.push_back(example_model(kind, 2, 1, NoiseForm::full, false, models.size() % 2 == 1));
    }
    models.push_back(example_model(ModelKind::car3d, 3, 2, NoiseForm::diagonal, true));
    models.back().names = {"R", "550nm", "height"};
    return models;
}

std::vector<std::string> json_seeds() {
    std::vector<std::string> seeds;
    for (const TextureModel& model : example_models()) seeds.push_back(to_json(model));
    return seeds;
}

std::vector<std::string> cbor_seeds() {
    std::vector<std::string> seeds;
    const TemporaryFolder folder;
    for (const TextureModel& model : example_models()) {
        write_model(folder / "a.btfm", model);
        seeds.push_back(bytes_of(folder / "a.btfm"));
    }
    return seeds;
}

/// Control fields that take long to decode are as good as others.
bool is_large(const nlohmann::json& value) {
    const auto control = value.find("control");
    if (control == value.end() || !control->is_object() || !control->contains("size")) return false;
    double pixels = 1.0;
    for (const auto& side : (*control)["size"])
        pixels *= side.is_number() ? std::abs(side.get<double>()) : 1.0;
    return pixels > 4096.0;
}

void read_any(std::string_view bytes) {
    if (is_large(detail::parse_strictly(bytes, std::string(asked)))) return;
    const std::variant<TextureModel, CompoundModel> model = read_any_model(file_with(bytes));
    if (const auto* compound = std::get_if<CompoundModel>(&model)) check(*compound);
}

std::vector<std::string> compound_seeds() {
    const ControlField field = patchy_labels({40, 48}, 3);
    Image image(field.size, 2);
    unsigned state = 1;
    for (int p = 0; p < 2; ++p)
        for (std::size_t i = 0; i < field.labels.size(); ++i) {
            state = state * 1664525U + 1013904223U;
            image.plane(p)[i] =
                0.2F * static_cast<float>(field.labels[i]) + 0.1F * static_cast<float>(state >> 8) * 0x1p-24F;
        }
    CompoundOptions options;
    options.labels = field;
    options.local.levels = 1;
    options.local.order = 1;
    Device device;
    const CompoundModel model = fit_compound(device, image, options);
    std::vector<std::string> seeds;
    const TemporaryFolder folder;
    for (const char* name : {"a.json", "a.btfm"}) {
        write_compound(folder / name, model);
        seeds.push_back(bytes_of(folder / name));
    }
    return seeds;
}

/// Two sides and a number of regions, then the code.
void read_label_code(std::string_view bytes) {
    if (bytes.size() < 3) return;
    const auto number = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    const Size size{number(0) % 33, number(1) % 33};
    const int regions = number(2);
    const std::string_view rest = bytes.substr(3);
    const std::span code(reinterpret_cast<const std::uint8_t*>(rest.data()), rest.size());
    const std::vector<std::uint8_t> labels = detail::decode_labels(code, size, regions, std::string(asked));
    const std::vector<std::uint8_t> again = detail::encode_labels({size, regions, labels});
    demand(detail::decode_labels(again, size, regions, std::string(asked)) == labels,
           "labels change on their way through the code");
}

std::vector<std::string> label_code_seeds() {
    std::vector<std::string> seeds;
    for (const int regions : {1, 2, 5, 12}) {
        const ControlField field = patchy_labels({24, 31}, regions);
        const std::vector<std::uint8_t> code = detail::encode_labels(field);
        seeds.push_back(std::string{'\x18', '\x1f', static_cast<char>(regions)} +
                        std::string(code.begin(), code.end()));
    }
    return seeds;
}

void read_configuration(std::string_view bytes) {
    static_cast<void>(detail::experiment_from_text(std::string(bytes), ".", std::string(asked)));
}

std::vector<std::string> configuration_seeds() {
    return {R"({"pictures": [{"material": "stone", "files": ["a.ppm"], "crop": [0, 0, 8, 8]}],
                "models": ["3d-car", "2d-msar", "roll", "compound"], "orders": [1, 2], "levels": [1, 3],
                "seeds": [5], "estimators": ["ls"], "metric": "max"})",
            bytes_of(data_folder() + "/experiment.json"),
            bytes_of(source_folder() + "/docs/p4-table-1.json")};
}

}  // namespace

std::vector<FuzzTarget> model_targets() {
    return {{"model-json", &read_json_model, &json_seeds},
            {"model-cbor", &read_cbor_model, &cbor_seeds},
            {"compound", &read_any, &compound_seeds},
            {"labels", &read_label_code, &label_code_seeds},
            {"experiment", &read_configuration, &configuration_seeds}};
}

}  // namespace btfield::test
