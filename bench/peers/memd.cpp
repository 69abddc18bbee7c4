#include "bench/peers/memd.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace btfield::peer {
namespace {

constexpr std::size_t d = 3;

float distance(const float* a, const float* b) {
    return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

class KdTree {
  public:
    explicit KdTree(const std::vector<float>& colours)
        : colours_(&colours), order_(colours.size() / d), leaf_of_(order_.size()) {
        for (std::size_t k = 0; k < order_.size(); ++k) order_[k] = k;
        nodes_.reserve(order_.size() / 3 + 16);
        build(0, order_.size(), none);
    }

    /// Takes the nearest pixel away.
    /// \return its distance
    float take_nearest(const float* colour) {
        best_ = std::numeric_limits<float>::max();
        nearest_ = none;
        search(0, colour, 0.0F);
        remove(nearest_);
        return best_;
    }

  private:
    static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
    static constexpr std::size_t leaf_size = 12;
    struct Node {
        std::array<float, d> low{}, high{};
        std::size_t left = none, right = none, parent = none, begin = 0, live = 0;
    };

    [[nodiscard]] const float* at(std::size_t pixel) const { return colours_->data() + d * pixel; }

    std::size_t build(std::size_t begin, std::size_t end, std::size_t parent) {
        const std::size_t self = nodes_.size();
        Node node;
        node.parent = parent;
        node.begin = begin;
        node.live = end - begin;
        for (std::size_t i = 0; i < d; ++i) {
            node.low[i] = node.high[i] = at(order_[begin])[i];
            for (std::size_t k = begin; k < end; ++k) {
                node.low[i] = std::min(node.low[i], at(order_[k])[i]);
                node.high[i] = std::max(node.high[i], at(order_[k])[i]);
            }
        }
        nodes_.push_back(node);
        std::size_t widest = 0;
        for (std::size_t i = 1; i < d; ++i)
            if (node.high[i] - node.low[i] > node.high[widest] - node.low[widest]) widest = i;
        if (end - begin <= leaf_size || node.low == node.high) {
            for (std::size_t k = begin; k < end; ++k) leaf_of_[order_[k]] = self;
            return self;
        }
        const std::size_t middle = (begin + end) / 2;
        const auto place = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
        std::nth_element(place(begin), place(middle), place(end),
                         [&](std::size_t x, std::size_t y) { return at(x)[widest] < at(y)[widest]; });
        const std::size_t left = build(begin, middle, self);
        const std::size_t right = build(middle, end, self);
        nodes_[self].left = left;
        nodes_[self].right = right;
        return self;
    }

    static float bound(const Node& node, const float* colour) {
        float most = 0.0F;
        for (std::size_t i = 0; i < d; ++i)
            most = std::max({most, node.low[i] - colour[i], colour[i] - node.high[i]});
        return most;
    }

    void search(std::size_t at_node, const float* colour, float least) {
        const Node& node = nodes_[at_node];
        if (node.live == 0 || least > best_) return;
        if (node.left == none) {
            for (std::size_t k = node.begin; k < node.begin + node.live; ++k) {
                const float here = distance(at(order_[k]), colour);
                if (here < best_ || (here == best_ && order_[k] < nearest_)) {
                    best_ = here;
                    nearest_ = order_[k];
                }
            }
            return;
        }
        const float left = bound(nodes_[node.left], colour), right = bound(nodes_[node.right], colour);
        if (left <= right) {
            search(node.left, colour, left);
            search(node.right, colour, right);
        } else {
            search(node.right, colour, right);
            search(node.left, colour, left);
        }
    }

    void remove(std::size_t pixel) {
        const Node& leaf = nodes_[leaf_of_[pixel]];
        const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(leaf.begin);
        const auto last = begin + static_cast<std::ptrdiff_t>(leaf.live) - 1;
        std::iter_swap(std::find(begin, last, pixel), last);
        for (std::size_t node = leaf_of_[pixel]; node != none; node = nodes_[node].parent)
            --nodes_[node].live;
    }

    const std::vector<float>* colours_;
    std::vector<std::size_t> order_, leaf_of_;
    std::vector<Node> nodes_;
    float best_ = 0.0F;
    std::size_t nearest_ = none;
};

}  // namespace

double memd_loop(const std::vector<float>& a, const std::vector<float>& b) {
    const std::size_t count = std::min(a.size(), b.size()) / d;
    std::vector<char> taken(b.size() / d, 0);
    double sum = 0.0;
    for (std::size_t pixel = 0; pixel < count; ++pixel) {
        float best = std::numeric_limits<float>::max();
        std::size_t nearest = 0;
        for (std::size_t k = 0; k < taken.size(); ++k) {
            const float here = distance(a.data() + d * pixel, b.data() + d * k);
            if (taken[k] == 0 && here < best) {
                best = here;
                nearest = k;
            }
        }
        taken[nearest] = 1;
        sum += static_cast<double>(best);
    }
    return sum / static_cast<double>(count);
}

double memd_tree(const std::vector<float>& a, const std::vector<float>& b) {
    const std::size_t count = std::min(a.size(), b.size()) / d;
    KdTree tree(b);
    double sum = 0.0;
    for (std::size_t pixel = 0; pixel < count; ++pixel)
        sum += static_cast<double>(tree.take_nearest(a.data() + d * pixel));
    return sum / static_cast<double>(count);
}

}  // namespace btfield::peer
