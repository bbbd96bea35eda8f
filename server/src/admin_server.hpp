#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "listener.hpp"
#include "wire/descriptor.hpp"

namespace meshsmooth::server {

struct HttpAnswer {
  int status = 200;
  std::string text;
};

/// Serves a few fixed pages in plain HTTP, for probes and Prometheus. One thread reads and writes
/// for all clients, so slow ones delay nobody; each page has a thread of its own, which answers all
/// that wait for it by the same text, so neither a slow page nor a crowd delays the others.
/// Libraries with a thread a client (civetweb) let 200 slow clients delay a probe by 4 s.
class AdminServer {
 public:
  using Pages = std::map<std::string, std::function<HttpAnswer()>, std::less<>>;

  /// Serves `pages` by path on `address` (HOST:PORT; port 0 picks one). Throws
  /// InvalidOption (OPTION_OUT_OF_RANGE) when it cannot be bound.
  AdminServer(const std::string& address, const Pages& pages);
  /// Waits for the pages in progress.
  ~AdminServer();
  AdminServer(const AdminServer&) = delete;
  AdminServer& operator=(const AdminServer&) = delete;

  [[nodiscard]] int port() const { return listener_.port(); }

 private:
  using Clock = std::chrono::steady_clock;
  enum class State : std::uint8_t { reading, waiting, writing, ending };
  struct Client {
    wire::Descriptor socket;
    std::uint64_t id;
    Clock::time_point deadline;  // of its state, unless it waits for us
    State state = State::reading;
    std::string received = {};
    std::string answer = {};
    bool head_only = false;
  };
  struct Page {
    std::function<HttpAnswer()> make;
    std::vector<std::uint64_t> waiting;  // the clients, with the lock
    std::thread thread;
  };
  struct Answered {
    std::uint64_t client;
    HttpAnswer answer;
  };

  void run();
  void take_accepted();
  void take_answers();
  /// Whether the client stays.
  bool serve(Client& client);
  bool read(Client& client);
  void ask(Client& client);
  static bool write(Client& client);
  static void begin_answer(Client& client, const HttpAnswer& answer);
  void answer_page(Page& page);
  void wake() const;

  std::list<Client> clients_;  // the oldest first
  std::uint64_t next_id_ = 0;
  wire::Descriptor wake_;
  std::mutex mutex_;
  std::condition_variable page_wanted_;
  std::map<std::string, Page, std::less<>> pages_;
  std::vector<wire::Descriptor> accepted_;  // with the lock, as the next
  std::vector<Answered> answered_;
  std::atomic<bool> stopped_ = false;
  Listener listener_;
  std::thread thread_;
};

}  // namespace meshsmooth::server
