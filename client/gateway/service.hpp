#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <semaphore>
#include <string>

#include "client_process.hpp"
#include "operation.hpp"
#include "settings.hpp"
#include "stop.hpp"
#include "work_folder.hpp"

namespace meshsmooth::gateway {

/// A request whose files have arrived.
struct Order {
  Operation operation;
  Parameters parameters;
  std::string token;        // of the caller; empty: none
  std::string caller;       // by what it is told from others; empty: one of this host
  std::string traceparent;  // the same
  std::string mesh_name;    // as the caller calls it: for headers only
  std::map<std::string, std::string> files;  // names in the folder, by part
};

/// Where the files of an order that is done lie in its folder; empty: there is none.
struct Outcome {
  std::string mesh, report, summary, quality;
  std::string download_name;  // of the mesh
};

/// What the requests share: the limits, and the processes that work for them. Thread-safe.
class Service {
 public:
  /// A place among those that are served at a time; it ends with the object.
  class Place {
   public:
    Place(Service& service, std::string caller) : service_(&service), caller_(std::move(caller)) {}
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    Service* service_;
    std::string caller_;
  };

  explicit Service(Settings settings);

  /// Throws `Problem` (QUEUE_FULL, DRAINING). A caller who is not of this host has three quarters
  /// of the places at most.
  [[nodiscard]] std::shared_ptr<Place> admit(const std::string& caller);
  /// To be called before anything of a caller is read. Where other machines reach the gateway, a
  /// caller needs a token that the server knows. Throws `Problem` (TOKEN_MISSING, TOKEN_UNKNOWN).
  void check_token(const std::string& token);
  /// Waits for its turn, then runs the client. `on_progress` gets an object at the start and for
  /// each report. Throws `Problem`.
  [[nodiscard]] Outcome run(const Order& order, const RequestFolder& folder,
                            Interruptions interruptions,
                            const std::function<void(const nlohmann::json&)>& on_progress);
  /// Whether the server serves.
  [[nodiscard]] bool is_ready();

  /// From now on nobody is admitted.
  void drain() { draining_ = true; }
  /// Ends what still runs.
  void stop() { stop_.request(); }
  [[nodiscard]] bool is_draining() const { return draining_; }
  [[nodiscard]] const Stop& stopped() const { return stop_; }

  [[nodiscard]] const Settings& settings() const { return settings_; }
  [[nodiscard]] WorkFolder& work() { return work_; }

 private:
  class Turn;

  /// A call of the client that has no mesh.
  [[nodiscard]] CallResult ask_server(const std::string& command, const std::string& token);

  void add_server(const std::string& token, const RequestFolder& folder,
                  std::vector<std::string>& arguments) const;

  const Settings settings_;
  WorkFolder work_;
  Stop stop_;
  std::atomic<bool> draining_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<const Turn*> waiting_;                // in order of arrival
  std::map<std::string, int> running_, admitted_;  // by caller
  std::counting_semaphore<> questions_;            // to the server, that may run at a time
  std::mutex tokens_mutex_;
  std::map<std::string, std::chrono::steady_clock::time_point> known_tokens_;  // until then
  std::mutex ready_mutex_;
  std::chrono::steady_clock::time_point ready_checked_{};
  bool ready_ = false;
};

}  // namespace meshsmooth::gateway
