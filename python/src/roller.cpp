#include "python/src/parts.hpp"

namespace btfield::python {
void add_roller(nanobind::module_& /*module*/) {}
}  // namespace btfield::python
