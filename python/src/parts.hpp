#pragma once

// What the module is made of: each adds its names.

#include <nanobind/nanobind.h>

namespace btfield::python {

void add_errors(nanobind::module_& module);
void add_version(nanobind::module_& module);
void add_device(nanobind::module_& module);
void add_analysis(nanobind::module_& module);
void add_fields(nanobind::module_& module);
void add_models(nanobind::module_& module);
void add_fit(nanobind::module_& module);
void add_synthesis(nanobind::module_& module);
void add_noise(nanobind::module_& module);
void add_criteria(nanobind::module_& module);
void add_roller(nanobind::module_& module);
void add_compound(nanobind::module_& module);
void add_relief(nanobind::module_& module);
void add_material(nanobind::module_& module);
void add_btf_set(nanobind::module_& module);
void add_btf_models(nanobind::module_& module);

}  // namespace btfield::python
