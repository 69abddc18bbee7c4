#include "python/src/parts.hpp"

namespace btfield::python {
void add_relief(nanobind::module_& /*module*/) {}
}  // namespace btfield::python
