#include "open_connections.hpp"

#include <sys/socket.h>
#include <sys/stat.h>

#include <algorithm>
#include <utility>

#include "log.hpp"
#include "tcp_traffic.hpp"

namespace meshsmooth::server {
namespace {

// One count of the open connections costs a system call for each.
constexpr auto kCountInterval = std::chrono::milliseconds(20);
constexpr std::size_t kWatchedAtOnce = 256;
constexpr std::size_t kDroppedBytes = 1 << 30;  // more than a socket holds

unsigned long inode_of(int descriptor) {
  struct stat facts {};
  return fstat(descriptor, &facts) == 0 ? facts.st_ino : 0;
}

// Drops what the kernel still holds, which gRPC would read, parse and keep before it sees the end.
void end(int descriptor) {
  shutdown(descriptor, SHUT_RDWR);
  recv(descriptor, nullptr, kDroppedBytes, MSG_TRUNC | MSG_DONTWAIT);
}

}  // namespace

void OpenConnections::add(int descriptor, std::string address, int port) {
  open_[descriptor] = {inode_of(descriptor), std::move(address), port};
}

bool OpenConnections::has_room(const std::string& address) {
  const auto fits = [&] {
    if (open_.size() >= limits_.max_count) return false;
    if (address.empty()) return true;
    const auto same = std::ranges::count_if(
        open_, [&](const auto& entry) { return entry.second.address == address; });
    return static_cast<std::size_t>(same) < limits_.max_count_per_address;
  };
  if (fits()) return true;
  const auto now = Clock::now();
  if (now - counted_ < kCountInterval) return false;
  counted_ = now;
  forget_closed();
  return fits();
}

int OpenConnections::cut(const std::string& peer) {
  forget_closed();
  int count = 0;
  for (const auto& [descriptor, open] : open_) {
    if (!peer.ends_with(':' + std::to_string(open.port)) ||
        peer.find(open.address) == std::string::npos) {
      continue;
    }
    end(descriptor);
    ++count;
  }
  return count;
}

int OpenConnections::cut_floods() {
  int count = 0;
  auto next = open_.upper_bound(watched_);
  for (std::size_t left = std::min(open_.size(), kWatchedAtOnce); left > 0; --left) {
    if (next == open_.end()) next = open_.begin();
    const auto entry = next++;
    watched_ = entry->first;
    if (inode_of(entry->first) != entry->second.inode) {
      open_.erase(entry);
      continue;
    }
    look_at(*entry);
    if (entry->second.unanswered_bytes <= limits_.max_unanswered_bytes) continue;
    end_flood(entry, "more than " + std::to_string(limits_.max_unanswered_bytes) +
                         " bytes without an answer to any of them");
    ++count;
  }
  return count + cut_largest();
}

int OpenConnections::cut_largest() {
  if (!limits_.unanswered_budget_bytes) return 0;
  std::uint64_t sum = 0;
  for (const auto& entry : open_) sum += entry.second.unanswered_bytes;
  const std::uint64_t budget = limits_.unanswered_budget_bytes();
  int count = 0;
  for (; sum > budget; ++count) {
    const auto largest = std::ranges::max_element(
        open_, {}, [](const auto& entry) { return entry.second.unanswered_bytes; });
    sum -= largest->second.unanswered_bytes;
    end_flood(largest, std::to_string(largest->second.unanswered_bytes) +
                           " bytes without an answer, the most of all connections, which have " +
                           "more than " + std::to_string(budget));
  }
  return count;
}

void OpenConnections::end_flood(Entries::iterator flooding, const std::string& why) {
  const auto& [descriptor, open] = *flooding;
  log_cut((open.address.empty() ? "this host" : open.address) + ":" + std::to_string(open.port),
          why);
  end(descriptor);
  open_.erase(flooding);
}

void OpenConnections::look_at(Entries::reference entry) {
  Open& open = entry.second;
  const std::optional<TcpTraffic> traffic = tcp_traffic(entry.first);
  if (!traffic) return;
  if (traffic->sent_bytes != open.sent_bytes) {
    open.sent_bytes = traffic->sent_bytes;
    open.read_bytes = traffic->read_bytes;
  }
  open.unanswered_bytes = traffic->read_bytes - std::min(traffic->read_bytes, open.read_bytes);
}

void OpenConnections::forget_closed() {
  std::erase_if(open_,
                [](const auto& entry) { return inode_of(entry.first) != entry.second.inode; });
}

}  // namespace meshsmooth::server
