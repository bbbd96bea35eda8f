#include "service_error.hpp"

#include <cstdio>
#include <initializer_list>
#include <string_view>

#include "wire/status_details.hpp"

namespace meshsmooth::client {
namespace {

constexpr std::string_view kUnchanged = "; the mesh here is unchanged";

bool contains_any(std::string_view text, std::initializer_list<std::string_view> words) {
  for (const std::string_view word : words) {
    if (text.find(word) != std::string_view::npos) return true;
  }
  return false;
}

std::string seconds_text(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g s", seconds);
  return text;
}

bool was_reset(std::string_view message, int code) {
  return contains_any(message, {"RST_STREAM"}) &&
         message.ends_with("error code " + std::to_string(code));
}

bool never_connected(std::string_view message) {
  return contains_any(message, {"failed to connect", "onnection refused", "resolution failed"});
}

/// A connection that broke may come back; an address where nobody answers does not.
std::optional<std::chrono::nanoseconds> foreign_retry_delay(const grpc::Status& status) {
  if (status.error_code() != grpc::StatusCode::UNAVAILABLE ||
      never_connected(status.error_message())) {
    return std::nullopt;
  }
  return std::chrono::milliseconds(100);
}

std::string unavailable_hint(std::string_view message, const std::string& server) {
  if (contains_any(message, {"http2 header with status: 50"})) {
    return "a proxy answers at " + server + ", but no server behind it does";
  }
  if (never_connected(message)) {
    return "no server answers there; check the address, or start one with: "
           "meshsmooth-server --listen " +
           server;
  }
  return "the connection to " + server +
         " broke while the job was under way: the server ended or the network failed" +
         std::string(kUnchanged) + ", send it again";
}

/// What an error that no meshsmooth server sent usually means. The texts that
/// proxies cause were seen with HAProxy 2.6 and nginx 1.22.
std::string foreign_hint(const grpc::Status& status, const CallFacts& facts) {
  const std::string& message = status.error_message();
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      return unavailable_hint(message, facts.server);
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return "allow more time, or set a compute budget to get the best result reached in it" +
             std::string(kUnchanged);
    case grpc::StatusCode::CANCELLED:
      if (facts.cancelled_by_caller) return {};
      return "neither side asked for this: a proxy or the server ended the call (HAProxy: timeout "
             "server and timeout tunnel, or no server behind it)" +
             std::string(kUnchanged);
    case grpc::StatusCode::INTERNAL:
      if (was_reset(message, 0)) {
        return "a proxy cut the upload: lift its body limit (nginx: client_max_body_size 0)";
      }
      if (was_reset(message, 1)) {
        return "a proxy gave up waiting: raise its timeouts (nginx: grpc_read_timeout, "
               "client_body_timeout)";
      }
      return "something between here and the server failed" + std::string(kUnchanged);
    case grpc::StatusCode::UNIMPLEMENTED:
      return "what answers at " + facts.server +
             " is no meshsmooth server, or one too old for this";
    default:
      return {};
  }
}

std::string foreign_message(const grpc::Status& status, const CallFacts& facts) {
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) {
    return "the call did not end within its " + seconds_text(facts.timeout_seconds);
  }
  if (facts.cancelled_by_caller) return "cancelled";
  return facts.server + ": " +
         (status.error_message().empty() ? "the call failed without a message"
                                         : status.error_message());
}

}  // namespace

ServiceError to_service_error(const grpc::Status& status, const CallFacts& facts) {
  const auto code = static_cast<StatusCode>(status.error_code());
  const auto details = wire::decode_status_details(status.error_details());
  if (!details || details->reason.empty()) {
    return {code,
            {},
            foreign_message(status, facts),
            {},
            foreign_hint(status, facts),
            foreign_retry_delay(status)};
  }
  std::string hint;
  if (details->retry_delay) {
    const double delay = std::chrono::duration<double>(*details->retry_delay).count();
    hint = delay > 0 ? "try again in " + seconds_text(delay) : "try again at once, or elsewhere";
  }
  return {code,
          details->reason,
          status.error_message(),
          details->metadata,
          std::move(hint),
          details->retry_delay};
}

ServiceError broken_answer(const std::string& what) {
  return {StatusCode::data_loss,
          {},
          what,
          {},
          "server and client do not understand each other, or something between them cuts answers" +
              std::string(kUnchanged)};
}

}  // namespace meshsmooth::client
