#include "traces/span.hpp"

#include <cstdint>
#include <nlohmann/json.hpp>

namespace meshsmooth::server {
namespace {

using nlohmann::json;

// Protobuf's JSON has 64-bit integers as strings.
json value_of(const LogValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return {{"stringValue", *text}};
  if (const auto* flag = std::get_if<bool>(&value)) return {{"boolValue", *flag}};
  if (const auto* number = std::get_if<double>(&value)) return {{"doubleValue", *number}};
  return {{"intValue", std::to_string(std::get<std::int64_t>(value))}};
}

json nanoseconds_of(Span::Time time) { return std::to_string(time.time_since_epoch().count()); }

json json_of(const Span& span, const std::string& trace_id) {
  constexpr int kInternal = 1, kServer = 2;  // SpanKind
  constexpr int kError = 2;                  // Status.StatusCode
  json object = {{"traceId", trace_id},
                 {"spanId", span.span_id},
                 {"name", span.name},
                 {"kind", span.of_server ? kServer : kInternal},
                 {"startTimeUnixNano", nanoseconds_of(span.begin)},
                 {"endTimeUnixNano", nanoseconds_of(span.end)},
                 {"attributes", json::array()}};
  if (!span.parent_id.empty()) object["parentSpanId"] = span.parent_id;
  for (const auto& [key, value] : span.attributes) {
    object["attributes"].push_back({{"key", key}, {"value", value_of(value)}});
  }
  if (!span.error.empty()) object["status"] = {{"code", kError}, {"message", span.error}};
  return object;
}

}  // namespace

std::string to_otlp_json(const std::vector<JobSpans>& jobs, const TraceSettings::Pairs& resource) {
  json attributes = json::array();
  for (const auto& [key, value] : resource) {
    attributes.push_back({{"key", key}, {"value", value_of(value)}});
  }
  json spans = json::array();
  for (const JobSpans& job : jobs) {
    for (const Span& span : job.spans) spans.push_back(json_of(span, job.trace_id));
  }
  const json scope = {{"name", "meshsmooth-server"}, {"version", MESHSMOOTH_VERSION}};
  const json scope_spans = {{"scope", scope}, {"spans", std::move(spans)}};
  const json resource_spans = {{"resource", {{"attributes", std::move(attributes)}}},
                               {"scopeSpans", json::array({scope_spans})}};
  const json body = {{"resourceSpans", json::array({resource_spans})}};
  return body.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace meshsmooth::server
