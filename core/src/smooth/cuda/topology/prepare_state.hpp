#pragma once

namespace meshsmooth::detail {

/// What the kernels of `prepare_job` find out; all 0 before, but for the box when rows are searched
/// again.
struct PrepareState {
  // Of the box, as `ordered_bits`; of its lower corner their complement, so that all grow.
  unsigned long long lower[3], upper[3];
  unsigned int wrong_position;
  unsigned int wrong_element;
  unsigned int overused_facet;
  unsigned int overfull_ball;  // has no room in `BallSlots`
  unsigned int next_block, blocks_done;
  unsigned long long ring_entries;
  unsigned long long boundary, held, isolated, free;  // nodes, see `FixRule`
};

}  // namespace meshsmooth::detail
