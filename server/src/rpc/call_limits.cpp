#include "rpc/call_limits.hpp"

#include <chrono>

#include "busy.hpp"

namespace meshsmooth::server {
namespace {

constexpr auto kRetryDelay = std::chrono::milliseconds(100);

void check_answers(std::int64_t held, std::int64_t bytes, std::int64_t limit,
                   const std::string& whose) {
  if (held == 0 || bytes <= limit - held) return;  // one answer always fits
  throw Busy("QUOTA_EXCEEDED",
             "answers that " + whose + " not read hold " + std::to_string(held) +
                 " bytes, the limit is " + std::to_string(limit) + "; read them first",
             {{"limit_bytes", std::to_string(limit)}}, kRetryDelay);
}

}  // namespace

CallPlace::~CallPlace() {
  if (limits_ != nullptr) limits_->release(connection_, answer_bytes_);
}

void CallPlace::hold_answer(std::int64_t bytes) {
  if (limits_ == nullptr) return;
  limits_->hold_answer(connection_, bytes);
  answer_bytes_ += bytes;
}

CallPlace CallLimits::take(const std::string& connection) {
  const std::lock_guard lock(mutex_);
  Held& held = held_[connection];
  if (!connection.empty() && held.calls >= limits_.calls_per_connection) {
    if (++held.refused == limits_.calls_per_connection) cut_(connection);
    throw Busy("QUOTA_EXCEEDED",
               "this connection has " + std::to_string(held.calls) +
                   " unfinished calls, the limit of this server; finish one of them first",
               {{"limit_calls", std::to_string(limits_.calls_per_connection)}}, kRetryDelay);
  }
  ++held.calls;
  return {this, connection};
}

void CallLimits::hold_answer(const std::string& connection, std::int64_t bytes) {
  const std::lock_guard lock(mutex_);
  Held& held = held_[connection];
  if (!connection.empty()) {
    check_answers(held.answer_bytes, bytes, limits_.answer_bytes_per_connection,
                  "this connection has");
  }
  check_answers(answer_bytes_, bytes, limits_.answer_bytes, "clients have");
  held.answer_bytes += bytes;
  answer_bytes_ += bytes;
}

void CallLimits::release(const std::string& connection, std::int64_t answer_bytes) {
  const std::lock_guard lock(mutex_);
  const auto held = held_.find(connection);
  held->second.answer_bytes -= answer_bytes;
  answer_bytes_ -= answer_bytes;
  if (--held->second.calls == 0) held_.erase(held);
}

}  // namespace meshsmooth::server
