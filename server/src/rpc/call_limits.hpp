#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <utility>

namespace meshsmooth::server {

class CallLimits;

/// The place of one unfinished call and of its answer; returned on destruction. Move-only; the
/// `CallLimits` outlives it.
class CallPlace {
 public:
  CallPlace() = default;
  CallPlace(CallPlace&& other) noexcept
      : limits_(std::exchange(other.limits_, nullptr)),
        connection_(std::move(other.connection_)),
        answer_bytes_(other.answer_bytes_) {}
  CallPlace& operator=(CallPlace&& other) noexcept {
    std::swap(limits_, other.limits_);
    std::swap(connection_, other.connection_);
    std::swap(answer_bytes_, other.answer_bytes_);
    return *this;
  }
  ~CallPlace();

  /// Counts the answer of a unary call until the client has it. Throws Busy (QUOTA_EXCEEDED).
  void hold_answer(std::int64_t bytes);

 private:
  friend class CallLimits;
  CallPlace(CallLimits* limits, std::string connection)
      : limits_(limits), connection_(std::move(connection)) {}

  CallLimits* limits_ = nullptr;
  std::string connection_;
  std::int64_t answer_bytes_ = 0;
};

/// Counts the unfinished calls of each connection, and the answers that their clients have not
/// read. The limit of streams that HTTP/2 announces binds only clients that acknowledge it.
/// Thread-safe.
class CallLimits {
 public:
  /// Where connections cannot be told apart, only the sum of the answers is limited.
  struct Limits {
    int calls_per_connection;
    std::int64_t answer_bytes_per_connection;
    std::int64_t answer_bytes;
  };
  /// `cut` ends a connection that begins many more calls than it may.
  explicit CallLimits(
      Limits limits, std::function<void(const std::string&)> cut = [](const std::string&) {})
      : limits_(limits), cut_(std::move(cut)) {}

  /// Throws Busy (QUOTA_EXCEEDED). O(log connections).
  [[nodiscard]] CallPlace take(const std::string& connection);

 private:
  friend class CallPlace;
  void hold_answer(const std::string& connection, std::int64_t bytes);
  void release(const std::string& connection, std::int64_t answer_bytes);

  struct Held {
    int calls = 0, refused = 0;
    std::int64_t answer_bytes = 0;
  };
  const Limits limits_;
  const std::function<void(const std::string&)> cut_;
  std::mutex mutex_;
  std::map<std::string, Held> held_;  // by connection
  std::int64_t answer_bytes_ = 0;
};

}  // namespace meshsmooth::server
