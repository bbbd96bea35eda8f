#pragma once

#include "meshsmooth.h"
#include "meshsmooth/client.hpp"

namespace meshsmooth::c {

/// The options of C in the structures of C++.
struct Job {
  SmoothOptions smooth;
  client::RequestOptions request;
};

/// Reads options; null: the defaults of a method.
/// @throws InvalidOption ARGUMENT_INVALID, OPTION_OUT_OF_RANGE
[[nodiscard]] Job read_options(const meshsmooth_options* options, const Method& method);

}  // namespace meshsmooth::c
