#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace meshsmooth::server {

/// Where the spans of jobs go, over HTTP in JSON, and of which jobs: what the variables OTEL_… of
/// OpenTelemetry say.
struct TraceSettings {
  using Pairs = std::vector<std::pair<std::string, std::string>>;

  std::string endpoint = "";  // "http://collector:4318/v1/traces"; empty: nowhere
  Pairs headers = {};         // of each request
  Pairs resource = {};        // attributes of this server, with service.name
  /// Whether a caller's traceparent decides; otherwise, and for jobs without one, `ratio` does.
  bool parent_decides = true;
  double ratio = 1;                           // of traces that are sampled
  std::chrono::milliseconds timeout{10'000};  // of a request
  std::chrono::milliseconds delay{5'000};     // between two requests, unless one is full
  std::size_t max_queued_spans = 2048;        // further jobs are not sent
  std::size_t max_batch_spans = 512;          // of a request
};

}  // namespace meshsmooth::server
