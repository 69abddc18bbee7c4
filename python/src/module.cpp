#include <nanobind/nanobind.h>

#include "btfield/error.hpp"
#include "python/src/options.hpp"
#include "python/src/parts.hpp"

namespace btfield::python {

void set_fields(nb::handle object, const nb::kwargs& keywords) {
    for (const auto& [keyword, value] : keywords) {
        if (!nb::hasattr(object.type(), keyword)) {
            const auto word = nb::cast<std::string>(keyword);
            const auto type = nb::cast<std::string>(nb::str(object.type().attr("__name__")));
            const nb::object near = nb::module_::import_("difflib").attr("get_close_matches")(
                keyword, nb::module_::import_("builtins").attr("dir")(object.type()), 1);
            std::string text = "'" + word + "' is no field of " + type;
            if (nb::len(near) > 0)
                text += ", did you mean '" + nb::cast<std::string>(nb::str(near[0])) + "'?";
            throw nb::type_error(text.c_str());
        }
        nb::setattr(object, keyword, value);
    }
}

namespace {

/// Raises the class of btfield._errors that mirrors the exception.
void raise(const Error& error, const char* type, const std::string& log) {
    try {
        const nb::object made = nb::module_::import_("btfield._errors").attr(type);
        PyErr_SetObject(made.ptr(),
                        made(error.asked(), error.found(), error.remedy(), error.what(), log).ptr());
    } catch (nb::python_error& failed) {
        failed.restore();
    }
}

void translate(const std::exception_ptr& thrown, void* /*payload*/) {
    try {
        std::rethrow_exception(thrown);
    } catch (const DeviceError& error) {
        raise(error, "DeviceError", error.log());
    } catch (const InputError& error) {
        raise(error, "InputError", {});
    } catch (const Stopped& error) {
        raise(error, "Stopped", {});
    } catch (const Error& error) {
        raise(error, "Error", {});
    }
}

}  // namespace

void add_errors(nb::module_& /*module*/) {
    nb::register_exception_translator(translate);
}

}  // namespace btfield::python

NB_MODULE(_btfield, module) {
    using namespace btfield::python;
    module.doc() = "What btfield for Python is made of: see btfield.";
    add_errors(module);
    add_version(module);
    add_device(module);
    add_analysis(module);
    add_fields(module);
    add_models(module);
    add_fit(module);
    add_synthesis(module);
    add_noise(module);
    add_criteria(module);
    add_roller(module);
    add_compound(module);
    add_relief(module);
    add_material(module);
    add_btf_set(module);
    add_btf_models(module);
}
