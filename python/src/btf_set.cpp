#include "python/src/parts.hpp"

namespace btfield::python {
void add_btf_set(nanobind::module_& /*module*/) {}
}  // namespace btfield::python
