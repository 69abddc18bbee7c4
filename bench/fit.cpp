#include "btfield/fit.hpp"

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "bench/cases.hpp"
#include "bench/report.hpp"

namespace btfield::bench {
namespace {

struct State {
    Image image;
    std::map<std::string, double> stages;
    std::mutex adding;
    int runs = 0;
    /// Reports here what the stages take.
    void listen(FitOptions& options) {
        options.progress = [this](std::string_view stage, double seconds) {
            const std::lock_guard lock(adding);
            stages[std::string(stage)] += seconds;
        };
    }
};

/// \param run one iteration
void add_stages(const std::string& name, const std::function<void(State&)>& run) {
    auto state = std::make_shared<State>();
    add_split(
        name,
        [=] {
            state->image = picture({800, 800});
            state->stages.clear();
            state->runs = 0;
            return std::pair(Work{}, std::function<void()>([state, run] {
                                 run(*state);
                                 ++state->runs;
                             }));
        },
        [state] {
            auto parts = state->stages;
            for (auto& [stage, seconds] : parts) seconds /= state->runs;
            return parts;
        });
}

void add_case(const std::string& name, ModelKind kind, int order, int levels) {
    add_stages(name, [=](State& state) {
        FitOptions options;
        options.model = kind;
        options.order = order;
        options.levels = levels;
        state.listen(options);
        benchmark::DoNotOptimize(fit(device(), state.image, options));
    });
}

/// All ten models from one analysis. They are fitted side by side: the times of the stages add up to more
/// than passes.
void add_all_models(const std::string& name, int order, int levels) {
    add_stages(name, [=](State& state) {
        std::vector<FitOptions> all;
        for (const ModelKind kind : model_kinds()) {
            FitOptions& options = all.emplace_back();
            options.model = kind;
            options.order = order;
            options.levels = levels;
            state.listen(options);
        }
        Analysis analysis(device(), state.image);
        benchmark::DoNotOptimize(analysis.fit_all(all));
    });
}

}  // namespace

void add_fit() {
    add_case("fit 3d-car 800 rgb order 5 K=4", ModelKind::car3d, 5, 4);
    add_case("fit 3d-car 800 rgb order 5 K=1", ModelKind::car3d, 5, 1);
    add_case("fit 3d-msar 800 rgb order 3 K=3", ModelKind::msar3d, 3, 3);
    add_all_models("fit --all 800 rgb order 5 K=3", 5, 3);
}

}  // namespace btfield::bench
