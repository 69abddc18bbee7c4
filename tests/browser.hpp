#pragma once

// Pages in a browser without a screen: `./dev test browser`.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace btfield::test {

/// Opens a copy of the page in headless Chromium, with WebGL in software, and returns what `script`, run at its
/// end, gives for `result`: JSON. `troubles` has the errors that scripts threw and the console got.
/// \param address  what follows the file's name: "#light=45,90"
[[nodiscard]] nlohmann::json in_browser(const std::filesystem::path& page, const std::string& script,
                                        const std::string& address = {},
                                        const std::string& window = "900,700");

}  // namespace btfield::test
