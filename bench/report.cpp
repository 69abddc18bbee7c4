#include "bench/report.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace btfield::bench {
namespace {

const std::string part_prefix = "part:";

/// Names as they were registered: repetitions run interleaved, the table keeps this order.
std::vector<std::string>& registered() {
    static std::vector<std::string> names;
    return names;
}

/// Value at fraction q of the sorted sample, between neighbours linearly.
double quantile(std::vector<double> sample, double q) {
    std::ranges::sort(sample);
    const double at = q * static_cast<double>(sample.size() - 1);
    const auto below = static_cast<std::size_t>(at);
    const std::size_t above = std::min(below + 1, sample.size() - 1);
    return sample[below] + (at - static_cast<double>(below)) * (sample[above] - sample[below]);
}

double counter(const std::map<std::string, double>& counters, const std::string& name) {
    const auto found = counters.find(name);
    return found == counters.end() ? 0.0 : found->second;
}

std::string number(const char* format, double value) {
    char text[32];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

}  // namespace

void add_split(const std::string& name, std::function<std::pair<Work, std::function<void()>>()> make,
               std::function<std::map<std::string, double>()> parts) {
    registered().push_back(name);
    benchmark::RegisterBenchmark(name.c_str(),
                                 [make = std::move(make), parts = std::move(parts)](benchmark::State& state) {
                                     try {
                                         const auto [work, body] = make();
                                         body();
                                         for (auto _ : state) body();
                                         state.counters["items"] = work.items;
                                         state.counters["bytes"] = work.bytes;
                                         state.counters["textures"] = work.textures;
                                         if (parts)
                                             for (const auto& [part, seconds] : parts())
                                                 state.counters[part_prefix + part] = seconds;
                                     } catch (const std::exception& error) {
                                         state.SkipWithError(error.what());
                                     }
                                 })
        ->UseRealTime()
        ->Unit(benchmark::kMillisecond);
}

void add(const std::string& name, std::function<std::pair<Work, std::function<void()>>()> make) {
    add_split(name, std::move(make), {});
}

void add(const std::string& name, const Work& work, std::function<void()> body) {
    add(name, [work, body = std::move(body)] { return std::pair(work, body); });
}

bool Table::ReportContext(const Context&) {
    return true;
}

void Table::ReportRuns(const std::vector<Run>& runs) {
    for (const Run& run : runs) {
        const std::string& name = run.run_name.function_name;
        if (run.error_occurred) {
            std::printf("%s: %s\n", name.c_str(), run.error_message.c_str());
            failed_ = true;
            continue;
        }
        if (run.run_type != Run::RT_Iteration) continue;
        Row& row = rows_[name];
        row.seconds.push_back(run.real_accumulated_time / static_cast<double>(run.iterations));
        for (const auto& [key, value] : run.counters) row.counters[key] = value.value;
    }
}

void Table::print(const std::string& name, const Row& row, double ceiling) const {
    const double textures = std::max(1.0, counter(row.counters, "textures"));
    const double median = quantile(row.seconds, 0.5);
    const double spread = (quantile(row.seconds, 0.75) - quantile(row.seconds, 0.25)) / median;
    const double items = counter(row.counters, "items");
    const double bytes = counter(row.counters, "bytes");
    const std::string rate = items > 0 ? number("%.3f", items / median / 1e9) : "";
    const std::string traffic = bytes > 0 ? number("%.1f", bytes / median / 1e9) : "";
    const std::string share =
        bytes > 0 && ceiling > 0 ? number("%.0f %%", 100 * bytes / median / ceiling) : "";
    std::string peer, ratio;
    if (const auto found = rows_.find(name + peer_suffix); found != rows_.end()) {
        const double other = quantile(found->second.seconds, 0.5);
        peer = number("%.3f", 1e3 * other / textures);
        ratio = number("%.2f", median / other);
    }
    std::printf("%-52s %10.3f %8s %9s %8s %8s %10s %7s\n", name.c_str(), 1e3 * median / textures,
                number("%.1f %%", 100 * spread).c_str(), rate.c_str(), traffic.c_str(), share.c_str(),
                peer.c_str(), ratio.c_str());
    for (const auto& [key, seconds] : row.counters)
        if (key.starts_with(part_prefix))
            std::printf("    %-48s %10.3f\n", key.substr(part_prefix.size()).c_str(), 1e3 * seconds);
}

void Table::Finalize() {
    double ceiling = 0;
    if (const auto found = rows_.find(ceiling_name); found != rows_.end())
        ceiling = counter(found->second.counters, "bytes") / quantile(found->second.seconds, 0.5);
    std::printf("%-52s %10s %8s %9s %8s %8s %10s %7s\n", "benchmark", "median ms", "spread", "G items/s",
                "GB/s", "ceiling", "peer ms", "ratio");
    for (const std::string& name : registered())
        if (rows_.contains(name) && !name.ends_with(peer_suffix)) print(name, rows_.at(name), ceiling);
    std::printf(
        "\nMedian over repetitions, per texture where a batch runs; spread is the interquartile range; items "
        "are\n"
        "results (normals, pixel values); ceiling is the share of the memory triad's traffic; ratio < 1: "
        "faster than\n"
        "the peer.\n");
    if (failed_) std::printf("Some benchmarks failed: see above.\n");
}

}  // namespace btfield::bench
