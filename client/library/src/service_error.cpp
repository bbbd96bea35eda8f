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
  return contains_any(message, {"failed to connect", "onnection refused", "resolution failed",
                                "empty address list"});
}

/// What a proxy makes of a server that died under a call (HAProxy 2.6 ends the stream without a
/// status, or resets it), and gRPC's server of a call that comes while it shuts down. A server of
/// ours that cancels a job says why.
bool broken_off(const grpc::Status& status) {
  return (status.error_code() == grpc::StatusCode::UNKNOWN &&
          status.error_message() == "Stream removed") ||
         status.error_code() == grpc::StatusCode::CANCELLED;
}

/// A connection that broke may come back, or another server be behind it; an address where nobody
/// answers does not.
std::optional<std::chrono::nanoseconds> foreign_retry_delay(const grpc::Status& status,
                                                            const CallFacts& facts) {
  const bool broke = status.error_code() == grpc::StatusCode::UNAVAILABLE &&
                     !never_connected(status.error_message());
  if (!broke && (facts.cancelled_by_caller || !broken_off(status))) return std::nullopt;
  return std::chrono::milliseconds(100);
}

/// Why no secure connection came about; empty when TLS is not to blame. The texts
/// are those of gRPC 1.51 with OpenSSL 3.
std::string tls_hint(std::string_view message, const std::string& server) {
  if (contains_any(message, {"certificate verify failed"})) {
    return "the certificate of " + server +
           " is expired or not signed by an authority that this client trusts; set "
           "Credentials::tls_ca";
  }
  if (contains_any(message, {"is not in peer certificate"})) {
    return "the certificate is for another name; if that is the intended server, set "
           "Credentials::tls_server_name";
  }
  if (contains_any(message, {"wrong version number"})) {
    return "the server at " + server +
           " runs without TLS; leave Credentials::tls and the other TLS fields unset";
  }
  if (never_connected(message) && contains_any(message, {"Socket closed", "onnection reset"})) {
    return "the server closed the connection before the call: it may require TLS "
           "(Credentials::tls, "
           "Credentials::tls_ca) or a valid client certificate that it trusts "
           "(Credentials::tls_cert, Credentials::tls_key)";
  }
  if (contains_any(message, {"empty address list"})) {
    return "the files of Credentials::tls_cert and Credentials::tls_key cannot be used: check that "
           "they are PEM and belong together";
  }
  return {};
}

std::string unavailable_hint(std::string_view message, const std::string& server) {
  // HAProxy 2.6 answers 502 or, while the request still comes in, REFUSED_STREAM (RFC 9113, §7).
  if (was_reset(message, 7) ||
      contains_any(message, {"http2 header with status: 50", "no server behind this proxy"})) {
    return "a proxy answers at " + server +
           ", but no server behind it does, or the two do not speak HTTP/2 to each other";
  }
  if (contains_any(message, {"http1.x server"})) {
    return "the peer at " + server +
           " does not speak HTTP/2; if it is a proxy, enable HTTP/2 (nginx: listen … http2; "
           "HAProxy: proto h2, or alpn h2 with TLS)";
  }
  if (std::string hint = tls_hint(message, server); !hint.empty()) return hint;
  if (never_connected(message)) {
    return "no server answers there; check the address, or start one with: "
           "meshsmooth-server --listen " +
           server;
  }
  return "the connection to " + server +
         " broke while the job was under way: the server ended or the network failed" +
         std::string(kUnchanged) + ", send it again";
}

std::string proxy_ended_hint() {
  return "neither side cancelled: a proxy or the server ended the call (HAProxy: timeout "
         "client, timeout server, or the server behind it is gone)" +
         std::string(kUnchanged);
}

/// What an error that no meshsmooth server sent usually means. The texts that
/// proxies cause were seen with HAProxy 2.6 and nginx 1.22.
std::string foreign_hint(const grpc::Status& status, const CallFacts& facts) {
  const std::string& message = status.error_message();
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      return unavailable_hint(message, facts.server);
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      if (!facts.answered) {
        return "no response received; a proxy may be buffering the request "
               "(nginx: grpc_pass, not proxy_pass)" +
               std::string(kUnchanged);
      }
      return "allow more time, or set a compute budget to get the best result reached in it" +
             std::string(kUnchanged);
    case grpc::StatusCode::CANCELLED:
      if (facts.cancelled_by_caller) return {};
      return proxy_ended_hint();
    case grpc::StatusCode::UNKNOWN:
      return contains_any(message, {"Stream removed"}) ? proxy_ended_hint() : std::string();
    case grpc::StatusCode::INTERNAL:
      if (was_reset(message, 0)) {
        return "a proxy cut the upload: lift its body limit (nginx: client_max_body_size 0)";
      }
      if (was_reset(message, 1)) {
        return "a proxy gave up waiting: raise its timeouts (nginx: grpc_read_timeout, "
               "client_body_timeout)";
      }
      if (was_reset(message, 2)) {
        return "a proxy ended the call: lift its body limit (nginx: client_max_body_size 0) and "
               "raise its timeouts (nginx: grpc_read_timeout, client_body_timeout), unless the "
               "server behind it is gone" +
               std::string(kUnchanged);
      }
      return "something between here and the server failed" + std::string(kUnchanged);
    case grpc::StatusCode::UNIMPLEMENTED:
      return "what answers at " + facts.server +
             " is not a meshsmooth server, or is too old for this call";
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
            foreign_retry_delay(status, facts)};
  }
  std::string hint;
  if (details->retry_delay) {
    const double delay = std::chrono::duration<double>(*details->retry_delay).count();
    hint = delay > 0 ? "try again in " + seconds_text(delay) : "try again at once, or elsewhere";
  }
  if (code == StatusCode::unauthenticated) {
    hint = "set Credentials::token_file";
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
          "server and client are incompatible, or a proxy between them truncates responses" +
              std::string(kUnchanged)};
}

}  // namespace meshsmooth::client
