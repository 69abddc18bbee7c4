#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <thread>
#include <utility>

#include "btfield/btf_textures.hpp"
#include "btfield/error.hpp"
#include "btfield/threads.hpp"
#include "host/base/parallel.hpp"
#include "host/base/stop.hpp"
#include "host/base/text.hpp"
#include "host/btf/btf_measured.hpp"
#include "host/btf/btf_tables.hpp"
#include "host/btf/contrast_code.hpp"
#include "host/btf/each_part.hpp"
#include "host/btf/picture_clusters.hpp"
#include "host/btf/picture_texture.hpp"
#include "host/btf/textures_score.hpp"

namespace btfield {

using namespace detail;

namespace {

constexpr const char* asked_textures = "fit textures to a BTF";
/// Pictures that are read between two calls of progress.
constexpr std::size_t features_at_once = 128;

void check_options(const BtfSet& set, const BtfTexturesOptions& options) {
    if (options.method == BtfMethod::joint)
        throw InputError(asked_textures, "the method joint has planes of a surface, not textures",
                         "use fit_btf()");
    if (options.clusters < 1 || options.clusters > most_clusters)
        throw InputError(asked_textures, counted(options.clusters, "cluster") + " were asked for",
                         "give 1 to " + std::to_string(most_clusters));
    if (options.jobs < 0)
        throw InputError(asked_textures, "jobs are " + std::to_string(options.jobs),
                         "give a number from 0 on");
    check_leave_out(options.leave_out);
    if (options.method == BtfMethod::each && set.pictures().size() > most_btf_textures)
        throw InputError(asked_textures, "the set has " + counted(set.pictures().size(), "picture"),
                         "take every second view and light, or the method segment");
}

/// Calls work(i) for each i on so many threads, and told(done) in the caller's, which may throw.
void work_through(std::size_t count, int jobs, const std::function<void(std::size_t)>& work,
                  const std::function<void(std::size_t)>& told) {
    std::atomic<std::size_t> next{0}, done{0};
    std::atomic<bool> ended{false};
    const auto caller = std::this_thread::get_id();
    const auto drain = [&](int) {
        try {
            while (!ended) {
                const std::size_t i = next++;
                if (i >= count) return;
                stop_if_asked();
                work(i);
                ++done;
                if (std::this_thread::get_id() == caller) told(done);
            }
        } catch (...) {
            ended = true;
            throw;
        }
    };
    for_each_block(std::max(1, jobs), drain);
    told(done);
}

class TexturesFitting {
  public:
    TexturesFitting(Device& device, const BtfSet& set, const BtfTexturesOptions& options)
        : device_(&device), set_(&set), options_(&options) {
        for (const BtfPair& pair : set.pictures())
            (is_left_out(pair, options.leave_out) ? left_out_ : shown_).push_back(pair);
        moments_.resize(shown_.size());
    }
    [[nodiscard]] BtfTexturesFit run();
    [[nodiscard]] BtfShardFit run_shard(int shard, int shards);

  private:
    void tell(std::string_view stage, double share) const {
        if (options_->progress) options_->progress(stage, share);
    }
    [[nodiscard]] int jobs() const { return options_->jobs > 0 ? options_->jobs : thread_limit(); }
    [[nodiscard]] PictureFeatures read_pictures();
    void segment(BtfTexturesFit& fit);
    void each(BtfTexturesFit& fit);
    /// \param missing  of `all` pictures that this run is to have in the end
    void fit_missing(EachPart& part, const std::vector<std::size_t>& missing, std::size_t all,
                     std::vector<PictureTexture>& textures);
    void add_texture(BtfTextures& model, PictureTexture texture) const;
    void fill_tables(BtfTextures& model) const;
    void remark_invalid(BtfTexturesFit& fit) const;

    Device* device_;
    const BtfSet* set_;
    const BtfTexturesOptions* options_;
    std::vector<BtfPair> shown_, left_out_;
    std::vector<PictureMoments> moments_;  ///< of those that are shown
};

PictureFeatures TexturesFitting::read_pictures() {
    PictureFeatures features;
    for (std::size_t first = 0; first < shown_.size(); first += features_at_once) {
        const std::size_t count = std::min(features_at_once, shown_.size() - first);
        if (first == 0) features.prepare(set_->picture(shown_[0].view, shown_[0].light), shown_.size());
        for_each_block(static_cast<int>(count), [&](int block) {
            const std::size_t i = first + static_cast<std::size_t>(block);
            const Image picture = set_->picture(shown_[i].view, shown_[i].light);
            moments_[i] = moments_of(picture);
            features.put(i, picture, set_->white());
        });
        tell("pictures", static_cast<double>(first + count) / static_cast<double>(shown_.size()));
    }
    return features;
}

void TexturesFitting::add_texture(BtfTextures& model, PictureTexture texture) const {
    for (const double mean : texture.moments.mean)
        model.texture_means.push_back(static_cast<float>(std::max(mean, 0.0)));
    model.textures.push_back(std::move(texture.texture));
}

void TexturesFitting::segment(BtfTexturesFit& fit) {
    BtfTextures& model = fit.model;
    const PictureFeatures features = read_pictures();
    const PictureClusters clusters = cluster_pictures(features, moments_, options_->clusters);
    tell("clusters", 1.0);
    model.labels.assign(clusters.labels.begin(), clusters.labels.end());
    model.sources.assign(clusters.nearest.begin(), clusters.nearest.end());
    if (static_cast<int>(clusters.nearest.size()) < options_->clusters)
        fit.remarks.push_back("only " + counted(clusters.nearest.size(), "cluster") +
                              " of pictures differ from each other");
    std::vector<PictureTexture> textures(clusters.nearest.size());
    work_through(
        textures.size(), jobs(),
        [&](std::size_t k) {
            textures[k] = picture_texture(*device_, *set_, shown_[clusters.nearest[k]], options_->field);
        },
        [&](std::size_t done) {
            tell("textures", static_cast<double>(done) / static_cast<double>(textures.size()));
        });
    for (PictureTexture& texture : textures) add_texture(model, std::move(texture));
}

void TexturesFitting::fit_missing(EachPart& part, const std::vector<std::size_t>& missing, std::size_t all,
                                  std::vector<PictureTexture>& textures) {
    work_through(
        missing.size(), jobs(),
        [&](std::size_t at) {
            const std::size_t i = missing[at];
            textures[i] = picture_texture(*device_, *set_, shown_[i], options_->field);
            part.add(i, textures[i]);
        },
        [&](std::size_t done) {
            tell("textures", static_cast<double>(all - missing.size() + done) / static_cast<double>(all));
        });
}

BtfShardFit TexturesFitting::run_shard(int shard, int shards) {
    BtfShardFit result;
    result.part = shard_part(options_->part, shard, shards);
    EachPart part(result.part, *set_, *options_);
    const auto kept = part.take();
    std::vector<std::size_t> missing;
    for (auto i = static_cast<std::size_t>(shard - 1); i < shown_.size();
         i += static_cast<std::size_t>(shards)) {
        ++result.pictures;
        if (!kept.contains(i)) missing.push_back(i);
    }
    result.resumed = result.pictures - missing.size();
    std::vector<PictureTexture> textures(shown_.size());
    if (result.pictures > 0) fit_missing(part, missing, result.pictures, textures);
    return result;
}

void TexturesFitting::each(BtfTexturesFit& fit) {
    BtfTextures& model = fit.model;
    // Whoever joins shards waits for them: their parts are locked as long as they work. A part of its own is
    // begun only when theirs are known to fit.
    std::map<std::size_t, PictureTexture> of_shards;
    const std::vector<std::filesystem::path> shards = shard_parts(options_->part);
    for (const std::filesystem::path& other : shards)
        of_shards.merge(EachPart(other, *set_, *options_).take());
    EachPart part(options_->part, *set_, *options_);
    std::vector<PictureTexture> textures(shown_.size());
    std::vector<std::size_t> missing;
    auto kept = part.take();
    kept.merge(of_shards);
    for (std::size_t i = 0; i < shown_.size(); ++i) {
        const auto found = kept.find(i);
        if (found != kept.end())
            textures[i] = std::move(found->second);
        else
            missing.push_back(i);
    }
    fit.resumed = shown_.size() - missing.size();
    const std::string text = missing_text(shards, missing);
    if (!text.empty() && options_->tell)
        options_->tell(text);
    else if (!text.empty())
        fit.remarks.push_back(text);
    fit_missing(part, missing, textures.size(), textures);
    model.labels.resize(shown_.size());
    std::iota(model.labels.begin(), model.labels.end(), std::uint16_t{0});
    model.sources.resize(shown_.size());
    std::iota(model.sources.begin(), model.sources.end(), 0U);
    for (std::size_t i = 0; i < textures.size(); ++i) {
        moments_[i] = textures[i].moments;
        add_texture(model, std::move(textures[i]));
    }
}

void TexturesFitting::fill_tables(BtfTextures& model) const {
    for (const PictureMoments& of : moments_)
        for (std::size_t c = 0; c < of.mean.size(); ++c) {
            model.means.push_back(static_cast<float>(std::max(of.mean[c], 0.0)));
            model.contrasts.push_back(contrast_code(of.mean[c], of.deviation[c]));
        }
    round_means(model.means);
}

void TexturesFitting::remark_invalid(BtfTexturesFit& fit) const {
    const auto invalid =
        std::ranges::count_if(fit.model.textures, [](const TextureModel& t) { return !is_valid(t); });
    if (invalid > 0)
        fit.remarks.push_back(
            counted(invalid, "texture") + " of " + std::to_string(fit.model.textures.size()) +
            " failed the certificate, and synth will refuse them; use another order or model");
}

BtfTexturesFit TexturesFitting::run() {
    BtfTexturesFit fit;
    BtfTextures& model = fit.model;
    describe(model, *set_);
    model.method = options_->method;
    model.match = options_->match;
    model.pairs = shown_;
    bool moved = false;
    for (const BtfPair& pair : shown_) {
        model.true_lights.push_back(set_->light(pair.view, pair.light));
        moved |= !(model.true_lights.back() == set_->lights()[static_cast<std::size_t>(pair.light)]);
    }
    if (!moved) model.true_lights.clear();
    if (model.method == BtfMethod::segment)
        segment(fit);
    else
        each(fit);
    round_means(model.texture_means);
    if (model.match == BtfMatch::means) fill_tables(model);
    check(model);
    remark_invalid(fit);
    if (!left_out_.empty())
        fit.score =
            score_textures(*device_, *set_, model, left_out_, [&](double share) { tell("score", share); });
    return fit;
}

}  // namespace

FitOptions BtfTexturesOptions::field_defaults(BtfMethod method) {
    FitOptions field;
    field.model = method == BtfMethod::segment ? ModelKind::msar3d : ModelKind::car3d;
    field.order = method == BtfMethod::segment ? 2 : 3;
    return field;
}

BtfTexturesOptions::BtfTexturesOptions(BtfMethod how) : method(how), field(field_defaults(how)) {}

BtfTexturesFit fit_btf_textures(Device& device, const BtfSet& set, const BtfTexturesOptions& options) {
    check_options(set, options);
    return TexturesFitting(device, set, options).run();
}

BtfShardFit fit_btf_shard(Device& device, const BtfSet& set, const BtfTexturesOptions& options, int shard,
                          int shards) {
    const std::string asked = "fit shard " + std::to_string(shard) + " of " + std::to_string(shards);
    if (options.method != BtfMethod::each)
        throw InputError(asked,
                         "the method " + std::string(name(options.method)) + " needs all pictures at once",
                         "use the method each, or one process");
    if (shards < 1 || shard < 1 || shard > shards)
        throw InputError(asked, "there is no such shard", "give 1 to the number of shards");
    if (options.part.empty())
        throw InputError(asked, "no part is named", "name one: it is where shards leave what they did");
    check_options(set, options);
    return TexturesFitting(device, set, options).run_shard(shard, shards);
}

std::vector<std::filesystem::path> btf_shard_parts(const std::filesystem::path& part) {
    return shard_parts(part);
}

}  // namespace btfield
