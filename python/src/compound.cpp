#include "python/src/parts.hpp"

namespace btfield::python {
void add_compound(nanobind::module_& /*module*/) {}
}  // namespace btfield::python
