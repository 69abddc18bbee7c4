#include "btfield/fit.hpp"

#include <map>
#include <memory>
#include <string>

#include "bench/cases.hpp"
#include "bench/report.hpp"

namespace btfield::bench {
namespace {

void add_case(const std::string& name, ModelKind kind, int order, int levels) {
    struct State {
        Image image;
        std::map<std::string, double> stages;
        int runs = 0;
    };
    auto state = std::make_shared<State>();
    add_split(
        name,
        [=] {
            state->image = picture({800, 800});
            state->stages.clear();
            state->runs = 0;
            FitOptions options;
            options.model = kind;
            options.order = order;
            options.levels = levels;
            options.progress = [s = state.get()](std::string_view stage, double seconds) {
                s->stages[std::string(stage)] += seconds;
            };
            return std::pair(Work{}, std::function<void()>([state, options] {
                                 benchmark::DoNotOptimize(fit(device(), state->image, options));
                                 ++state->runs;
                             }));
        },
        [state] {
            auto parts = state->stages;
            for (auto& [stage, seconds] : parts) seconds /= state->runs;
            return parts;
        });
}

}  // namespace

void add_fit() {
    add_case("fit 3d-car 800 rgb order 5 K=4", ModelKind::car3d, 5, 4);
    add_case("fit 3d-car 800 rgb order 5 K=1", ModelKind::car3d, 5, 1);
    add_case("fit 3d-msar 800 rgb order 3 K=3", ModelKind::msar3d, 3, 3);
}

}  // namespace btfield::bench
