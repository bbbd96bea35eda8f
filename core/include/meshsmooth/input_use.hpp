#pragma once

#include "meshsmooth/options.hpp"

namespace meshsmooth {

/// Checks that a job with these options may have a target surface.
/// @throws NotSupported OPTION_NOT_SUPPORTED, detail "field": "surface".
void validate_surface_use(const SmoothOptions& options);

/// Checks that a job with these options uses every array of the input; `validate(options, input)`
/// checks the options too. O(1).
/// @throws NotSupported OPTION_NOT_SUPPORTED, detail "field": "reference", "optimize.target",
///         "surface" or "prescribed".
void validate_input_use(const SmoothOptions& options, const JobInput& input);

}  // namespace meshsmooth
