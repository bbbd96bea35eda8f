#pragma once

#include <exception>
#include <string>

namespace meshsmooth::server {

class Job;
struct ServerConfig;

/// Structured lines (key=value) on standard error. Never a byte of a mesh.
/// `level` is debug, info, warn, error or off; off until set.
void set_log_level(const std::string& level);

/// `passed_over`: why better backends do not run; a warning unless empty.
void log_start(const ServerConfig& config, const std::string& backend, int port, int admin_port,
               const std::string& passed_over);
/// The one line of a job.
void log_job_end(const Job& job);
/// Work was refused before it became a job.
void log_refused(const std::exception_ptr& error);
void log_error(const std::string& event, const std::string& message);
void log_event(const std::string& event);

}  // namespace meshsmooth::server
