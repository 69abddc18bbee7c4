// host/experiment/direction_map.cpp

#include "host/experiment/direction_map.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "host/experiment/angles.hpp"

namespace btfield::detail {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

BtfDirection at(double theta, double phi) {
    return {from_degrees(theta), from_degrees(phi)};
}

const std::vector<DirectedValue>& values() {
    static const std::vector<DirectedValue> all{{{at(0.0, 90.0), at(30.0, -90.0)}, 1.0},
                                                {{at(0.0, 0.0), at(60.0, 180.0)}, 3.0},
                                                {{at(45.0, 0.0), at(60.0, 180.0)}, 8.0},
                                                {{at(75.0, 0.0), at(60.0, 180.0)}, nan}};
    return all;
}

TEST(DirectionMap, MeansAreOverTheOtherDirection) {
    const std::vector<DirectionMean> views = means_over_lights(values()), lights = means_over_views(values());
    ASSERT_EQ(views.size(), 2U);  // above is one, whatever phi; one has no value
    EXPECT_EQ(views[0].mean, 2.0);
    EXPECT_EQ(views[0].pictures, 2);
    EXPECT_EQ(views[1].mean, 8.0);
    EXPECT_NEAR(in_degrees(views[1].direction.theta), 45.0, 1e-9);
    ASSERT_EQ(lights.size(), 2U);
    EXPECT_EQ(lights[0].mean, 1.0);
    EXPECT_NEAR(in_degrees(lights[0].direction.phi), 270.0, 1e-9);
    EXPECT_EQ(lights[1].mean, 5.5);
}

TEST(DirectionMap, DotsStandWhereDirectionsPoint) {
    const std::string svg = direction_map("MEMD* <&>", " %", values(), map_scale({values()}, false));
    const auto holds = [&](const std::string& part) {
        EXPECT_NE(svg.find(part), std::string::npos) << part << " in " << svg;
    };
    // Discs of 84 pixels about (92, 136) and (276, 136); the highest is light, none dark.
    holds("<circle cx=\"92\" cy=\"136\" r=\"7\" fill=\"" + std::string("#3b528b"));
    holds(
        "<circle cx=\"134\" cy=\"136\" r=\"7\" fill=\"#fde725\"><title>45,0: 8 %, 1 "
        "picture</title>");
    holds("<circle cx=\"276\" cy=\"164\"");  // phi 270 is below
    holds("<circle cx=\"220\" cy=\"136\"");  // phi 180 is left
    holds("MEMD* &lt;&amp;&gt;");
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    const std::vector<DirectedValue> none{{{at(0.0, 0.0), at(0.0, 0.0)}, nan}};
    EXPECT_TRUE(direction_map("t", "", none, map_scale({none}, false)).empty());
    // A tenth, and ten times that: the middle of a logarithmic scale.
    const std::vector<DirectedValue> decades{{{at(0.0, 0.0), at(0.0, 0.0)}, 0.01},
                                             {{at(30.0, 0.0), at(30.0, 0.0)}, 0.1},
                                             {{at(60.0, 0.0), at(60.0, 0.0)}, 1.0}};
    EXPECT_NE(direction_map("t", "", decades, map_scale({decades}, true))
                  .find("cx=\"120\" cy=\"136\" r=\"7\" fill=\"#21918c\""),
              std::string::npos);
}

TEST(DirectionMap, MapsOfOneThingHaveOneScale) {
    // The same error is the same colour whatever else its own map has.
    const ExperimentDirections above{at(0.0, 0.0), at(0.0, 0.0)}, aside{at(30.0, 0.0), at(30.0, 0.0)};
    ExperimentTable table;
    table.materials = {"a", "b"};
    table.rows.resize(2);
    table.rows[0].model = "3d-car";
    table.rows[1].model = "2d-car";
    for (const auto& [material, where, values] :
         {std::tuple("a", above, std::pair(2.0, 4.0)), std::tuple("a", aside, std::pair(1.0, 4.0)),
          std::tuple("b", above, std::pair(4.0, 8.0))}) {
        ExperimentTable::PictureRow row;
        row.material = material;
        row.directions = where;
        row.best = {values.first, values.second};
        row.std_ratio = {1.0, 1.0};
        row.kappa = 1.0;
        table.picture_rows.push_back(row);
    }
    const std::string html = direction_maps_html(table);
    const auto colours_of = [&](const std::string& value) {
        std::set<std::string> colours;
        const std::string told = "<title>0,0: " + value + " %, 1 picture</title>";
        for (std::size_t to = html.find(told); to != std::string::npos; to = html.find(told, to + 1))
            colours.insert(html.substr(html.rfind("fill=\"", to) + 6, 7));
        return colours;
    };
    EXPECT_EQ(colours_of("4").size(), 1U);
    EXPECT_EQ(colours_of("8"), (std::set<std::string>{"#fde725"}));
    EXPECT_EQ(colours_of("2").size(), 1U);
    EXPECT_NE(colours_of("2"), colours_of("4"));
    EXPECT_NE(html.find("mean the same in all maps of MEMD*"), std::string::npos);
}

}  // namespace
}  // namespace btfield::detail
