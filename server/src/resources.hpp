#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "memory_budget.hpp"
#include "meshsmooth/server.hpp"
#include "meshsmooth/server_config.hpp"
#include "meshsmooth/smoother.hpp"
#include "meshsmooth/staging_memory.hpp"

namespace meshsmooth::server {

/// Makes another smoother of a device.
using MakeSmoother = std::function<std::unique_ptr<Smoother>(int device)>;

/// What the settings mean on this machine: backends, memory and threads.
struct Resources {
  /// A GPU, or the host as the one device of the CPU backend.
  struct Device {
    std::string backend;                               // "cuda:0", "cpu"
    std::vector<std::unique_ptr<Smoother>> smoothers;  // one per lane
  };

  ServerConfig config;                   // with the defaults that depend on the machine filled in
  std::unique_ptr<ThreadLimit> threads;  // shared by all lanes
  std::vector<Device> devices;
  MakeSmoother make_smoother;
  MemoryBytes limits;                      // for all jobs
  std::string passed_over;                 // why backends that "auto" prefers are not used
  std::unique_ptr<StagingMemory> staging;  // for the arrays of meshes
  std::int64_t resident_bytes = 0;         // of the process, once all this exists
};

/// Builds and warms up the smoothers: by `factory` if there is one, else for `config.backend`.
/// Throws what either throws, and InvalidOption (OPTION_OUT_OF_RANGE) when so many lanes leave no
/// device memory for jobs.
[[nodiscard]] Resources acquire_resources(ServerConfig config, const SmootherFactory& factory);

}  // namespace meshsmooth::server
