#pragma once

// Small experiments for tests: pictures that take no time, and all that a database holds as text.

#include <cstdint>
#include <deque>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "btfield/experiment.hpp"
#include "host/experiment/sqlite.hpp"
#include "tests/temporary_folder.hpp"

namespace btfield::test {

using namespace detail;

/// A coloured texture with correlation along rows; another for every seed. PPM: needs no codec.
inline void write_texture(const std::filesystem::path& path, unsigned seed, Size size = {32, 40}) {
    Image image(size, 3, ColourSpace::srgb);
    unsigned state = 2 * seed + 1;
    float before = 0.0F;
    for (std::size_t i = 0; i < area(size); ++i) {
        for (int p = 0; p < 3; ++p) {
            state = state * 1664525U + 1013904223U;
            const float noise = static_cast<float>(state >> 8) * 0x1p-24F;
            before = 0.7F * before + 0.3F * noise;
            image.plane(p)[i] = p == 1 ? before : 0.5F * before + 0.4F * noise;
        }
    }
    write_picture(path, image);
}

/// A run on this many threads.
inline ExperimentRunOptions threads(int count) {
    ExperimentRunOptions options;
    options.jobs = count;
    return options;
}

/// The lines of a query, columns separated by bars.
inline std::vector<std::string> query_lines(const std::filesystem::path& database, const std::string& query,
                                            int columns) {
    Connection connection(database, Connection::Access::read, "read '" + database.string() + "'");
    Statement statement(connection, query);
    std::vector<std::string> lines;
    while (statement.step()) {
        std::string line;
        for (int c = 0; c < columns; ++c) line += statement.text(c) + "|";
        lines.push_back(std::move(line));
    }
    return lines;
}

/// All that two runs must agree on.
inline std::vector<std::string> comparable_rows(const std::filesystem::path& database) {
    return query_lines(database, "SELECT * FROM results", 29);
}

/// Whole rows of `jobs`, times included.
inline std::vector<std::string> whole_rows(const std::filesystem::path& database) {
    return query_lines(database, "SELECT * FROM jobs ORDER BY key", 32);
}

/// Two pictures of two materials and a configuration of 24 jobs.
inline std::filesystem::path small_experiment(const TemporaryFolder& folder) {
    write_texture(folder / "a.ppm", 1);
    write_texture(folder / "b.ppm", 2);
    put_bytes(folder / "small.json", R"json({
        "pictures": [{"material": "stone", "files": ["a.ppm"]}, {"material": "bark", "files": ["b.p?m"]}],
        "models": ["3d-car", "2d-car"], "orders": [1, 2, 3], "levels": [1], "seeds": [5, 7]
    })json");
    return folder / "small.json";
}

inline constexpr std::uint64_t varied_jobs = 10;
/// One picture, and textures of it from a random field (4), a compound model (4) and rolls (2).
inline std::filesystem::path varied_experiment(const TemporaryFolder& folder) {
    write_texture(folder / "a.ppm", 1);
    put_bytes(folder / "varied.json", R"json({
        "pictures": [{"material": "stone", "files": ["a.ppm"]}],
        "models": ["roll", "3d-car", "compound"], "orders": [1, 2], "levels": [1], "seeds": [5, 7]
    })json");
    return folder / "varied.json";
}

/// Ranks that are threads of this process.
class ThreadRanks {
  public:
    explicit ThreadRanks(int size) : boxes_(static_cast<std::size_t>(size)) {}
    class Rank final : public ExperimentRanks {
      public:
        Rank(ThreadRanks& post, int rank) : post_(post), rank_(rank) {}
        [[nodiscard]] int rank() const override { return rank_; }
        [[nodiscard]] int size() const override { return static_cast<int>(post_.boxes_.size()); }
        void send(int to, const std::string& message) override {
            const std::lock_guard lock(post_.mutex_);
            post_.boxes_[static_cast<std::size_t>(to)].push_back({rank_, message});
        }
        [[nodiscard]] std::optional<Message> receive() override {
            const std::lock_guard lock(post_.mutex_);
            auto& box = post_.boxes_[static_cast<std::size_t>(rank_)];
            if (box.empty()) return std::nullopt;
            Message message = std::move(box.front());
            box.pop_front();
            return message;
        }

      private:
        ThreadRanks& post_;
        int rank_;
    };

  private:
    std::mutex mutex_;
    std::vector<std::deque<ExperimentRanks::Message>> boxes_;
};

}  // namespace btfield::test
