#pragma once

/// \file
/// What a benchmark tells the table. Names: "STATION CASE"; its native peer is called the same with
/// peer_suffix.

#include <benchmark/benchmark.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace btfield::bench {

inline constexpr const char* peer_suffix = " [peer]";
/// The benchmark whose memory traffic is the machine's measured ceiling.
inline constexpr const char* ceiling_name = "memory triad";

/// What one iteration does; 0 = says nothing.
struct Work {
    double items = 0;     ///< results (normals, pixels, textures)
    double bytes = 0;     ///< memory traffic that no implementation can avoid
    double textures = 1;  ///< the time is shown divided by this
};

/// Registers a benchmark of `body`, run once before the clock starts.
void add(const std::string& name, const Work& work, std::function<void()> body);

/// Registers a benchmark whose body and work are made only when it runs.
void add(const std::string& name, std::function<std::pair<Work, std::function<void()>>()> make);

/// Registers a benchmark that says where its time goes: `parts` gives seconds per texture by name, once at
/// the end.
void add_split(const std::string& name, std::function<std::pair<Work, std::function<void()>>()> make,
               std::function<std::map<std::string, double>()> parts);

/// Collects repetitions; prints one table at the end: median, spread, rates beside the ceiling, ratio to the
/// peer.
class Table : public benchmark::BenchmarkReporter {
  public:
    bool ReportContext(const Context& context) override;
    void ReportRuns(const std::vector<Run>& runs) override;
    void Finalize() override;

  private:
    struct Row {
        std::vector<double> seconds;
        std::map<std::string, double> counters;
    };
    void print(const std::string& name, const Row& row, double ceiling) const;

    std::map<std::string, Row> rows_;
    bool failed_ = false;
};

}  // namespace btfield::bench
