#include "python/src/model_bytes.hpp"

#include <nlohmann/json.hpp>

#include "btfield/model_file.hpp"
#include "host/base/strict_json.hpp"
#include "host/btf/btf_model_json.hpp"
#include "host/compound/compound_json.hpp"
#include "host/model/model_json.hpp"

namespace btfield::python {
namespace {

std::string coded(const nlohmann::ordered_json& value, bool binary) {
    if (!binary) return detail::printed(value);
    std::string bytes;
    nlohmann::ordered_json::to_cbor(value, bytes);
    return bytes;
}

}  // namespace

std::string bytes_of(const TextureModel& model, bool binary) {
    check(model);
    return coded(detail::model_value(model), binary);
}

std::string bytes_of(const CompoundModel& model, bool binary) {
    check(model);
    return coded(detail::compound_value(model, binary), binary);
}

std::string bytes_of(const BtfModel& model, bool binary) {
    check(model);
    return coded(detail::joint_model_value(model, binary), binary);
}

std::string bytes_of(const BtfTextures& model, bool binary) {
    check(model);
    return coded(detail::textures_model_value(model, binary), binary);
}

AnyModel model_of_bytes(std::string_view bytes, const std::string& asked) {
    const nlohmann::json value = detail::parse_strictly(bytes, asked);
    const auto format = value.is_object() ? value.find("format") : value.end();
    if (value.is_object() && format != value.end()) {
        if (*format == detail::compound_format) return detail::compound_from(value, {asked});
        if (*format == detail::btf_format)
            return std::visit([](auto&& model) { return AnyModel(std::forward<decltype(model)>(model)); },
                              detail::btf_from(value, {asked}));
    }
    return detail::model_from(value, "", {asked});
}

}  // namespace btfield::python
