#include "host/experiment/ledger.hpp"

#include <algorithm>
#include <set>

#include "btfield/error.hpp"

namespace btfield::detail {
namespace {

std::string asked_for(const std::filesystem::path& database) {
    return "run the experiment into '" + database.string() + "'";
}

/// Whether two names share a picture is no error: the results are those of the picture.
std::vector<PictureSource> distinct(const std::vector<PictureSource>& sources) {
    std::vector<PictureSource> pictures;
    std::set<std::string> seen;
    for (const PictureSource& source : sources) {
        if (seen.insert(source.picture).second) pictures.push_back(source);
    }
    return pictures;
}

}  // namespace

Ledger::Ledger(const ExperimentConfig& config, const std::filesystem::path& database,
               const ExperimentRunOptions& options, OpenSets& sets, int workers)
    : config_(config),
      textures_(options.textures.empty() ? options.textures : std::filesystem::absolute(options.textures)),
      shard_(options.shard),
      shards_(options.shards),
      database_(database, asked_for(database)),
      settings_(job_settings(config)) {
    if (shards_ < 1 || shard_ < 1 || shard_ > shards_) {
        throw InputError("run shard " + std::to_string(shard_) + " of " + std::to_string(shards_),
                         "there is no such shard", "number the shards from 1");
    }
    progress_.stage = "pictures";
    if (options.progress) options.progress(progress_);
    KnownPictures known = database_.known_pictures();
    const std::vector<PictureSource> sources = picture_sources(config, sets, &known);
    check_room(config, sources, check_pictures(sources, [&](const std::string& picture) {
                   return database_.shape_of(picture);
               }));
    database_.add(config, sources);
    database_.keep(known);
    plan(sources);
    if (options.unit > 0) {
        largest_unit_ = static_cast<std::size_t>(options.unit);
    } else if (workers > 1) {
        // A picture's jobs share much, so they are divided no finer than keeps all workers busy to the end.
        constexpr std::uint64_t rounds = 8;
        const std::uint64_t left = progress_.jobs - progress_.skipped;
        largest_unit_ =
            std::max<std::size_t>(config.seeds.size(), left / (rounds * static_cast<std::uint64_t>(workers)));
    }
    progress_.stage = "jobs";
}

void Ledger::plan(const std::vector<PictureSource>& sources) {
    const std::vector<PictureSource> pictures = distinct(sources);
    // Whole pictures where there are enough of them, else fits.
    const bool by_picture = pictures.size() >= static_cast<std::size_t>(shards_);
    const auto mine = [&](std::size_t index) {
        return index % static_cast<std::size_t>(shards_) == static_cast<std::size_t>(shard_ - 1);
    };
    std::vector<std::string> texts;
    for (const JobSettings& settings : settings_) texts.push_back(settings_text(config_, settings));
    std::size_t fit = 0;
    for (std::size_t p = 0; p < pictures.size(); ++p) {
        if (by_picture && !mine(p)) continue;
        Picture picture;
        picture.source = pictures[p];
        const std::map<std::string, JobStatus> known = database_.jobs_of(picture.source.picture);
        for (std::size_t i = 0; i < settings_.size(); ++i) {
            if (i > 0 && !same_fit(settings_[i - 1], settings_[i])) ++fit;
            if (!by_picture && !mine(fit)) continue;
            ++progress_.jobs;
            const auto found = known.find(job_key(picture.source.picture, texts[i]));
            if (found != known.end() && found->second != JobStatus::failed) {
                ++progress_.skipped;
            } else {
                picture.pending.push_back(static_cast<std::uint32_t>(i));
            }
        }
        ++fit;
        picture.outstanding = picture.pending.size();
        by_identity_.emplace(picture.source.picture, pictures_.size());
        pictures_.push_back(std::move(picture));
        if (pictures_.back().outstanding == 0) plan_textures(pictures_.back().source.picture);
    }
}

void Ledger::plan_textures(const std::string& identity) {
    if (textures_.empty()) return;
    const Picture& picture = pictures_[by_identity_.at(identity)];
    std::vector<std::string> keys;  // of settings_
    for (const JobSettings& settings : settings_)
        keys.push_back(job_key(identity, settings_text(config_, settings)));
    const std::vector<std::string> best =
        database_.best_not_kept(identity, {keys.begin(), keys.end()}, textures_);
    WorkUnit unit;
    unit.source = picture.source;
    unit.keep = true;
    for (std::size_t i = 0; i < settings_.size(); ++i)
        if (std::ranges::find(best, keys[i]) != best.end()) unit.jobs.push_back(settings_[i]);
    if (!unit.jobs.empty()) texture_units_.push_back(std::move(unit));
}

bool Ledger::jobs_left() {
    while (current_ < pictures_.size() &&
           pictures_[current_].handed_out == pictures_[current_].pending.size()) {
        ++current_;
    }
    return current_ < pictures_.size();
}

std::optional<WorkUnit> Ledger::next_locked() {
    if (stopped_) return std::nullopt;
    WorkUnit unit;
    if (jobs_left()) {
        Picture& picture = pictures_[current_];
        unit.source = picture.source;
        const std::size_t left = picture.pending.size() - picture.handed_out;
        std::size_t count = largest_unit_ == 0 ? left : std::min(left, largest_unit_);
        const auto setting = [&](std::size_t i) -> const JobSettings& {
            return settings_[picture.pending[picture.handed_out + i]];
        };
        // The textures of one fit stay together, but for units that are smaller on purpose.
        while (largest_unit_ >= config_.seeds.size() && count < left &&
               same_fit(setting(count - 1), setting(count))) {
            ++count;
        }
        for (std::size_t i = 0; i < count; ++i) unit.jobs.push_back(setting(i));
        picture.handed_out += count;
    } else if (!texture_units_.empty()) {
        unit = std::move(texture_units_.front());
        texture_units_.pop_front();
        progress_.stage = "textures";
    } else {
        return std::nullopt;
    }
    ++in_progress_;
    return unit;
}

bool Ledger::finished_locked() {
    return stopped_ || (!jobs_left() && texture_units_.empty() && in_progress_ == 0);
}

std::optional<WorkUnit> Ledger::next() {
    const std::lock_guard lock(mutex_);
    return next_locked();
}

std::optional<WorkUnit> Ledger::wait_for_next() {
    std::unique_lock lock(mutex_);
    for (;;) {
        std::optional<WorkUnit> unit = next_locked();
        if (unit || finished_locked()) return unit;
        changed_.wait(lock);
    }
}

bool Ledger::finished() {
    const std::lock_guard lock(mutex_);
    return finished_locked();
}

void Ledger::take(const WorkReport& report) {
    const std::lock_guard lock(mutex_);
    try {
        if (fatal_) return;  // the first error is the one to tell
        database_.add(report);
        for (const JobResult& result : report.results) {
            switch (result.status) {
                case JobStatus::done:
                    ++progress_.done;
                    break;
                case JobStatus::refused:
                    ++progress_.refused;
                    break;
                case JobStatus::failed:
                    ++progress_.failed;
                    if (first_failure_.empty()) first_failure_ = result.reason;
                    break;
            }
            Picture& picture = pictures_[by_identity_.at(result.picture)];
            if (--picture.outstanding == 0) plan_textures(result.picture);
        }
        if (texture_trouble_.empty()) texture_trouble_ = report.trouble;
    } catch (...) {
        fatal_ = std::current_exception();
        stopped_ = true;
    }
    changed_.notify_all();
}

void Ledger::unit_ended() {
    const std::lock_guard lock(mutex_);
    --in_progress_;
    changed_.notify_all();
}

void Ledger::stop() {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    changed_.notify_all();
}

ExperimentProgress Ledger::progress() {
    const std::lock_guard lock(mutex_);
    ExperimentProgress now = progress_;
    now.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    return now;
}

ExperimentResult Ledger::conclude() {
    ExperimentResult result;
    static_cast<ExperimentProgress&>(result) = progress();
    const std::lock_guard lock(mutex_);
    if (fatal_) std::rethrow_exception(fatal_);
    result.interrupted = result.done + result.refused + result.failed + result.skipped < result.jobs;
    const bool nothing = result.interrupted && result.done + result.refused + result.failed == 0;
    if (!nothing) database_.close();
    if (!texture_trouble_.empty()) {
        throw InputError("keep the best textures in '" + textures_.string() + "'", texture_trouble_,
                         "mend that and run the same command again: no job is done twice");
    }
    result.failure = first_failure_;
    return result;
}

}  // namespace btfield::detail
