#include "http_server.hpp"

#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>

#include "answers.hpp"
#include "http/listener.hpp"
#include "jobs.hpp"
#include "page.hpp"
#include "problem.hpp"
#include "upload.hpp"

namespace meshsmooth::gateway {
namespace {

using nlohmann::json;

constexpr std::string_view kJobs = "/v1/jobs/";
/// The path of the document that a path of a request is.
std::string declared_path(const std::string& path) {
  if (!path.starts_with(kJobs)) return path;
  const std::size_t end = path.find('/', kJobs.size());
  return std::string(kJobs) + "{job}" + (end == std::string::npos ? "" : path.substr(end));
}

/// The job that a path names.
std::string job_of(const std::string& path) {
  return path.substr(kJobs.size(), path.find('/', kJobs.size()) - kJobs.size());
}

/// By what callers are told apart; empty: those of this host.
std::string caller_name(const Request& request, const std::string& token) {
  if (!token.empty()) return token;
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(request.peer, error);
  return !error && address.is_loopback() ? std::string() : request.peer;
}

Listener::Options listener_options(const Settings& settings) {
  return {.host = settings.host,
          .port = settings.port,
          .tls_cert = settings.tls_cert,
          .tls_key = settings.tls_key,
          .max_connections = static_cast<std::size_t>(settings.max_connections)};
}

}  // namespace

class HttpServer::Impl {
 public:
  explicit Impl(Service& service)
      : service_(service), jobs_(service), listener_(listener_options(service.settings())) {
    add_gets();
    add_jobs();
  }

  int port() const { return listener_.port(); }
  void stop() { listener_.stop(); }
  void end_transfers() { listener_.end_transfers(); }
  void run() {
    listener_.run([this](Connection& connection) { serve(connection); });
  }

 private:
  using Handler = std::function<Answer(const Request&, Connection&)>;
  using Job = std::shared_ptr<KeptJob>;

  void serve(Connection& connection) {
    Request request;
    Answer answer;
    try {
      if (!connection.read_head(request)) return;
      answer = find_handler(request)(request, connection);
    } catch (const Problem& problem) {
      answer = problem_answer(problem);
      if (problem.status() == 405) answer.headers.emplace_back("Allow", methods_of(request));
    } catch (const std::exception& failure) {
      answer = problem_answer(Problem("INTERNAL", failure.what()));
    }
    log(request, "status", answer.status);
    try {
      connection.send(answer);
    } catch (const std::exception& failure) {  // without memory, say
      log(request, "failure", failure.what());
    }
  }

  /// The path and no more of what callers send.
  template <class Value>
  void log(const Request& request, const char* key, const Value& value) {
    const json line = {{"event", "request"},
                       {"method", request.method},
                       {"path", declared_path(request.path)},
                       {key, value},
                       {"peer", request.peer}};
    const std::lock_guard lock(log_mutex_);
    std::cerr << to_text(line) << std::endl;
  }

  std::string methods_of(const Request& request) const {
    std::string methods;
    for (const std::string& method : paths_.at(declared_path(request.path))) {
      methods += (methods.empty() ? "" : ", ") + method;
    }
    return methods;
  }

  Handler find_handler(const Request& request) {
    const std::string path = declared_path(request.path);
    const auto methods = paths_.find(path);
    if (methods == paths_.end()) {
      throw Problem(404,
                    "there is no " + request.path + " here; /openapi.json lists what there is");
    }
    if (!methods->second.contains(request.method)) {
      throw Problem(405, request.path + " has " + methods_of(request) + " only");
    }
    if (const auto found = handlers_.find({request.method, path}); found != handlers_.end()) {
      return found->second;
    }
    return [this, &operation = operations_.at(path)](const Request& form, Connection& connection) {
      return post(operation, form, connection);
    };
  }

  std::string check_caller(const Request& request) const {
    std::string token = bearer_token(request);
    service_.check_token(token);
    return token;
  }

  Answer post(const Operation& operation, const Request& request, Connection& connection) {
    Order order;
    order.operation = operation;
    order.parameters = request.parameters;
    order.token = check_caller(request);
    order.caller = caller_name(request, order.token);
    order.traceparent = request.header("traceparent");
    (void)to_flags(operation, order.parameters);
    check_length(connection, service_.settings());
    (void)service_.admit(order.caller);  // who cannot have a place need not send
    auto folder = std::make_unique<RequestFolder>(service_.work());
    read_form(connection, request, service_, *folder, order);
    connection.begin_work();
    auto place = service_.admit(order.caller);
    if (operation.can_be_job && request.header("Prefer") == "respond-async") {
      const Job job = jobs_.start(std::move(order), std::move(folder), std::move(place));
      Answer answer = json_answer(job->to_json());
      answer.status = 202;
      answer.headers = {{"Location", std::string(kJobs) + job->id()},
                        {"Preference-Applied", "respond-async"}};
      return answer;
    }
    Interruptions interruptions;
    interruptions.peer = connection.descriptor();
    const Outcome outcome = service_.run(order, *folder, interruptions, [](const json&) {});
    if (!outcome.quality.empty()) return file_answer(*folder / outcome.quality, kJson);
    return outcome.report.empty() ? mesh_answer(*folder, outcome) : report_answer(*folder, outcome);
  }

  void add_gets() {
    handlers_[{"GET", "/"}] = [](const Request&, Connection&) {
      Answer answer = text_answer(page_html, kHtml);
      answer.headers.emplace_back("Content-Security-Policy", page_policy);
      return answer;
    };
    handlers_[{"GET", "/openapi.json"}] = [](const Request&, Connection&) {
      return text_answer(openapi_document, kJson);
    };
    handlers_[{"GET", "/healthz"}] = [](const Request&, Connection&) {
      return text_answer("ok\n", "text/plain");
    };
    handlers_[{"GET", "/readyz"}] = [this](const Request&, Connection&) {
      if (service_.is_draining()) throw Problem("DRAINING", "the gateway is shutting down");
      if (!service_.is_ready()) throw Problem("UNAVAILABLE", "the server does not serve");
      return text_answer("ok\n", "text/plain");
    };
  }

  void add_jobs() {
    const auto add = [this](const std::string& part, Answer (*answer)(const Job&)) {
      handlers_[{"GET", std::string(kJobs) + "{job}" + part}] =
          [this, answer](const Request& request, Connection&) { return answer(find(request)); };
    };
    add("", [](const Job& job) { return json_answer(job->to_json()); });
    add("/result", [](const Job& job) { return mesh_answer(job->folder(), job->outcome(), job); });
    add("/report",
        [](const Job& job) { return report_answer(job->folder(), job->outcome(), job); });
    add("/summary", [](const Job& job) {
      return file_answer(job->folder() / job->outcome().summary, kJson, job);
    });
    handlers_[{"GET", std::string(kJobs) + "{job}/events"}] = [this](const Request& request,
                                                                     Connection&) {
      Answer answer = text_answer("", "text/event-stream");
      answer.headers.emplace_back("Cache-Control", "no-store");
      answer.next_piece = [this, job = find(request),
                           version = std::uint64_t{0}](std::string& piece) mutable {
        return next_event(*job, version, piece);
      };
      return answer;
    };
    handlers_[{"DELETE", std::string(kJobs) + "{job}"}] = [this](const Request& request,
                                                                 Connection&) {
      jobs_.remove(job_of(request.path), check_caller(request));
      Answer answer;
      answer.status = 204;
      return answer;
    };
  }

  Job find(const Request& request) {
    return jobs_.find(job_of(request.path), check_caller(request));
  }

  /// An event, or a comment by which a caller who is gone is noticed.
  bool next_event(const KeptJob& job, std::uint64_t& version, std::string& piece) const {
    const std::uint64_t newest = job.wait(version, std::chrono::seconds(1));
    const bool ended = job.has_ended();
    piece = ": waiting\n\n";
    if (newest != version || ended) {
      piece = std::string("event: ") + (ended ? "end" : "progress") +
              "\ndata: " + to_text(job.to_json()) + "\n\n";
    }
    version = newest;
    return !ended && !service_.stopped().requested();
  }

  Service& service_;
  JobStore jobs_;
  Listener listener_;
  const std::map<std::string, std::set<std::string>> paths_ = read_paths();
  const std::map<std::string, Operation> operations_ = read_operations();
  std::map<std::pair<std::string, std::string>, Handler> handlers_;  // by method and path
  std::mutex log_mutex_;
};

HttpServer::HttpServer(Service& service) : impl_(std::make_unique<Impl>(service)) {}
HttpServer::~HttpServer() = default;
int HttpServer::port() const { return impl_->port(); }
void HttpServer::run() { impl_->run(); }
void HttpServer::stop() { impl_->stop(); }
void HttpServer::end_transfers() { impl_->end_transfers(); }

}  // namespace meshsmooth::gateway
