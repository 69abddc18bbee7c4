// The memory bandwidth that this machine gives to two threads: a triad over arrays that no cache holds.
#include <cstddef>
#include <vector>

#include "bench/cases.hpp"
#include "bench/peers/parallel.hpp"
#include "bench/report.hpp"

namespace btfield::bench {

void add_ceiling() {
    add(ceiling_name, [] {
        struct Arrays {
            std::vector<float> a, b, c;
        };
        const int n = 1 << 25;
        const auto size = static_cast<std::size_t>(n);
        auto arrays = std::make_shared<Arrays>(
            Arrays{std::vector<float>(size), std::vector<float>(size, 1.0F), std::vector<float>(size, 2.0F)});
        const Work work{.bytes = 3.0 * static_cast<double>(size) * sizeof(float)};
        return std::pair(work, std::function<void()>([arrays] {
                             peer::parallel([&](int t) {
                                 for (auto i = static_cast<std::size_t>(peer::share(n, t));
                                      i < static_cast<std::size_t>(peer::share(n, t + 1)); ++i)
                                     arrays->a[i] = arrays->b[i] + 0.5F * arrays->c[i];
                             });
                             benchmark::DoNotOptimize(arrays->a.data());
                         }));
    });
}

}  // namespace btfield::bench
