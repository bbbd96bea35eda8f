#pragma once

#include <concepts>

#include "smooth/linear/kept_reference.hpp"

namespace meshsmooth::detail {

/// What a motion's linear system needs of a backend.
///
///   kept_reference()      where a motion finds its Laplace system, and keeps it; null: nowhere
///   keep(buffer)          moves a buffer there
template <class B>
concept SolvingBackend = requires(B& backend, typename B::Executor::template Buffer<NodeId>& ids) {
  { backend.executor() } -> std::same_as<typename B::Executor&>;
  { backend.kept_reference() } -> std::same_as<KeptReference<typename B::Executor>*>;
  { backend.keep(ids) } -> std::same_as<void>;
}
&&Executor<typename B::Executor>;

}  // namespace meshsmooth::detail
