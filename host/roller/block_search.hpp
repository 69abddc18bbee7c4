#pragma once

// Where in a sample a patch would fit to what lies there already: bounds of squared differences at all
// positions, by correlation in frequency on the device, and the choice among them in integers (theory 17.3).

#include <cstdint>
#include <map>
#include <mutex>
#include <span>
#include <tuple>
#include <vector>

#include "host/cl/device_impl.hpp"
#include "host/roller/canvas.hpp"
#include "host/roller/features.hpp"
#include "host/roller/leading_planes.hpp"
#include "host/roller/summed_area.hpp"

namespace btfield::detail {

/// A patch to be found.
struct BlockQuery {
    Strips strips;
    std::vector<std::int16_t> known;  ///< [row][column][plane], 0 outside of the strips
    std::vector<Position> excluded;   ///< centres of what may not be chosen, unless nothing else is left
    std::uint64_t key = 0;            ///< decides among what the tolerance admits
};

/// What squared differences are multiplied by, by position, [row][column].
struct PositionWeights {
    std::vector<float> values;
    float largest = 1.0F;
};

/// For any number of threads, one of which searches at a time.
class BlockSearch {
  public:
    /// \param features outlive the search
    BlockSearch(DeviceImpl& device, const Features& features);

    /// For each query, a position whose squared difference in the strips is at most (1 + tolerance) times the
    /// least: the one that the key makes first. All of the sample where the strips are empty.
    /// \param radius positions nearer than this to an excluded one, along both axes, are excluded
    /// \param weights null: all 1
    [[nodiscard]] std::vector<Position> find(std::span<const BlockQuery> queries, Size patch, int radius,
                                             double tolerance, const PositionWeights* weights = nullptr);

    /// Planes that are correlated; the others' differences are bounded. For tests.
    [[nodiscard]] int correlated_planes() const { return planes_.kept(); }

  private:
    struct Energy {
        std::vector<float> values;  ///< [row][column]: Σ sample² in the strips of a patch there
        std::vector<float> rests;  ///< √ of the part of it that is not correlated; empty where there is none
        float largest = 0.0F;
    };
    /// What all queries of a find() share.
    struct Request {
        Size patch;
        int rows = 0, columns = 0;  ///< of positions
        int radius = 0;
        double tolerance = 0.0;
        const PositionWeights* weights = nullptr;
    };
    /// Σ known², and the part of it that is not correlated, or more.
    struct Known {
        double energy = 0.0, rest = 0.0;
    };
    /// What was chosen, and how many positions were compared in integers for it.
    struct Choice {
        Position at;
        std::int64_t compared = 0;
    };

    void transform_sample();
    const Energy& energy(Size patch, const Strips& strips);
    /// To what is correlated: [plane][row][column].
    Known write_known(const BlockQuery& query, Size patch, float* to) const;
    [[nodiscard]] Choice choose(const BlockQuery& query, const Known& known, const Request& request,
                                const Energy& energy, const float* scores) const;
    /// Any number above `most` where it is above.
    [[nodiscard]] std::int64_t difference(const BlockQuery& query, Size patch, Position at,
                                          double most) const;

    DeviceImpl* device_;
    const Features* features_;
    Size lattice_;  ///< the sample's, or the next larger one that is transformed; zeros beyond the sample
    double norm_ = 0.0;   ///< √ Σ sample²
    SummedArea squares_;  ///< of the sample
    std::mutex mutex_;    ///< of what follows
    LeadingPlanes planes_;
    SummedArea rests_;  ///< of what they leave out
    Spectrum spectrum_;
    std::int64_t compared_ = 0, queries_ = 0;  ///< positions compared in integers with these planes
    std::map<std::tuple<int, int, Strips>, Energy> energies_;
};

}  // namespace btfield::detail
