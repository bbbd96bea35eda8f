#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "mesh.hpp"
#include "meshsmooth.h"
#include "meshsmooth/client.hpp"

/// A client, which its sessions share: they may be freed in any order.
struct meshsmooth_client {
  std::shared_ptr<meshsmooth::client::Client> client;
};

/// A report; its JSON is written when it is asked for.
struct meshsmooth_report {
  explicit meshsmooth_report(meshsmooth::client::SmoothReport its_report)
      : report(std::move(its_report)) {}

  meshsmooth::client::SmoothReport report;
  mutable std::once_flag json_written;
  mutable std::string json;
};

namespace meshsmooth::c {

/// Hands a job's positions and its report, where that is wanted, to the caller: both or neither.
inline void hand_over(client::SmoothReport job, const PositionsView& positions, void* result,
                      meshsmooth_report** report) {
  // Made first, as it may fail.
  std::unique_ptr<meshsmooth_report> made;
  if (report != nullptr) made = std::make_unique<meshsmooth_report>(std::move(job));
  write_positions(positions, result);
  if (report != nullptr) *report = made.release();
}

}  // namespace meshsmooth::c
