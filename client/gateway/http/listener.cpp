#include "http/listener.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stdexcept>

namespace meshsmooth::gateway {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using Phase = Connection::Phase;

std::optional<Connection::TlsContext> make_tls(const Listener::Options& options) {
  if (options.tls_cert.empty()) return std::nullopt;
  std::optional<Connection::TlsContext> tls(std::in_place, asio::ssl::context::tls_server);
  try {
    ::SSL_CTX_set_min_proto_version(tls->native_handle(), TLS1_2_VERSION);
    tls->use_certificate_chain_file(options.tls_cert);
    tls->use_private_key_file(options.tls_key, asio::ssl::context::pem);
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error(
        std::string("--listen-tls-cert and --listen-tls-key are no certificate and key: ") +
        error.what());
  }
  return tls;
}

}  // namespace

Listener::Listener(const Options& options)
    : acceptor_(context_), tls_(make_tls(options)), max_connections_(options.max_connections) {
  try {
    tcp::resolver resolver(context_);
    const auto endpoints =
        resolver.resolve(options.host, std::to_string(options.port), tcp::resolver::passive);
    const tcp::endpoint endpoint = endpoints.begin()->endpoint();
    acceptor_.open(endpoint.protocol());
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    acceptor_.bind(endpoint);
    acceptor_.listen();
    acceptor_.non_blocking(true);
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error("cannot listen on " + options.host + ":" +
                             std::to_string(options.port) + ": " + error.code().message());
  }
  port_ = acceptor_.local_endpoint().port();
  wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (wake_ < 0) throw std::runtime_error("no eventfd");
}

Listener::~Listener() { ::close(wake_); }

void Listener::run(const std::function<void(Connection&)>& serve) {
  while (true) {
    std::array<pollfd, 2> descriptors{{{acceptor_.native_handle(), POLLIN, 0}, {wake_, POLLIN, 0}}};
    ::poll(descriptors.data(), descriptors.size(), -1);
    if (descriptors[1].revents != 0) break;
    join_ended();
    boost::system::error_code error;
    tcp::socket socket = acceptor_.accept(error);
    if (!error) {
      add(std::move(socket), serve);
    } else if (error != asio::error::would_block && error != asio::error::connection_aborted) {
      // Without descriptors or memory: one that gives way frees both.
      make_room();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  acceptor_.close();
  std::unique_lock lock(mutex_);
  for (Entry& entry : entries_) {
    if (!entry.has_ended && entry.connection->phase() < Phase::events) entry.connection->give_way();
  }
  changed_.wait(lock, [this] { return std::ranges::all_of(entries_, &Entry::has_ended); });
  lock.unlock();
  join_ended();
}

void Listener::stop() {
  const std::uint64_t one = 1;
  (void)!::write(wake_, &one, sizeof one);
}

void Listener::add(tcp::socket socket, const std::function<void(Connection&)>& serve) {
  while (true) {
    std::unique_lock lock(mutex_);
    if (entries_.size() < max_connections_) break;
    lock.unlock();
    make_room();
    lock.lock();
    changed_.wait_for(lock, std::chrono::milliseconds(100),
                      [this] { return std::ranges::any_of(entries_, &Entry::has_ended); });
    lock.unlock();
    join_ended();
    pollfd stopped{wake_, POLLIN, 0};
    if (::poll(&stopped, 1, 0) == 1) return;
  }
  boost::system::error_code error;
  socket.set_option(tcp::no_delay(true), error);
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_.emplace_back();
  try {
    entry.connection = std::make_unique<Connection>(std::move(socket), tls_ ? &*tls_ : nullptr);
    entry.thread = std::thread([this, &entry, &serve] {
      serve(*entry.connection);
      const std::lock_guard end(mutex_);
      entry.connection->close();
      entry.has_ended = true;
      changed_.notify_all();
    });
  } catch (const std::exception&) {  // no thread or no memory: this one is dropped
    entries_.pop_back();
  }
}

void Listener::make_room() {
  const std::lock_guard lock(mutex_);
  Connection* first = nullptr;
  for (const Entry& entry : entries_) {
    Connection& one = *entry.connection;
    if (entry.has_ended || !one.can_give_way()) continue;
    // Entries are in order of age: of one phase the oldest is met first.
    if (first == nullptr || one.phase() < first->phase()) first = &one;
  }
  if (first != nullptr) first->give_way();
}

void Listener::end_transfers() {
  const std::lock_guard lock(mutex_);
  for (const Entry& entry : entries_) {
    if (!entry.has_ended && entry.connection->phase() != Phase::work) entry.connection->give_way();
  }
}

void Listener::join_ended() {
  std::list<Entry> ended;
  {
    const std::lock_guard lock(mutex_);
    for (auto entry = entries_.begin(); entry != entries_.end();) {
      const auto next = std::next(entry);
      if (entry->has_ended) ended.splice(ended.end(), entries_, entry);
      entry = next;
    }
  }
  for (Entry& entry : ended) entry.thread.join();
}

}  // namespace meshsmooth::gateway
