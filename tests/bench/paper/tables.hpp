#pragma once

#include <iosfwd>
#include <vector>

#include "paper/measure.hpp"

namespace meshsmooth::bench {

/// The paper's Tables 2 to 7 and what we found, each measured figure beside the
/// published one.
void print_tables(std::ostream& out, const std::vector<PaperFigures>& meshes);

}  // namespace meshsmooth::bench
