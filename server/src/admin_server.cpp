#include "admin_server.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <exception>
#include <string_view>
#include <utility>

namespace meshsmooth::server {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMaxClients = 256;
constexpr std::size_t kMaxRequestBytes = 8192;
// For a request to arrive, for an answer to be read, and for the client to close then.
constexpr auto kTimeout = 5s;
constexpr auto kTick = 100ms;

const char* phrase(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 400:
      return "Bad Request";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    default:
      return "Service Unavailable";
  }
}

Listener::Limits limits() {
  return {.max_connections = 1 << 20,  // the clients are counted here
          .max_connections_per_address = 1 << 20,
          .max_descriptor = max_connection_descriptor(),
          .first_byte_timeout = kTimeout};
}

bool again() { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

}  // namespace

AdminServer::AdminServer(const std::string& address, const Pages& pages)
    : wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)), listener_(address, limits(), "admin-listen") {
  for (const auto& [path, make] : pages) pages_[path].make = make;
  for (auto& [path, page] : pages_) page.thread = std::thread([this, &page] { answer_page(page); });
  thread_ = std::thread([this] { run(); });
  listener_.start([this](int descriptor, int) {
    {
      const std::lock_guard lock(mutex_);
      accepted_.emplace_back(descriptor);
    }
    wake();
  });
}

AdminServer::~AdminServer() {
  listener_.close();
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  page_wanted_.notify_all();
  wake();
  thread_.join();
  for (auto& [path, page] : pages_) page.thread.join();
}

void AdminServer::wake() const {
  const std::uint64_t one = 1;
  static_cast<void>(!::write(wake_.number(), &one, sizeof one));
}

void AdminServer::answer_page(Page& page) {
  std::unique_lock lock(mutex_);
  for (;;) {
    page_wanted_.wait(lock, [&] { return stopped_ || !page.waiting.empty(); });
    if (stopped_) return;
    const std::vector<std::uint64_t> clients = std::exchange(page.waiting, {});
    lock.unlock();
    HttpAnswer answer;
    try {
      answer = page.make();
    } catch (const std::exception& error) {
      answer = {503, std::string(error.what()) + '\n'};
    }
    lock.lock();
    for (const std::uint64_t client : clients) answered_.push_back({client, answer});
    wake();
  }
}

void AdminServer::run() {
  std::vector<pollfd> events;
  while (!stopped_) {
    events = {{wake_.number(), POLLIN, 0}};
    for (const Client& client : clients_) {
      const short wanted = client.state == State::waiting   ? 0
                           : client.state == State::writing ? POLLOUT
                                                            : POLLIN;
      events.push_back({client.socket.number(), wanted, 0});
    }
    const int timeout = clients_.empty() ? -1 : static_cast<int>(kTick.count());
    if (poll(events.data(), events.size(), timeout) < 0) continue;
    const auto now = Clock::now();
    std::size_t place = 1;
    for (auto client = clients_.begin(); client != clients_.end(); ++place) {
      const bool late = client->state != State::waiting && now >= client->deadline;
      const bool stays = events[place].revents == 0 ? !late : serve(*client);
      client = stays ? std::next(client) : clients_.erase(client);
    }
    std::uint64_t ignored = 0;
    static_cast<void>(!::read(wake_.number(), &ignored, sizeof ignored));
    take_answers();
    take_accepted();
  }
}

void AdminServer::take_accepted() {
  std::vector<wire::Descriptor> accepted;
  {
    const std::lock_guard lock(mutex_);
    accepted.swap(accepted_);
  }
  for (wire::Descriptor& socket : accepted) {
    if (clients_.size() >= kMaxClients) clients_.pop_front();
    clients_.push_back({std::move(socket), next_id_++, Clock::now() + kTimeout});
    // Most requests are there as a whole.
    if (!serve(clients_.back())) clients_.pop_back();
  }
}

void AdminServer::take_answers() {
  std::vector<Answered> answered;
  {
    const std::lock_guard lock(mutex_);
    answered.swap(answered_);
  }
  for (const Answered& one : answered) {
    const auto client = std::ranges::find(clients_, one.client, &Client::id);
    if (client == clients_.end()) continue;  // it gave way
    begin_answer(*client, one.answer);
    if (!write(*client)) clients_.erase(client);
  }
}

bool AdminServer::serve(Client& client) {
  switch (client.state) {
    case State::reading:
      return read(client);
    case State::waiting:
      return false;  // it has closed
    case State::writing:
      return write(client);
    case State::ending:
      break;
  }
  std::array<char, 4096> ignored;
  const ssize_t count = recv(client.socket.number(), ignored.data(), ignored.size(), 0);
  return count > 0 || (count < 0 && again());
}

bool AdminServer::read(Client& client) {
  std::array<char, 4096> buffer;
  const ssize_t count = recv(client.socket.number(), buffer.data(), buffer.size(), 0);
  if (count <= 0) return count < 0 && again();
  client.received.append(buffer.data(), static_cast<std::size_t>(count));
  if (client.received.find("\r\n\r\n") != std::string::npos) {
    ask(client);
  } else if (client.received.size() > kMaxRequestBytes) {
    begin_answer(client, {400, "the request is too long\n"});
  }
  return client.state != State::writing || write(client);
}

void AdminServer::ask(Client& client) {
  const std::string_view line =
      std::string_view(client.received).substr(0, client.received.find("\r\n"));
  const std::size_t method_end = line.find(' '), target_end = line.rfind(' ');
  if (method_end == std::string_view::npos || target_end <= method_end ||
      !line.substr(target_end + 1).starts_with("HTTP/1.")) {
    begin_answer(client, {400, "not a request of HTTP/1\n"});
    return;
  }
  const std::string_view method = line.substr(0, method_end);
  std::string_view path = line.substr(method_end + 1, target_end - method_end - 1);
  path = path.substr(0, path.find('?'));
  client.head_only = method == "HEAD";
  const auto page = pages_.find(path);
  if (page == pages_.end()) {
    begin_answer(client, {404, "not found\n"});
  } else if (method != "GET" && method != "HEAD") {
    begin_answer(client, {405, "only GET and HEAD\n"});
  } else {
    client.state = State::waiting;
    {
      const std::lock_guard lock(mutex_);
      page->second.waiting.push_back(client.id);
    }
    page_wanted_.notify_all();
  }
}

void AdminServer::begin_answer(Client& client, const HttpAnswer& answer) {
  client.answer = fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\n"
      "Content-Length: {}\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n{}",
      answer.status, phrase(answer.status), answer.text.size(),
      client.head_only ? "" : answer.text);
  client.state = State::writing;
  client.deadline = Clock::now() + kTimeout;
}

bool AdminServer::write(Client& client) {
  const ssize_t count = send(client.socket.number(), client.answer.data(), client.answer.size(),
                             MSG_NOSIGNAL | MSG_DONTWAIT);
  if (count < 0) return again();
  client.answer.erase(0, static_cast<std::size_t>(count));
  if (client.answer.empty()) {
    // To close at once would reset the connection where the client still sends, and it would
    // lose the answer.
    shutdown(client.socket.number(), SHUT_WR);
    client.state = State::ending;
    client.deadline = Clock::now() + kTimeout;
  }
  return true;
}

}  // namespace meshsmooth::server
