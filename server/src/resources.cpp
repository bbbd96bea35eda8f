#include "resources.hpp"

#include <algorithm>
#include <span>
#include <sstream>
#include <utility>
#include <variant>
#include <vector>

#include "host_memory.hpp"
#include "machine_limits.hpp"
#include "meshsmooth/backend_name.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/method_traits.hpp"
#include "process_stats.hpp"

namespace meshsmooth::server {
namespace {

using Device = Resources::Device;

constexpr std::string_view kAllDevices = "all";

// One lane computes while others copy.
constexpr int kCudaLanes = 4;

bool is_cuda(std::string_view backend) {
  const auto name = parse_backend_name(backend);
  return name && name->kind == BackendKind::cuda;
}

// On the CPU a single job uses all cores; a second one uses those that are idle between sweeps and
// in serial parts. Small meshes do not keep many cores busy.
int lane_count(const ServerConfig& config, std::string_view backend) {
  if (config.lanes != 0) return config.lanes;
  if (is_cuda(backend)) return kCudaLanes;
  const int cores = available_cores();
  return std::min(cores, std::clamp(cores / 4, 2, 8));
}

std::unique_ptr<Smoother> make(const ServerConfig& config, const std::string& backend) {
  return make_smoother(backend, config.threads_per_lane);
}

Device device_with(std::unique_ptr<Smoother> smoother) {
  Device device{std::string(smoother->backend()), {}};
  device.smoothers.push_back(std::move(smoother));
  return device;
}

// The first backend of those that "auto" stands for that works, on as many of its devices as are
// wanted; `passed_over` explains why better ones are not used.
std::vector<Device> find_devices(const ServerConfig& config, std::string& passed_over) {
  const auto pass_over = [&](const BackendInfo& info, const std::string& why) {
    passed_over += (passed_over.empty() ? "" : "; ") + info.name + ": " + why;
  };
  std::vector<Device> devices;
  const std::vector<BackendInfo> backends = list_backends();
  for (const BackendInfo& info : backends) {
    if (!devices.empty() && (config.devices != kAllDevices || !is_cuda(info.name))) break;
    if (!info.available) {
      pass_over(info, info.problem);
      continue;
    }
    try {
      devices.push_back(device_with(make(config, info.name)));
    } catch (const Error& error) {
      if (info.name == backends.back().name) throw;
      pass_over(info, error.what());
    }
  }
  if (devices.empty()) {
    throw NotSupported("BACKEND_NOT_AVAILABLE", "no backend is available: " + passed_over);
  }
  return devices;
}

// The numbers in the setting `devices`.
std::vector<std::string> chosen_devices(const ServerConfig& config) {
  std::vector<std::string> numbers;
  if (config.devices == kAllDevices) return numbers;
  std::istringstream text(config.devices);
  for (std::string number; std::getline(text, number, ',');) numbers.push_back(number);
  return numbers;
}

// The backends that the settings name explicitly.
std::vector<std::string> named_backends(const ServerConfig& config) {
  std::vector<std::string> names;
  if (!config.devices.empty() && config.backend != "auto" && config.backend != "cuda") {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "devices: GPUs need the backend cuda, not " + config.backend +
                            "; set backend to cuda, or omit one of the two settings",
                        {{"field", "devices"}});
  }
  for (const std::string& number : chosen_devices(config)) names.push_back("cuda:" + number);
  if (config.devices == kAllDevices) {
    for (const BackendInfo& info : list_backends()) {
      if (info.available && is_cuda(info.name)) names.push_back(info.name);
    }
  }
  if (names.empty()) names.push_back(config.backend);  // its error explains why there is none
  return names;
}

void fill_in_host_bytes(ServerConfig& config) {
  if (config.host_memory_limit_bytes == 0) {
    config.host_memory_limit_bytes = available_host_bytes() / 10 * 8;
  }
  // The rest is for jobs of other callers.
  if (config.max_job_bytes == 0) config.max_job_bytes = config.host_memory_limit_bytes / 8 * 7;
  if (config.max_queued_bytes == 0) config.max_queued_bytes = config.host_memory_limit_bytes;
  if (config.max_kept_result_bytes == 0) {
    config.max_kept_result_bytes = config.host_memory_limit_bytes / 4;
  }
  if (config.max_topology_bytes == 0) {
    config.max_topology_bytes = config.host_memory_limit_bytes / 4;
  }
  if (config.max_shared_memory_bytes == 0)
    config.max_shared_memory_bytes = config.host_memory_limit_bytes / 4;
  if (config.idle_pinned_bytes == 0) {
    config.idle_pinned_bytes = std::min(std::int64_t{1} << 30, config.host_memory_limit_bytes / 16);
  }
}

// Device memory for all jobs: what is free once every lane exists, less what the other lanes may
// hold while idle, less a margin for later allocations of the driver (kernel code, fragmentation).
// No limit where the device is the host.
std::int64_t device_limit(const ServerConfig& config, const DeviceSpace& space) {
  if (space.total_bytes == 0) return INT64_MAX;
  const std::int64_t margin = std::max(std::int64_t{256} << 20, space.total_bytes / 32);
  const std::int64_t usable =
      space.free_bytes - (config.lanes + config.reserved_lanes - 1) * space.kept_bytes - margin;
  if (usable <= 0) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "lanes: " + std::to_string(config.lanes) + " lanes may keep " +
                            std::to_string(space.kept_bytes) +
                            " bytes of device memory each, but only " +
                            std::to_string(space.free_bytes) + " are free; use fewer lanes",
                        {{"field", "lanes"}});
  }
  return config.device_bytes == 0 ? usable : std::min(config.device_bytes, usable);
}

/// A cube of tetrahedra whose inner nodes do not lie in the middle of their neighbours.
Mesh warm_up_mesh(int cells) {
  const int side = cells + 1;
  Mesh mesh;
  auto& positions = mesh.positions.emplace<std::vector<Vec3d>>();
  std::vector<NodeId> tetrahedra;
  const auto node = [=](int x, int y, int z) { return (x * side + y) * side + z; };
  const auto shift = [=](int i) { return i % cells == 0 ? 0 : i % 3 * 0.1; };
  for (int x = 0; x < side; ++x) {
    for (int y = 0; y < side; ++y) {
      for (int z = 0; z < side; ++z) {
        positions.push_back({x + shift(x), y + shift(y), z + shift(z)});
        if (x == cells || y == cells || z == cells) continue;
        const NodeId ring[] = {node(x + 1, y, z),     node(x + 1, y + 1, z), node(x, y + 1, z),
                               node(x, y + 1, z + 1), node(x, y, z + 1),     node(x + 1, y, z + 1)};
        for (int k = 0; k < 6; ++k) {
          tetrahedra.insert(tetrahedra.end(),
                            {node(x, y, z), ring[k], ring[(k + 1) % 6], node(x + 1, y + 1, z + 1)});
        }
      }
    }
  }
  mesh.blocks = {{ElementType::tetrahedron, std::move(tetrahedra)}};
  return mesh;
}

// The first job of each method pays for one-time loading and allocation; of a GPU, where memory is
// mapped and kernels are loaded, more than on the host.
void warm_up(Smoother& smoother) {
  const Mesh mesh = warm_up_mesh(smoother.device_space().total_bytes > 0 ? 22 : 2);
  const std::vector<NodeId> moved = {0};
  const std::vector<Vec3d> there = {{-0.1, 0, 0}};
  for_each_method([&](const Method& method) {
    SmoothOptions options;
    options.method = method;
    options.max_iterations = 2;
    JobInput input;
    if (is_motion(method)) input.prescribed = {moved, std::span(there)};
    Mesh copy = mesh;
    smoother.smooth(copy, options, {}, input);
  });
}

// Released blocks are kept for the next jobs, up to a limit: fresh pages cost a good part of an
// upload. For GPUs they are page-locked as well.
std::unique_ptr<StagingMemory> make_job_memory(std::string_view backend,
                                               std::size_t max_idle_bytes) {
  constexpr std::size_t kReadyBytes = 64 << 20;  // a job of half a million nodes
  if (auto staging = make_staging_memory(backend, max_idle_bytes, host_memory(), kReadyBytes)) {
    return staging;
  }
  return std::make_unique<StagingMemory>(
      StagingMemory::PageLock{[](void*, std::size_t) { return true; }, [](void*) {}},
      max_idle_bytes, host_memory());
}

}  // namespace

Resources acquire_resources(ServerConfig config, const SmootherFactory& factory) {
  Resources result;
  const int cores = available_cores();
  if (config.threads_per_lane == 0) config.threads_per_lane = cores;
  // All lanes share one thread pool, which may be set larger than the number of cores.
  result.threads = std::make_unique<ThreadLimit>(std::max(cores, config.threads_per_lane));
  if (factory) {
    const std::size_t count = std::max<std::size_t>(1, chosen_devices(config).size());
    while (result.devices.size() < count) result.devices.push_back(device_with(factory()));
  } else if (config.backend == "auto" && chosen_devices(config).empty()) {
    result.devices = find_devices(config, result.passed_over);
  } else {
    for (const std::string& name : named_backends(config)) {
      result.devices.push_back(device_with(make(config, name)));
    }
  }
  const std::string backend = result.devices.front().backend;
  config.lanes = lane_count(config, backend);
  for (Device& device : result.devices) {
    while (device.smoothers.size() <
           static_cast<std::size_t>(config.lanes + config.reserved_lanes)) {
      device.smoothers.push_back(factory ? factory() : make(config, device.backend));
    }
    if (!factory && config.warm_up) {
      for (const auto& smoother : device.smoothers) warm_up(*smoother);
    }
  }

  fill_in_host_bytes(config);
  result.limits.host_bytes = config.host_memory_limit_bytes;
  for (const Device& device : result.devices) {
    result.limits.device_bytes.push_back(
        device_limit(config, device.smoothers.front()->device_space()));
  }
  const std::int64_t most = *std::ranges::max_element(result.limits.device_bytes);
  config.device_bytes = most == INT64_MAX ? 0 : most;
  result.staging = make_job_memory(backend, static_cast<std::size_t>(config.idle_pinned_bytes));
  result.resident_bytes = process_stats().resident_bytes;
  std::vector<std::string> backends;
  for (const Device& device : result.devices) backends.push_back(device.backend);
  result.make_smoother = [factory, config, backends](int device) {
    return factory ? factory() : make(config, backends[static_cast<std::size_t>(device)]);
  };
  result.config = std::move(config);
  return result;
}

}  // namespace meshsmooth::server
