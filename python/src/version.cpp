#include "btfield/version.hpp"

#include <nanobind/stl/string.h>

#include "python/src/parts.hpp"

namespace btfield::python {

void add_version(nanobind::module_& module) {
    module.attr("__version__") = std::string(version());
}

}  // namespace btfield::python
