#include "metrics.hpp"

#include <prometheus/counter.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <sstream>
#include <utility>
#include <vector>

#include "engine.hpp"
#include "error_text.hpp"
#include "job.hpp"
#include "process_stats.hpp"

namespace meshsmooth::server {
namespace {

using prometheus::ClientMetric;
using prometheus::Counter;
using prometheus::Family;
using prometheus::Histogram;
using prometheus::MetricFamily;
using prometheus::MetricType;

// OpenTelemetry's for the duration of calls, on to the ten minutes that a job may take.
const Histogram::BucketBoundaries kSeconds = {0.005, 0.01, 0.025, 0.05, 0.075, 0.1, 0.25,
                                              0.5,   0.75, 1,     2.5,  5,     7.5, 10,
                                              30,    60,   120,   300,  600};

/// A family whose values are looked up when they are asked for.
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
      Reading("meshsmooth_build_info", "1, with what runs here as labels")
          .add(1, {{"version", MESHSMOOTH_VERSION}, {"commit", MESHSMOOTH_BUILD_COMMIT}})
          .take());
  families.push_back(Reading("process_resident_memory_bytes", "Memory in use")
                         .add(static_cast<double>(stats.resident_bytes))
                         .take());
  families.push_back(Reading("process_cpu_seconds_total", "Time on all cores, user and system",
                             MetricType::Counter)
                         .add(stats.cpu_seconds)
                         .take());
  families.push_back(Reading("process_open_fds", "Open file descriptors")
                         .add(static_cast<double>(stats.open_descriptors))
                         .take());
  families.push_back(Reading("process_threads", "Threads of the process")
                         .add(static_cast<double>(stats.threads))
                         .take());
}

void read_jobs(const Engine& engine, std::vector<MetricFamily>& families) {
  std::array<int, kJobStateNames.size()> in_state{};
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

  Reading living("meshsmooth_jobs", "Jobs that have not ended, by state");
  for (const JobState state :
       {JobState::receiving, JobState::queued, JobState::running, JobState::sending}) {
    living.add(in_state[static_cast<std::size_t>(state)],
               {{"state", std::string(job_state_name(state))}});
  }
  families.push_back(living.take());
  constexpr std::array kPriorities = {"batch", "normal", "interactive"};
  Reading depth("meshsmooth_queue_depth", "Jobs that wait for a lane");
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    depth.add(waiting[i], {{"priority", kPriorities[i]}});
  }
  families.push_back(depth.take());
  families.push_back(
      Reading("meshsmooth_queue_oldest_seconds", "How long the oldest of them has waited")
          .add(oldest)
          .take());
}

void read_equipment(const Engine& engine, std::vector<MetricFamily>& families) {
  families.push_back(Reading("meshsmooth_streams", "Smooth calls under way that have a job")
                         .add(engine.call_count())
                         .take());

  const MemoryBytes reserved = engine.ledger().reserved();
  const MemoryBytes limit = engine.ledger().limit();
  Reading reserved_bytes("meshsmooth_reserved_bytes", "Memory promised to jobs");
  Reading limit_bytes("meshsmooth_reserved_limit_bytes", "Memory that may be promised to jobs");
  reserved_bytes.add(static_cast<double>(reserved.host_bytes), {{"space", "host"}});
  limit_bytes.add(static_cast<double>(limit.host_bytes), {{"space", "host"}});
  for (std::size_t i = 0; i < engine.devices().size(); ++i) {
    if (limit.device_bytes[i] == INT64_MAX) continue;  // it works in the host's
    const std::vector<prometheus::ClientMetric::Label> labels{{"space", "device"},
                                                              {"device", engine.devices()[i]}};
    reserved_bytes.add(static_cast<double>(reserved.device_bytes[i]), labels);
    limit_bytes.add(static_cast<double>(limit.device_bytes[i]), labels);
  }
  families.push_back(reserved_bytes.take());
  families.push_back(limit_bytes.take());
  families.push_back(Reading("meshsmooth_memory_ceiling_bytes",
                             "What the process takes at most of the host's memory")
                         .add(static_cast<double>(engine.memory_ceiling_bytes()))
                         .take());

  Reading busy("meshsmooth_lane_busy_seconds_total", "Time that the lane had a job",
               MetricType::Counter);
  int broken = 0;
  for (std::size_t i = 0; i < engine.lanes().size(); ++i) {
    const Lane& lane = *engine.lanes()[i];
    busy.add(lane.busy_seconds(),
             {{"device", engine.devices()[lane.device()]}, {"lane", std::to_string(i)}});
    if (lane.broken()) ++broken;
  }
  families.push_back(busy.take());
  families.push_back(
      Reading("meshsmooth_lanes", "Lanes that take jobs, and those that lost their device")
          .add(static_cast<double>(engine.lanes().size()) - broken, {{"state", "working"}})
          .add(broken, {{"state", "broken"}})
          .take());
}

void read_topologies(const TopologyCache& cache, std::vector<MetricFamily>& families) {
  const auto add = [&](const char* name, const char* help, auto value, MetricType type) {
    families.push_back(Reading(std::string("meshsmooth_topology_cache_") + name, help, type)
                           .add(static_cast<double>(value))
                           .take());
  };
  add("hits_total", "Jobs that named a topology which was there", cache.hit_count(),
      MetricType::Counter);
  add("misses_total", "Jobs that named one which was not", cache.miss_count(), MetricType::Counter);
  add("evictions_total", "Topologies that went for want of room", cache.eviction_count(),
      MetricType::Counter);
  add("bytes", "Memory of the topologies that are there", cache.bytes(), MetricType::Gauge);
  add("entries", "Topologies that are there", cache.size(), MetricType::Gauge);
}

}  // namespace

struct Metrics::Impl {
  prometheus::Registry registry;

  Family<Counter>& jobs = prometheus::BuildCounter()
                              .Name("meshsmooth_jobs_total")
                              .Help("Jobs that are over, and calls refused before they were one")
                              .Register(registry);
  Family<Counter>& denied = prometheus::BuildCounter()
                                .Name("meshsmooth_denied_calls_total")
                                .Help("Calls whose caller was not let in")
                                .Register(registry);
  Counter& iterations = add_counter("meshsmooth_iterations_total", "Sweeps over meshes");
  Counter& nodes = add_counter("meshsmooth_nodes_total", "Nodes of the meshes smoothed");
  Counter& received =
      add_counter("meshsmooth_received_bytes_total", "Bytes of meshes that came in chunks");
  Counter& sent =
      add_counter("meshsmooth_sent_bytes_total", "Bytes of positions that went in chunks");
  Histogram& queue_wait = prometheus::BuildHistogram()
                              .Name("meshsmooth_queue_wait_seconds")
                              .Help("From the last byte to a lane")
                              .Register(registry)
                              .Add({}, kSeconds);
  Histogram& job_seconds = prometheus::BuildHistogram()
                               .Name("meshsmooth_job_seconds")
                               .Help("From admission to the end, of jobs that succeeded")
                               .Register(registry)
                               .Add({}, kSeconds);
  Family<Histogram>& stages = prometheus::BuildHistogram()
                                  .Name("meshsmooth_stage_seconds")
                                  .Help("Of jobs that succeeded, step by step")
                                  .Register(registry);

  Impl() {
    count(std::string(job_state_name(JobState::succeeded)),
          "");  // so that the first is an increase from 0
  }

  Counter& add_counter(const std::string& name, const std::string& help) {
    return prometheus::BuildCounter().Name(name).Help(help).Register(registry).Add({});
  }

  Counter& count(const std::string& outcome, const std::string& reason) {
    return jobs.Add({{"outcome", outcome}, {"reason", reason}});
  }

  void observe_stage(const std::string& stage, double seconds) {
    stages.Add({{"stage", stage}}, kSeconds).Observe(seconds);
  }
};

Metrics::Metrics() : impl_(std::make_unique<Impl>()) {}
Metrics::~Metrics() = default;

void Metrics::job_ended(const Job& job) {
  const JobSnapshot now = job.snapshot();
  if (now.times.started) impl_->queue_wait.Observe(now.times.queue_seconds());
  if (now.summary) {
    impl_->iterations.Increment(now.summary->convergence.iteration_count);
    impl_->nodes.Increment(static_cast<double>(now.summary->nodes.total));
  }
  if (now.state == JobState::succeeded && now.summary) {
    const StageTimes& times = now.summary->times;
    impl_->observe_stage("receive", now.times.receive_seconds());
    impl_->observe_stage("upload", times.upload_seconds);
    impl_->observe_stage("find_neighbours", times.find_neighbours_seconds);
    impl_->observe_stage("find_boundary", times.find_boundary_seconds);
    impl_->observe_stage("iterate", times.iterate_seconds);
    impl_->observe_stage("evaluate", times.evaluate_seconds);
    impl_->observe_stage("download", times.download_seconds);
    impl_->observe_stage("send", now.times.send_seconds());
    impl_->job_seconds.Observe(
        std::chrono::duration<double>(*now.times.ended - now.times.admitted).count());
  }
  impl_->count(std::string(job_state_name(now.state)), error_text(now.error).reason).Increment();
}

void Metrics::refused(const std::exception_ptr& error) {
  impl_->count("refused", error_text(error).reason).Increment();
}

void Metrics::denied(const std::string& reason) {
  impl_->denied.Add({{"reason", reason}}).Increment();
}

void Metrics::received(std::int64_t bytes) {
  impl_->received.Increment(static_cast<double>(bytes));
}

void Metrics::sent(std::int64_t bytes) { impl_->sent.Increment(static_cast<double>(bytes)); }

std::string expose_metrics(const Engine* engine) {
  std::vector<MetricFamily> families;
  read_process(families);
  if (engine != nullptr) {
    read_jobs(*engine, families);
    read_equipment(*engine, families);
    read_topologies(engine->topologies(), families);
    std::ranges::move(engine->metrics().impl_->registry.Collect(), std::back_inserter(families));
  }
  std::ostringstream text;
  prometheus::TextSerializer().Serialize(text, families);
  return std::move(text).str();
}

}  // namespace meshsmooth::server
