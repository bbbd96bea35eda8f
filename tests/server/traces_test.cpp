#include <gtest/gtest.h>
#include <httplib.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "meshsmooth/error.hpp"
#include "smooth_call.hpp"
#include "support/http.hpp"
#include "support/in_process_server.hpp"

namespace meshsmooth::testing {
namespace {

using nlohmann::json;

/// Takes what is sent to /v1/traces, and answers with a status.
class Collector {
 public:
  explicit Collector(int status = 200) : status_(status) {
    server_.Post("/v1/traces", [this](const httplib::Request& request, httplib::Response& answer) {
      {
        const std::lock_guard lock(mutex_);
        ++requests_;
        headers_ = {request.headers.begin(), request.headers.end()};
        answer.status = status_;
        if (status_ == 200) take(json::parse(request.body));
      }
      changed_.notify_all();
    });
    port_ = server_.bind_to_any_port("127.0.0.1");
    thread_ = std::thread([this] { server_.listen_after_bind(); });
  }
  ~Collector() {
    server_.stop();
    thread_.join();
  }

  [[nodiscard]] std::string endpoint() const {
    return "http://127.0.0.1:" + std::to_string(port_) + "/v1/traces";
  }
  void answer(int status) {
    const std::lock_guard lock(mutex_);
    status_ = status;
  }
  /// Waits for so many roots of traces, and what is below them.
  std::vector<json> wait_for_jobs(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return jobs_ >= count; });
    return spans_;
  }
  void wait_for_requests(int count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return requests_ >= count; });
  }
  [[nodiscard]] std::multimap<std::string, std::string> headers() {
    const std::lock_guard lock(mutex_);
    return headers_;
  }
  [[nodiscard]] json resource() {
    const std::lock_guard lock(mutex_);
    return resource_;
  }

 private:
  void take(const json& body) {
    const json& of_resource = body.at("resourceSpans").at(0);
    resource_ = of_resource.at("resource").at("attributes");
    for (const json& span : of_resource.at("scopeSpans").at(0).at("spans")) {
      spans_.push_back(span);
      if (span.at("kind") == 2) ++jobs_;
    }
  }

  httplib::Server server_;
  int port_ = 0;
  std::thread thread_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int status_;
  int requests_ = 0;
  std::size_t jobs_ = 0;
  std::vector<json> spans_;
  std::multimap<std::string, std::string> headers_;
  json resource_;
};

server::ServerConfig traced_config(const Collector& collector) {
  server::ServerConfig config = quiet_config();
  config.traces.endpoint = collector.endpoint();
  config.traces.resource = {{"service.name", "mesh"}};
  config.traces.delay = std::chrono::milliseconds(1);
  return config;
}

void smooth(InProcessServer& server, const std::string& traceparent = "") {
  Stub stub(server.channel());
  SmoothCall call(stub, {},
                  traceparent.empty() ? Metadata{} : Metadata{{"traceparent", traceparent}});
  call.send_all({});
  call.finish();
}

std::map<std::string, json> by_name(const std::vector<json>& spans) {
  std::map<std::string, json> named;
  for (const json& span : spans) named[span.at("name")] = span;
  return named;
}

std::int64_t time_of(const json& span, const char* key) {
  return std::stoll(span.at(key).get<std::string>());
}

const std::string kTrace = "4bf92f3577b34da6a3ce929d0e0e4736";
const std::string kParent = "00f067aa0ba902b7";

TEST(Traces, HaveTheStagesOfAJobBelowItsCaller) {
  Collector collector;
  server::ServerConfig config = traced_config(collector);
  config.traces.headers = {{"Authorization", "Bearer a"}};
  InProcessServer server(config);

  smooth(server, "00-" + kTrace + "-" + kParent + "-01");

  const auto spans = by_name(collector.wait_for_jobs(1));
  const json& job = spans.at("optimize");
  EXPECT_EQ(job.at("parentSpanId"), kParent);
  EXPECT_EQ(job.at("kind"), 2);
  EXPECT_FALSE(job.contains("status"));
  for (const char* step : {"receive", "queue", "run"}) {
    EXPECT_EQ(spans.at(step).at("parentSpanId"), job.at("spanId")) << step;
  }
  for (const char* stage :
       {"upload", "find_neighbours", "find_boundary", "iterate", "evaluate", "download"}) {
    EXPECT_EQ(spans.at(stage).at("parentSpanId"), spans.at("run").at("spanId")) << stage;
  }
  for (const auto& [name, span] : spans) {
    EXPECT_EQ(span.at("traceId"), kTrace) << name;
    EXPECT_EQ(span.at("spanId").get<std::string>().size(), 16U) << name;
    EXPECT_LE(time_of(span, "startTimeUnixNano"), time_of(span, "endTimeUnixNano")) << name;
    EXPECT_GE(time_of(span, "startTimeUnixNano"), time_of(job, "startTimeUnixNano")) << name;
  }
  EXPECT_EQ(collector.resource().at(0).at("value").at("stringValue"), "mesh");
  EXPECT_EQ(collector.headers().find("Authorization")->second, "Bearer a");
}

TEST(Traces, TellWhyAJobFailed) {
  Collector collector;
  InProcessServer server(traced_config(collector));
  server.fake().fail_with([] { throw InvalidMesh("MESH_TANGLED", "element 7 is inverted"); });

  smooth(server);

  const auto spans = by_name(collector.wait_for_jobs(1));
  const json& job = spans.at("optimize");
  EXPECT_FALSE(job.contains("parentSpanId"));
  EXPECT_EQ(job.at("status").at("code"), 2);
  EXPECT_EQ(job.at("status").at("message"), "element 7 is inverted");
  EXPECT_FALSE(spans.contains("iterate"));
}

TEST(Traces, AreThoseThatTheCallerSamples) {
  Collector collector;
  InProcessServer server(traced_config(collector));

  smooth(server, "00-" + kTrace + "-" + kParent + "-00");
  smooth(server, "00-11111111111111111111111111111111-" + kParent + "-01");

  for (const json& span : collector.wait_for_jobs(1)) EXPECT_NE(span.at("traceId"), kTrace);
}

TEST(Traces, OfTheOthersAShareBySampler) {
  Collector collector;
  server::ServerConfig config = traced_config(collector);
  config.traces.ratio = 0.5;
  InProcessServer server(config);

  smooth(server, "00-" + kTrace + "-" + kParent + "-01");  // its caller decides
  EXPECT_EQ(collector.wait_for_jobs(1).front().at("traceId"), kTrace);

  server::ServerConfig by_id = traced_config(collector);
  by_id.traces.parent_decides = false;
  by_id.traces.ratio = 0.5;
  InProcessServer other(by_id);
  smooth(other, "00-111111111111111111ffffffffffffff-" + kParent + "-01");
  smooth(other, "00-22222222222222222200000000000001-" + kParent + "-00");
  for (const json& span : collector.wait_for_jobs(2)) {
    EXPECT_NE(span.at("traceId").get<std::string>().front(), '1');
  }
}

// A collector that is away keeps nobody waiting, and gets what there is room for once it is back.
TEST(Traces, WaitForACollectorThatDoesNotAnswer) {
  Collector collector(503);
  server::ServerConfig config = traced_config(collector);
  config.admin_listen = "127.0.0.1:0";
  config.traces.max_queued_spans = 25;  // two jobs and some
  InProcessServer server(config);

  for (int i = 0; i < 4; ++i) smooth(server, "00-" + kTrace + "-" + kParent + "-01");
  constexpr double kSpansOfAJob = 11;
  const auto count = [&](const std::string& outcome) {
    const auto metrics = parse_metrics(http_get(server.server().admin_port(), "/metrics").text);
    return metrics.at("meshsmooth_spans_total{outcome=\"" + outcome + "\"}");
  };
  while (count("dropped") < kSpansOfAJob) collector.wait_for_requests(1);
  EXPECT_EQ(count("sent"), 0);
  collector.answer(200);

  collector.wait_for_jobs(2);
  while (count("sent") + count("dropped") < 4 * kSpansOfAJob) collector.wait_for_requests(1);
  EXPECT_GE(count("sent"), 2 * kSpansOfAJob);
}

TEST(Traces, AreSentBeforeTheServerEnds) {
  Collector collector;
  server::ServerConfig config = traced_config(collector);
  config.traces.delay = std::chrono::hours(1);
  InProcessServer server(config);
  smooth(server);

  server.drain();

  EXPECT_FALSE(collector.wait_for_jobs(1).empty());
}

}  // namespace
}  // namespace meshsmooth::testing
