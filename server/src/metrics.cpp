#include "metrics.hpp"

#include <prometheus/counter.h>
#include <prometheus/histogram.h>
#include <prometheus/metric_family.h>
#include <prometheus/registry.h>

#include <chrono>

#include "error_text.hpp"
#include "job.hpp"
#include "stage_times.hpp"

namespace meshsmooth::server {
namespace {

using prometheus::Counter;
using prometheus::Family;
using prometheus::Histogram;

// The buckets of OpenTelemetry for call durations, extended to ten minutes.
const Histogram::BucketBoundaries kSeconds = {0.005, 0.01, 0.025, 0.05, 0.075, 0.1, 0.25,
                                              0.5,   0.75, 1,     2.5,  5,     7.5, 10,
                                              30,    60,   120,   300,  600};

}  // namespace

struct Metrics::Impl {
  prometheus::Registry registry;

  Family<Counter>& jobs = prometheus::BuildCounter()
                              .Name("meshsmooth_jobs_total")
                              .Help("Ended jobs and refused calls, by outcome and reason")
                              .Register(registry);
  Family<Counter>& denied = prometheus::BuildCounter()
                                .Name("meshsmooth_denied_calls_total")
                                .Help("Calls without valid credentials")
                                .Register(registry);
  Counter& iterations = add_counter("meshsmooth_iterations_total", "Sweeps over all meshes");
  Counter& nodes = add_counter("meshsmooth_nodes_total", "Nodes of all smoothed meshes");
  Counter& received = add_counter("meshsmooth_received_bytes_total", "Received mesh data in bytes");
  Counter& sent = add_counter("meshsmooth_sent_bytes_total", "Sent result data in bytes");
  Histogram& queue_wait =
      prometheus::BuildHistogram()
          .Name("meshsmooth_queue_wait_seconds")
          .Help("Time from the end of the upload to the start of the job in seconds")
          .Register(registry)
          .Add({}, kSeconds);
  Histogram& job_seconds = prometheus::BuildHistogram()
                               .Name("meshsmooth_job_seconds")
                               .Help("Time from admission to the end of successful jobs in seconds")
                               .Register(registry)
                               .Add({}, kSeconds);
  Family<Histogram>& stages = prometheus::BuildHistogram()
                                  .Name("meshsmooth_stage_seconds")
                                  .Help("Time of each step of successful jobs in seconds")
                                  .Register(registry);

  Impl() {
    count(std::string(job_state_name(JobState::succeeded)),
          "");  // so that the first job increments a 0
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
    impl_->observe_stage("receive", now.times.receive_seconds());
    for (const auto& [stage, seconds] : kStageTimes) {
      impl_->observe_stage(stage, now.summary->times.*seconds);
    }
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

std::vector<prometheus::MetricFamily> Metrics::collect() const { return impl_->registry.Collect(); }

}  // namespace meshsmooth::server
