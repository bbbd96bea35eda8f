#include "mesh/parallel.hpp"

#include <oneapi/tbb/parallel_for.h>

namespace meshsmooth::detail {

void call_in(tbb::task_arena& arena, const AnyBody& body) {
  arena.execute([&] { body.call(body, 0); });
}

void call_for_each(std::size_t count, const AnyBody& body) {
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { body.call(body, i); });
}

}  // namespace meshsmooth::detail
