#pragma once

#include <string>

namespace meshsmooth::server {

class Engine;

/// All metrics in Prometheus' text format: what was counted, and the current state of the engine;
/// without an engine only those of the process. docs/operations.md lists the names.
/// O(unfinished jobs).
[[nodiscard]] std::string metrics_page(const Engine* engine);

}  // namespace meshsmooth::server
