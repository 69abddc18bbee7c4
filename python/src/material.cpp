#include "python/src/parts.hpp"

namespace btfield::python {
void add_material(nanobind::module_& /*module*/) {}
}  // namespace btfield::python
