#pragma once

// Pages in a browser without a screen: `./dev test browser`.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace btfield::test {

/// Opens a copy of the page in headless Chromium, with WebGL in software, and runs `script` at its end.
/// \param address  what follows the file's name: "#light=45,90"
/// \return `result`, which the script sets, and `troubles`: what scripts threw and the console was told
[[nodiscard]] nlohmann::json in_browser(const std::filesystem::path& page, const std::string& script,
                                        const std::string& address = {},
                                        const std::string& window = "900,700");

}  // namespace btfield::test
