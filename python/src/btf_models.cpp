#include "python/src/parts.hpp"

namespace btfield::python {
void add_btf_models(nanobind::module_& /*module*/) {}
}  // namespace btfield::python
