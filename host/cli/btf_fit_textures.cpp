#include "host/cli/btf_fit_textures.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <string_view>
#include <system_error>
#include <thread>

#include "btfield/device.hpp"
#include "btfield/error.hpp"
#include "btfield/threads.hpp"
#include "host/base/text.hpp"
#include "host/cli/btf_parts.hpp"
#include "host/cli/command_text.hpp"
#include "host/cli/model_report.hpp"
#include "host/cli/mpi_ranks.hpp"
#include "host/cli/options.hpp"
#include "host/cli/run_files.hpp"

namespace btfield::cli {
namespace {

namespace fs = std::filesystem;

bool are_valid(const BtfTextures& model) {
    return std::ranges::all_of(model.textures, [](const TextureModel& t) { return is_valid(t); });
}

/// Of the model's first texture that is no flat picture, which stand for themselves.
std::string field_name(const BtfTextures& model) {
    for (const TextureModel& texture : model.textures)
        if (texture.levels.front().gain > 0.0) return std::string(name(texture.kind));
    return std::string(name(model.textures.front().kind));
}

Json parts_json(const BtfTextures& model, std::uintmax_t bytes) {
    const BtfTexturesParts parts = parts_of(model, bytes);
    Json object;
    object["labels"] = parts.labels;
    object["means"] = parts.means;
    object["contrasts"] = parts.contrasts;
    object["textures"] = parts.textures;
    object["rest"] = parts.rest;
    return object;
}

std::string parts_text(const BtfTextures& model, std::uintmax_t bytes) {
    const BtfTexturesParts parts = parts_of(model, bytes);
    return std::to_string(bytes) + ": labels " + std::to_string(parts.labels) + ", means " +
           std::to_string(parts.means) + ", contrasts " + std::to_string(parts.contrasts) + ", textures " +
           std::to_string(parts.textures) + ", rest " + std::to_string(parts.rest);
}

Json statistics_json(const BtfStatistics& of) {
    Json object;
    object["mean_error"] = number(of.mean_error);
    object["std_error"] = number(of.std_error);
    object["std_error_95"] = number(of.std_error_95);
    object["lag_covariance_error"] = number(of.lag_covariance_error);
    return object;
}

std::string share_text(double share) {
    return number_text(100.0 * share) + " %";
}

std::string statistics_text(const BtfStatistics& of) {
    return "means are off by " + share_text(of.mean_error) + ", deviations by " + share_text(of.std_error) +
           " (95 %: " + share_text(of.std_error_95) + "), covariances by " +
           share_text(of.lag_covariance_error);
}

/// Seconds of the stages of a fit, from what it tells.
class StageTimes {
  public:
    void told(std::string_view stage) {
        const double now = watch_.seconds();
        seconds_[std::string(stage)] += now - last_;
        last_ = now;
    }
    void put(Json& object) const {
        for (const auto& [stage, seconds] : seconds_) object[stage] = seconds;
    }

  private:
    Stopwatch watch_;
    double last_ = 0.0;
    std::map<std::string, double> seconds_;
};

Json textures_fit_json(const TexturesFitArguments& options, const BtfTexturesFit& fit, std::uintmax_t bytes) {
    const BtfTextures& model = fit.model;
    Json object;
    object["output"] = options.output;
    object["method"] = std::string(name(model.method));
    object["planes"] = nullptr;
    object["unexplained"] = nullptr;
    object["clusters"] = model.method == BtfMethod::segment ? Json(model.textures.size()) : Json(nullptr);
    object["textures"] = model.textures.size();
    object["match"] = std::string(name(model.match));
    object["pictures"] = model.pairs.size();
    object["relief"] = nullptr;
    if (model.method == BtfMethod::each) object["resumed"] = fit.resumed;
    if (fit.score) {
        Json score = statistics_json(fit.score->model);
        score["directions"] = fit.score->pairs.size();
        score["nearest"] = statistics_json(fit.score->nearest);
        object["left_out"] = std::move(score);
    }
    object["model"] = field_name(model);
    object["valid"] = are_valid(model);
    object["bytes"] = bytes;
    object["parts"] = parts_json(model, bytes);
    object["compression_ratio"] = number(compression_ratio(model.picture_bytes, bytes));
    return object;
}

std::string textures_fit_text(const TexturesFitArguments& options, const BtfTexturesFit& fit,
                              std::uintmax_t bytes, double seconds) {
    const BtfTextures& model = fit.model;
    std::string text = "wrote " + options.output + ": " + std::to_string(model.pairs.size()) +
                       " pictures of " + detail::text_of(model.size) + " pixels as " +
                       detail::counted(model.textures.size(), "texture") + ", " + field_name(model) +
                       ", in " + seconds_text(seconds) + "\n";
    if (fit.resumed > 0) text += std::to_string(fit.resumed) + " of them were fitted by runs before.\n";
    text += model.match == BtfMatch::means ? "Each direction has its own mean and contrast.\n"
                                           : "Directions of one texture are the same picture.\n";
    if (fit.score) {
        text += std::to_string(fit.score->pairs.size()) +
                " pictures that the fit was not shown: " + statistics_text(fit.score->model) +
                ".\nOf the nearest picture " + statistics_text(fit.score->nearest) + ".\n";
    }
    return text + "bytes " + parts_text(model, bytes) +
           "; 1 : " + number_text(compression_ratio(model.picture_bytes, bytes)) + " of 8-bit pictures\n";
}

double textures_share(BtfMethod method, bool scored, std::string_view stage, double share) {
    const double fitted = scored ? 0.9 : 1.0;
    if (stage == "score") return fitted + (1.0 - fitted) * share;
    if (method == BtfMethod::each) return fitted * share;
    if (stage == "pictures") return 0.8 * fitted * share;
    if (stage == "clusters") return 0.85 * fitted;
    return fitted * (0.85 + 0.15 * share);
}

/// Shows how far a fit is.
class TexturesProgress {
  public:
    /// \param all  pictures of the fit
    TexturesProgress(const BtfTexturesOptions& fit, std::size_t all)
        : method_(fit.method), scored_(fit.leave_out.any()), all_(static_cast<double>(all)) {}
    void show(std::string_view stage, double share) {
        std::string what(stage);
        if (stage == "pictures" || (stage == "textures" && method_ == BtfMethod::each)) {
            if (first_ < 0.0) first_ = stage == "pictures" ? 0.0 : share;
            const double seconds = std::max(watch_.seconds(), 1e-9), done = share - first_;
            what += ", " + number_text(all_ * done / seconds) + "/s";
            if (done > 0.0) what += ", " + seconds_text(seconds * (1.0 - share) / done) + " left";
        }
        bar_.show(textures_share(method_, scored_, stage, share), what);
    }

  private:
    BtfMethod method_;
    bool scored_;
    double all_, first_ = -1.0;
    Progress bar_;
    Stopwatch watch_;
};

BtfShardFit fit_shard(Device& device, const BtfSet& set, const BtfTexturesOptions& options, Shard shard,
                      bool told) {
    BtfTexturesOptions fit = options;
    TexturesProgress progress(fit, set.pictures().size() / static_cast<std::size_t>(shard.count));
    if (told) fit.progress = [&](std::string_view stage, double share) { progress.show(stage, share); };
    return fit_btf_shard(device, set, fit, shard.index, shard.count);
}

void run_shard(const TexturesFitArguments& options, const BtfSet& set) {
    const Stopwatch total;
    Device device(options.device);
    const BtfShardFit shard = fit_shard(device, set, options.fit, *options.shard, true);
    if (options.json) {
        Json object;
        object["output"] = nullptr;
        object["part"] = shard.part.string();
        object["shard"] = Json::array({options.shard->index, options.shard->count});
        object["method"] = std::string(name(options.fit.method));
        object["pictures"] = shard.pictures;
        object["resumed"] = shard.resumed;
        object["device"] = device.info().name;
        object["seconds"]["total"] = total.seconds();
        emit_json(object);
        return;
    }
    emit_result("wrote " + shard.part.string() + ": " + detail::counted(shard.pictures, "picture") + ", " +
                std::to_string(shard.resumed) + " of them before, in " + seconds_text(total.seconds()) +
                "\nThe same command without --shard joins all shards that are there.\n");
}

/// The whole fit: what parts have, and the rest.
/// \param resumed  pictures that were there before ranks began, where there are ranks
void fit_and_write(const TexturesFitArguments& options, const BtfSet& set, Device& device,
                   const Stopwatch& total, std::optional<std::size_t> resumed) {
    BtfTexturesFit fit;
    StageTimes times;
    BtfTexturesOptions how = options.fit;
    {
        TexturesProgress progress(how, set.pictures().size());
        how.progress = [&](std::string_view stage, double share) {
            times.told(stage);
            progress.show(stage, share);
        };
        how.tell = [&](const std::string& remark) { warn("'" + options.output + "': " + remark); };
        fit = fit_btf_textures(device, set, how);
    }
    if (resumed) fit.resumed = *resumed;
    for (const std::string& remark : fit.remarks) warn("'" + options.output + "': " + remark);
    write_btf_textures(options.output, fit.model);
    if (!how.part.empty()) {
        std::error_code ignored;
        for (const fs::path& part : btf_shard_parts(how.part)) fs::remove(part, ignored);
        fs::remove(how.part, ignored);
    }
    const std::uintmax_t bytes = model_file_bytes(options.output);
    if (options.json) {
        Json object = textures_fit_json(options, fit, bytes);
        object["device"] = device.info().name;
        times.put(object["seconds"]);
        object["seconds"]["total"] = total.seconds();
        emit_json(object);
    } else {
        emit_result(textures_fit_text(options, fit, bytes, total.seconds()));
    }
}

// What ranks tell each other: rank 0 whether there is work; others that they have done it, behind that how
// many pictures they had before, or why not.
constexpr std::string_view rank_begins = "begin", rank_ends = "end", rank_done = "done ";
constexpr std::chrono::milliseconds message_interval{5};

ExperimentRanks::Message next_message(ExperimentRanks& ranks) {
    for (;;) {
        if (auto message = ranks.receive()) return *message;
        std::this_thread::sleep_for(message_interval);
    }
}

void tell_ranks(ExperimentRanks& ranks, std::string_view what) {
    for (int rank = 1; rank < ranks.size(); ++rank) ranks.send(rank, std::string(what));
}

/// A rank but the first.
void run_as_rank(const TexturesFitArguments& options, ExperimentRanks& ranks) {
    if (next_message(ranks).bytes != rank_begins) return;
    std::string end(rank_done);
    try {
        const BtfSet set = BtfSet::open(options.set, options.reading);
        Device device(options.device);
        const Shard own{ranks.rank() + 1, ranks.size()};
        end += std::to_string(fit_shard(device, set, options.fit, own, false).resumed);
    } catch (const std::exception& error) {
        end = error.what();
    }
    ranks.send(0, end);
}

/// \return pictures that parts had before
std::size_t share_with_ranks(Device& device, const BtfSet& set, const TexturesFitArguments& options,
                             ExperimentRanks& ranks) {
    tell_ranks(ranks, rank_begins);
    const BtfShardFit own = fit_shard(device, set, options.fit, {1, ranks.size()}, true);
    std::size_t resumed = own.resumed;
    std::string trouble;
    for (int others = ranks.size() - 1; others > 0; --others) {
        const ExperimentRanks::Message message = next_message(ranks);
        if (message.bytes.starts_with(rank_done))
            resumed +=
                parse_number(message.bytes.substr(rank_done.size()), 0, set.pictures().size()).value_or(0);
        else if (trouble.empty())
            trouble = "rank " + std::to_string(message.rank) + " ended: " + message.bytes;
    }
    if (!trouble.empty())
        throw InputError("fit '" + options.output + "'", trouble,
                         "mend that and run the same command again: it goes on from here");
    return resumed;
}

}  // namespace

void run_textures_fit(const TexturesFitArguments& given) {
    const Stopwatch total;
    TexturesFitArguments options = given;
    const bool each = options.fit.method == BtfMethod::each;
    std::unique_ptr<ExperimentRanks> ranks = each ? open_ranks() : nullptr;
    const bool shared = ranks && ranks->size() > 1;
    const bool kept = each && !is_standard_output(options.output);
    if (kept) options.fit.part = options.output + ".part";
    if (shared) {
        // Whoever starts ranks counts the cores.
        if (options.fit.jobs == 0) options.fit.jobs = 1;
        limit_threads(options.fit.jobs);
        if (ranks->rank() > 0) {
            run_as_rank(options, *ranks);
            return;
        }
    }
    bool begun = false;
    std::optional<std::size_t> resumed;
    try {
        if (options.shard && shared)
            throw UsageError("--shard: ranks of mpirun are shards already; leave one of them out");
        if ((options.shard || shared) && !kept)
            throw UsageError("shards leave what they did beside the model: name a file for it");
        RunFiles files(options.overwrite, options.json);
        check_outside("write the model '" + options.output + "'", options.output, options.set);
        files.writes_model(options.output);
        if (kept) files.writes(options.fit.part);
        const BtfSet set = open_told(options.set, options.reading);
        if (options.shard) {
            run_shard(options, set);
            return;
        }
        Device device(options.device);
        if (shared) {
            begun = true;
            resumed = share_with_ranks(device, set, options, *ranks);
        }
        fit_and_write(options, set, device, total, resumed);
    } catch (...) {
        if (shared && !begun) tell_ranks(*ranks, rank_ends);
        throw;
    }
}

Json textures_json(const BtfTextures& model, std::uintmax_t bytes) {
    Json object;
    object["format"] = "model";
    object["method"] = std::string(name(model.method));
    object["size"] = size_json(model.size);
    object["planes"] = model.colours;
    object["views"] = model.views.size();
    object["lights"] = model.lights.size();
    object["pictures"] = model.pairs.size();
    object["colour"] = std::string(name(model.space));
    object["white"] = number(model.white);
    object["textures"] = model.textures.size();
    object["match"] = std::string(name(model.match));
    object["model"] = field_name(model);
    object["valid"] = are_valid(model);
    object["bytes"] = bytes;
    object["parts"] = parts_json(model, bytes);
    object["compression_ratio"] = number(compression_ratio(model.picture_bytes, bytes));
    object["file_ratio"] = number(compression_ratio(model.file_bytes, bytes));
    return object;
}

std::string textures_text(const BtfTextures& model, std::uintmax_t bytes) {
    std::string text = "model     " + std::string(name(model.method)) + ": " +
                       detail::counted(model.textures.size(), "texture") + " as " + field_name(model) +
                       (model.method == BtfMethod::each ? ", one for each picture\n"
                                                        : ", each for all pictures that look alike\n");
    text += model.match == BtfMatch::means
                ? "match     means: a direction has its own mean and contrast, all else from its texture\n"
                : "match     none: all directions of a texture are the same picture\n";
    text += "pictures  " + std::to_string(model.pairs.size()) + ": " +
            detail::counted(model.views.size(), "view") + " x " +
            detail::counted(model.lights.size(), "light") + ", of " + detail::text_of(model.size) +
            " pixels, " + detail::counted(model.colours, "plane") + "\n";
    text += "bytes     " + parts_text(model, bytes) + "\n";
    text +=
        "ratio     1 : " + number_text(compression_ratio(model.picture_bytes, bytes)) + " of 8-bit pictures";
    if (model.file_bytes > 0)
        text += ", 1 : " + number_text(compression_ratio(model.file_bytes, bytes)) + " of the set's files";
    return text + "\n";
}

}  // namespace btfield::cli
