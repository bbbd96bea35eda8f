#include "metrics_page.hpp"

#include <prometheus/client_metric.h>
#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <iterator>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "engine.hpp"
#include "job.hpp"
#include "process_stats.hpp"

namespace meshsmooth::server {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

/// A metric family whose values are read when the page is requested.
class Reading {
 public:
  Reading(std::string name, std::string help, MetricType type = MetricType::Gauge)
      : family_{std::move(name), std::move(help), type, {}} {}

  Reading& add(double value, std::vector<ClientMetric::Label> labels = {}) {
    ClientMetric metric;
    metric.label = std::move(labels);
    (family_.type == MetricType::Counter ? metric.counter.value : metric.gauge.value) = value;
    family_.metric.push_back(std::move(metric));
    return *this;
  }
  [[nodiscard]] MetricFamily take() { return std::move(family_); }

 private:
  MetricFamily family_;
};

double seconds_since(Clock::time_point time) {
  return std::chrono::duration<double>(Clock::now() - time).count();
}

void read_process(std::vector<MetricFamily>& families) {
  const ProcessStats stats = process_stats();
  families.push_back(
      Reading("meshsmooth_build_info", "Constant 1, labelled with version and commit")
          .add(1, {{"version", MESHSMOOTH_VERSION}, {"commit", MESHSMOOTH_BUILD_COMMIT}})
          .take());
  families.push_back(Reading("process_resident_memory_bytes", "Resident memory size in bytes")
                         .add(static_cast<double>(stats.resident_bytes))
                         .take());
  families.push_back(Reading("process_cpu_seconds_total",
                             "Total user and system CPU time in seconds", MetricType::Counter)
                         .add(stats.cpu_seconds)
                         .take());
  families.push_back(Reading("process_open_fds", "Number of open file descriptors")
                         .add(static_cast<double>(stats.open_descriptors))
                         .take());
  families.push_back(Reading("process_threads", "Number of threads of the process")
                         .add(static_cast<double>(stats.threads))
                         .take());
}

void read_jobs(const Engine& engine, std::vector<MetricFamily>& families) {
  std::array<int, kEnumNames<JobState>.size()> in_state{};
  std::array<int, 3> waiting{};
  double oldest = 0;
  for (const auto& job : engine.store().living()) {
    const JobSnapshot now = job->snapshot();
    if (has_ended(now.state)) continue;
    ++in_state[static_cast<std::size_t>(now.state)];
    if (now.state != JobState::queued) continue;
    ++waiting[static_cast<std::size_t>(job->request().priority)];
    oldest = std::max(oldest, seconds_since(*now.times.queued));
  }

  Reading living("meshsmooth_jobs", "Unfinished jobs by state");
  for (const JobState state :
       {JobState::receiving, JobState::queued, JobState::running, JobState::sending}) {
    living.add(in_state[static_cast<std::size_t>(state)],
               {{"state", std::string(job_state_name(state))}});
  }
  families.push_back(living.take());
  Reading depth("meshsmooth_queue_depth", "Jobs waiting for a lane, by priority");
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    depth.add(waiting[i], {{"priority", std::string(kEnumNames<Priority>[i])}});
  }
  families.push_back(depth.take());
  families.push_back(
      Reading("meshsmooth_queue_oldest_seconds", "Waiting time of the oldest queued job in seconds")
          .add(oldest)
          .take());
}

void read_resources(const Engine& engine, std::vector<MetricFamily>& families) {
  families.push_back(Reading("meshsmooth_streams", "Calls in progress that have a job")
                         .add(engine.call_count())
                         .take());

  const MemoryBytes reserved = engine.memory_budget().reserved();
  const MemoryBytes limit = engine.memory_budget().limit();
  Reading reserved_bytes("meshsmooth_reserved_bytes", "Memory reserved for jobs in bytes");
  Reading limit_bytes("meshsmooth_reserved_limit_bytes",
                      "Limit of the memory reserved for jobs in bytes");
  reserved_bytes.add(static_cast<double>(reserved.host_bytes), {{"space", "host"}});
  limit_bytes.add(static_cast<double>(limit.host_bytes), {{"space", "host"}});
  for (std::size_t i = 0; i < engine.devices().size(); ++i) {
    if (limit.device_bytes[i] == INT64_MAX) continue;  // it computes in host memory
    const std::vector<prometheus::ClientMetric::Label> labels{{"space", "device"},
                                                              {"device", engine.devices()[i]}};
    reserved_bytes.add(static_cast<double>(reserved.device_bytes[i]), labels);
    limit_bytes.add(static_cast<double>(limit.device_bytes[i]), labels);
  }
  families.push_back(reserved_bytes.take());
  families.push_back(limit_bytes.take());
  families.push_back(Reading("meshsmooth_memory_ceiling_bytes",
                             "Upper bound of the host memory of the process in bytes")
                         .add(static_cast<double>(engine.memory_ceiling_bytes()))
                         .take());

  Reading busy("meshsmooth_lane_busy_seconds_total",
               "Time that the lane has spent on jobs in seconds", MetricType::Counter);
  int broken = 0;
  const auto lanes = engine.lanes();
  for (const auto& lane : lanes) {
    busy.add(lane->busy_seconds(), {{"device", engine.devices()[lane->device()]},
                                    {"lane", std::to_string(lane->number())}});
    if (!lane->in_service()) ++broken;
  }
  families.push_back(busy.take());
  families.push_back(
      Reading("meshsmooth_lanes",
              "Lanes by state: working, or broken because the device is lost or a job hangs")
          .add(static_cast<double>(lanes.size()) - broken, {{"state", "working"}})
          .add(broken, {{"state", "broken"}})
          .take());
}

void read_topologies(const TopologyCache& cache, std::vector<MetricFamily>& families) {
  const auto add = [&](const char* name, const char* help, auto value, MetricType type) {
    families.push_back(Reading(std::string("meshsmooth_topology_cache_") + name, help, type)
                           .add(static_cast<double>(value))
                           .take());
  };
  add("hits_total", "Jobs that named a cached topology", cache.hit_count(), MetricType::Counter);
  add("misses_total", "Jobs that named a topology that is not cached", cache.miss_count(),
      MetricType::Counter);
  add("evictions_total", "Topologies evicted to free memory", cache.eviction_count(),
      MetricType::Counter);
  add("bytes", "Memory of cached topologies in bytes", cache.bytes(), MetricType::Gauge);
  add("entries", "Number of cached topologies", cache.size(), MetricType::Gauge);
}

void read_transport(const Transport& transport, std::vector<MetricFamily>& families) {
  if (transport.max_bytes() == 0) return;
  const Transport::Bytes bytes = transport.bytes();
  families.push_back(Reading("meshsmooth_shared_memory_bytes",
                             "Memory shared with callers in bytes: leased, or ended but still "
                             "mapped by its caller")
                         .add(static_cast<double>(bytes.leased), {{"state", "leased"}})
                         .add(static_cast<double>(bytes.ended), {{"state", "ended"}})
                         .take());
}

void read_traces(const SpanExporter& traces, std::vector<MetricFamily>& families) {
  const SpanExporter::Counts counts = traces.counts();
  families.push_back(Reading("meshsmooth_spans_total",
                             "Spans of jobs that a collector of traces took, or that were dropped",
                             MetricType::Counter)
                         .add(static_cast<double>(counts.sent), {{"outcome", "sent"}})
                         .add(static_cast<double>(counts.dropped), {{"outcome", "dropped"}})
                         .take());
}

}  // namespace

std::string metrics_page(const Engine* engine) {
  std::vector<MetricFamily> families;
  read_process(families);
  if (engine != nullptr) {
    read_jobs(*engine, families);
    read_resources(*engine, families);
    read_topologies(engine->topologies(), families);
    read_transport(engine->transport(), families);
    read_traces(engine->traces(), families);
    std::ranges::move(engine->metrics().collect(), std::back_inserter(families));
  }
  std::ostringstream text;
  prometheus::TextSerializer().Serialize(text, families);
  return std::move(text).str();
}

}  // namespace meshsmooth::server
