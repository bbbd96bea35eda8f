#include "log.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <utility>
#include <variant>

#include "config.hpp"
#include "error_text.hpp"
#include "job.hpp"
#include "log_fields.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

using spdlog::level::level_enum;

std::atomic<bool> in_json = false;

spdlog::logger& logger() {
  static const std::shared_ptr<spdlog::logger> instance = [] {
    auto made = std::make_shared<spdlog::logger>(
        "meshsmooth", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
    made->set_level(spdlog::level::off);
    made->flush_on(spdlog::level::debug);
    return made;
  }();
  return *instance;
}

void write(level_enum level, const LogFields& fields) {
  if (!logger().should_log(level)) return;
  logger().log(level, spdlog::string_view_t(in_json ? to_json(fields) : to_text(fields)));
}

// Whoever can connect can cause a line for each call. Beyond so many a second they are counted
// only.
class LineLimit {
 public:
  /// Whether a line may be written; `suppressed`: how many were not since the last one.
  bool take(std::int64_t& suppressed) {
    constexpr int kLinesPerSecond = 10;
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (now - begin_ >= std::chrono::seconds(1)) {
      begin_ = now;
      lines_ = 0;
    }
    if (lines_ == kLinesPerSecond) {
      ++suppressed_;
      return false;
    }
    ++lines_;
    suppressed = std::exchange(suppressed_, 0);
    return true;
  }

 private:
  std::mutex mutex_;
  std::chrono::steady_clock::time_point begin_;
  int lines_ = 0;
  std::int64_t suppressed_ = 0;
};

void write_limited(LineLimit& limit, level_enum level, LogFields fields) {
  std::int64_t suppressed = 0;
  if (!limit.take(suppressed)) return;
  if (suppressed > 0) fields.emplace_back("suppressed", suppressed);
  write(level, fields);
}

void add_error(LogFields& fields, const ErrorText& error) {
  fields.emplace_back("reason", error.reason);
  fields.emplace_back("message", error.message);
}

}  // namespace

void set_log(const std::string& level, const std::string& format) {
  in_json = format == "json";
  logger().set_pattern(in_json ? R"({"time":"%Y-%m-%dT%H:%M:%S.%e%z","level":"%l",%v})"
                               : "%Y-%m-%dT%H:%M:%S.%e%z %l %v");
  logger().set_level(spdlog::level::from_str(level));
}

void log_start(const ServerConfig& config, const std::vector<std::string>& backends, int port,
               int admin_port, const std::string& passed_over) {
  std::string backend;
  for (const std::string& name : backends) backend += (backend.empty() ? "" : ",") + name;
  LogFields fields = {{"event", "start"},
                      {"version", MESHSMOOTH_VERSION},
                      {"running_backend", backend},
                      {"port", std::int64_t{port}},
                      {"admin_port", std::int64_t{admin_port}}};
  if (!passed_over.empty()) {
    fields.emplace_back("message", "jobs run on " + backend + "; " + passed_over);
  }
  for (auto& [key, value] : list_settings(config)) {
    std::ranges::replace(key, '-', '_');
    fields.emplace_back(std::move(key), std::move(value));
  }
  write(passed_over.empty() ? spdlog::level::info : spdlog::level::warn, fields);
}

void log_job_end(const Job& job) {
  const JobSnapshot now = job.snapshot();
  const JobRequest& request = job.request();
  LogFields fields = {{"event", "job_end"},
                      {"job", job.name()},
                      {"caller", request.caller},
                      {"outcome", std::string(job_state_name(now.state))}};
  const ErrorText error = error_text(now.error);
  if (now.error) add_error(fields, error);
  fields.insert(fields.end(), {{"request_id", request.request_id},
                               {"nodes", request.layout.node_count},
                               {"elements", request.layout.element_count()},
                               {"method", std::string(method_name(request.options.method))},
                               {"mesh_bytes", request.layout.total_bytes()},
                               {"reserved_bytes", job.reserved_bytes().host_bytes},
                               {"reserved_device_bytes", job.reserved_bytes().device_bytes},
                               {"receive_seconds", now.times.receive_seconds()},
                               {"queue_seconds", now.times.queue_seconds()},
                               {"run_seconds", now.times.run_seconds()},
                               {"send_seconds", now.times.send_seconds()}});
  if (now.summary) {
    fields.insert(fields.end(),
                  {{"backend", now.summary->backend},
                   {"iterations", std::int64_t{now.summary->convergence.iteration_count}},
                   {"inverted_before", now.summary->quality_before.inverted_count},
                   {"inverted_after", now.summary->quality_after.inverted_count}});
  }
  if (!request.traceparent.empty()) fields.emplace_back("traceparent", request.traceparent);
  const bool bug = now.error && !error.ours;
  write(bug ? spdlog::level::err : spdlog::level::info, fields);
}

void log_refused(const std::exception_ptr& error, const std::string& traceparent) {
  const ErrorText text = error_text(error);
  LogFields fields = {{"event", "refused"}};
  add_error(fields, text);
  if (!traceparent.empty()) fields.emplace_back("traceparent", traceparent);
  static LineLimit limit;
  if (text.ours) {
    write_limited(limit, spdlog::level::warn, std::move(fields));
  } else {
    write(spdlog::level::err, fields);
  }
}

void log_denied(const Error& error, const std::string& peer) {
  static LineLimit limit;
  write_limited(limit, spdlog::level::warn,
                {{"event", "denied"}, {"reason", error.reason()}, {"peer", peer}});
}

void log_cut(const std::string& peer, const std::string& why) {
  static LineLimit limit;
  write_limited(limit, spdlog::level::warn, {{"event", "cut"}, {"peer", peer}, {"message", why}});
}

void log_event(const std::string& event) { write(spdlog::level::info, {{"event", event}}); }

void log_warning(const std::string& event, const std::string& message) {
  write(spdlog::level::warn, {{"event", event}, {"message", message}});
}

void log_error(const std::string& event, const std::string& message) {
  write(spdlog::level::err, {{"event", event}, {"message", message}});
}

}  // namespace meshsmooth::server
