#include "service.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "meshsmooth/error_reason.hpp"
#include "problem.hpp"

namespace meshsmooth::gateway {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;

constexpr const char* kTokenFile = "token";
constexpr std::size_t kMostKnownTokens = 1024;
constexpr std::chrono::seconds kTokenKnownFor{60};
constexpr const char* kReport = "report.html";
constexpr const char* kSummary = "summary.json";

[[noreturn]] void fail_by(CallEnd end) {
  switch (end) {
    case CallEnd::peer_gone:
      throw Problem("CANCELLED_BY_CLIENT", "the caller closed the connection");
    case CallEnd::cancelled:
      throw Problem("CANCELLED_BY_JOB_CALL", "the job was cancelled");
    case CallEnd::draining:
      throw Problem("DRAINING", "the gateway is shutting down");
    case CallEnd::deadline:
    case CallEnd::exited:
      break;
  }
  throw Problem("DEADLINE_RUNNING", "the job took longer than the gateway allows (--job-timeout)");
}

/// What the client said when it failed.
[[noreturn]] void fail_by(const CallResult& result) {
  const json object = json::parse(result.error, nullptr, false);
  if (object.is_object() && object.contains("error")) {
    const json& error = object.at("error");
    if (!error.value("reason", "").empty()) throw Problem(error);
    if (error.value("message", "").find("bad_alloc") != std::string::npos) {
      throw Problem("MESH_TOO_LARGE",
                    "the mesh needs more memory than the gateway allows (--max-client-bytes)");
    }
    throw Problem("INTERNAL", error.value("message", ""));
  }
  throw Problem("INTERNAL", result.signal != 0
                                ? "the client was ended by signal " + std::to_string(result.signal)
                                : "the client ended with exit code " +
                                      std::to_string(result.exit_code) + ": " + result.error);
}

/// The extension of the result: that of the parameter `to`, else the mesh's.
std::string result_extension(const Order& order) {
  const std::string mesh = order.files.at("mesh");
  std::string to = value_of(order.parameters, "to");
  if (to.empty()) {
    const std::string own = safe_extension(mesh);
    const std::string format = value_of(order.parameters, "format");
    return own.empty() && !format.empty() ? safe_extension("." + format) : own;
  }
  if (!to.starts_with('.')) to.insert(to.begin(), '.');
  const std::string extension = safe_extension("result" + to);
  if (extension.size() == to.size()) return extension;
  throw Problem("FORMAT_UNKNOWN", "to: " + to + " is no extension of a file", {{"field", "to"}});
}

/// The part of a form that is a flag of the same name.
bool is_file_flag(const std::string& part) { return part != "mesh"; }

int count_of(const std::map<std::string, int>& counts, const std::string& caller) {
  const auto found = counts.find(caller);
  return found == counts.end() ? 0 : found->second;
}

int total(const std::map<std::string, int>& counts) {
  int sum = 0;
  for (const auto& [caller, count] : counts) sum += count;
  return sum;
}

void remove_one(std::map<std::string, int>& counts, const std::string& caller) {
  if (--counts[caller] == 0) counts.erase(caller);
}

}  // namespace

/// A turn to run a process: they are taken in order of arrival.
class Service::Turn {
 public:
  Turn(Service& service, const std::string& caller, const Interruptions& interruptions,
       Clock::time_point deadline)
      : service_(service), caller_(caller) {
    std::unique_lock lock(service.mutex_);
    service.waiting_.push_back(this);
    const auto is_next = [&] {
      return total(service.running_) < service.settings_.clients && next() == this;
    };
    // Connections cannot be waited for beside a condition, so they are looked at now and then.
    while (!service.changed_.wait_for(lock, std::chrono::milliseconds(100), is_next)) {
      const CallEnd end = end_of(interruptions, deadline);
      if (end == CallEnd::exited) continue;
      std::erase(service.waiting_, this);
      service.changed_.notify_all();
      fail_by(end);
    }
    std::erase(service.waiting_, this);
    ++service.running_[caller_];
    service.changed_.notify_all();
  }
  ~Turn() {
    const std::lock_guard lock(service_.mutex_);
    remove_one(service_.running_, caller_);
    service_.changed_.notify_all();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  static CallEnd end_of(const Interruptions& by, Clock::time_point deadline) {
    if (is_gone(by.peer)) return CallEnd::peer_gone;
    if (by.cancel != nullptr && by.cancel->requested()) return CallEnd::cancelled;
    if (by.drain != nullptr && by.drain->requested()) return CallEnd::draining;
    return Clock::now() >= deadline ? CallEnd::deadline : CallEnd::exited;
  }

  /// The first of the caller of whom the fewest run.
  [[nodiscard]] const Turn* next() const {
    return *std::ranges::min_element(service_.waiting_, {}, [this](const Turn* turn) {
      return count_of(service_.running_, turn->caller_);
    });
  }

  Service& service_;
  const std::string caller_;
};

Service::Place::~Place() {
  const std::lock_guard lock(service_->mutex_);
  remove_one(service_->admitted_, caller_);
}

Service::Service(Settings settings)
    : settings_(std::move(settings)), work_(settings_.folder), questions_(settings_.clients) {}

std::shared_ptr<Service::Place> Service::admit(const std::string& caller) {
  if (draining_) throw Problem("DRAINING", "the gateway is shutting down");
  const std::lock_guard lock(mutex_);
  const int most = settings_.max_requests;
  if (total(admitted_) >= most) {
    throw Problem("QUEUE_FULL", "the gateway serves " + std::to_string(most) +
                                    " requests at a time (--max-requests)");
  }
  const int share = std::max(1, most * 3 / 4);
  if (!caller.empty() && count_of(admitted_, caller) >= share) {
    throw Problem("QUEUE_FULL", "the gateway serves " + std::to_string(share) +
                                    " requests of one caller at a time (of --max-requests)");
  }
  auto place = std::make_shared<Place>(*this, caller);
  ++admitted_[caller];
  return place;
}

void Service::check_token(const std::string& token) {
  if (settings_.allow_anonymous || !settings_.is_public()) return;
  if (token.empty()) {
    throw Problem("TOKEN_MISSING", "the gateway asks for the header Authorization: Bearer TOKEN");
  }
  {
    const std::lock_guard lock(tokens_mutex_);
    const auto known = known_tokens_.find(token);
    if (known != known_tokens_.end() && Clock::now() < known->second) return;
  }
  const CallResult result = ask_server("info", token);
  if (result.end != CallEnd::exited) fail_by(result.end);
  if (result.signal != 0 || result.exit_code != 0) fail_by(result);
  const std::lock_guard lock(tokens_mutex_);
  if (known_tokens_.size() >= kMostKnownTokens) known_tokens_.clear();
  known_tokens_[token] = Clock::now() + kTokenKnownFor;
}

CallResult Service::ask_server(const std::string& command, const std::string& token) {
  questions_.acquire();
  const std::shared_ptr<void> end(nullptr, [this](void*) { questions_.release(); });
  const RequestFolder folder(work_);
  ClientCall call{.program = settings_.client,
                  .arguments = {"--errors=json", command},
                  .folder = folder.path(),
                  .deadline = Clock::now() + std::chrono::seconds(10)};
  add_server(token, folder, call.arguments);
  Interruptions interruptions;
  interruptions.drain = &stop_;
  return run_client(call, interruptions, [](const json&) {});
}

void Service::add_server(const std::string& token, const RequestFolder& folder,
                         std::vector<std::string>& arguments) const {
  std::ranges::copy(settings_.server_flags, std::back_inserter(arguments));
  if (!token.empty()) {
    // In a file, as arguments of processes are seen by all users.
    NewFile(folder / kTokenFile).write(token + "\n");
    arguments.emplace_back(std::string("--token-file=") + kTokenFile);
  } else if (!settings_.token_file.empty()) {
    arguments.push_back("--token-file=" + settings_.token_file.string());
  }
}

Outcome Service::run(const Order& order, const RequestFolder& folder, Interruptions interruptions,
                     const std::function<void(const json&)>& on_progress) {
  interruptions.drain = &stop_;
  const Clock::time_point deadline = Clock::now() + settings_.job_timeout;
  const bool is_job = order.operation.name != "quality";
  ClientCall call{.program = settings_.client,
                  .arguments = {"--errors=json"},
                  .folder = folder.path(),
                  .max_bytes = settings_.max_client_bytes,
                  .deadline = deadline,
                  .traceparent = order.traceparent};
  Outcome outcome;
  auto& arguments = call.arguments;
  arguments.push_back(order.operation.name == "report" ? "smooth" : order.operation.name);
  arguments.emplace_back("--self-contained");
  std::ranges::copy(to_flags(order.operation, order.parameters), std::back_inserter(arguments));
  for (const auto& [part, file] : order.files) {
    if (is_file_flag(part)) arguments.push_back("--" + part + "=" + file);
  }
  if (is_job) {
    const std::string extension = result_extension(order);
    outcome.mesh = "result" + extension;
    outcome.report = kReport;
    outcome.summary = kSummary;
    outcome.download_name = result_name(order.mesh_name, order.operation.name, extension);
    arguments.insert(arguments.end(), {"--progress=json", "--output=" + outcome.mesh,
                                       "--report=" + outcome.summary});
    // It takes a while to make, and only jobs and reports show it.
    if (order.operation.name == "report" || interruptions.peer < 0) {
      arguments.push_back("--html=" + outcome.report);
    } else {
      outcome.report.clear();
    }
    add_server(order.token, folder, arguments);
  } else {
    arguments.emplace_back("--json");
    outcome.quality = kPrintedFile;
  }
  arguments.push_back(order.files.at("mesh"));

  const Turn turn(*this, order.caller, interruptions, deadline);
  on_progress({{"state", "running"}});
  const CallResult result = run_client(call, interruptions, on_progress);
  if (result.end != CallEnd::exited) fail_by(result.end);
  if (result.signal == 0 && result.exit_code == static_cast<int>(ExitCode::incomplete) && is_job) {
    if (value_of(order.parameters, "partial") == "on") return outcome;
    throw Problem("MOTION_INCOMPLETE",
                  "the boundary can be moved in part only without inverted elements; partial=on "
                  "returns what was reached");
  }
  if (result.signal != 0 || result.exit_code != 0) fail_by(result);
  return outcome;
}

bool Service::is_ready() {
  if (draining_) return false;
  // One question a second, whoever asks and however often.
  const std::lock_guard lock(ready_mutex_);
  if (Clock::now() - ready_checked_ < std::chrono::seconds(1)) return ready_;
  const CallResult result = ask_server("health", {});
  ready_ = result.end == CallEnd::exited && result.signal == 0 && result.exit_code == 0;
  ready_checked_ = Clock::now();
  return ready_;
}

}  // namespace meshsmooth::gateway
