#include <signal.h>

#include <atomic>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>

#include "http_server.hpp"
#include "meshsmooth/error_reason.hpp"
#include "service.hpp"
#include "settings.hpp"

namespace {

using namespace meshsmooth::gateway;

void log(const nlohmann::json& line) { std::cerr << line.dump() << std::endl; }

/// At the first signal requests are refused and those that run may end, at the second or after the
/// grace time they are ended.
void wait_for_signals(const sigset_t& signals, const std::atomic<bool>& over, Service& service,
                      HttpServer& server) {
  int signal = 0;
  ::sigwait(&signals, &signal);
  if (over) return;
  log({{"event", "drain"}});
  service.drain();
  server.stop();
  const timespec grace{service.settings().drain_grace.count(), 0};
  ::sigtimedwait(&signals, nullptr, &grace);
  service.stop();
  server.end_transfers();
}

int serve(const Settings& settings, const sigset_t& signals) {
  Service service(settings);
  HttpServer server(service);
  std::atomic<bool> over = false;
  std::thread waiter([&] { wait_for_signals(signals, over, service, server); });
  log({{"event", "start"}, {"port", server.port()}, {"folder", service.work().path().string()}});
  server.run();
  over = true;
  ::pthread_kill(waiter.native_handle(), SIGTERM);  // wakes it
  waiter.join();
  log({{"event", "end"}});
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  int exit_code = 0;
  const std::optional<Settings> settings = read_settings(argc, argv, exit_code);
  if (!settings) return exit_code;
  ::signal(SIGPIPE, SIG_IGN);
  // Before any thread is made: they inherit it, and one waits for the signals.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  try {
    return serve(*settings, signals);
  } catch (const std::exception& error) {
    std::cerr << "meshsmooth-gateway: " << error.what() << std::endl;
    return static_cast<int>(meshsmooth::ExitCode::failed);
  }
}
