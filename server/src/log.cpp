#include "log.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <exception>
#include <memory>

#include "config.hpp"
#include "job.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::server {
namespace {

spdlog::logger& logger() {
  static const std::shared_ptr<spdlog::logger> instance = [] {
    auto made = std::make_shared<spdlog::logger>(
        "meshsmooth", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
    made->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
    made->set_level(spdlog::level::off);
    made->flush_on(spdlog::level::debug);
    return made;
  }();
  return *instance;
}

struct ErrorText {
  std::string reason;
  std::string message;
  bool ours = false;  // not a bug
};

ErrorText error_text(const std::exception_ptr& error) {
  if (!error) return {};
  try {
    std::rethrow_exception(error);
  } catch (const Error& e) {
    return {.reason = e.reason(), .message = e.what(), .ours = true};
  } catch (const std::exception& e) {
    return {.reason = "INTERNAL", .message = e.what(), .ours = false};
  } catch (...) {
    return {.reason = "INTERNAL", .message = "unknown exception", .ours = false};
  }
}

}  // namespace

void set_log_level(const std::string& level) { logger().set_level(spdlog::level::from_str(level)); }

void log_start(const ServerConfig& config, const std::string& backend, int port,
               const std::string& passed_over) {
  std::string line = fmt::format("event=start running_backend={} port={} ", backend, port);
  if (!passed_over.empty())
    line += fmt::format("message=\"jobs run on {}; {}\" ", backend, passed_over);
  for (const auto& [key, value] : list_settings(config)) {
    std::visit([&](const auto& v) { line += fmt::format("{}={} ", key, v); }, value);
  }
  logger().log(passed_over.empty() ? spdlog::level::info : spdlog::level::warn, line);
}

void log_job_end(const Job& job) {
  const JobSnapshot now = job.snapshot();
  const JobRequest& request = job.request();
  const ErrorText error = error_text(now.error);
  std::string line = fmt::format(
      "event=job_end job={} request_id=\"{}\" state={} nodes={} elements={} method={} "
      "reserved_bytes={} receive_seconds={:.6f} queue_seconds={:.6f} run_seconds={:.6f} "
      "send_seconds={:.6f}",
      job.name(), request.request_id, state_name(now.state), request.layout.node_count,
      request.layout.element_count(), method_name(request.options.method),
      job.reserved_bytes().host_bytes, now.times.receive_seconds(), now.times.queue_seconds(),
      now.times.run_seconds(), now.times.send_seconds());
  if (now.summary) {
    line += fmt::format(" backend={} iterations={} inverted_before={} inverted_after={}",
                        now.summary->backend, now.summary->convergence.iteration_count,
                        now.summary->quality_before.inverted_count,
                        now.summary->quality_after.inverted_count);
  }
  if (now.error) line += fmt::format(" reason={} message=\"{}\"", error.reason, error.message);
  const bool bug = now.error && !error.ours;
  logger().log(bug ? spdlog::level::err : spdlog::level::info, line);
}

void log_refused(const std::exception_ptr& error) {
  const ErrorText text = error_text(error);
  logger().log(text.ours ? spdlog::level::warn : spdlog::level::err,
               "event=refused reason={} message=\"{}\"", text.reason, text.message);
}

void log_event(const std::string& event) { logger().info("event={}", event); }

void log_error(const std::string& event, const std::string& message) {
  logger().error("event={} message=\"{}\"", event, message);
}

}  // namespace meshsmooth::server
