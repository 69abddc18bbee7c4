#pragma once

/// \file
/// All of the library, but for experiments, which are one of their own (btfield/experiment.hpp). Programs
/// that name the headers they need compile faster.

#include "btfield/api.hpp"             // IWYU pragma: export
#include "btfield/btf_measured.hpp"    // IWYU pragma: export
#include "btfield/btf_model.hpp"       // IWYU pragma: export
#include "btfield/btf_output.hpp"      // IWYU pragma: export
#include "btfield/btf_page.hpp"        // IWYU pragma: export
#include "btfield/btf_renderer.hpp"    // IWYU pragma: export
#include "btfield/btf_set.hpp"         // IWYU pragma: export
#include "btfield/btf_textures.hpp"    // IWYU pragma: export
#include "btfield/ceilings.hpp"        // IWYU pragma: export
#include "btfield/certificate.hpp"     // IWYU pragma: export
#include "btfield/compound.hpp"        // IWYU pragma: export
#include "btfield/control_field.hpp"   // IWYU pragma: export
#include "btfield/criteria.hpp"        // IWYU pragma: export
#include "btfield/curves.hpp"          // IWYU pragma: export
#include "btfield/device.hpp"          // IWYU pragma: export
#include "btfield/device_opencl.hpp"   // IWYU pragma: export
#include "btfield/error.hpp"           // IWYU pragma: export
#include "btfield/fit.hpp"             // IWYU pragma: export
#include "btfield/height.hpp"          // IWYU pragma: export
#include "btfield/image.hpp"           // IWYU pragma: export
#include "btfield/image_io.hpp"        // IWYU pragma: export
#include "btfield/lag_covariance.hpp"  // IWYU pragma: export
#include "btfield/light_set.hpp"       // IWYU pragma: export
#include "btfield/light_trend.hpp"     // IWYU pragma: export
#include "btfield/made_btf.hpp"        // IWYU pragma: export
#include "btfield/marginals.hpp"       // IWYU pragma: export
#include "btfield/material.hpp"
#include "btfield/memd.hpp"            // IWYU pragma: export
#include "btfield/model_file.hpp"      // IWYU pragma: export
#include "btfield/models.hpp"          // IWYU pragma: export
#include "btfield/neighbourhood.hpp"   // IWYU pragma: export
#include "btfield/picture_batch.hpp"   // IWYU pragma: export
#include "btfield/progress.hpp"        // IWYU pragma: export
#include "btfield/pyramid.hpp"         // IWYU pragma: export
#include "btfield/relief.hpp"          // IWYU pragma: export
#include "btfield/relightable.hpp"     // IWYU pragma: export
#include "btfield/relighting.hpp"      // IWYU pragma: export
#include "btfield/roller.hpp"          // IWYU pragma: export
#include "btfield/spectral_basis.hpp"  // IWYU pragma: export
#include "btfield/stop.hpp"            // IWYU pragma: export
#include "btfield/synthesis.hpp"       // IWYU pragma: export
#include "btfield/theory.hpp"          // IWYU pragma: export
#include "btfield/threads.hpp"         // IWYU pragma: export
#include "btfield/version.hpp"         // IWYU pragma: export
