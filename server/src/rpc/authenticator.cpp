#include "rpc/authenticator.hpp"

#include <chrono>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

#include "log.hpp"
#include "meshsmooth/error.hpp"
#include "wire/local_address.hpp"
#include "wire/traceparent.hpp"

namespace meshsmooth::server {
namespace {

/// The value of a key that occurs exactly once.
std::optional<std::string_view> metadata(const grpc::CallbackServerContext& context,
                                         const char* key) {
  const auto [first, last] = context.client_metadata().equal_range(key);
  if (first == last || std::next(first) != last) return std::nullopt;
  return std::string_view(first->second.data(), first->second.size());
}

std::string name_in_certificate(const grpc::CallbackServerContext& context) {
  const std::shared_ptr<const grpc::AuthContext> peer = context.auth_context();
  if (!peer || !peer->IsPeerAuthenticated()) return kAnonymous;
  // A SPIFFE id, else the first alternative name, else the common name.
  auto names = peer->FindPropertyValues("peer_spiffe_id");
  if (names.empty()) names = peer->GetPeerIdentity();
  return names.empty() ? kAnonymous : std::string(names.front().data(), names.front().size());
}

// Address and port of the peer. Over a Unix socket or within the process all peers have the same.
std::string connection_of(const grpc::CallbackServerContext& context) {
  std::string peer = context.peer();
  return peer.starts_with("ipv4:") || peer.starts_with("ipv6:") ? peer : std::string();
}

// The address of the peer; where a proxy may stand for many, as on this host, its connection.
std::string origin_of(const std::string& connection, bool behind_proxy) {
  const std::string address = connection.substr(connection.find(':') + 1);
  if (behind_proxy || connection.empty() || wire::is_local_address(address)) return connection;
  return connection.substr(0, connection.rfind(':'));
}

}  // namespace

Authenticator::Authenticator(const ServerConfig& config, Metrics& metrics, CallLimits& calls)
    : tokens_(
          config.token_file.empty()
              ? nullptr
              : std::make_unique<TokenFile>(config.token_file, config.credentials_reload_interval)),
      metrics_(metrics),
      calls_(calls),
      behind_proxy_(config.behind_proxy) {}

AuthResult Authenticator::authenticate(grpc::CallbackServerContext& context) const {
  AuthResult auth;
  auth.caller.connection = connection_of(context);
  try {
    auth.place = calls_.take(auth.caller.connection);
  } catch (const Error&) {
    auth.over_limit = std::current_exception();
    return auth;
  }
  if (const auto traceparent = metadata(context, "traceparent");
      traceparent && wire::is_traceparent(*traceparent)) {
    auth.caller.traceparent = *traceparent;
    context.AddInitialMetadata("traceparent", auth.caller.traceparent);
  }
  try {
    auth.caller.name = identify(context);
    auth.caller.share = auth.caller.name == kAnonymous
                            ? origin_of(auth.caller.connection, behind_proxy_)
                            : auth.caller.name;
  } catch (const Error& error) {
    metrics_.denied(error.reason());
    log_denied(error, context.peer());
    auth.denied = std::current_exception();
  }
  return auth;
}

std::string Authenticator::identify(const grpc::CallbackServerContext& context) const {
  if (!tokens_) return name_in_certificate(context);
  constexpr std::string_view kScheme = "Bearer ";
  const auto authorization = metadata(context, "authorization");
  if (!authorization || !authorization->starts_with(kScheme)) {
    throw Error("TOKEN_MISSING", "this server requires a token: authorization: Bearer TOKEN");
  }
  const auto caller = tokens_->find_caller(authorization->substr(kScheme.size()));
  if (!caller) throw Error("TOKEN_UNKNOWN", "unknown token");
  return *caller;
}

}  // namespace meshsmooth::server
