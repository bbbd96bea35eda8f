#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace meshsmooth::gateway {

/// All that the program can be told. What it says of itself is in `read_settings`.
struct Settings {
  std::string host = "127.0.0.1";
  int port = 8080;
  std::filesystem::path tls_cert, tls_key;  // of the listener
  bool insecure = false;
  bool allow_anonymous = false;

  std::filesystem::path client;           // the program `meshsmooth`
  std::vector<std::string> server_flags;  // by which it reaches the server
  std::filesystem::path token_file;       // for callers without a token

  std::filesystem::path folder;  // of uploads and results
  std::uint64_t max_upload_bytes = std::uint64_t{1} << 30;
  std::uint64_t max_client_bytes = std::uint64_t{16} << 30;  // of address space; 0: no limit
  int max_requests = 64;
  int max_connections = 256;
  int max_kept_jobs = 64;
  int clients = 4;  // processes at a time
  std::chrono::seconds upload_timeout{600};
  std::chrono::seconds job_timeout{3600};
  std::chrono::seconds result_ttl{600};
  std::chrono::seconds drain_grace{30};

  /// Whether other machines can reach it.
  [[nodiscard]] bool is_public() const;
};

/// Of the command line and the environment. Unset: the program is to end with the exit code, having
/// said why.
[[nodiscard]] std::optional<Settings> read_settings(int argc, char** argv, int& exit_code);

}  // namespace meshsmooth::gateway
