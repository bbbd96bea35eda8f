#pragma once

#include <grpcpp/alarm.h>

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "job.hpp"

namespace meshsmooth::server {

/// What the reactors of all streaming calls have in common. Events (a read or write is done, the
/// job changed, the client is gone, time has passed) only change the state under the lock and call
/// `pump`. `Reactor::next_action` inspects the state and returns what to do next; `pump` does it.
/// One thread pumps at a time, so there is at most one read and one write outstanding. No lock is
/// held over a call into gRPC or the engine: both may call back on the same thread.
///
/// The reactor owns itself, from `start` until gRPC's OnDone calls `release`.
template <class Reactor>
class CallLoop : public std::enable_shared_from_this<Reactor> {
 public:
  /// Takes ownership of a new reactor, for gRPC.
  static Reactor* start(std::shared_ptr<Reactor> reactor) {
    Reactor* const raw = reactor.get();
    raw->self_ = std::move(reactor);
    raw->pump();
    return raw;
  }

 protected:
  using Action = std::function<void()>;

  CallLoop() = default;
  ~CallLoop() = default;

  void pump() {
    const auto keep_alive = this->shared_from_this();
    std::unique_lock lock(mutex_);
    // Whoever pumps checks again after each action, so it will see what changed.
    if (std::exchange(pumping_, true)) return;
    for (;;) {
      const auto now = Clock::now();
      wake_.reset();
      Action action = static_cast<Reactor*>(this)->next_action(now);
      if (!action) action = next_alarm();
      if (!action) break;
      lock.unlock();
      action();
      action = nullptr;
      lock.lock();
    }
    pumping_ = false;
  }

  /// Calls `pump`, from any thread, as long as the reactor exists.
  [[nodiscard]] std::function<void()> pump_later() {
    return [weak = this->weak_from_this()] {
      if (const auto reactor = weak.lock()) reactor->pump();
    };
  }

  // --- with the lock, by `next_action` ---------------------------------------------

  /// `next_action` wants to be asked again at this time, if nothing happens before.
  void wake_at(Clock::time_point time) {
    if (!wake_ || time < *wake_) wake_ = time;
  }

  [[nodiscard]] bool writing() const { return write_began_.has_value(); }
  void write_begins(Clock::time_point now) { write_began_ = now; }
  void write_ended() { write_began_.reset(); }
  /// Whether the client has not taken the last message for so long.
  [[nodiscard]] bool write_stalled(Clock::time_point now, Clock::duration timeout) {
    if (!write_began_) return false;
    if (now >= *write_began_ + timeout) return true;
    wake_at(*write_began_ + timeout);
    return false;
  }

  /// In the action that finishes the call.
  void cancel_alarm() { alarm_.reset(); }
  /// In OnDone: destroys the reactor.
  void release() { self_.reset(); }

  std::mutex mutex_;

 private:
  Action next_alarm() {
    // Alarms cost more than being asked once too often.
    constexpr std::chrono::milliseconds kSlack(1);
    if (!wake_ || (alarm_at_ && *wake_ + kSlack >= *alarm_at_)) return {};
    alarm_at_ = wake_;
    return [this, at = *wake_, generation = ++alarm_generation_] { set_alarm(at, generation); };
  }

  void set_alarm(Clock::time_point at, int generation) {
    auto alarm = std::make_unique<grpc::Alarm>();
    alarm->Set(
        std::chrono::system_clock::now() +
            std::chrono::duration_cast<std::chrono::system_clock::duration>(at - Clock::now()),
        [weak = this->weak_from_this(), generation](bool) {
          if (const auto reactor = weak.lock()) reactor->on_alarm(generation);
        });
    alarm_ = std::move(alarm);  // cancels the one before
  }

  void on_alarm(int generation) {
    {
      const std::lock_guard lock(mutex_);
      if (generation != alarm_generation_) return;
      alarm_at_.reset();
    }
    pump();
  }

  std::shared_ptr<Reactor> self_;
  bool pumping_ = false;
  std::optional<Clock::time_point> write_began_;  // of the outstanding write
  std::optional<Clock::time_point> wake_;         // when `next_action` wants to be asked again
  std::optional<Clock::time_point> alarm_at_;     // when the alarm will ask it
  int alarm_generation_ = 0;
  std::unique_ptr<grpc::Alarm> alarm_;  // used by the pumping thread only
};

}  // namespace meshsmooth::server
