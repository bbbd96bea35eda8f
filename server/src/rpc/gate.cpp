#include "rpc/gate.hpp"

#include <chrono>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

#include "log.hpp"
#include "meshsmooth/error.hpp"
#include "traceparent.hpp"

namespace meshsmooth::server {
namespace {

/// The value under a key that came once.
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

}  // namespace

Gate::Gate(const ServerConfig& config, Metrics& metrics)
    : tokens_(
          config.token_file.empty()
              ? nullptr
              : std::make_unique<TokenFile>(config.token_file, config.credentials_reload_interval)),
      metrics_(metrics) {}

Entry Gate::enter(grpc::CallbackServerContext& context) const {
  Entry entry;
  entry.caller.connection = connection_of(context);
  if (const auto traceparent = metadata(context, "traceparent");
      traceparent && is_traceparent(*traceparent)) {
    entry.caller.traceparent = *traceparent;
    context.AddInitialMetadata("traceparent", entry.caller.traceparent);
  }
  try {
    entry.caller.identity = identify(context);
  } catch (const Error& error) {
    metrics_.denied(error.reason());
    log_denied(error, context.peer());
    entry.denied = std::current_exception();
  }
  return entry;
}

std::string Gate::identify(const grpc::CallbackServerContext& context) const {
  if (!tokens_) return name_in_certificate(context);
  constexpr std::string_view kScheme = "Bearer ";
  const auto authorization = metadata(context, "authorization");
  if (!authorization || !authorization->starts_with(kScheme)) {
    throw Error("TOKEN_MISSING", "this server asks for a token: authorization: Bearer TOKEN");
  }
  const auto identity = tokens_->identity_of(authorization->substr(kScheme.size()));
  if (!identity) throw Error("TOKEN_UNKNOWN", "this server does not know the token");
  return *identity;
}

}  // namespace meshsmooth::server
