#include <pthread.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <thread>

#include "config.hpp"
#include "host_memory.hpp"
#include "meshsmooth/error.hpp"
#include "meshsmooth/server.hpp"

namespace {

using namespace meshsmooth;

constexpr int kExitUsage = 2;
constexpr int kExitDeviceLost = 69;  // EX_UNAVAILABLE
constexpr int kExitNotDrained = 75;  // EX_TEMPFAIL
constexpr auto kWatchdogSlack = std::chrono::seconds(2);

// Blocked here, and so in every thread created later: they are only received by sigwait.
sigset_t block_exit_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

// SIGTERM drains, a second one forces the shutdown; if even that hangs, the process exits. A lost
// device does not come back within this process: it drains without waiting and exits with its own
// code, so that the supervisor starts another process.
void serve(server::Server& server, const server::ServerConfig& config, const sigset_t& signals) {
  int signal = 0;
  sigwait(&signals, &signal);
  if (server.device_lost()) server.force_shutdown();

  std::thread([&] {
    int again = 0;
    sigwait(&signals, &again);
    server.force_shutdown();
  }).detach();
  const auto limit = config.lame_duck + config.drain_grace + kWatchdogSlack;
  std::thread([limit] {
    std::this_thread::sleep_for(limit);
    _exit(kExitNotDrained);
  }).detach();
  server.drain();
  std::fflush(nullptr);
  // The two threads above never end by themselves.
  _exit(server.device_lost() ? kExitDeviceLost : 0);
}

int fail(const Error& error) {
  std::fprintf(stderr, "meshsmooth-server: %s\n", error.what());
  return kExitUsage;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Smooths finite-element meshes as a gRPC service (meshsmooth.v1).",
               "meshsmooth-server");
  app.set_version_flag("--version", MESHSMOOTH_VERSION);
  bool print_config = false;
  app.add_flag("--print-config", print_config,
               "Print all settings in effect, in the format of --config, and exit");
  server::ServerConfig config;
  try {
    config = server::read_config(app, argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitUsage;
  } catch (const Error& error) {
    return fail(error);
  }
  if (print_config) {
    std::fputs(server::describe(config).c_str(), stdout);
    return 0;
  }

  server::keep_heap_warm();
  const sigset_t signals = block_exit_signals();
  server::Server server(config);
  try {
    server.start([] { kill(getpid(), SIGTERM); });
  } catch (const Error& error) {
    return fail(error);
  }
  serve(server, config, signals);
}
