#include "transport/copy_threads.hpp"

#include <utility>

namespace meshsmooth::server {
namespace {

// Two, so that a large mesh does not hold up a small one; they saturate the memory's bandwidth.
constexpr int kThreadCount = 2;

}  // namespace

CopyThreads::CopyThreads() {
  for (int i = 0; i < kThreadCount; ++i) threads_.emplace_back([this] { work(); });
}

CopyThreads::~CopyThreads() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
}

void CopyThreads::post(Task task) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
  }
  changed_.notify_one();
}

void CopyThreads::work() {
  for (;;) {
    Task task;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return closed_ || !tasks_.empty(); });
      if (closed_) return;
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    task();
  }
}

}  // namespace meshsmooth::server
