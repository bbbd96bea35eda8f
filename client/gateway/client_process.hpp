#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "stop.hpp"

namespace meshsmooth::gateway {

/// One run of the client: a process of its own reads, sends and writes a mesh, so that a parser
/// that fails takes nobody along, its memory is bounded and goes with it, and formats whose
/// libraries know one thread only are read side by side.
struct ClientCall {
  std::filesystem::path program;
  std::vector<std::string> arguments;
  /// Where it works: its names of files, also in messages, are relative to this.
  std::filesystem::path folder;
  std::uint64_t max_bytes = 0;  // of address space; 0: no limit
  std::chrono::steady_clock::time_point deadline;
  std::string traceparent = "";  // of the caller, as it came; empty: none
};

/// What may end a call early.
struct Interruptions {
  int peer = -1;  // the caller's connection; -1: none waits
  const Stop* cancel = nullptr;
  const Stop* drain = nullptr;
};

enum class CallEnd { exited, peer_gone, cancelled, draining, deadline };

struct CallResult {
  CallEnd end = CallEnd::exited;
  int exit_code = 0;  // of a process that exited
  int signal = 0;     // that ended it
  std::string error;  // its last message: an object in JSON, or text
};

/// The name of the file in the folder that has what the client printed.
inline constexpr const char* kPrintedFile = "printed";

/// Runs the client to its end; interrupted, it is asked to cancel its job and, if it does not end
/// soon, killed. It never outlives this process. `on_progress` gets an object for each report.
[[nodiscard]] CallResult run_client(const ClientCall& call, const Interruptions& interruptions,
                                    const std::function<void(const nlohmann::json&)>& on_progress);

/// Whether the caller has closed its connection.
[[nodiscard]] bool is_gone(int peer);

}  // namespace meshsmooth::gateway
