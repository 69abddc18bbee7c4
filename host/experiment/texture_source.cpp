#include "host/experiment/texture_source.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "btfield/compound.hpp"
#include "btfield/error.hpp"
#include "btfield/roller.hpp"
#include "btfield/synthesis.hpp"
#include "host/experiment/sha256.hpp"

namespace btfield::detail {
namespace {

/// The worst of the certificates of all levels of all fields.
void describe_certificates(std::span<const TextureModel* const> fields, JobResult& result) {
    double singular = std::numeric_limits<double>::infinity();
    double lowest = std::numeric_limits<double>::infinity(), highest = 0.0;
    int zeros = 0;
    for (const TextureModel* field : fields) {
        for (const LevelModel& level : field->levels) {
            singular = std::min(singular, level.certificate.min_singular);
            zeros += level.certificate.zeros;
            for (const double ratio : level.certificate.variance_ratio) {
                lowest = std::min(lowest, ratio);
                highest = std::max(highest, ratio);
            }
        }
    }
    result.min_singular = singular;
    result.zeros = zeros;
    result.lowest_ratio = lowest;
    result.highest_ratio = highest;
}

void describe_levels(const TextureModel& field, JobResult& result) {
    std::string estimators;
    for (const LevelModel& level : field.levels)
        estimators += (estimators.empty() ? "" : ",") + std::string(name(level.estimator));
    result.estimators = estimators;
    result.fitted_levels = static_cast<int>(field.levels.size());
}

class FieldSource final : public TextureSource {
  public:
    FieldSource(Device& device, TextureModel model, Size size, bool allow_invalid)
        : device_(device), model_(std::move(model)), size_(size), allow_invalid_(allow_invalid) {}

    void describe(JobResult& result) const override {
        const TextureModel* const field = &model_;
        result.valid = is_valid(model_);
        result.parameters = parameter_count(model_);
        describe_certificates({&field, 1}, result);
        describe_levels(model_, result);
    }
    void prepare() override {
        SynthesisOptions options;
        options.allow_invalid = allow_invalid_;
        synthesiser_.emplace(device_, model_, size_, options);
    }
    [[nodiscard]] std::size_t batch() const override {
        return static_cast<std::size_t>(std::max(1, synthesiser_->batch()));
    }
    [[nodiscard]] std::vector<Image> synthesise(std::span<const std::uint64_t> seeds) override {
        return synthesiser_->synthesise(seeds);
    }

  private:
    Device& device_;
    TextureModel model_;
    Size size_;
    bool allow_invalid_;
    std::optional<Synthesiser> synthesiser_;
};

class CompoundSource final : public TextureSource {
  public:
    CompoundSource(Device& device, CompoundModel model, Size size, bool allow_invalid)
        : device_(device), model_(std::move(model)), size_(size), allow_invalid_(allow_invalid) {}

    void describe(JobResult& result) const override {
        std::vector<const TextureModel*> fields;
        for (const CompoundRegion& region : model_.regions) fields.push_back(&region.residual);
        result.valid = is_valid(model_);
        result.parameters = parameter_count(model_);
        describe_certificates(fields, result);
        describe_levels(*fields.front(), result);  // the regions are fitted alike
    }
    void prepare() override { synthesiser_.emplace(device_, model_, size_, allow_invalid_); }
    [[nodiscard]] std::vector<Image> synthesise(std::span<const std::uint64_t> seeds) override {
        std::vector<Image> textures;
        for (const std::uint64_t seed : seeds) textures.push_back(synthesiser_->synthesise(seed));
        return textures;
    }

  private:
    Device& device_;
    CompoundModel model_;
    Size size_;
    bool allow_invalid_;
    std::optional<CompoundSynthesiser> synthesiser_;
};

class RollSource final : public TextureSource {
  public:
    RollSource(Device& device, const Image& picture, Size size)
        : picture_(picture), size_(size), roller_(device, {&picture, 1}) {}

    void describe(JobResult& /*result*/) const override {}
    void prepare() override {}
    [[nodiscard]] std::vector<Image> synthesise(std::span<const std::uint64_t> seeds) override {
        std::vector<Image> textures;
        for (const std::uint64_t seed : seeds) {
            RollerOptions options;
            options.seed = seed;
            textures.push_back(apply(roller_.quilt(size_, options), picture_));
        }
        return textures;
    }

  private:
    const Image& picture_;
    Size size_;
    Roller roller_;
};

class GrownSource final : public TextureSource {
  public:
    GrownSource(GrownBtfs& btfs, const DirectionSource& direction, Size size)
        : btfs_(btfs), direction_(direction), size_(size), model_(btfs.model(direction)) {}

    void describe(JobResult& result) const override {
        result.valid = is_valid(model_);
        result.parameters = parameter_count(model_);
        std::vector<const TextureModel*> fields;
        if (const auto* field = std::get_if<TextureModel>(&model_.surface)) fields.push_back(field);
        if (const auto* compound = std::get_if<CompoundModel>(&model_.surface))
            for (const CompoundRegion& region : compound->regions) fields.push_back(&region.residual);
        if (fields.empty()) return;  // the surface's own pixels
        describe_certificates(fields, result);
        describe_levels(*fields.front(), result);
    }
    void prepare() override {}
    [[nodiscard]] std::vector<Image> synthesise(std::span<const std::uint64_t> seeds) override {
        std::vector<Image> textures;
        for (const std::uint64_t seed : seeds)
            textures.push_back(btfs_.grown(size_, seed).picture(direction_.at.view, direction_.true_light));
        return textures;
    }

  private:
    GrownBtfs& btfs_;
    const DirectionSource& direction_;
    Size size_;
    const BtfModel& model_;
};

FitOptions field_options(ModelKind kind, const ExperimentConfig& config, const JobSettings& settings) {
    FitOptions options;
    options.model = kind;
    options.order = settings.order;
    options.levels = settings.levels;
    options.factor = config.factor;
    options.estimator = settings.estimator;
    options.noise = noise_of(config, settings.model);
    options.gains = gains_of(config, settings.model);
    options.marginals = settings.marginals;
    return options;
}

CompoundOptions compound_options(const ExperimentConfig& config, const JobSettings& settings) {
    CompoundOptions options;
    options.local.order = settings.order;
    options.local.levels = settings.levels;
    options.local.factor = config.factor;
    options.local.estimator = settings.estimator;
    options.local.noise = noise_of(config, settings.model);
    options.local.marginals = settings.marginals;
    return options;
}

}  // namespace

const BtfModel& GrownBtfs::model(const DirectionSource& direction) {
    if (model_ && content_ == direction.model_content) return *model_;
    const std::string what = "the BTF model '" + direction.model.string() + "'";
    try {
        if (sha256_of_file(direction.model) != direction.model_content)
            throw std::runtime_error(what + " changed during the run");
        BtfModel read = read_btf_model(direction.model);
        grown_.clear();
        model_ = std::move(read);
    } catch (const InputError& error) {
        throw std::runtime_error(error.what());
    }
    content_ = direction.model_content;
    return *model_;
}

const BtfSynthesiser& GrownBtfs::grown(Size size, std::uint64_t seed) {
    constexpr double most_bytes = 1e9;  // of surfaces that are kept
    if (size != size_) grown_.clear();
    size_ = size;
    const auto found = grown_.find(seed);
    if (found != grown_.end()) return found->second;
    const double each =
        sizeof(float) * static_cast<double>(area(size)) * static_cast<double>(model_->planes() + 1);
    if (static_cast<double>(grown_.size() + 1) * each > most_bytes) grown_.clear();
    return grown_.try_emplace(seed, device_, *model_, size, seed, allow_invalid_).first->second;
}

std::unique_ptr<TextureSource> texture_source(Device& device, Analysis& picture,
                                              const ExperimentConfig& config, const JobSettings& settings,
                                              const PictureSource& source, GrownBtfs& btfs) {
    const Image& image = picture.image();
    const Size size = config.size.value_or(image.size());
    if (const std::optional<ModelKind> kind = random_field(settings.model)) {
        return std::make_unique<FieldSource>(device, picture.fit(field_options(*kind, config, settings)),
                                             size, config.allow_invalid);
    }
    if (settings.model == ExperimentModel::compound) {
        return std::make_unique<CompoundSource>(
            device, fit_compound(device, image, compound_options(config, settings)), size,
            config.allow_invalid);
    }
    if (settings.model == ExperimentModel::btf) {
        if (!source.direction)
            throw InputError("show the picture of a BTF model", "the picture is of no BTF",
                             "use other models");
        return std::make_unique<GrownSource>(btfs, *source.direction, size);
    }
    return std::make_unique<RollSource>(device, image, size);
}

}  // namespace btfield::detail
