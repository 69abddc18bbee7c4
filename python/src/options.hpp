#pragma once

// Options: a class with every field of the library's struct, and keywords of functions that set them.

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>

#include "host/base/names.hpp"

#include "python/src/casters.hpp"

namespace btfield::python {

/// Sets attributes of an object by keywords.
/// \throws TypeError for a keyword that is none of its fields, with the one that may have been meant
void set_fields(nb::handle object, const nb::kwargs& keywords);

/// `options`, or default ones where it is None, with the keywords put into a copy.
template <class Options>
Options options_of(const Options* options, const nb::kwargs& keywords) {
    Options copy = options != nullptr ? *options : Options();
    if (keywords.size() == 0) return copy;
    const nb::object object = nb::cast(&copy, nb::rv_policy::reference);
    set_fields(object, keywords);
    return copy;
}

/// A class of options that keywords construct.
template <class Options>
class OptionsClass {
  public:
    OptionsClass(nb::handle scope, const char* name, const char* text) : class_(scope, name, text) {
        class_.def("__init__", [](nb::pointer_and_handle<Options> self, const nb::kwargs& keywords) {
            new (self.p) Options();
            nb::inst_mark_ready(self.h);
            set_fields(self.h, keywords);
        });
        class_.def("__copy__", [](const Options& self) { return Options(self); });
    }

    template <class Owner, class Value>
    OptionsClass& field(const char* name, Value Owner::*member, const char* text) {
        class_.def_prop_rw(
            name, [member](const Options& self) { return self.*member; },
            [member](Options& self, const Value& value) { self.*member = value; },
            nb::for_setter(nb::arg("value").none()), text);
        return *this;
    }
    /// A field that is an object with fields of its own.
    template <class Owner, class Value>
    OptionsClass& nested(const char* name, Value Owner::*member, const char* text) {
        class_.def_rw(name, member, text);
        return *this;
    }
    /// A field of an enumeration, by its words.
    template <class Owner, class Value>
    OptionsClass& word(const char* name, Value Owner::*member, const char* text) {
        class_.def_prop_rw(
            name, [member](const Options& self) { return std::string(detail::word_of(self.*member)); },
            [member](Options& self, const std::string& value) {
                self.*member = detail::value_of<Value>(value);
            },
            text);
        return *this;
    }
    template <class Owner, class Value>
    OptionsClass& word(const char* name, std::optional<Value> Owner::*member, const char* text) {
        class_.def_prop_rw(
            name,
            [member](const Options& self) {
                const std::optional<Value>& value = self.*member;
                return value ? std::optional(std::string(detail::word_of(*value))) : std::nullopt;
            },
            [member](Options& self, const std::optional<std::string>& value) {
                if (value)
                    self.*member = detail::value_of<Value>(*value);
                else
                    self.*member = std::nullopt;
            },
            nb::for_setter(nb::arg("value").none()), text);
        return *this;
    }
    nb::class_<Options>& operator*() { return class_; }

  private:
    nb::class_<Options> class_;
};

}  // namespace btfield::python
