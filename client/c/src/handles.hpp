#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <utility>

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

/// Hands a report to a caller who wants it. Made before a result is written, which nothing may
/// follow that fails.
inline std::unique_ptr<meshsmooth_report> make_report(meshsmooth_report** wanted,
                                                      client::SmoothReport report) {
  return wanted != nullptr ? std::make_unique<meshsmooth_report>(std::move(report)) : nullptr;
}

}  // namespace meshsmooth::c
