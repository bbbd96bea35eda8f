// The settings of addresses, credentials, connections and streams.
#include <algorithm>
#include <cctype>

#include "setting_table.hpp"

namespace meshsmooth::server {
namespace {

using C = ServerConfig;

bool is_number(std::string_view text) {
  return !text.empty() &&
         std::ranges::all_of(text, [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool is_address(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  return colon != std::string_view::npos && colon > 0 && is_number(text.substr(colon + 1)) &&
         is_printable(text) && text.find_first_of(", ") == std::string_view::npos;
}

bool is_listen_address(std::string_view text) {
  if (text.starts_with("unix:")) return is_printable(text);
  return text.empty() || is_address(text);
}

bool is_admin_address(std::string_view text) { return text.empty() || is_address(text); }

}  // namespace

void add_connection_settings(Table& table) {
  const CLI::Validator none;
  const auto text = text_that("printable", is_printable);
  const auto seconds = seconds_range();
  table
      .add("listen", &C::listen,
           "Address to serve on, HOST:PORT or unix:PATH; port 0 selects a free port, unix: alone "
           "creates a socket in a private folder, removed at exit",
           text_that("HOST:PORT or unix:PATH", is_listen_address))
      .add("admin-listen", &C::admin_listen,
           "Address of /metrics, /healthz and /readyz in plain HTTP, HOST:PORT; empty: none",
           text_that("HOST:PORT", is_admin_address))
      .add("insecure", &C::insecure,
           "Allow an address without TLS that other machines can reach, because something else "
           "protects it",
           none)
      .add("behind-proxy", &C::behind_proxy,
           "Allow an address that other machines can reach though this server's gRPC has known "
           "vulnerabilities, because only a proxy that cuts off floods, as deploy/haproxy does, "
           "can reach it",
           none)
      .add("i-accept-old-grpc", &C::i_accept_old_grpc,
           "Allow such an address without a proxy: whoever can connect can then exhaust the "
           "server's memory",
           none)
      .add("tls-cert", &C::tls_cert, "PEM file with the server's certificate chain; enables TLS",
           text)
      .add("tls-key", &C::tls_key, "PEM file with the private key of the certificate", text)
      .add("tls-client-ca", &C::tls_client_ca,
           "PEM file with certificate authorities; clients must present a certificate signed by "
           "one of them",
           text)
      .add("token-file", &C::token_file,
           "File of lines CALLER:TOKEN or CALLER:sha256:HEX; calls must carry one of the "
           "tokens",
           text)
      .add("credentials-reload-interval-seconds", &C::credentials_reload_interval,
           "Reload interval for certificates and tokens, in seconds", seconds)
      .add("max-metadata-bytes", &C::max_metadata_bytes,
           "Maximum metadata size of a call, in bytes", CLI::Range(1024, 1 << 20))
      .add("max-jobs-per-caller", &C::max_jobs_per_caller,
           "Maximum number of unfinished jobs of one caller; 0: no limit", CLI::Range(0, 1'000'000))
      .add("max-bytes-per-caller", &C::max_bytes_per_caller,
           "Maximum memory reserved for the unfinished jobs of one caller, without their streams, "
           "in bytes; 0: no limit",
           Bytes())
      .add("max-caller-memory-share", &C::max_caller_memory_share,
           "Fraction of host and device memory that the unfinished jobs of one caller may reserve "
           "together; a single job may exceed it",
           fraction())
      .add("interactive-callers", &C::interactive_callers,
           "Callers whose jobs may have the priority INTERACTIVE, separated by commas; all: every "
           "caller; the jobs of others are NORMAL then",
           text);
}

void add_stream_settings(Table& table) {
  const auto seconds = seconds_range();
  const auto message_bytes = CLI::Range(4096, 1 << 30);
  table
      .add("early-data-bytes", &C::early_data_bytes,
           "Advice to clients: maximum data to send before the job is accepted, in bytes",
           CLI::Range(0, 1 << 22))
      .add("max-chunk-bytes", &C::max_chunk_bytes,
           "Advice to clients: maximum chunk size, in bytes", message_bytes)
      .add("result-chunk-bytes", &C::result_chunk_bytes, "Chunk size of results, in bytes",
           message_bytes)
      // Clients send chunks of 1 MiB, whatever is set.
      .add("max-receive-message-bytes", &C::max_receive_message_bytes,
           "Maximum size of a received message, in bytes", CLI::Range(2 << 20, 1 << 30))
      .add("stream-window-bytes", &C::stream_window_bytes,
           "Flow-control window of a stream, in bytes; 0: adapts to the network",
           CLI::Range(0, 1 << 30))
      .add("max-concurrent-streams", &C::max_concurrent_streams,
           "Maximum number of concurrent calls per connection", CLI::Range(1, 1'000'000))
      .add("max-connections", &C::max_connections,
           "Maximum number of connections; the limit of open files may allow fewer",
           CLI::Range(1, 1'000'000))
      .add("max-connections-per-address", &C::max_connections_per_address,
           "Maximum number of connections from one address (of IPv6: one network of 64 bits); not "
           "applied to this host nor with behind-proxy",
           CLI::Range(1, 1'000'000))
      .add("keepalive-time-seconds", &C::keepalive_time,
           "Idle time after which a connection is pinged, in seconds", seconds)
      .add("keepalive-timeout-seconds", &C::keepalive_timeout,
           "Time to wait for the answer to a ping before closing the connection, in seconds",
           seconds)
      .add("min-client-ping-interval-seconds", &C::min_client_ping_interval,
           "Minimum interval between pings of a client, in seconds; with gRPC before 1.54, clients "
           "that ping more often are disconnected",
           seconds)
      .add("max-connection-age-seconds", &C::max_connection_age,
           "Age from which on a connection takes no new calls, in seconds; 0: no limit", seconds)
      .add("max-connection-idle-seconds", &C::max_connection_idle,
           "Time after which a connection without calls is closed, in seconds; 0: no limit",
           seconds);
}

}  // namespace meshsmooth::server
