#include "tests/browser.hpp"

#include <gtest/gtest.h>

#include "tests/json_text.hpp"
#include "tests/run_program.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield::test {

namespace fs = std::filesystem;

nlohmann::json in_browser(const fs::path& page, const std::string& script, const std::string& address,
                          const std::string& window) {
    std::string html = bytes_of(page);
    html.insert(html.find("<head>") + 6, R"html(<script>
const troubles = [];
addEventListener("error", event => troubles.push(String(event.message)));
addEventListener("unhandledrejection", event => troubles.push(String(event.reason)));
for (const what of ["error", "warn"]) console[what] = (...words) => troubles.push(words.join(" "));
</script>)html");
    html.insert(html.rfind("</body>"), "<script>\nlet result = null;\ntry {\n" + script + R"html(
} catch (error) {
    troubles.push(String(error));
}
const measured = document.createElement("pre");
measured.id = "measured";
measured.textContent = JSON.stringify({result, troubles}).replace(/[&<>]/g,
    sign => "\\u00" + sign.charCodeAt(0).toString(16));
document.body.append(measured);
</script>)html");
    const fs::path copy = page.parent_path() / "in-browser.html", profile = page.parent_path() / "profile";
    put_bytes(copy, html);
    const Ended ended =
        run_program({"/usr/bin/env", "chromium", "--headless=new", "--no-sandbox", "--use-gl=angle",
                     "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage",
                     "--hide-scrollbars", "--user-data-dir=" + profile.string(), "--window-size=" + window,
                     "--dump-dom", "file://" + copy.string() + address});
    EXPECT_EQ(ended.code, 0) << ended.err;
    const std::string start = "<pre id=\"measured\">";
    const std::size_t from = ended.out.find(start);
    if (from == std::string::npos) {
        ADD_FAILURE() << "the browser ran no script to its end\n" << ended.out.substr(0, 2000) << ended.err;
        return {};
    }
    const std::size_t begin = from + start.size();
    return parsed(ended.out.substr(begin, ended.out.find("</pre>", begin) - begin));
}

}  // namespace btfield::test
