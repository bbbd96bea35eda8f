#include "meshsmooth/smoother.hpp"

#include "meshsmooth/backend_name.hpp"
#include "meshsmooth/error.hpp"
#include "smooth/canonical_smoother.hpp"
#include "smooth/cpu/cpu_smoother.hpp"
#include "smooth/cuda/smoother.hpp"
#include "smooth/paired_smoother.hpp"
#include "smooth/second_order/second_order_smoother.hpp"

namespace meshsmooth {
namespace {

[[noreturn]] void throw_not_available(std::string_view backend) {
  std::string names, problems;
  const std::vector<BackendInfo> backends = list_backends();
  if (backends.size() == 1) problems = "; this build has no CUDA";
  for (const BackendInfo& info : backends) {
    if (info.available) {
      names += (names.empty() ? "" : ", ") + info.name;
    } else {
      problems += "; " + info.name + ": " + info.problem;
    }
  }
  throw NotSupported("BACKEND_NOT_AVAILABLE",
                     "backend '" + std::string(backend) + "' is not available here" + problems +
                         "; there is: " + names,
                     {{"field", "backend"}});
}

/// A backend's smoother with what is the same on all of them.
std::unique_ptr<Smoother> complete(std::unique_ptr<Smoother> backend, int thread_count) {
  return detail::make_paired_smoother(detail::make_canonical_smoother(
      detail::make_second_order_smoother(std::move(backend), thread_count)));
}

}  // namespace

std::shared_ptr<const PreparedTopology> Smoother::prepare(const TopologyView& topology,
                                                          const JobControl&,
                                                          const PositionsView& reference) {
  auto result = std::make_shared<PreparedTopology>();
  result->topology = topology;
  result->reference = reference;
  return result;
}

MemoryEstimate Smoother::estimate_prepared(const MeshSize&) const { return {}; }

SmoothSummary Smoother::smooth(const PreparedTopology& prepared, const JobPositions& positions,
                               const SmoothOptions& options, const JobControl& control) {
  return smooth(prepared.topology, positions, options, control);
}

std::vector<BackendInfo> list_backends() {
  std::vector<BackendInfo> backends = detail::list_cuda_backends();
  backends.push_back({.name = "cpu", .available = true, .device_name = "CPU", .problem = {}});
  return backends;
}

std::unique_ptr<Smoother> make_smoother(std::string_view backend, int thread_count) {
  std::string name(backend);
  if (backend == "auto") {
    for (const BackendInfo& info : list_backends()) {
      if (!info.available) continue;
      name = info.name;
      break;
    }
  }
  if (name == "cpu") {
    return complete(detail::make_cpu_smoother(thread_count), thread_count);
  }
  const int device = detail::cuda_device(name);
  for (const BackendInfo& info : detail::list_cuda_backends()) {
    if (info.available && info.name == to_string({.kind = BackendKind::cuda, .device = device})) {
      return complete(detail::make_cuda_smoother(device), thread_count);
    }
  }
  throw_not_available(backend);
}

}  // namespace meshsmooth
