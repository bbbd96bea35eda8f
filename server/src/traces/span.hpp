#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "log_fields.hpp"
#include "meshsmooth/trace_settings.hpp"

namespace meshsmooth::server {

/// One step of a job, or the job itself, as OpenTelemetry has them.
struct Span {
  using Time = std::chrono::sys_time<std::chrono::nanoseconds>;

  std::string name;
  std::string span_id;     // 16 hex digits
  std::string parent_id;   // the same; empty: none
  bool of_server = false;  // answers a call
  Time begin, end;
  LogFields attributes = {};
  std::string error = "";  // why it failed; empty: it did not
};

/// The spans of one job, which belong to one trace.
struct JobSpans {
  std::string trace_id;  // 32 hex digits
  std::vector<Span> spans;
};

/// The body of an ExportTraceServiceRequest in OTLP's JSON. Bytes that are no UTF-8 are replaced.
[[nodiscard]] std::string to_otlp_json(const std::vector<JobSpans>& jobs,
                                       const TraceSettings::Pairs& resource);

}  // namespace meshsmooth::server
