#pragma once

#include <string>

#include "btfield/models.hpp"
#include "python/src/arrays.hpp"

namespace btfield::python {

/// Of a picture that is an array.
[[nodiscard]] Provenance provenance_of(const ArrayPicture& picture, const std::string& source);

}  // namespace btfield::python
