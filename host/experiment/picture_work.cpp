#include "host/experiment/picture_work.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <new>
#include <span>
#include <utility>

#include "btfield/criteria.hpp"
#include "btfield/error.hpp"
#include "host/experiment/set_pictures.hpp"
#include "host/experiment/sha256.hpp"
#include "host/pictures/pixel_values.hpp"

namespace btfield::detail {
namespace {

namespace fs = std::filesystem;

constexpr double kappa_range = 256.0;  // c of P4 eq. 49

class Watch {
  public:
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

template <class T>
Image rounded(Image image) {
    for (float& value : image.values()) {
        value = static_cast<float>(to_integer<T>(value)) / static_cast<float>(std::numeric_limits<T>::max());
    }
    return image;
}

bool is_integer(PixelType type) {
    return type == PixelType::uint8 || type == PixelType::uint16;
}

/// Pixels with a value below 0 or above white.
std::uint64_t outside(const Image& image, float white) {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < area(image.size()); ++i) {
        bool out = false;
        for (int p = 0; p < image.planes(); ++p) {
            const float value = image.plane(p)[i];
            out = out || value < 0.0F || value > white;
        }
        count += out ? 1U : 0U;
    }
    return count;
}

void check_finite(const Image& image) {
    const auto values = image.values();
    if (!std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); })) {
        throw InputError("synthesise a texture", "it holds NaN or infinite values",
                         "use another model or order");
    }
}

/// What a failure says about the job: input errors come from the picture and the settings and would come
/// again.
struct Failure {
    JobStatus status = JobStatus::failed;
    std::string reason;
};

Failure current_failure() {
    try {
        throw;
    } catch (const InputError& error) {
        return {JobStatus::refused, error.what()};
    } catch (const std::bad_alloc&) {
        return {JobStatus::failed, "there is not enough memory"};
    } catch (const std::exception& error) {
        return {JobStatus::failed, error.what()};
    }
}

void fail_from(std::vector<JobResult>& results, std::size_t first, const Failure& failure) {
    for (std::size_t i = first; i < results.size(); ++i) {
        results[i].status = failure.status;
        results[i].reason = failure.reason;
    }
}

/// Failures to read are the surroundings', not the picture's: it could be read when the run began.
Picture read(const PictureSource& source, OpenSets& sets) {
    const auto changed = [&](const std::string& content, const std::string& what) {
        if (content != source.content)
            throw std::runtime_error("the picture '" + what + "' changed during the run");
    };
    try {
        if (source.direction) {
            Picture picture;
            picture.image = read_direction(sets, source.file, *source.direction, source.crop);
            picture.type = PixelType::float32;  // linear light is not in the steps of the file
            changed(sha256_of_values(picture.image), source.name);
            return picture;
        }
        changed(sha256_of_file(source.file), source.file.string());
        return read_picture(source.file, source.crop);
    } catch (const InputError& error) {
        throw std::runtime_error(error.what());
    }
}

/// "bark", and of a BTF "bark-view-30-45-light-60-200".
std::string stem_of(const PictureSource& source) {
    if (!source.direction) return fs::path(source.name).stem().string();
    std::string text =
        fs::path(source.direction->set_name).stem().string() + "-" + directions_text(source.direction->at);
    std::ranges::replace_if(
        text, [](char c) { return c == ' ' || c == ','; }, '-');
    return text;
}

/// "bark-1f2e3d4c-3d-car-match.png": the format of the picture's values, lossless.
std::string texture_name(const PictureSource& source, const JobSettings& settings, const std::string& metric,
                         PixelType type, int planes) {
    const bool png = is_integer(type) && (planes == 1 || planes == 3);
    return stem_of(source) + "-" + source.picture.substr(0, 8) + "-" + std::string(name(settings.model)) +
           "-" + std::string(marginals_text(settings)) + (metric == name(Metric::max) ? "" : "-" + metric) +
           (png                ? ".png"
            : is_integer(type) ? ".tif"
                               : ".exr");
}

/// A material as the name of a folder.
std::string folder_name(std::string material) {
    std::replace(material.begin(), material.end(), '/', '-');
    if (material == "." || material == "..") material = "-";
    return material;
}

}  // namespace

Image as_stored(const Image& image, PixelType type) {
    switch (type) {
        case PixelType::uint8:
            return rounded<std::uint8_t>(image);
        case PixelType::uint16:
            return rounded<std::uint16_t>(image);
        case PixelType::half:
        case PixelType::float32:
            break;
    }
    return image;
}

Image as_eight_bit(const Image& image, double white) {
    Image values = image;
    for (float& value : values.values()) {
        const double share = std::clamp(static_cast<double>(value) / white, 0.0, 1.0);
        value = static_cast<float>(std::round(share * 255.0) / 255.0 * white);
    }
    return values;
}

/// What the jobs of a picture share.
class PictureWork::Picture {
  public:
    Picture(Device& device, const PictureSource& source, btfield::Picture file,
            const ExperimentConfig& config)
        : type(file.type),
          analysis(device, std::move(file.image)),
          device_(device),
          source_(source),
          metric_(config.metric),
          eight_bit_(config.values == MeasuredValues::eight_bit) {
        if (eight_bit_) measured_ = as_eight_bit(image(), source.white);
    }

    [[nodiscard]] const Image& image() const { return analysis.image(); }
    /// What textures are held against.
    [[nodiscard]] const Image& measured() const { return eight_bit_ ? measured_ : image(); }
    /// What is held against it.
    [[nodiscard]] Image measured(const Image& texture) const {
        return eight_bit_ ? as_eight_bit(texture, source_.white) : as_stored(texture, type);
    }
    [[nodiscard]] std::uint64_t clamped(const Image& texture) const {
        if (eight_bit_) return outside(texture, static_cast<float>(source_.white));
        return is_integer(type) ? outside(texture, 1.0F) : 0;
    }
    [[nodiscard]] PictureFacts facts() const {
        return {source_.picture, kappa(image(), kappa_range, source_.white).kappa, image().size(),
                image().planes()};
    }
    [[nodiscard]] MemdReference& reference() {
        if (!reference_) {
            MemdOptions options;
            options.metric = metric_;
            options.white = {source_.white, source_.white};
            reference_ = std::make_unique<MemdReference>(device_, measured(), options);
        }
        return *reference_;
    }

    const PixelType type;
    Analysis analysis;

  private:
    Device& device_;
    const PictureSource& source_;
    Metric metric_;
    bool eight_bit_;
    Image measured_;
    std::unique_ptr<MemdReference> reference_;
};

PictureWork::PictureWork(const ExperimentConfig& config, const std::string& device, fs::path textures,
                         OpenSets& sets)
    : config_(config),
      device_(device),
      textures_(std::move(textures)),
      sets_(sets),
      btfs_(device_, config.allow_invalid) {}

std::vector<JobResult> PictureWork::blanks(const PictureSource& source,
                                           std::span<const JobSettings> jobs) const {
    std::vector<JobResult> results;
    for (const JobSettings& settings : jobs) {
        JobResult result;
        result.settings = settings;
        result.metric = name(config_.metric);
        result.settings_text = settings_text(config_, settings);
        result.picture = source.picture;
        result.key = job_key(source.picture, result.settings_text);
        result.status = JobStatus::done;
        result.device = device_.info().name;
        results.push_back(std::move(result));
    }
    return results;
}

void PictureWork::run(const WorkUnit& unit, const std::function<void(WorkReport)>& report,
                      const std::function<bool()>& stop) {
    if (stop()) return;
    std::unique_ptr<Picture> picture;
    try {
        picture = std::make_unique<Picture>(device_, unit.source, read(unit.source, sets_), config_);
        if (!unit.keep) report({picture->facts(), {}, {}, {}});
    } catch (const Stopped&) {
        throw;
    } catch (...) {
        const Failure failure = current_failure();
        WorkReport news;
        if (unit.keep) {
            news.trouble = failure.reason;
        } else {
            news.results = blanks(unit.source, unit.jobs);
            fail_from(news.results, 0, failure);
        }
        report(std::move(news));
        return;
    }
    for (std::size_t first = 0; first < unit.jobs.size() && !stop();) {
        std::size_t end = first + 1;
        while (end < unit.jobs.size() && same_fit(unit.jobs[first], unit.jobs[end])) ++end;
        const auto jobs = std::span(unit.jobs).subspan(first, end - first);
        report(unit.keep ? keep(*picture, unit.source, jobs) : measure(*picture, unit.source, jobs));
        first = end;
    }
}

void PictureWork::hold(Picture& picture, const Image& texture, JobResult& result) {
    check_finite(texture);
    const Image stored = picture.measured(texture);
    const Watch searching;
    const Memd memd = picture.reference()(stored);
    result.memd_seconds = searching.seconds();
    const Comparison comparison = compare(picture.measured(), stored);
    double ratio = 0.0;
    for (const Comparison::Plane& plane : comparison.planes) ratio += plane.std_ratio * plane.std_ratio;
    result.memd = memd.memd;
    result.memd_star = memd.memd_star;
    result.variance_ratio = ratio / static_cast<double>(comparison.planes.size());
    result.lag_covariance_error = comparison.lag_covariance_error;
    result.spectral_covariance_error = comparison.spectral_covariance_error;
    result.clamped_pixels = picture.clamped(texture);
}

WorkReport PictureWork::measure(Picture& picture, const PictureSource& source,
                                std::span<const JobSettings> jobs) {
    WorkReport news;
    std::vector<JobResult>& results = news.results;
    results = blanks(source, jobs);
    std::size_t measured = 0;
    try {
        const Watch fitting;
        const std::unique_ptr<TextureSource> textures_of =
            texture_source(device_, picture.analysis, config_, jobs.front(), source, btfs_);
        const double fit_share = fitting.seconds() / static_cast<double>(jobs.size());
        for (JobResult& result : results) {
            result.fit_seconds = fit_share;
            textures_of->describe(result);
        }
        const Watch preparing;
        textures_of->prepare();
        const double share = preparing.seconds() / static_cast<double>(jobs.size());
        std::vector<std::uint64_t> seeds;
        for (const JobSettings& job : jobs) seeds.push_back(job.seed);
        while (measured < seeds.size()) {
            const std::size_t count = std::min(textures_of->batch(), seeds.size() - measured);
            const Watch synthesising;
            const std::vector<Image> textures =
                textures_of->synthesise(std::span(seeds).subspan(measured, count));
            const double each = synthesising.seconds() / static_cast<double>(count);
            for (const Image& texture : textures) {
                results[measured].synthesis_seconds = share + each;
                hold(picture, texture, results[measured]);
                ++measured;
            }
        }
    } catch (const Stopped&) {
        throw;
    } catch (...) {
        fail_from(results, measured, current_failure());
    }
    return news;
}

WorkReport PictureWork::keep(Picture& picture, const PictureSource& source,
                             std::span<const JobSettings> jobs) {
    WorkReport news;
    try {
        const std::unique_ptr<TextureSource> textures_of =
            texture_source(device_, picture.analysis, config_, jobs.front(), source, btfs_);
        textures_of->prepare();
        const fs::path folder = textures_ / folder_name(source.material);
        fs::create_directories(folder);
        for (const JobResult& job : blanks(source, jobs)) {
            const Image texture = textures_of->synthesise({&job.settings.seed, 1}).front();
            const fs::path file =
                folder / texture_name(source, job.settings, job.metric, picture.type, texture.planes());
            // Half floats would not give back the values that were measured.
            write_picture(file, texture, picture.type,
                          is_integer(picture.type) ? picture.type : PixelType::float32);
            news.kept.push_back({job.picture, std::string(name(job.settings.model)),
                                 std::string(marginals_text(job.settings)), job.metric, job.key,
                                 fs::absolute(file).string()});
        }
    } catch (const Stopped&) {
        throw;
    } catch (...) {
        news.trouble = current_failure().reason;
    }
    return news;
}

}  // namespace btfield::detail
