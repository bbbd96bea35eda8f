#include "rpc/transport_limits.hpp"

#include <grpcpp/resource_quota.h>
#include <grpcpp/version_info.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <string>

#include "log.hpp"
#include "tcp_traffic.hpp"

namespace meshsmooth::server {
namespace {

constexpr int kMaxReflectionThreads = 16;
constexpr auto kHandshakeTimeout = std::chrono::seconds(20);

int to_milliseconds(ServerConfig::Duration duration) {
  return static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(duration).count());
}

// gRPC opens a window again when it has read half of it. Windows are 16 MiB, or twice what is under
// way on a fast and long line, which fits into the kernel's buffer.
std::uint64_t max_unanswered_bytes() {
  constexpr std::uint64_t kHalfWindow = 8 << 20;
  return std::max(kHalfWindow + kHalfWindow / 2, 2 * max_receive_buffer_bytes());
}

}  // namespace

void configure_transport(grpc::ServerBuilder& builder, const ServerConfig& config,
                         std::int64_t transport_bytes) {
  builder.SetMaxReceiveMessageSize(config.max_receive_message_bytes);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, config.max_metadata_bytes);
#ifdef GRPC_ARG_ABSOLUTE_MAX_METADATA_SIZE
  // Since 1.54 the one above is the size from which on calls are refused at random.
  builder.AddChannelArgument(GRPC_ARG_ABSOLUTE_MAX_METADATA_SIZE, config.max_metadata_bytes);
#endif
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, config.max_concurrent_streams);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, to_milliseconds(config.keepalive_time));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS,
                             to_milliseconds(config.keepalive_timeout));
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             to_milliseconds(config.min_client_ping_interval));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
#if GRPC_CPP_VERSION_MAJOR > 1 || GRPC_CPP_VERSION_MINOR >= 54
  // Each ping beyond those that are allowed adds an error to those of the connection before it
  // is closed, in time that grows with the square of the pings that were read at once: 4 MB of them
  // held a thread for seconds. Answers that a client does not take stop the reading anyway.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PING_STRIKES, 0);
#endif
  // For TLS, and for the first settings of HTTP/2.
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS,
                             to_milliseconds(kHandshakeTimeout));
  if (config.max_connection_idle > ServerConfig::Duration::zero()) {
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS,
                               to_milliseconds(config.max_connection_idle));
  }
  if (config.max_connection_age > ServerConfig::Duration::zero()) {
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS,
                               to_milliseconds(config.max_connection_age));
  }
  if (config.stream_window_bytes > 0) {
    builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    builder.AddChannelArgument(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, config.stream_window_bytes);
  }
  // Reflection holds a thread for each open stream; it waits for one when there are too many.
  grpc::ResourceQuota quota("meshsmooth");
  quota.SetMaxThreads(kMaxReflectionThreads);
#if GRPC_CPP_VERSION_MAJOR > 1 || GRPC_CPP_VERSION_MINOR >= 54
  // No bound of memory: gRPC 1.83 measures how much of it is in use each so many reads, as many as
  // there were in a second before. When a flood that filled it ends at once, as when its
  // connections are cut off, the measure stays: no connection is taken any more, and so nothing is
  // read that would correct it. Floods are cut off before they take much, see OpenConnections.
  static_cast<void>(transport_bytes);
#else
  quota.Resize(static_cast<std::size_t>(transport_bytes));
#endif
  builder.SetResourceQuota(quota);
  builder.SetSyncServerOption(grpc::ServerBuilder::NUM_CQS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MIN_POLLERS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, 2);
}

// Twice of what is announced: calls that have ended for the client may not have ended here.
CallLimits::Limits call_limits(const ServerConfig& config) {
  constexpr std::int64_t kAnswerBytes = 8 << 20;  // more than one answer ever has
  return {.calls_per_connection = 2 * config.max_concurrent_streams,
          .answer_bytes_per_connection = kAnswerBytes,
          .answer_bytes = 4 * kAnswerBytes};
}

Listener::Limits listener_limits(const ServerConfig& config) {
  const auto all = static_cast<std::size_t>(config.max_connections);
  const auto one = static_cast<std::size_t>(config.max_connections_per_address);
  return {.max_connections = all,
          .max_connections_per_address = config.behind_proxy ? all : std::min(all, one),
          .max_descriptor = max_connection_descriptor(),
          .first_byte_timeout = kHandshakeTimeout,
          .unacknowledged_timeout =
              std::chrono::duration_cast<std::chrono::milliseconds>(config.keepalive_timeout),
          .max_unanswered_bytes = max_unanswered_bytes()};
}

void check_descriptors(const ServerConfig& config) {
  constexpr int kFewest = 8;
  const int room = free_connection_descriptors();
  if (room >= config.max_connections) return;
  const std::string what = "the limit of open files leaves room for " + std::to_string(room) +
                           " connections, max-connections is " +
                           std::to_string(config.max_connections);
  if (room < std::min(kFewest, config.max_connections)) {
    throw std::runtime_error(what + "; raise the limit (ulimit -n, LimitNOFILE)");
  }
  log_warning("few_descriptors", what);
}

}  // namespace meshsmooth::server
