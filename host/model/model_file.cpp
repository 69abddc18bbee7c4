#include "btfield/model_file.hpp"

#include "host/base/file_output.hpp"
#include "host/base/strict_json.hpp"
#include "host/model/model_json.hpp"

namespace btfield {

using namespace detail;

TextureModel read_model(const std::filesystem::path& path) {
    const std::string asked = "read the model '" + path.string() + "'";
    return model_from(parse_strictly(model_bytes(path, asked), asked), "", {asked});
}

void write_model(const std::filesystem::path& path, const TextureModel& model) {
    check(model);
    write_model_value(path, model_value(model), "write the model '" + path.string() + "'");
}

void check_model_writable(const std::filesystem::path& path) {
    check_output(path, "write the model '" + path.string() + "'");
}

std::string to_json(const TextureModel& model) {
    check(model);
    return printed(model_value(model));
}

TextureModel from_json(const std::string& text, const std::string& source) {
    const std::string asked = "read " + source;
    return model_from(parse_strictly(text, asked), "", {asked});
}

}  // namespace btfield
