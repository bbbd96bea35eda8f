#pragma once

namespace meshsmooth::detail {

/// Findings of the kernels of `prepare_job`; all 0 before, except the box when the search for rings
/// is repeated.
struct PrepareState {
  // The box as `ordered_bits`; the lower corner complemented, so that atomicMax serves both.
  unsigned long long lower[3], upper[3];
  unsigned int wrong_position;
  unsigned int wrong_element;
  unsigned int overused_facet;
  unsigned int overfull_ball;  // exceeds its `BallSlots`
  unsigned int next_block, blocks_done;
  unsigned long long ring_entries;
  unsigned long long boundary, fixed, isolated, on_non_manifold_edges, free;  // see `FixRule`
};

}  // namespace meshsmooth::detail
