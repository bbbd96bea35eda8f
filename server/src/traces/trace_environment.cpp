#include "traces/trace_environment.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <string_view>

#include "config.hpp"

namespace meshsmooth::server {
namespace {

using Lookup = std::function<std::string(const std::string& name)>;

[[noreturn]] void throw_wrong(const std::string& name, const std::string& value,
                              const std::string& what) {
  throw_wrong_setting(name, "\"" + value + "\": " + what);
}

/// The number of a variable in [least, most], or `otherwise` if it is not set.
template <class Number>
Number number(const Lookup& variable, const std::string& name, Number least, Number most,
              Number otherwise) {
  const std::string text = variable(name);
  if (text.empty()) return otherwise;
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < least || value > most) {
    throw_wrong(name, text,
                "must be a number from " + std::to_string(least) + " to " + std::to_string(most));
  }
  return value;
}

std::string_view trimmed(std::string_view text) {
  const auto is_space = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

/// "%2C" is ','.
std::string percent_decoded(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned byte = 0;
    const char* const end = text.data() + std::min(i + 3, text.size());
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(text.data() + i + 1, end, byte, 16).ptr == end) {
      decoded += static_cast<char>(byte);
      i += 2;
    } else {
      decoded += text[i];
    }
  }
  return decoded;
}

/// "key=value,key=value", values percent-encoded, as W3C's Baggage.
TraceSettings::Pairs pairs(const Lookup& variable, const std::string& name) {
  const std::string text = variable(name);
  TraceSettings::Pairs found;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    const std::string_view item = trimmed(rest.substr(0, comma));
    rest.remove_prefix(std::min(comma + 1, rest.size()));
    if (item.empty()) continue;
    const std::size_t equals = item.find('=');
    const std::string_view key = trimmed(item.substr(0, equals));
    // Headers may hold credentials: the value is not shown.
    if (equals == item.npos || key.empty()) throw_wrong(name, "…", "must be key=value,key=value");
    found.emplace_back(key, percent_decoded(trimmed(item.substr(equals + 1))));
  }
  return found;
}

/// The variable of traces where it is set, else that of all signals: OTEL_EXPORTER_OTLP_….
std::string name_of(const Lookup& variable, const std::string& what) {
  std::string of_traces = "OTEL_EXPORTER_OTLP_TRACES_" + what;
  return variable(of_traces).empty() ? "OTEL_EXPORTER_OTLP_" + what : of_traces;
}

std::string read_endpoint(const Lookup& variable) {
  const std::string name = name_of(variable, "ENDPOINT");
  std::string text = variable(name);
  if (text.empty()) return text;
  if (name == "OTEL_EXPORTER_OTLP_ENDPOINT") {
    while (text.ends_with('/')) text.pop_back();
    text += "/v1/traces";
  }
  if (!text.starts_with("http://") && !text.starts_with("https://")) {
    throw_wrong(name, text, "must begin with http:// or https://");
  }
  return text;
}

void read_sampler(const Lookup& variable, TraceSettings& traces) {
  constexpr std::string_view kParentBased = "parentbased_";
  const std::string name = "OTEL_TRACES_SAMPLER";
  const std::string text = variable(name);
  if (text.empty()) return;
  std::string_view root = text;
  traces.parent_decides = root.starts_with(kParentBased);
  if (traces.parent_decides) root.remove_prefix(kParentBased.size());
  if (root == "traceidratio") {
    traces.ratio = number(variable, "OTEL_TRACES_SAMPLER_ARG", 0.0, 1.0, 1.0);
  } else if (root == "always_on" || root == "always_off") {
    traces.ratio = root == "always_on" ? 1 : 0;
  } else {
    throw_wrong(name, text,
                "must be always_on, always_off or traceidratio, with or without parentbased_");
  }
}

bool is_off(const Lookup& variable) {
  std::string disabled = variable("OTEL_SDK_DISABLED");
  std::ranges::transform(disabled, disabled.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::string exporter = variable("OTEL_TRACES_EXPORTER");
  if (disabled == "true" || exporter == "none") return true;
  if (!exporter.empty() && exporter != "otlp") {
    throw_wrong("OTEL_TRACES_EXPORTER", exporter, "must be otlp or none");
  }
  return false;
}

void check_protocol(const Lookup& variable) {
  const std::string name = name_of(variable, "PROTOCOL");
  const std::string protocol = variable(name);
  // Receivers of OTLP take both encodings at one address.
  if (protocol.empty() || protocol == "http/json" || protocol == "http/protobuf") return;
  throw_wrong(name, protocol,
              "must be http/json or http/protobuf, sent as JSON to either's address");
}

}  // namespace

TraceSettings read_trace_settings(const Lookup& variable) {
  TraceSettings traces;
  if (is_off(variable)) return traces;
  traces.endpoint = read_endpoint(variable);
  if (traces.endpoint.empty()) return traces;
  check_protocol(variable);
  read_sampler(variable, traces);
  traces.headers = pairs(variable, name_of(variable, "HEADERS"));
  traces.resource = pairs(variable, "OTEL_RESOURCE_ATTRIBUTES");
  const std::string service = variable("OTEL_SERVICE_NAME");
  const auto named = [](const auto& pair) { return pair.first == "service.name"; };
  if (!service.empty()) std::erase_if(traces.resource, named);
  if (std::ranges::none_of(traces.resource, named)) {
    traces.resource.emplace_back("service.name", service.empty() ? "meshsmooth-server" : service);
  }

  constexpr std::int64_t kDay = 86'400'000;
  using std::chrono::milliseconds;
  traces.timeout = milliseconds(number<std::int64_t>(variable, name_of(variable, "TIMEOUT"), 1,
                                                     kDay, traces.timeout.count()));
  traces.delay = milliseconds(
      number<std::int64_t>(variable, "OTEL_BSP_SCHEDULE_DELAY", 1, kDay, traces.delay.count()));
  traces.max_queued_spans =
      number<std::size_t>(variable, "OTEL_BSP_MAX_QUEUE_SIZE", 1, 1 << 20, traces.max_queued_spans);
  traces.max_batch_spans = number<std::size_t>(variable, "OTEL_BSP_MAX_EXPORT_BATCH_SIZE", 1,
                                               1 << 20, traces.max_batch_spans);
  return traces;
}

}  // namespace meshsmooth::server
