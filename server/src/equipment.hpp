#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "ledger.hpp"
#include "meshsmooth/server.hpp"
#include "meshsmooth/server_config.hpp"
#include "meshsmooth/smoother.hpp"
#include "meshsmooth/staging_memory.hpp"

namespace meshsmooth::server {

/// What the settings come to on this machine.
struct Equipment {
  /// A GPU, or the host as the one device of the CPU backend.
  struct Device {
    std::string backend;                               // "cuda:0", "cpu"
    std::vector<std::unique_ptr<Smoother>> smoothers;  // one a lane
  };

  ServerConfig config;                   // with every 0 that stands for a default filled in
  std::unique_ptr<ThreadLimit> threads;  // of all lanes
  std::vector<Device> devices;
  MemoryBytes limits;                      // for all jobs
  std::string passed_over;                 // why backends that "auto" prefers do not run
  std::unique_ptr<StagingMemory> staging;  // for the arrays of meshes
  std::int64_t resident_bytes = 0;         // of the process, once all this is there
};

/// Builds and warms up the smoothers. `factory`: of every lane, instead of
/// `config.backend`. Throws what it or `make_smoother` throws, and InvalidOption
/// (OPTION_OUT_OF_RANGE) when so many lanes leave a job no device memory.
[[nodiscard]] Equipment equip(ServerConfig config, const SmootherFactory& factory);

}  // namespace meshsmooth::server
