#include "mesh/parallel.hpp"

#include <oneapi/tbb/parallel_for.h>

namespace meshsmooth::detail {

void call_in(tbb::task_arena& arena, const AnyBody& functor) {
  arena.execute([&] { functor.call(functor, 0); });
}

void call_for_each(std::size_t count, const AnyBody& functor) {
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { functor.call(functor, i); });
}

}  // namespace meshsmooth::detail
