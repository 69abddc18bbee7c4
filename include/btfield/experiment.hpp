#pragma once

/// \file
/// Experiments over many pictures and models, as P4 section 5: pictures × models × orders × levels ×
/// estimators × marginals × seeds, every texture held against its picture; compound models and rolls beside
/// the random fields. docs/experiments.md describes configuration and database.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "btfield/api.hpp"
#include "btfield/btf_set.hpp"
#include "btfield/device.hpp"
#include "btfield/fit.hpp"
#include "btfield/image.hpp"
#include "btfield/image_io.hpp"
#include "btfield/memd.hpp"

namespace btfield {

/// What an experiment compares: the ten random fields, in the order of ModelKind, and what textures may come
/// from instead.
enum class ExperimentModel {
    car2d,
    car3d,
    ma2d,
    ma3d,
    msar2d,
    msar3d,
    mmrf2d,
    mmrf3d,
    pmrf2d,
    pmrf3d,
    compound,  ///< fit_compound() and CompoundSynthesiser
    roll,      ///< Roller::quilt() of the picture itself
    btf,       ///< BtfSynthesiser of ExperimentBtf::model, seen from the picture's directions
};
/// "2d-car", …, "compound", "roll", "btf".
[[nodiscard]] BTFIELD_API std::string_view name(ExperimentModel model);
[[nodiscard]] BTFIELD_API ExperimentModel experiment_model(ModelKind kind);
/// Nothing for those that are no random field.
[[nodiscard]] BTFIELD_API std::optional<ModelKind> random_field(ExperimentModel model);

/// Where a picture of a BTF is seen and lit from.
struct ExperimentDirections {
    BtfDirection view, light;
    friend bool operator==(const ExperimentDirections&, const ExperimentDirections&) = default;
};

/// A BTF whose pictures are pictures of the experiment, each under its view and its nominal light: linear
/// light, as BtfSet::picture() gives it.
struct ExperimentBtf {
    /// What BtfSet::open() opens, relative to ExperimentConfig::folder.
    std::string set;
    /// But for the crop, which is that of ExperimentPictures.
    BtfOptions reading;
    /// These pictures of it, each to a tenth of a degree; empty: as `number` says.
    std::vector<ExperimentDirections> named;
    /// So many, spread evenly over views and lights; 0: all that there are.
    int number = 0;
    std::uint64_t seed = 0;  ///< which of them
    /// That read_btf_model() reads, relative to ExperimentConfig::folder; for ExperimentModel::btf alone.
    std::string model;
};

/// Pictures of one material.
struct ExperimentPictures {
    std::string material;
    /// Paths and glob patterns (* ? [...]), relative to ExperimentConfig::folder.
    std::vector<std::string> files{};
    std::optional<Crop> crop{};
    /// Value that is white, 256 units of κ and 255 of MEMD: the white level of HDR pictures. Empty: 1, and of
    /// a BTF that of the set.
    std::optional<double> white{};
    std::optional<ExperimentBtf> btf{};  ///< in place of files
};

/// What a model has in place of what ExperimentConfig gives to all.
struct ExperimentModelSettings {
    std::optional<NoiseForm> noise;
    std::optional<GainMode> gains;
    std::optional<std::vector<EstimatorChoice>> estimators;
    std::optional<std::vector<MarginalMode>> marginals;
};

/// What is measured of picture and texture.
enum class MeasuredValues {
    stored,     ///< values as the picture's type stores them
    eight_bit,  ///< both in whole 255ths of white, clamped to 0 … white: what 8-bit pictures would hold
};

struct ExperimentConfig {
    std::string name;
    std::filesystem::path folder;  ///< that paths are relative to: the configuration file's
    std::vector<ExperimentPictures> pictures;
    std::vector<ExperimentModel> models;
    std::vector<int> orders;
    std::vector<int> levels;  ///< K; 0 = as fit() chooses
    std::vector<EstimatorChoice> estimators{EstimatorChoice::automatic};
    std::vector<MarginalMode> marginals{MarginalMode::match};
    std::vector<std::uint64_t> seeds{0};
    int factor = 2;
    NoiseForm noise = NoiseForm::full;
    GainMode gains = GainMode::match;
    /// Of single models, before noise, gains, estimators and marginals above.
    std::map<ExperimentModel, ExperimentModelSettings> own;
    Metric metric = Metric::max;
    MeasuredValues values = MeasuredValues::stored;
    std::optional<Size> size;    ///< of the textures; empty = as the picture
    bool allow_invalid = false;  ///< synthesise although a certificate fails
    std::string text;            ///< the file, for the record
};

/// Reads and checks a configuration against its schema (docs/experiment.schema.json).
/// \throws InputError naming the place: no JSON, an unknown or missing key, a value out of range, a list with
///     a value twice
[[nodiscard]] BTFIELD_API ExperimentConfig read_experiment(const std::filesystem::path& path);

/// How far a run has come.
struct ExperimentProgress {
    std::uint64_t jobs = 0;     ///< of this run: the whole experiment or its shard
    std::uint64_t done = 0;     ///< computed in this run
    std::uint64_t refused = 0;  ///< no such model or texture for that picture, found in this run
    /// Stopped by the surroundings: picture gone, device failure; the next run retries.
    std::uint64_t failed = 0;
    std::uint64_t skipped = 0;  ///< in the database before the run
    double seconds = 0.0;
    /// What goes on now: "read 3 pictures", "jobs", "textures".
    std::string_view stage;
};

/// Processes that share a run. Messages between two processes keep their order.
class BTFIELD_API ExperimentRanks {
  public:
    ExperimentRanks() = default;
    virtual ~ExperimentRanks() = default;
    ExperimentRanks(const ExperimentRanks&) = delete;
    ExperimentRanks& operator=(const ExperimentRanks&) = delete;
    [[nodiscard]] virtual int rank() const = 0;
    [[nodiscard]] virtual int size() const = 0;
    virtual void send(int rank, const std::string& message) = 0;
    struct Message {
        int rank = 0;
        std::string bytes;
    };
    /// The next message that has arrived, from any rank; nothing when there is none.
    [[nodiscard]] virtual std::optional<Message> receive() = 0;
};

struct ExperimentRunOptions {
    std::string device;  ///< as Device takes it
    int jobs = 0;        ///< threads that compute side by side, each with a device of its own; 0 = chosen
    int shard = 1, shards = 1;
    /// Keeps the best texture of every (picture, model) there; empty = none is kept.
    std::filesystem::path textures;
    /// Called from the calling thread, a few times a second and at the end; what it throws ends the run after
    /// the fits under way.
    std::function<void(const ExperimentProgress&)> progress;
    /// Asked often, from several threads; true ends the run after the fits under way. A StopScope of the
    /// calling thread ends these too, and the run throws Stopped; other ranks finish theirs.
    std::function<bool()> stop;
    ExperimentRanks* ranks = nullptr;  ///< nullptr = this process alone
    /// Jobs that share the work of one picture at most; 0 = all of them. 1 is a job at a time, for
    /// comparison.
    int unit = 0;
};

struct ExperimentResult : ExperimentProgress {
    bool interrupted = false;
    std::string failure;  ///< of the first job that failed
};

/// Runs what the database lacks. Rows are committed fit by fit; a run that ends at any moment, by whatever
/// means, is resumed by the next one, and the rows are the same in the end. Where there are ranks, rank 0
/// alone opens the database and returns the result of all; other ranks return an empty one.
/// \throws InputError when a pattern matches nothing, a picture cannot be read or a crop leaves it, a BTF has
///     not the directions that are named or a model of it cannot be read, a picture has no room for a number
///     of levels or an order whatever it is combined with, or too many planes for a model, or no device could
///     hold textures of the size, before any work is done and with nothing added to the database; when
///     another run writes to the database, the file is no such database, damaged, or cannot be written
/// \throws DeviceError when no process can open its device
BTFIELD_API ExperimentResult run_experiment(const ExperimentConfig& config,
                                            const std::filesystem::path& database,
                                            const ExperimentRunOptions& options = {});

/// Lets other ranks return from run_experiment when rank 0 will not call it.
BTFIELD_API void dismiss(ExperimentRanks& ranks);

/// Joins the databases of shards. A job that several have is taken once: computed before failed, then the
/// first.
/// \throws InputError as run_experiment; when `output` exists
BTFIELD_API ExperimentResult merge_experiments(const std::vector<std::filesystem::path>& inputs,
                                               const std::filesystem::path& output);

/// P4's Table 1: per picture and model the best MEMD* over orders, levels, estimators and seeds; mean and
/// deviation of these over the pictures of a material, and over all. Percent of the largest MEMD. Rows are in
/// the order of ExperimentModel.
struct ExperimentTable {
    struct Cell {
        int pictures = 0;        ///< that the model gave a texture for; of fewer than all: a partial mean
        double mean = 0.0;       ///< MEMD*, percent; NaN without pictures
        double deviation = 0.0;  ///< of the population
    };
    struct Row {
        std::string model;
        std::vector<Cell> materials;
        Cell all;
    };
    struct Colour {
        double kappa = 0.0;    ///< κ(256), median over the material's pictures
        double best_2d = 0.0;  ///< mean over pictures of the least MEMD* of the 2D fields; NaN without
        double best_3d = 0.0;  ///< the same of the 3D fields
        /// That these are means over: those that have both, or all of one's where none has.
        int pictures_2d = 0, pictures_3d = 0;
        bool needs_3d = false;  ///< what κ > 3 predicts
        bool gap = false;       ///< best_2d exceeds best_3d by more than gap_threshold
    };
    /// Jobs without a texture whose reasons differ in numbers alone.
    struct Reason {
        std::string status;  ///< "refused" or "failed"
        std::string text;    ///< of one of them
        std::vector<std::string> models;
        std::uint64_t jobs = 0;
    };
    /// One picture under one material.
    struct PictureRow {
        std::string picture, material;  ///< name as the configuration leads to it, with its crop
        double kappa = 0.0;             ///< κ(256); NaN where nothing of it was done yet
        std::vector<double> best;       ///< MEMD*, percent, of each of `rows`; NaN without a texture
        /// Of these textures: standard deviation to the picture's, root mean square over planes.
        std::vector<double> std_ratio;
        std::optional<ExperimentDirections> directions;  ///< of a picture of a BTF
    };
    std::string configuration;      ///< name; empty where the database has none
    std::string metric, marginals;  ///< what all jobs of the table have in common
    /// All values among the jobs, "diagonal, full"; empty where none of the models reads them.
    std::string noise, gains, estimators;
    std::vector<std::string> materials;
    std::vector<int> pictures;  ///< per material, of the configuration: with jobs or without
    int all_pictures = 0;       ///< one that stands under two materials counts once
    std::vector<Row> rows;
    std::vector<Colour> colours;  ///< per material
    std::uint64_t done = 0, refused = 0, failed = 0;
    std::vector<Reason> reasons;           ///< those of most jobs first
    std::vector<PictureRow> picture_rows;  ///< by material and name, where they were asked for
};

/// Percentage points of MEMD* by which 2D models must fall behind 3D ones to count as a gap: P4 states whole
/// percents.
inline constexpr double memd_gap_threshold = 1.0;

/// What a database holds.
struct ExperimentContents {
    struct Configuration {
        std::string name;
        std::string last_run;    ///< UTC, "2026-11-29T13:50:00Z"
        std::uint64_t jobs = 0;  ///< of its pictures and settings
    };
    std::vector<Configuration> configurations;  ///< the one that was run last first
    std::uint64_t jobs = 0;                     ///< of all, and of none
};
/// \throws InputError when the file is no such database or damaged
[[nodiscard]] BTFIELD_API ExperimentContents experiment_contents(const std::filesystem::path& database);

/// Which jobs count, and what tells tables apart besides metric and marginals.
struct ExperimentTableOptions {
    /// By name: the one so named that was run last. Empty: that of the last run.
    std::string configuration{};
    bool all_configurations = false;  ///< of each configuration its own tables
    bool by_noise = false, by_gains = false, by_estimator = false;
    bool by_picture = false;  ///< ExperimentTable::picture_rows too
};

/// One table per metric and marginals, from the jobs that the database has so far of the pictures and
/// settings of a configuration: jobs of others do not count. What reads no marginals, or nothing else that
/// tells tables apart (rolls; CAR and MA models, which have one estimator), is in all tables.
/// \throws InputError when the file is no such database or damaged; when no configuration is so named
[[nodiscard]] BTFIELD_API std::vector<ExperimentTable> experiment_tables(
    const std::filesystem::path& database, const ExperimentTableOptions& options = {});

enum class TableFormat { text, markdown, csv, latex };
[[nodiscard]] BTFIELD_API std::string format_tables(const std::vector<ExperimentTable>& tables,
                                                    TableFormat format);

/// Writes one HTML page that needs no other file: tables, thumbnails of pictures and best textures, κ, plots
/// of MEMD* by order and levels, and of BTFs maps of errors over views and lights.
/// \param most_pictures that are shown one by one
/// \param options which tables; pictures and plots are of the configuration asked for
/// \throws InputError as experiment_tables; when the page cannot be written
BTFIELD_API void write_experiment_report(const std::filesystem::path& database,
                                         const std::filesystem::path& page, int most_pictures = 24,
                                         const ExperimentTableOptions& options = {});

/// Which jobs to forget: those that meet every condition. A list that is empty sets none.
struct ExperimentForget {
    /// Names of pictures as the configuration leads to them, or file names alone; patterns (* ? [...]) too.
    std::vector<std::string> pictures{};
    std::vector<std::string> materials{};
    std::vector<ExperimentModel> models{};
    std::vector<int> orders{}, levels{};
    std::vector<EstimatorChoice> estimators{};
    std::vector<MarginalMode> marginals{};
    std::vector<NoiseForm> noise{};
    std::vector<GainMode> gains{};
    std::vector<Metric> metrics{};
    std::vector<std::uint64_t> seeds{};
    bool failed = false, refused = false;  ///< of these states alone; both: either
    bool stale = false;                    ///< not of the configuration that was run last
    bool dry_run = false;                  ///< says what it would forget

    /// No condition is set.
    [[nodiscard]] bool is_empty() const {
        return pictures.empty() && materials.empty() && models.empty() && orders.empty() && levels.empty() &&
               estimators.empty() && marginals.empty() && noise.empty() && gains.empty() && metrics.empty() &&
               seeds.empty() && !failed && !refused && !stale;
    }
};
struct ForgottenJobs {
    struct Part {
        std::string picture;  ///< name and crop; the hash of one that no file stands for any more
        std::string model;
        std::uint64_t done = 0, refused = 0, failed = 0;
    };
    std::vector<Part> parts;                                    ///< by picture, then in the order of models
    std::uint64_t jobs = 0, done = 0, refused = 0, failed = 0;  ///< that were forgotten
    std::uint64_t textures = 0;                                 ///< records of kept ones; their files stay
    std::uint64_t left = 0;                                     ///< jobs that the database keeps
};

/// Removes jobs from a database, so that tables do without them and the next run does them anew where its
/// configuration asks for them. Pictures and configurations that no job is left of go too.
/// \throws InputError when no condition is set; when a picture, material or configuration asked for is not in
///     the database; as run_experiment for the database
BTFIELD_API ForgottenJobs forget_jobs(const std::filesystem::path& database, const ExperimentForget& which);

}  // namespace btfield
