#include "problem.hpp"

#include <nlohmann/json.hpp>
#include <utility>

#include "meshsmooth/error_reason.hpp"

namespace meshsmooth::gateway {
namespace {

/// Those whose meaning to a caller of HTTP is another than their status has in general.
const std::map<std::string, int, std::less<>> kOwnStatus = {
    {"FORMAT_UNKNOWN", 415},       {"MESH_TOO_LARGE", 413},    {"UPLOAD_TOO_LARGE", 413},
    {"UPLOAD_TOO_SLOW", 408},      {"FILE_NOT_READABLE", 500}, {"FILE_NOT_WRITABLE", 507},
    {"CREDENTIALS_UNUSABLE", 500}, {"MOTION_INCOMPLETE", 422}, {"RESPONSE_NOT_UNDERSTOOD", 502},
    {"FILE_NOT_FOUND", 500},       {"QUEUE_FULL", 503},
};

int status_of(StatusCode code) {
  switch (code) {
    case StatusCode::invalid_argument:
    case StatusCode::out_of_range:
      return 400;
    case StatusCode::unauthenticated:
      return 401;
    case StatusCode::permission_denied:
      return 403;
    case StatusCode::not_found:
      return 404;
    case StatusCode::already_exists:
    case StatusCode::failed_precondition:
      return 409;
    case StatusCode::resource_exhausted:
      return 429;
    case StatusCode::unimplemented:
      return 501;
    case StatusCode::unavailable:
    case StatusCode::cancelled:
      return 503;
    case StatusCode::deadline_exceeded:
      return 504;
    case StatusCode::unknown:
    case StatusCode::internal:
    case StatusCode::data_loss:
      break;
  }
  return 500;
}

/// A call that failed on its way has its status in place of a reason.
int status_of_name(const std::string& name) {
  for (int code = 1; code <= static_cast<int>(StatusCode::unauthenticated); ++code) {
    const auto status = static_cast<StatusCode>(code);
    if (status_code_name(status) == name) return status_of(status);
  }
  return 500;
}

int status_of(const std::string& name) {
  if (const auto own = kOwnStatus.find(name); own != kOwnStatus.end()) return own->second;
  const ErrorReason* reason = find_error_reason(name);
  if (reason == nullptr) return status_of_name(name);
  // What was sent is understood, but as a mesh it is wrong.
  return reason->exit_code == ExitCode::bad_mesh ? 422 : status_of(reason->status);
}

int delay_of(const std::string& name) {
  const ErrorReason* reason = find_error_reason(name);
  const bool again = reason != nullptr && reason->retry.starts_with("yes");
  if (!again) return name == "UNAVAILABLE" ? 5 : 0;
  return reason->retry_delay && reason->retry_delay->count() == 0 ? 1 : 5;
}

}  // namespace

Problem::Problem(std::string reason, std::string detail, std::map<std::string, std::string> details)
    : status_(status_of(reason)),
      reason_(std::move(reason)),
      detail_(std::move(detail)),
      details_(std::move(details)),
      retry_after_(delay_of(reason_)) {}

Problem::Problem(int status, std::string detail) : status_(status), detail_(std::move(detail)) {}

Problem::Problem(const nlohmann::json& error)
    : Problem(error.value("reason", std::string()), error.value("message", std::string()),
              error.value("details", std::map<std::string, std::string>())) {
  hint_ = error.value("hint", std::string());
}

nlohmann::json Problem::to_json() const {
  nlohmann::json json = {{"type", "about:blank"},
                         {"title", status_title(status_)},
                         {"status", status_},
                         {"detail", detail_}};
  if (reason_.empty()) return json;
  json["type"] = "urn:meshsmooth:" + reason_;
  json["reason"] = reason_;
  const ErrorReason* reason = find_error_reason(reason_);
  if (reason != nullptr) json["title"] = reason->meaning;
  if (!hint_.empty()) json["hint"] = hint_;
  if (!details_.empty()) json["details"] = details_;
  return json;
}

const char* status_title(int status) {
  static const std::map<int, const char*> titles = {{400, "Bad Request"},
                                                    {401, "Unauthorized"},
                                                    {404, "Not Found"},
                                                    {405, "Method Not Allowed"},
                                                    {408, "Request Timeout"},
                                                    {413, "Content Too Large"},
                                                    {414, "URI Too Long"},
                                                    {415, "Unsupported Media Type"},
                                                    {422, "Unprocessable Content"},
                                                    {431, "Request Header Fields Too Large"},
                                                    {500, "Internal Server Error"},
                                                    {503, "Service Unavailable"},
                                                    {504, "Gateway Timeout"}};
  const auto found = titles.find(status);
  return found == titles.end() ? "Error" : found->second;
}

}  // namespace meshsmooth::gateway
