#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace meshsmooth::server {

/// Threads that copy between memory of callers and the arrays of jobs, so that no thread of gRPC
/// does. Thread-safe.
class CopyThreads {
 public:
  using Task = std::function<void()>;
  /// Handing over a task that moves no more takes longer than the copy. A gRPC thread copies as
  /// much of any message that it receives.
  static constexpr std::int64_t kAtOnceBytes = 4 << 20;

  CopyThreads();
  /// Finishes what runs; what waits is dropped.
  ~CopyThreads();
  CopyThreads(const CopyThreads&) = delete;
  CopyThreads& operator=(const CopyThreads&) = delete;

  /// Has a thread run the task.
  void post(Task task);

 private:
  void work();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Task> tasks_;
  bool closed_ = false;
  std::vector<std::jthread> threads_;
};

}  // namespace meshsmooth::server
