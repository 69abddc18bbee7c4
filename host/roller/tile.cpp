#include "host/roller/tile.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "btfield/error.hpp"
#include "host/base/parallel.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/base/work_part.hpp"
#include "host/roller/canvas.hpp"
#include "host/roller/minimum_cut.hpp"
#include "host/roller/summed_area.hpp"

namespace btfield::detail {
namespace {

using std::size_t;

/// Of the time that a tile takes.
constexpr double share_of_differences = 0.1, share_of_places = 0.1, share_of_cuts = 0.75;

/// Squared distances between pixels a lag apart.
SummedArea lag_differences(const Features& features, int down, int right) {
    const auto width = static_cast<size_t>(features.size.width);
    const size_t lag = static_cast<size_t>(down) * width + static_cast<size_t>(right);
    return {{features.size.height - down, features.size.width - right}, [&](int r, int c) {
                const size_t a = static_cast<size_t>(r) * width + static_cast<size_t>(c);
                return features.distance(a, a + lag);
            }};
}

double mean(const SummedArea& of, Position at, int rows, int columns) {
    return static_cast<double>(of.sum(at.row, at.column, at.row + rows, at.column + columns)) /
           (static_cast<double>(rows) * columns);
}

/// A patch of the sample as a tile: `size` and an overlap to the right and below.
struct TilePlace {
    Position at;
    Size size;
    double difference = 0.0;  ///< mean over both overlaps
};

/// A tile as the cuts make it.
struct CutTile {
    std::vector<std::uint32_t> source;
    Cost cost;
};

/// Cuts rows first: a picture that continues itself from right to left, higher by the overlap than the tile.
/// Its own upper and lower ends are cut along a closed path, so the corner is right from both sides.
CutTile cut_tile(const Features& features, const TilePlace& place, int overlap) {
    const int h = place.size.height, w = place.size.width;
    const auto pixel = [&](int r, int c) {
        return static_cast<size_t>(place.at.row + r) * static_cast<size_t>(features.size.width) +
               static_cast<size_t>(place.at.column + c);
    };
    std::vector<std::int64_t> errors;
    for (int r = 0; r < h + overlap; ++r)
        for (int c = 0; c < overlap; ++c) errors.push_back(features.distance(pixel(r, c), pixel(r, c + w)));
    const BoundaryCut sides = minimum_cut(errors, h + overlap, overlap);
    const auto wrapped = [&](int r, int c) {
        return c < sides.cut[static_cast<size_t>(r)] ? pixel(r, c + w) : pixel(r, c);
    };
    errors.clear();
    for (int c = 0; c < w; ++c)
        for (int r = 0; r < overlap; ++r)
            errors.push_back(features.distance(wrapped(r, c), wrapped(r + h, c)));
    const BoundaryCut ends = minimum_cut(errors, w, overlap, true);
    CutTile result{{}, {sides.cost + ends.cost, h + overlap + w}};
    result.source.reserve(area(place.size));
    for (int r = 0; r < h; ++r)
        for (int c = 0; c < w; ++c)
            result.source.push_back(static_cast<std::uint32_t>(
                r < ends.cut[static_cast<size_t>(c)] ? wrapped(r + h, c) : wrapped(r, c)));
    return result;
}

struct TilePlaceAndCut {
    TilePlace place;
    CutTile tile;
};

/// Sides that are tried along one axis.
std::vector<int> tile_sides(std::optional<int> given, int sample, int length, int overlap, int parts,
                            const std::string& asked) {
    const int most = sample - overlap;
    if (given) {
        if (*given > most)
            throw InputError(asked,
                             "a side of " + std::to_string(*given) + " and an overlap of " +
                                 std::to_string(overlap) + " out of " + counted(sample, "pixel"),
                             "ask for at most " + std::to_string(most) +
                                 " with such an overlap, or for a quilt, which has any size");
        return {*given};
    }
    const int end = std::max(std::min(smallest_rolled_side, most), most / parts);
    const int begin = std::clamp(std::max(3 * end / 4, 8 * length), std::min(smallest_rolled_side, end), end);
    constexpr int tried = 8;
    std::vector<int> sides;
    for (int i = 0; i < tried; ++i) {
        const int value = begin + (end - begin) * i / (tried - 1);
        if (sides.empty() || value > sides.back()) sides.push_back(value);
    }
    return sides;
}

void keep_best(std::vector<TilePlace>& places, size_t count) {
    std::stable_sort(places.begin(), places.end(),
                     [](const TilePlace& a, const TilePlace& b) { return a.difference < b.difference; });
    places.resize(std::min(count, places.size()));
}

/// The best places of each size, one from each part of the sample as large as the overlap; best first.
std::vector<TilePlace> best_places(const Features& features, const std::vector<int>& heights,
                                   const std::vector<int>& widths, int overlap) {
    std::vector<std::optional<SummedArea>> down(heights.size()), right(widths.size());
    std::optional<WorkPart> share(std::in_place, share_of_differences);
    for_each_part(static_cast<int>(heights.size() + widths.size()), [&](int i) {
        const auto n = static_cast<size_t>(i);
        if (n < heights.size())
            down[n] = lag_differences(features, heights[n], 0);
        else
            right[n - heights.size()] = lag_differences(features, 0, widths[n - heights.size()]);
    });
    constexpr size_t kept = 8;
    std::vector<std::vector<TilePlace>> of_size(heights.size() * widths.size());
    share.reset();
    share.emplace(share_of_places);
    for_each_part(static_cast<int>(of_size.size()), [&](int i) {
        const size_t y = static_cast<size_t>(i) / widths.size(), x = static_cast<size_t>(i) % widths.size();
        const Size size{heights[y], widths[x]};
        const int rows = features.size.height - size.height - overlap + 1,
                  columns = features.size.width - size.width - overlap + 1;
        std::vector<TilePlace>& places = of_size[static_cast<size_t>(i)];
        for (int top = 0; top < rows; top += overlap) {
            stop_if_asked();
            for (int left = 0; left < columns; left += overlap) {
                TilePlace best{{}, size, std::numeric_limits<double>::infinity()};
                for (int r = top; r < std::min(rows, top + overlap); ++r)
                    for (int c = left; c < std::min(columns, left + overlap); ++c) {
                        const Position at{r, c};
                        const double difference = mean(*right[x], at, size.height + overlap, overlap) +
                                                  mean(*down[y], at, overlap, size.width + overlap);
                        if (difference < best.difference) best = {at, size, difference};
                    }
                places.push_back(best);
            }
        }
        keep_best(places, kept);
    });
    std::vector<TilePlace> all;
    for (const std::vector<TilePlace>& places : of_size) all.insert(all.end(), places.begin(), places.end());
    keep_best(all, all.size());
    return all;
}

TilePlaceAndCut first_tile(const Features& features, const std::vector<int>& heights,
                           const std::vector<int>& widths, int overlap, std::uint64_t seed,
                           double tolerance) {
    std::vector<TilePlace> places = best_places(features, heights, widths, overlap);
    constexpr size_t examined = 48;
    places.resize(std::min(examined, places.size()));
    std::vector<CutTile> tiles(places.size());
    const WorkPart share(share_of_cuts);
    for_each_part(static_cast<int>(places.size()), [&](int i) {
        tiles[static_cast<size_t>(i)] = cut_tile(features, places[static_cast<size_t>(i)], overlap);
    });
    double least = std::numeric_limits<double>::infinity();
    for (const CutTile& each : tiles) least = std::min(least, each.cost.mean());
    size_t chosen = tiles.size();
    for (size_t i = 0; i < tiles.size(); ++i)
        if (tiles[i].cost.mean() <= (1.0 + tolerance) * least &&
            (chosen == tiles.size() || draw(seed, i) < draw(seed, chosen)))
            chosen = i;
    return {places[chosen], std::move(tiles[chosen])};
}

/// Tiles with the first one's border and another inside each.
void add_insides(std::vector<SourceMap>& tiles, const Features& features, BlockSearch& search, int count,
                 const TilePlaceAndCut& first, int overlap, std::uint64_t seed, double tolerance,
                 const std::string& asked) {
    const int border = std::max(1, overlap / 2);
    const Size size = first.place.size;
    const Size patch{size.height - 2 * border, size.width - 2 * border};
    const int strip = std::min(overlap, std::min(patch.height, patch.width) / 2);
    if (strip < 2)
        throw InputError(asked, "it leaves no room for an inside",
                         "ask for larger tiles, or for a smaller overlap");
    BlockQuery query;
    query.strips = {strip, strip, strip, strip};
    const Canvas border_canvas(features, size, first.tile.source);
    query.known = border_canvas.known({border, border}, patch, query.strips);
    query.excluded = {{first.place.at.row + border, first.place.at.column + border}};
    for (int i = 1; i < count; ++i) {
        query.key = draw(seed, static_cast<std::uint64_t>(i));
        const Position found = search.find({&query, 1}, patch, std::max(1, strip), tolerance).front();
        Canvas canvas = border_canvas;
        Cost cost = first.tile.cost;
        cost += canvas.lay({border, border}, patch, query.strips, found);
        tiles.push_back(std::move(canvas).finished(cost));
        query.excluded.push_back(found);
        work_nearer(1.0 / (count - i));
    }
}

}  // namespace

std::vector<SourceMap> make_tiles(const Features& features, BlockSearch& search, int count,
                                  std::optional<Size> size, int overlap, std::uint64_t seed, double tolerance,
                                  const std::string& asked) {
    const int parts = count > 1 ? 2 : 1;
    const auto side = [&](int Size::*which) { return size ? std::optional(*size.*which) : std::nullopt; };
    const TilePlaceAndCut first =
        first_tile(features,
                   tile_sides(side(&Size::height), features.size.height, correlation_length(features, false),
                              overlap, parts, asked),
                   tile_sides(side(&Size::width), features.size.width, correlation_length(features, true),
                              overlap, parts, asked),
                   overlap, seed, tolerance);
    std::vector<SourceMap> result{
        Canvas(features, first.place.size, first.tile.source).finished(first.tile.cost)};
    if (count > 1) add_insides(result, features, search, count, first, overlap, seed, tolerance, asked);
    return result;
}

}  // namespace btfield::detail
