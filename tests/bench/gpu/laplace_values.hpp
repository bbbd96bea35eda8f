#pragma once

#include "gpu/bench_mesh.hpp"

namespace meshsmooth::bench {

/// The milliseconds in which a GPU assembles the values of Laplace's matrix anew, as for another
/// reference on the same elements; float64. Median.
[[nodiscard]] double laplace_values_ms(const BenchMesh& mesh, int repeats);

}  // namespace meshsmooth::bench
