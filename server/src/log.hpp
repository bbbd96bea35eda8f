#pragma once

#include <exception>
#include <string>
#include <vector>

namespace meshsmooth {
class Error;
}

namespace meshsmooth::server {

class Job;
struct ServerConfig;

/// Structured lines on standard error: as text (key=value) or as JSON objects.
/// Never a byte of a mesh, never a token.
/// `level` is debug, info, warn, error or off; off until set. `format` is text or
/// json.
void set_log(const std::string& level, const std::string& format);

/// The whole configuration. `passed_over`: why better backends do not run; a
/// warning unless empty.
void log_start(const ServerConfig& config, const std::vector<std::string>& backends, int port,
               int admin_port, const std::string& passed_over);
/// The one line of a job.
void log_job_end(const Job& job);
/// Work was refused before it became a job.
void log_refused(const std::exception_ptr& error, const std::string& traceparent);
/// A caller was not let in.
void log_denied(const Error& error, const std::string& peer);
void log_error(const std::string& event, const std::string& message);
void log_event(const std::string& event);

}  // namespace meshsmooth::server
