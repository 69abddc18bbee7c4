// host/rendering/btf_page.cpp and host/rendering/page; in a browser: `./dev test browser`.

#include "btfield/btf_page.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "btfield/btf_renderer.hpp"
#include "btfield/error.hpp"
#include "btfield/image_io.hpp"
#include "host/base/base64.hpp"
#include "tests/browser.hpp"
#include "tests/device_cases.hpp"
#include "tests/rendering_cases.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield {
namespace {

using nlohmann::json;
using test::degree;

constexpr Size tile{24, 32};

std::string page_of(const BtfModel& model, const BtfPageOptions& options = {}) {
    const BtfSynthesiser shown(test::default_device(), model, test::smooth_surface(tile, model.planes()));
    return btf_page(model, shown, options);
}

/// Text of a script element.
std::string element(const std::string& page, const std::string& id) {
    const std::size_t from = page.find('>', page.find("id=\"" + id + "\"")) + 1;
    return page.substr(from, page.find("</script>", from) - from);
}

TEST(BtfPage, HoldsAllThatItNeeds) {
    const BtfModel model = test::smooth_btf(tile, 3, 6);
    BtfPageOptions options;
    options.title = "Moss & </script><b>";
    options.planes = 5;
    double last = 0.0;
    options.progress = [&](double share) { last = share; };
    const std::string page = page_of(model, options);
    EXPECT_EQ(last, 1.0);
    EXPECT_EQ(page.find("{{"), std::string::npos);
    for (const char* foreign : {"http://", "https://", "src=", "href=", "import "}) {
        const std::size_t at = page.find(foreign);
        // The name of a language, which nothing loads, and links to pictures that are saved.
        if (at != std::string::npos) {
            EXPECT_TRUE(page.substr(at, 26) == "http://www.w3.org/2000/svg") << foreign;
        }
    }
    EXPECT_NE(page.find("<title>Moss &amp; &lt;/script>&lt;b></title>"), std::string::npos)
        << page.substr(0, 400);
    const json told = json::parse(element(page, "material"));
    EXPECT_EQ(told["title"], "Moss & </script><b>");
    EXPECT_EQ(told["size"], json::array({32, 24}));
    EXPECT_EQ(told["planes"], 5);
    EXPECT_EQ(told["views"].size(), 81U);
    EXPECT_EQ(detail::from_base64(element(page, "planes-data")).size(), 24U * 32U * 8U);
    EXPECT_EQ(detail::from_base64(element(page, "height-data")).size(), 24U * 32U * 2U);
    EXPECT_EQ(detail::from_base64(element(page, "lattice-weights")).size(), 121U * 121U * 15U);
    EXPECT_EQ(detail::from_base64(element(page, "measured-weights")).size(), 81U * 81U * 15U);
    EXPECT_EQ(detail::from_base64(element(page, "measured-pairs")).size(), 81U * 81U * 4U);
}

TEST(BtfPage, WhatCannotBeShownIsRefused) {
    EXPECT_THROW(static_cast<void>(page_of(test::smooth_btf(tile, 2))), InputError);
    BtfPageOptions more;
    more.planes = 6;
    EXPECT_THROW(static_cast<void>(page_of(test::smooth_btf(tile, 3, 5), more)), InputError);
}

struct State {
    BtfShape shape;
    BtfDirection view, light;
};

std::string address_of(const State& state) {
    const auto direction = [](const BtfDirection& d) {
        return std::to_string(std::lround(d.theta / degree)) + "," +
               std::to_string(std::lround(d.phi / degree));
    };
    return "#shape=" + std::string(name(state.shape)) + "&view=" + direction(state.view) +
           "&light=" + direction(state.light) + "&size=160x120";
}

std::vector<State> states() {
    std::vector<State> all;
    for (const auto& [view, light] :
         {std::pair(BtfDirection{}, BtfDirection{45 * degree, 135 * degree}),
          std::pair(BtfDirection{40 * degree, 100 * degree}, BtfDirection{60 * degree, 20 * degree}),
          std::pair(BtfDirection{63 * degree, 300 * degree}, BtfDirection{30 * degree, 10 * degree}),
          std::pair(BtfDirection{20 * degree, 10 * degree}, BtfDirection{82 * degree, 160 * degree}),
          std::pair(BtfDirection{30 * degree, 200 * degree}, BtfDirection{70 * degree, 45 * degree})})
        for (const BtfShape shape : {BtfShape::sphere, BtfShape::plane}) all.push_back({shape, view, light});
    return all;
}

/// Pictures of a canvas that toDataURL() gave.
Image decoded(const test::TemporaryFolder& folder, const std::string& url) {
    const std::string start = "data:image/png;base64,";
    EXPECT_EQ(url.rfind(start, 0), 0U);
    const std::vector<std::uint8_t> bytes = detail::from_base64(url.substr(start.size()));
    test::put_bytes(folder / "canvas.png", std::string(bytes.begin(), bytes.end()));
    const Picture picture = read_picture(folder / "canvas.png");
    EXPECT_GE(picture.image.planes(), 3);
    return picture.image;
}

/// Mean and largest difference to what BtfRenderer shows, in steps of 8 bits.
std::pair<double, double> differences(const test::TemporaryFolder& folder, const Image& canvas,
                                      const Image& rendered) {
    write_picture(folder / "rendered.png", rendered, PixelType::uint8);
    const Image truth = read_picture(folder / "rendered.png").image;
    EXPECT_EQ(canvas.size(), truth.size());
    double sum = 0.0, largest = 0.0;
    for (int p = 0; p < 3; ++p)
        for (std::size_t i = 0; i < area(truth.size()); ++i) {
            const auto value = truth.plane(truth.planes() == 1 ? 0 : p)[i];
            const double d = 255.0 * std::abs(static_cast<double>(canvas.plane(p)[i] - value));
            sum += d;
            largest = std::max(largest, d);
        }
    return {sum / (3.0 * static_cast<double>(area(truth.size()))), largest};
}

class BtfPageBrowser : public testing::Test {
  protected:
    void put(const BtfModel& model) {
        BtfPageOptions options;
        options.title = "waves";
        test::put_bytes(folder_ / "page.html", page_of(model, options));
    }
    [[nodiscard]] json run(const std::string& script, const std::string& address = {},
                           const std::string& window = "900,700") const {
        const json told = test::in_browser(folder_ / "page.html", script, address, window);
        EXPECT_EQ(told["troubles"], json::array()) << told["troubles"];
        return told["result"];
    }
    /// All states, as addresses that the page restores; the first is the one that it opens with.
    void expect_renderings(const BtfModel& model) {
        put(model);
        const std::vector<State> all = states();
        json addresses = json::array();
        for (const State& state : all) addresses.push_back(address_of(state));
        const json canvases =
            run("result = [canvas.toDataURL()];\nfor (const address of " + addresses.dump() +
                    ".slice(1)) {\n history.replaceState(null, '', address);\n readAddress();\n paintNow();\n"
                    " result.push(canvas.toDataURL());\n}",
                address_of(all.front()));
        ASSERT_EQ(canvases.size(), all.size());
        const BtfRenderer renderer(test::default_device(), model, test::smooth_surface(tile, model.planes()));
        for (std::size_t i = 0; i < all.size(); ++i) {
            const Image canvas = decoded(folder_, canvases[i].get<std::string>());
            const Image truth =
                renderer.picture({all[i].shape, {120, 160}, 1.0, 0.02}, all[i].view, all[i].light);
            const auto [mean, largest] = differences(folder_, canvas, truth);
            // Planes of 8 bits, and filters whose weights have as many; spheres by a lattice too.
            EXPECT_LE(mean, all[i].shape == BtfShape::plane ? 0.5 : 1.0) << address_of(all[i]);
            EXPECT_LE(largest, all[i].shape == BtfShape::plane ? 4.0 : 30.0) << address_of(all[i]);
        }
    }
    test::TemporaryFolder folder_;
};

TEST_F(BtfPageBrowser, ShowsWhatTheRendererShows) {
    expect_renderings(test::smooth_btf(tile));
}

TEST_F(BtfPageBrowser, ShowsGreyAndXyz) {
    expect_renderings(test::smooth_btf(tile, 1, 4));
    BtfModel xyz = test::smooth_btf(tile);
    xyz.space = ColourSpace::xyz;
    xyz.white = 50.0;
    for (float& mean : xyz.tables.mean) mean *= 50.0F;
    expect_renderings(xyz);
}

TEST_F(BtfPageBrowser, ShowsSetsOfFewDirections) {
    // One view: values along views are not known. Lights that goniometers moved have their own directions.
    BtfModel model = test::smooth_btf(tile);
    model.pairs.resize(81);
    model.tables.mean.resize(81 * 3);
    model.tables.kept.resize(81);
    model.tables.contrast.resize(81 * 3);
    model.tables.weights.resize(81 * 3 * 5);
    for (const BtfDirection& light : model.lights)
        model.true_lights.push_back({light.theta * 0.99, light.phi + 0.01});
    expect_renderings(model);
}

TEST_F(BtfPageBrowser, MovesAsItIsTold) {
    put(test::smooth_btf(tile));
    const json told = run(R"js(
result = {};
const key = (name, more = {}) => document.dispatchEvent(new KeyboardEvent("keydown", {key: name, ...more}));
const box = canvas.getBoundingClientRect();
const pointer = (type, x, y, more = {}) => canvas.dispatchEvent(new PointerEvent(type,
    {clientX: box.left + x, clientY: box.top + y, pointerId: 1, buttons: 1, ...more}));
canvas.setPointerCapture = () => {};
const degrees = (what) => textOf(state[what]);
result.first = [state.shape, degrees("view"), degrees("light"), state.exposure, state.zoom];
key("p");
result.plane = [state.shape, location.hash];
key("Home");
key("ArrowRight");
result.arrow = degrees("light");
key("Home");
pointer("pointerdown", box.width / 2 + 0.225 * box.height, box.height / 2);
result.dragged = degrees("light");
pointer("pointermove", box.width / 2, box.height / 2 - 0.225 * box.height);
result.on = degrees("light");
pointer("pointerup", 0, 0);
pointer("pointermove", 3, 3);
result.released = degrees("light");
pointer("pointerdown", 100, 100, {button: 2, buttons: 2});
pointer("pointermove", 100 + 0.45 * box.height, 100, {buttons: 2});
result.turned = degrees("view");
pointer("pointerup", 0, 0);
key("l");
result.moving = [state.moving, byId("move-view").getAttribute("aria-pressed")];
paintNow();
result.pressed = byId("move-view").getAttribute("aria-pressed");
canvas.dispatchEvent(new WheelEvent("wheel", {deltaY: -400, cancelable: true}));
result.zoom = state.zoom;
key("]");
result.exposure = [state.exposure, location.hash];
byId("exposure").value = "1";
byId("exposure").dispatchEvent(new Event("input"));
result.slider = state.exposure;
key("h");
result.hidden = getComputedStyle(byId("panel")).display;
key("?");
result.help = byId("keys").open;
byId("keys").close();
key("Home");
result.home = [state.shape, degrees("view"), degrees("light"), state.exposure, state.zoom, state.moving];
result.dots = document.querySelectorAll("#light-disc .measured").length;
result.label = canvas.getAttribute("aria-label");
)js",
                          "#shape=plane&view=12,34&light=56,78&exposure=2&zoom=3&nonsense=1&light=99,0");
    EXPECT_EQ(told["first"], json::array({"plane", "12,34", "56,78", 2, 3}));
    EXPECT_EQ(told["plane"][0], "plane");
    EXPECT_EQ(told["plane"][1], "#shape=plane&view=12,34&light=56,78&exposure=2&zoom=3");
    // On the disc of theta from (−31.8, 31.8) to (−26.8, 31.8).
    EXPECT_EQ(told["arrow"], "41.6,130.1");
    // Half of the sphere's radius to the right: the light from there is 30 degrees from the normal.
    EXPECT_EQ(told["dragged"], "30,0");
    EXPECT_EQ(told["on"], "30,90");
    EXPECT_EQ(told["released"], "30,90");
    EXPECT_EQ(told["turned"], "45,180");
    EXPECT_EQ(told["moving"][0], "view");
    EXPECT_EQ(told["pressed"], "true");
    EXPECT_NEAR(told["zoom"].get<double>(), std::exp(0.6), 1e-9);
    EXPECT_NEAR(told["exposure"][0].get<double>(), std::sqrt(2.0), 1e-9);
    EXPECT_NE(told["exposure"][1].get<std::string>().find("exposure=1.414"), std::string::npos);
    EXPECT_EQ(told["slider"], 2);
    EXPECT_EQ(told["hidden"], "none");
    EXPECT_EQ(told["help"], true);
    EXPECT_EQ(told["home"], json::array({"sphere", "0,0", "45,135", 1, 1, "light"}));
    EXPECT_EQ(told["dots"], 81);
    EXPECT_NE(told["label"].get<std::string>().find("waves on a"), std::string::npos);
}

TEST_F(BtfPageBrowser, FitsWindowsOfAnySize) {
    put(test::smooth_btf(tile));
    for (const char* window : {"1400,900", "600,900", "500,420"}) {
        const json told = run(R"js(
const box = byId("panel").getBoundingClientRect();
result = {inside: box.left >= 0 && box.top >= 0 && box.right <= innerWidth && box.bottom <= innerHeight,
          canvas: [canvas.width === innerWidth, canvas.height === innerHeight],
          overflow: document.documentElement.scrollWidth - innerWidth,
          panel: byId("panel").scrollWidth - byId("panel").clientWidth};
)js",
                              {}, window);
        EXPECT_EQ(told["inside"], true) << window;
        EXPECT_EQ(told["canvas"], json::array({true, true})) << window;
        EXPECT_LE(told["overflow"], 0) << window;
        EXPECT_LE(told["panel"], 0) << window;
    }
}

TEST_F(BtfPageBrowser, SaysWhenWebGl2IsMissing) {
    put(test::smooth_btf(tile));
    std::string page = test::bytes_of(folder_ / "page.html");
    page.insert(page.find("<head>") + 6,
                "<script>HTMLCanvasElement.prototype.getContext = () => null;</script>");
    test::put_bytes(folder_ / "page.html", page);
    const json told =
        run("result = [byId('trouble').hidden, byId('trouble').textContent, "
            "getComputedStyle(byId('panel')).display];");
    EXPECT_EQ(told[0], false);
    EXPECT_NE(told[1].get<std::string>().find("no WebGL 2"), std::string::npos);
    EXPECT_EQ(told[2], "none");
}

}  // namespace
}  // namespace btfield
