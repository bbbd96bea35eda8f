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

unsigned long inode_of(int descriptor) {
  struct stat facts {};
  return fstat(descriptor, &facts) == 0 ? facts.st_ino : 0;
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
    shutdown(descriptor, SHUT_RDWR);
    ++count;
  }
  return count;
}

int OpenConnections::cut_floods() {
  int count = 0;
  auto next = open_.upper_bound(watched_);
  for (std::size_t left = std::min(open_.size(), kWatchedAtOnce); left > 0; --left) {
    if (next == open_.end()) next = open_.begin();
    watched_ = next->first;
    const bool closed = inode_of(next->first) != next->second.inode;
    const bool flooding = !closed && floods(*next);
    if (flooding) {
      log_cut((next->second.address.empty() ? "this host" : next->second.address) + ":" +
                  std::to_string(next->second.port),
              "more than " + std::to_string(limits_.max_unanswered_bytes) +
                  " bytes without an answer to any of them");
      shutdown(next->first, SHUT_RDWR);
      ++count;
    }
    next = closed || flooding ? open_.erase(next) : std::next(next);
  }
  return count;
}

bool OpenConnections::floods(Entries::reference entry) const {
  Open& open = entry.second;
  const std::optional<TcpTraffic> traffic = tcp_traffic(entry.first);
  if (!traffic) return false;
  if (traffic->sent_bytes != open.sent_bytes) {
    open.sent_bytes = traffic->sent_bytes;
    open.read_bytes = traffic->read_bytes;
  }
  return traffic->read_bytes > open.read_bytes + limits_.max_unanswered_bytes;
}

void OpenConnections::forget_closed() {
  std::erase_if(open_,
                [](const auto& entry) { return inode_of(entry.first) != entry.second.inode; });
}

}  // namespace meshsmooth::server
