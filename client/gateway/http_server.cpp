#include "http_server.hpp"

#include <httplib.h>

#include <algorithm>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "answers.hpp"
#include "jobs.hpp"
#include "page.hpp"
#include "problem.hpp"
#include "upload.hpp"

namespace meshsmooth::gateway {
namespace {

using httplib::Request;
using httplib::Response;
using nlohmann::json;

std::unique_ptr<httplib::Server> make_server(const Settings& settings) {
  if (settings.tls_cert.empty()) return std::make_unique<httplib::Server>();
  return std::make_unique<httplib::SSLServer>(settings.tls_cert.c_str(), settings.tls_key.c_str());
}

/// The path of the document that a path of a request is.
std::string declared_path(const std::string& path) {
  constexpr std::string_view kJobs = "/v1/jobs/";
  if (!path.starts_with(kJobs)) return path;
  const std::size_t end = path.find('/', kJobs.size());
  return std::string(kJobs) + "{job}" + (end == std::string::npos ? "" : path.substr(end));
}

}  // namespace

class HttpServer::Impl {
 public:
  explicit Impl(Service& service)
      : service_(service), jobs_(service), server_(make_server(service.settings())) {
    if (!server_->is_valid()) {
      throw std::runtime_error("--listen-tls-cert and --listen-tls-key are no certificate and key");
    }
    const Settings& settings = service.settings();
    server_->new_task_queue = [&settings] {
      return new httplib::ThreadPool(static_cast<std::size_t>(settings.max_connections));
    };
    server_->set_keep_alive_max_count(1);
    server_->set_read_timeout(30, 0);
    server_->set_write_timeout(30, 0);
    server_->set_tcp_nodelay(true);
    server_->set_payload_max_length(std::numeric_limits<std::size_t>::max());  // see read_form
    add_checks();
    add_posts();
    add_gets();
    add_jobs();
    const auto port = settings.port;
    port_ = port == 0 ? server_->bind_to_any_port(settings.host)
                      : (server_->bind_to_port(settings.host, port) ? port : -1);
    if (port_ < 0) {
      throw std::runtime_error("cannot listen on " + settings.host + ":" + std::to_string(port));
    }
  }

  int port() const { return port_; }
  void run() { server_->listen_after_bind(); }
  void stop() { server_->stop(); }

 private:
  void add_checks() {
    server_->set_pre_routing_handler([this](const Request& request, Response& response) {
      const auto path = paths_.find(declared_path(request.path));
      if (path == paths_.end()) {
        set_problem(response, Problem(404, "there is no " + request.path +
                                               " here; /openapi.json "
                                               "lists what there is"));
      } else if (!path->second.contains(request.method)) {
        std::string allowed;
        for (const std::string& method : path->second) {
          allowed += (allowed.empty() ? "" : ", ") + method;
        }
        response.set_header("Allow", allowed);
        set_problem(response, Problem(405, request.path + " has " + allowed + " only"));
      } else {
        return httplib::Server::HandlerResponse::Unhandled;
      }
      return httplib::Server::HandlerResponse::Handled;
    });
    // Of a form that is refused for its size or its caller, its sender need not send a byte.
    server_->set_expect_100_continue_handler([this](const Request& request, Response& response) {
      try {
        check_caller(request);
        const std::string length = request.get_header_value("Content-Length");
        if (std::strtoull(length.c_str(), nullptr, 10) > service_.settings().max_upload_bytes) {
          throw Problem("UPLOAD_TOO_LARGE",
                        "the form has " + length + " bytes, of " +
                            std::to_string(service_.settings().max_upload_bytes) +
                            " that the gateway takes");
        }
        return 100;
      } catch (const Problem& problem) {
        set_problem(response, problem);
        return problem.status();
      }
    });
    server_->set_error_handler([](const Request&, Response& response) {
      if (response.body.empty())
        set_problem(response, Problem(response.status, "no valid request"));
    });
    server_->set_logger([this](const Request& request, const Response& response) {
      // The path and no more of what callers send.
      const json line = {{"event", "request"},
                         {"method", request.method},
                         {"path", declared_path(request.path)},
                         {"status", response.status},
                         {"peer", request.remote_addr}};
      const std::lock_guard lock(log_mutex_);
      std::cerr << to_text(line) << std::endl;
    });
  }

  std::string check_caller(const Request& request) {
    std::string token = bearer_token(request);
    service_.check_token(token);
    return token;
  }

  void add_posts() {
    for (const auto& [path, operation] : read_operations()) {
      server_->Post(path, [this, operation = operation](const Request& request, Response& response,
                                                        const httplib::ContentReader& content) {
        answering([&](const Request&, Response&) { post(operation, request, response, content); })(
            request, response);
      });
    }
  }

  void post(const Operation& operation, const Request& request, Response& response,
            const httplib::ContentReader& content) {
    std::shared_ptr<Service::Place> place;
    auto folder = std::make_unique<RequestFolder>(service_.work());
    Order order;
    order.operation = operation;
    order.parameters = {request.params.begin(), request.params.end()};
    try {
      order.token = check_caller(request);
      order.traceparent = request.get_header_value("traceparent");
      place = service_.admit();
      (void)to_flags(operation, order.parameters);
    } catch (const Problem& problem) {
      // Read to its end where that is near: who sends first and reads then would miss the answer.
      std::uint64_t left = std::uint64_t{16} << 20;
      const auto drop = [&](const char*, std::size_t size) {
        left -= std::min<std::uint64_t>(left, size);
        return left > 0;
      };
      if (request.is_multipart_form_data()) {
        content([](const httplib::MultipartFormData&) { return true; }, drop);
      } else {
        content(drop);
      }
      set_problem(response, problem);
      return;
    }
    read_form(request, content, service_, *folder, order);
    if (operation.can_be_job && request.get_header_value("Prefer") == "respond-async") {
      const auto job = jobs_.start(std::move(order), std::move(folder), std::move(place));
      response.status = 202;
      response.set_header("Location", "/v1/jobs/" + job->id());
      response.set_header("Preference-Applied", "respond-async");
      response.set_content(to_text(job->to_json()) + "\n", kJson);
      return;
    }
    Interruptions interruptions;
    interruptions.peer = find_connection(request);
    if (interruptions.peer < 0)
      throw Problem("CANCELLED_BY_CLIENT", "the caller closed the connection");
    const Outcome outcome = service_.run(order, *folder, interruptions, [](const json&) {});
    if (!outcome.quality.empty()) {
      set_file(response, *folder / outcome.quality, kJson, place);
    } else if (!outcome.report.empty()) {
      set_report(response, *folder, outcome, place);
    } else {
      set_mesh(response, *folder, outcome, place);
    }
  }

  void add_gets() {
    server_->Get("/", [](const Request&, Response& response) {
      response.set_header("Content-Security-Policy", std::string(page_policy));
      response.set_content(page_html.data(), page_html.size(), kHtml);
    });
    server_->Get("/openapi.json", [](const Request&, Response& response) {
      response.set_content(openapi_document.data(), openapi_document.size(), kJson);
    });
    server_->Get("/healthz", [](const Request&, Response& response) {
      response.set_content("ok\n", "text/plain");
    });
    server_->Get("/readyz", answering([this](const Request&, Response& response) {
                   if (service_.is_draining())
                     throw Problem("DRAINING", "the gateway is shutting down");
                   if (!service_.is_ready())
                     throw Problem("UNAVAILABLE", "the server does not serve");
                   response.set_content("ok\n", "text/plain");
                 }));
  }

  void add_jobs() {
    const auto on_job = [this](auto function) {
      return answering([this, function](const Request& request, Response& response) {
        function(jobs_.find(request.matches[1], check_caller(request)), response);
      });
    };
    using Job = std::shared_ptr<KeptJob>;
    server_->Get("/v1/jobs/([0-9a-f]+)", on_job([](const Job& job, Response& response) {
                   response.set_content(to_text(job->to_json()) + "\n", kJson);
                 }));
    server_->Get("/v1/jobs/([0-9a-f]+)/result", on_job([](const Job& job, Response& response) {
                   set_mesh(response, job->folder(), job->outcome(), job);
                 }));
    server_->Get("/v1/jobs/([0-9a-f]+)/report", on_job([](const Job& job, Response& response) {
                   set_report(response, job->folder(), job->outcome(), job);
                 }));
    server_->Get("/v1/jobs/([0-9a-f]+)/summary", on_job([](const Job& job, Response& response) {
                   set_file(response, job->folder() / job->outcome().summary, kJson, job);
                 }));
    server_->Get("/v1/jobs/([0-9a-f]+)/events", on_job([this](const Job& job, Response& response) {
                   response.set_header("Cache-Control", "no-store");
                   response.set_chunked_content_provider(
                       "text/event-stream", [this, job, version = std::uint64_t{0}](
                                                std::size_t, httplib::DataSink& sink) mutable {
                         return send_event(*job, version, sink);
                       });
                 }));
    server_->Delete("/v1/jobs/([0-9a-f]+)",
                    answering([this](const Request& request, Response& response) {
                      jobs_.remove(request.matches[1], check_caller(request));
                      response.status = 204;
                    }));
  }

  /// The next event, or a comment by which a caller who is gone is noticed.
  bool send_event(const KeptJob& job, std::uint64_t& version, httplib::DataSink& sink) const {
    const std::uint64_t newest = job.wait(version, std::chrono::seconds(1));
    std::string text = ": waiting\n\n";
    const bool ended = job.has_ended();
    if (newest != version || ended) {
      text = std::string("event: ") + (ended ? "end" : "progress") +
             "\ndata: " + to_text(job.to_json()) + "\n\n";
    }
    version = newest;
    if (!sink.write(text.data(), text.size())) return false;
    if (ended || service_.stopped().requested()) sink.done();
    return true;
  }

  Service& service_;
  JobStore jobs_;
  const std::map<std::string, std::set<std::string>> paths_ = read_paths();
  std::mutex log_mutex_;
  std::unique_ptr<httplib::Server> server_;
  int port_ = -1;
};

HttpServer::HttpServer(Service& service) : impl_(std::make_unique<Impl>(service)) {}
HttpServer::~HttpServer() = default;
int HttpServer::port() const { return impl_->port(); }
void HttpServer::run() { impl_->run(); }
void HttpServer::stop() { impl_->stop(); }

}  // namespace meshsmooth::gateway
