#include "traces/trace_environment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;
using Variables = std::map<std::string, std::string>;

TraceSettings read(const Variables& variables) {
  return read_trace_settings([&](const std::string& name) {
    const auto found = variables.find(name);
    return found == variables.end() ? "" : found->second;
  });
}

std::string error_of(Variables variables) {
  variables.emplace("OTEL_EXPORTER_OTLP_ENDPOINT", "http://collector:4318");
  try {
    (void)read(variables);
  } catch (const InvalidOption& error) {
    return error.what();
  }
  return "";
}

TEST(TraceEnvironment, SendsNothingWithoutAnEndpointOrWhereItIsSwitchedOff) {
  const std::string endpoint = "OTEL_EXPORTER_OTLP_ENDPOINT";
  EXPECT_EQ(read({}).endpoint, "");
  EXPECT_EQ(read({{"OTEL_SERVICE_NAME", "a"}, {"OTEL_TRACES_SAMPLER", "always_on"}}).endpoint, "");
  EXPECT_EQ(read({{endpoint, "http://a:1"}, {"OTEL_SDK_DISABLED", "TRUE"}}).endpoint, "");
  EXPECT_EQ(read({{endpoint, "http://a:1"}, {"OTEL_TRACES_EXPORTER", "none"}}).endpoint, "");
  EXPECT_EQ(read({{endpoint, "http://a:1"}, {"OTEL_TRACES_EXPORTER", "otlp"}}).endpoint,
            "http://a:1/v1/traces");
}

TEST(TraceEnvironment, AddsThePathToTheCommonEndpointAlone) {
  const std::string all = "OTEL_EXPORTER_OTLP_ENDPOINT";
  const std::string traces = "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT";
  EXPECT_EQ(read({{all, "https://a:1/x/"}}).endpoint, "https://a:1/x/v1/traces");
  EXPECT_EQ(read({{all, "http://a:1"}, {traces, "http://b:2/y"}}).endpoint, "http://b:2/y");
}

TEST(TraceEnvironment, DecodesHeadersAndAttributes) {
  const TraceSettings traces =
      read({{"OTEL_EXPORTER_OTLP_ENDPOINT", "http://a:1"},
            {"OTEL_EXPORTER_OTLP_HEADERS", "authorization=a%20b%2C, x = 1"},
            {"OTEL_RESOURCE_ATTRIBUTES", "service.name=n,host=%zz"},
            {"OTEL_SERVICE_NAME", "mesh"}});
  EXPECT_THAT(traces.headers, UnorderedElementsAre(Pair("authorization", "a b,"), Pair("x", "1")));
  EXPECT_THAT(traces.resource,
              UnorderedElementsAre(Pair("service.name", "mesh"), Pair("host", "%zz")));
  EXPECT_THAT(read({{"OTEL_EXPORTER_OTLP_ENDPOINT", "http://a:1"}}).resource,
              UnorderedElementsAre(Pair("service.name", "meshsmooth-server")));
}

TEST(TraceEnvironment, ReadsSamplersAndLimits) {
  Variables variables = {{"OTEL_EXPORTER_OTLP_ENDPOINT", "http://a:1"},
                         {"OTEL_TRACES_SAMPLER", "parentbased_traceidratio"},
                         {"OTEL_TRACES_SAMPLER_ARG", "0.25"},
                         {"OTEL_EXPORTER_OTLP_TIMEOUT", "70"},
                         {"OTEL_BSP_SCHEDULE_DELAY", "80"},
                         {"OTEL_BSP_MAX_QUEUE_SIZE", "90"},
                         {"OTEL_BSP_MAX_EXPORT_BATCH_SIZE", "60"}};
  TraceSettings traces = read(variables);
  EXPECT_TRUE(traces.parent_decides);
  EXPECT_EQ(traces.ratio, 0.25);
  EXPECT_EQ(traces.timeout.count(), 70);
  EXPECT_EQ(traces.delay.count(), 80);
  EXPECT_EQ(traces.max_queued_spans, 90U);
  EXPECT_EQ(traces.max_batch_spans, 60U);
  variables["OTEL_TRACES_SAMPLER"] = "always_off";
  traces = read(variables);
  EXPECT_FALSE(traces.parent_decides);
  EXPECT_EQ(traces.ratio, 0);
}

TEST(TraceEnvironment, NamesAVariableThatItCannotObey) {
  for (const auto& [name, value] :
       Variables{{"OTEL_EXPORTER_OTLP_PROTOCOL", "grpc"},
                 {"OTEL_EXPORTER_OTLP_TRACES_PROTOCOL", "grpc"},
                 {"OTEL_EXPORTER_OTLP_TRACES_TIMEOUT", "soon"},
                 {"OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "collector:4317"},
                 {"OTEL_TRACES_EXPORTER", "zipkin"},
                 {"OTEL_TRACES_SAMPLER", "jaeger_remote"},
                 {"OTEL_EXPORTER_OTLP_HEADERS", "secret"},
                 {"OTEL_BSP_MAX_QUEUE_SIZE", "many"},
                 {"OTEL_EXPORTER_OTLP_TIMEOUT", "0"}}) {
    EXPECT_THAT(error_of({{name, value}}), HasSubstr(name)) << value;
  }
  EXPECT_THAT(error_of({{"OTEL_EXPORTER_OTLP_HEADERS", "secret"}}),
              ::testing::Not(HasSubstr("secret")));
  EXPECT_EQ(error_of({{"OTEL_EXPORTER_OTLP_PROTOCOL", "http/protobuf"}}), "");
}

}  // namespace
}  // namespace meshsmooth::server
