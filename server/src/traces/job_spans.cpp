#include "traces/job_spans.hpp"

#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <utility>

#include "error_text.hpp"
#include "job.hpp"
#include "stage_times.hpp"

namespace meshsmooth::server {
namespace {

struct Parent {
  std::string trace_id;
  std::string span_id;
  bool sampled = false;
};

// is_traceparent holds: version-trace-parent-flags, of which the last bit says "sampled".
Parent parse(const std::string& traceparent) {
  int flags = 0;
  std::from_chars(traceparent.data() + 53, traceparent.data() + 55, flags, 16);
  return {traceparent.substr(3, 32), traceparent.substr(36, 16), (flags & 1) != 0};
}

/// By the trace's id, so that all services decide alike for a trace.
bool in_ratio(const std::string& trace_id, double ratio) {
  constexpr std::size_t kDigits = 14;
  std::uint64_t value = 0;
  std::from_chars(trace_id.data() + trace_id.size() - kDigits, trace_id.data() + trace_id.size(),
                  value, 16);
  return static_cast<double>(value) < std::ldexp(ratio, 4 * kDigits);
}

/// Times of the steady clock as those of the wall, by the job's admission.
class WallClock {
 public:
  explicit WallClock(const JobTimes& times)
      : wall_(std::chrono::time_point_cast<std::chrono::nanoseconds>(times.created)),
        steady_(times.admitted) {}
  [[nodiscard]] Span::Time at(Clock::time_point time) const { return wall_ + (time - steady_); }

 private:
  Span::Time wall_;
  Clock::time_point steady_;
};

class Builder {
 public:
  Builder(const JobSnapshot& job, const MakeId& make_id)
      : times_(job.times), clock_(job.times), make_id_(make_id) {}

  std::string add_whole(const std::string& name, const std::string& parent) {
    return add(name, clock_.at(times_.admitted), clock_.at(*times_.ended), parent);
  }

  /// Up to the job's end if it ended during the step; nothing if the step was not begun.
  std::string add_step(const std::string& name, std::optional<Clock::time_point> begin,
                       std::optional<Clock::time_point> end, const std::string& parent) {
    if (!begin || *begin >= *times_.ended) return {};
    return add(name, clock_.at(*begin), clock_.at(end.value_or(*times_.ended)), parent);
  }

  void add_stages(const StageTimes& stages, const std::string& parent) {
    Span::Time begin = clock_.at(*times_.started);
    for (const auto& [name, seconds] : kStageTimes) {
      const auto duration = std::chrono::duration<double>(stages.*seconds);
      const Span::Time end = begin + std::chrono::duration_cast<std::chrono::nanoseconds>(duration);
      add(name, begin, end, parent);
      begin = end;
    }
  }

  [[nodiscard]] std::vector<Span>& spans() { return spans_; }

 private:
  std::string add(const std::string& name, Span::Time begin, Span::Time end,
                  const std::string& parent) {
    std::string id = make_id_();
    spans_.push_back(
        {.name = name, .span_id = id, .parent_id = parent, .begin = begin, .end = end});
    return id;
  }

  const JobTimes& times_;
  const WallClock clock_;
  const MakeId& make_id_;
  std::vector<Span> spans_;
};

LogFields attributes_of(const Job& job, const JobSnapshot& now) {
  const JobRequest& request = job.request();
  LogFields fields = {{"rpc.system", "grpc"},
                      {"meshsmooth.job", job.name()},
                      {"meshsmooth.request_id", request.request_id},
                      {"meshsmooth.caller", request.caller},
                      {"meshsmooth.method", std::string(method_name(request.options.method))},
                      {"meshsmooth.node_count", request.layout.node_count},
                      {"meshsmooth.element_count", request.layout.element_count()},
                      {"meshsmooth.outcome", std::string(job_state_name(now.state))}};
  if (now.error) fields.emplace_back("error.type", error_text(now.error).reason);
  if (now.summary) {
    fields.insert(fields.end(), {{"meshsmooth.backend", now.summary->backend},
                                 {"meshsmooth.iteration_count",
                                  std::int64_t{now.summary->convergence.iteration_count}}});
  }
  return fields;
}

}  // namespace

std::optional<JobSpans> make_spans(const Job& job, const TraceSettings& settings,
                                   const MakeId& make_id) {
  const std::string& traceparent = job.request().traceparent;
  const Parent parent =
      traceparent.empty() ? Parent{make_id() + make_id(), "", false} : parse(traceparent);
  const bool sampled = settings.parent_decides && !traceparent.empty()
                           ? parent.sampled
                           : in_ratio(parent.trace_id, settings.ratio);
  if (!sampled) return {};

  const JobSnapshot now = job.snapshot();
  const JobTimes& times = now.times;
  Builder builder(now, make_id);
  const std::string root =
      builder.add_whole(std::string(method_name(job.request().options.method)), parent.span_id);
  builder.add_step("receive", times.admitted, times.queued, root);
  builder.add_step("queue", times.queued, times.started, root);
  const std::string run = builder.add_step("run", times.started, times.finished, root);
  if (now.summary && !run.empty()) builder.add_stages(now.summary->times, run);
  builder.add_step("send", times.finished, times.ended, root);

  Span& whole = builder.spans().front();
  whole.of_server = true;
  whole.attributes = attributes_of(job, now);
  if (now.error) whole.error = error_text(now.error).message;
  return JobSpans{parent.trace_id, std::move(builder.spans())};
}

}  // namespace meshsmooth::server
