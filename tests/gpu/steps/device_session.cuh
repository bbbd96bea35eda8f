#pragma once

#include "gpu/steps/on_executor.hpp"
#include "smooth/cuda/primitives/executor.cuh"

namespace meshsmooth::test {

/// An executor on device 0 for one call of a test.
struct DeviceSession {
  JobControl control;
  detail::Interrupt interrupt{control};
  detail::CudaLane lane{0};
  detail::CudaExecutor executor{lane, interrupt};
};

template <class Real>
using OnDevice = OnExecutor<detail::CudaExecutor, Real>;

}  // namespace meshsmooth::test
