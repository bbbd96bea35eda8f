#pragma once

namespace meshsmooth {

/// The order in which the nodes of one sweep see each other's moves.
enum class Form {
  automatic,     // the method's own: `MethodTraits::forms`, the first
  jacobi,        // reads the old positions, writes new ones
  gauss_seidel,  // in place, colour by colour; deterministic
  asynchronous,  // in place, unordered; not deterministic
};

}  // namespace meshsmooth
