#include "btfield/synthesis.hpp"

#include <algorithm>

#include "host/synthesis/synthesis_names.hpp"
#include "python/src/arrays.hpp"
#include "python/src/device.hpp"
#include "python/src/options.hpp"
#include "python/src/parts.hpp"
#include "python/src/words.hpp"

namespace btfield::python {
namespace {

using PySynthesiser = Held<Synthesiser>;
using Seeds = std::vector<std::uint64_t>;

/// Textures one after the other, computed a batch at a time.
class Stream {
  public:
    Stream(nb::object synthesiser, std::uint64_t first)
        : synthesiser_(std::move(synthesiser)), next_(first) {}

    nb::object next() {
        if (ready_.empty()) {
            auto& synthesiser = nb::cast<PySynthesiser&>(synthesiser_);
            ready_ = unlocked([&] {
                Seeds seeds(static_cast<std::size_t>(std::clamp(synthesiser->batch(), 1, 16)));
                for (std::uint64_t& seed : seeds) seed = next_++;
                std::vector<Image> images = synthesiser->synthesise(seeds);
                std::ranges::reverse(images);
                return images;
            });
        }
        Image image = std::move(ready_.back());
        ready_.pop_back();
        return array_of(std::move(image));
    }

  private:
    nb::object synthesiser_;
    std::uint64_t next_;
    std::vector<Image> ready_;  // in reverse
};

}  // namespace

void add_synthesis(nb::module_& module) {
    OptionsClass<SynthesisOptions>(module, "SynthesisOptions",
                                   "How textures are grown; all of it as keywords of Synthesiser, too.")
        .word("noise_domain", &SynthesisOptions::noise_domain,
              "'frequency': the half spectrum directly; 'spatial': on the lattice, then transformed.")
        .field("allow_invalid", &SynthesisOptions::allow_invalid, "Grow although a certificate fails.")
        .word("method", &SynthesisOptions::method,
              "'torus', or, of CAR models, 'raster', which does not tile.")
        .word("moving_average", &SynthesisOptions::moving_average, "'auto', 'convolution' or 'transfer'.");
    module.def(
        "check_synthesis",
        [](const TextureModel& model, Size size, const SynthesisOptions* options,
           const nb::kwargs& keywords) { check_synthesis(model, size, options_of(options, keywords)); },
        nb::arg("model"), nb::arg("size"), nb::arg("options").none() = nb::none(), nb::arg("keywords"),
        "Raises InputError where a model cannot be grown as asked, as far as that can be told without a\n"
        "device.");
    nb::class_<Stream>(module, "TextureIterator", "Textures of one seed after the other, without end.")
        .def("__iter__", [](nb::handle self) { return nb::borrow(self); })
        .def("__next__", &Stream::next, nb::sig("def __next__(self) -> numpy.typing.NDArray[numpy.float32]"));
    nb::class_<PySynthesiser>(
        module, "Synthesiser",
        "Plans and factors for textures of one model and size; seeds reuse them. Any number of\n"
        "threads may ask one for textures at a time.")
        .def(
            "__init__",
            [](PySynthesiser* self, PyDevice& device, const TextureModel& model, Size size,
               const SynthesisOptions* options, const nb::kwargs& keywords) {
                const SynthesisOptions wanted = options_of(options, keywords);
                new (self) PySynthesiser(
                    [&] { return unlocked([&] { return Synthesiser(*device, model, size, wanted); }); });
            },
            nb::arg("device"), nb::arg("model"), nb::arg("size"), nb::arg("options").none() = nb::none(),
            nb::arg("keywords"), nb::keep_alive<1, 2>(),
            "size: (height, width) of the textures, any. options: SynthesisOptions, or its fields as "
            "keywords.\n\n"
            "Raises InputError when the model contradicts itself or a certificate fails (unless allowed);\n"
            "DeviceError when the device's memory cannot hold the work.")
        .def(
            "synthesise",
            [](PySynthesiser& self, std::uint64_t seed) {
                return unlocked([&] { return self->synthesise(seed); });
            },
            nb::arg("seed"),
            "Texture of one seed, H x W x d float32: a function of (model, size, method, noise domain, "
            "seed). In\n"
            "units of the analysed picture's values (whole numbers: fractions of white), not clamped.")
        .def(
            "synthesise",
            [](PySynthesiser& self, const Seeds& seeds, const nb::object& progress) {
                const auto told = share_told(progress);
                return arrays_of(unlocked([&] { return self->synthesise(seeds, told); }));
            },
            nb::arg("seeds"), nb::arg("progress").none() = nb::none(),
            nb::sig("def synthesise(self, seeds: collections.abc.Sequence[int], progress: "
                    "collections.abc.Callable[[float], object] | None = None) -> "
                    "list[numpy.typing.NDArray[numpy.float32]]"),
            "A texture for each seed, each equal to synthesise(seed), a batch at a time.\n"
            "progress: called with the share of the textures that are done; what it raises ends the work.")
        .def(
            "textures", [](nb::handle self, std::uint64_t first) { return Stream(nb::borrow(self), first); },
            nb::arg("first") = 0, "Iterates over textures of the seeds first, first + 1, ... without end.")
        .def_prop_ro("size", [](PySynthesiser& self) { return self->size(); })
        .def_prop_ro(
            "lattice", [](PySynthesiser& self) { return self->lattice(); },
            "What is computed before it is cropped to size.")
        .def_prop_ro(
            "tileable", [](PySynthesiser& self) { return self->tileable(); },
            "Whether opposite edges continue each other.")
        .def_prop_ro(
            "batch", [](PySynthesiser& self) { return self->batch(); },
            "Seeds that are computed together at most.");
    module.def(
        "synthesise",
        [](PyDevice& device, const TextureModel& model, Size size, std::uint64_t seed,
           const SynthesisOptions* options, const nb::kwargs& keywords) {
            const SynthesisOptions wanted = options_of(options, keywords);
            return unlocked([&] {
                Synthesiser synthesiser(*device, model, size, wanted);
                return synthesiser.synthesise(seed);
            });
        },
        nb::arg("device"), nb::arg("model"), nb::arg("size"), nb::arg("seed") = 0,
        nb::arg("options").none() = nb::none(), nb::arg("keywords"),
        "Synthesiser(device, model, size, options).synthesise(seed): one texture.");
}

}  // namespace btfield::python
