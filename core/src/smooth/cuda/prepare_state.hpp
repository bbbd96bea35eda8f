#pragma once

namespace meshsmooth::detail {

/// What the kernels of `prepare_job` tell the host.
struct PrepareState {
  unsigned long long lower[3], upper[3];  // of the box, as `ordered_bits`
  unsigned int wrong_position = 0;
  unsigned int wrong_element = 0;
  unsigned int overused_facet = 0;
  unsigned int overfull_ball = 0;  // has no room in `BallSlots`
  unsigned int next_block = 0;
  unsigned long long ring_entries = 0;
};

}  // namespace meshsmooth::detail
