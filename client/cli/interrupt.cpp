#include "interrupt.hpp"

#include <pthread.h>
#include <unistd.h>

#include "exit_code.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {

Interrupt::Interrupt() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, &previous_);
  waiter_ = std::jthread([this] { wait_for_signals(); });
}

Interrupt::~Interrupt() {
  over_ = true;
  pthread_kill(waiter_.native_handle(), SIGTERM);  // wakes it
  waiter_.join();
  pthread_sigmask(SIG_SETMASK, &previous_, nullptr);
}

void Interrupt::check() const {
  if (source_.stop_requested()) throw Cancelled("", "cancelled");
}

void Interrupt::wait_for_signals() {
  while (true) {
    int signal = 0;
    sigwait(&signals_, &signal);
    if (over_) return;
    if (source_.stop_requested()) ::_exit(static_cast<int>(ExitCode::stopped));
    source_.request_stop();
  }
}

}  // namespace meshsmooth::cli
