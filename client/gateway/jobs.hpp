#pragma once

#include <chrono>
#include <condition_variable>
#include <list>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>

#include "problem.hpp"
#include "service.hpp"

namespace meshsmooth::gateway {

enum class JobState { waiting, running, done, failed, cancelled };

/// A job with an address: it runs without a caller who waits, and its files stay for a while.
/// Thread-safe.
class KeptJob {
 public:
  KeptJob(std::string id, Order order, std::unique_ptr<RequestFolder> folder);

  [[nodiscard]] const std::string& id() const { return id_; }
  /// Whether a caller with this token may see it; a job of nobody is everybody's who knows its id.
  [[nodiscard]] bool belongs_to(const std::string& token) const;
  /// "id", "state", "progress" and "problem".
  [[nodiscard]] nlohmann::json to_json() const;
  [[nodiscard]] bool has_ended() const;
  /// Waits until there is something newer than `version`, at most that long. Returns the newest
  /// version: it grows with every change.
  [[nodiscard]] std::uint64_t wait(std::uint64_t version, std::chrono::milliseconds longest) const;
  /// Throws `Problem`: its own where it failed, JOB_NOT_FINISHED where it runs.
  [[nodiscard]] Outcome outcome() const;
  [[nodiscard]] const RequestFolder& folder() const { return *folder_; }

  void cancel() { cancel_.request(); }
  /// To its end; by a thread of its own.
  void run(Service& service, std::shared_ptr<Service::Place> place);

 private:
  friend class JobStore;
  void change(const std::function<void()>& change);

  const std::string id_;
  const Order order_;
  const std::unique_ptr<RequestFolder> folder_;
  Stop cancel_;
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::uint64_t version_ = 1;
  JobState state_ = JobState::waiting;
  nlohmann::json progress_ = nlohmann::json::object();
  std::optional<Problem> problem_;
  Outcome outcome_;
  std::chrono::steady_clock::time_point ended_{};
};

/// The jobs with an address. Thread-safe.
class JobStore {
 public:
  explicit JobStore(Service& service);
  /// Cancels what runs, and waits for it.
  ~JobStore();
  JobStore(const JobStore&) = delete;
  JobStore& operator=(const JobStore&) = delete;

  /// Throws `Problem` (QUEUE_FULL) where as many are kept as may be and all of them run.
  [[nodiscard]] std::shared_ptr<KeptJob> start(Order order, std::unique_ptr<RequestFolder> folder,
                                               std::shared_ptr<Service::Place> place);
  /// Throws `Problem` (JOB_NOT_FOUND).
  [[nodiscard]] std::shared_ptr<KeptJob> find(const std::string& id, const std::string& token);
  /// Cancels a job that runs, removes one that has ended. Throws `Problem` (JOB_NOT_FOUND).
  void remove(const std::string& id, const std::string& token);

 private:
  struct Entry {
    std::shared_ptr<KeptJob> job;
    std::jthread thread;
  };

  /// Removes those whose time is over; with `one`, also the oldest that has ended.
  void expire(bool one);

  Service& service_;
  std::mutex mutex_;
  std::list<Entry> jobs_;  // the oldest first
  std::condition_variable_any wake_;
  std::jthread maintenance_;  // the first to end
};

}  // namespace meshsmooth::gateway
