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

/// Structured lines on standard error, as text (key=value) or JSON objects. Mesh data and tokens
/// are never logged.
/// `level` is debug, info, warn, error or off; off until set. `format` is text or
/// json.
void set_log(const std::string& level, const std::string& format);

/// The complete configuration. `passed_over`: why better backends are not used; a
/// warning unless empty.
void log_start(const ServerConfig& config, const std::vector<std::string>& backends, int port,
               int admin_port, const std::string& passed_over);
/// The line for a job that has ended.
void log_job_end(const Job& job);
/// A call was refused before it had a job.
void log_refused(const std::exception_ptr& error, const std::string& traceparent);
/// A call had no valid credentials.
void log_denied(const Error& error, const std::string& peer);
/// A connection was ended because of what its peer sends.
void log_cut(const std::string& peer, const std::string& why);
void log_error(const std::string& event, const std::string& message);
void log_warning(const std::string& event, const std::string& message);
void log_event(const std::string& event);

}  // namespace meshsmooth::server
