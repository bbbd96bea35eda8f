#pragma once

#include <fcntl.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <poll.h>
#include <sched.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <mutex>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "support/process.hpp"

namespace meshsmooth::testing {

/// What a network does to packets, each way.
struct Conditions {
  std::chrono::microseconds delay{};
  double loss = 0;              // share of the packets
  double bytes_per_second = 0;  // 0: no limit
};

/// A network between two addresses that are both here: what is sent to `far` arrives at `near`,
/// late, slowly or never, as if from `far`. Not tc netem, which not every kernel has: a TUN device
/// whose packets come back with their addresses exchanged, which leaves their checksums right.
/// Needs a network namespace of its own (`enter_private_network`).
class BadNetwork {
 public:
  static constexpr const char* kNear = "10.77.0.1";
  static constexpr const char* kFar = "10.77.0.2";

  explicit BadNetwork(int mtu = 1500) : device_(open("/dev/net/tun", O_RDWR | O_CLOEXEC)) {
    ifreq request{};
    request.ifr_flags = IFF_TUN | IFF_NO_PI;
    std::strcpy(request.ifr_name, "bad0");
    if (device_ < 0 || ioctl(device_, TUNSETIFF, &request) != 0) {
      throw std::runtime_error("no TUN device");
    }
    run("ip address add " + std::string(kNear) + " peer " + kFar + " dev bad0");
    run("ip link set bad0 up txqueuelen 10000 mtu " + std::to_string(mtu));
    thread_ = std::thread([this] { forward_all(); });
  }
  ~BadNetwork() {
    stopping_ = true;
    wake();
    thread_.join();
    close(wake_);
    close(device_);
  }
  BadNetwork(const BadNetwork&) = delete;
  BadNetwork& operator=(const BadNetwork&) = delete;

  void set(const Conditions& conditions) {
    const std::lock_guard lock(mutex_);
    conditions_ = conditions;
  }
  /// Nothing passes, until it does again.
  void part() { parted_ = true; }
  void join() { parted_ = false; }

  /// Makes a network namespace for this thread and those that it will make, where that is
  /// allowed: before any other thread is there.
  static void enter_private_network() {
    available_ = access("/dev/net/tun", R_OK | W_OK) == 0 && !find_program("ip").empty() &&
                 unshare(CLONE_NEWNET) == 0 && std::system("ip link set lo up") == 0;
  }
  [[nodiscard]] static bool available() { return available_; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Packet {
    Clock::time_point due;
    std::vector<char> bytes;
  };
  /// One way.
  struct Line {
    std::deque<Packet> packets;
    std::size_t bytes = 0;
    Clock::time_point free;  // when the last packet is on its way
  };
  // As much as a router holds before it drops, at least.
  static constexpr std::size_t kQueueBytes = 256 << 10;

  static void run(const std::string& command) {
    if (std::system(command.c_str()) != 0) throw std::runtime_error("failed: " + command);
  }

  void wake() const {
    const std::uint64_t one = 1;
    if (write(wake_, &one, sizeof one) < 0) std::abort();
  }

  void forward_all() {
    std::vector<char> buffer(1 << 16);
    while (!stopping_) {
      std::array<pollfd, 2> files = {{{device_, POLLIN, 0}, {wake_, POLLIN, 0}}};
      const timespec timeout = until_next();
      ppoll(files.data(), files.size(), &timeout, nullptr);
      if ((files[0].revents & POLLIN) != 0) {
        const ssize_t size = read(device_, buffer.data(), buffer.size());
        if (size > 0) take(buffer.data(), static_cast<std::size_t>(size));
      }
      deliver();
    }
  }

  [[nodiscard]] timespec until_next() const {
    auto next = Clock::now() + std::chrono::seconds(1);
    for (const Line& line : lines_) {
      if (!line.packets.empty()) next = std::min(next, line.packets.front().due);
    }
    const auto left = std::max<Clock::duration>(next - Clock::now(), Clock::duration(0));
    return {left.count() / 1'000'000'000, left.count() % 1'000'000'000};
  }

  void take(char* bytes, std::size_t size) {
    constexpr std::size_t kHeader = 20, kSource = 12, kTarget = 16;
    if (size < kHeader + 4 || (bytes[0] >> 4) != 4 || parted_) return;
    std::swap_ranges(bytes + kSource, bytes + kTarget, bytes + kTarget);
    // The same connection's two ways differ in which port is the larger one.
    const std::size_t ports = static_cast<std::size_t>(bytes[0] & 0xf) * 4;
    Line& line = lines_[std::memcmp(bytes + ports, bytes + ports + 2, 2) < 0 ? 0 : 1];
    Conditions now;
    {
      const std::lock_guard lock(mutex_);
      now = conditions_;
    }
    if (std::uniform_real_distribution<>()(random_) < now.loss) return;
    auto sent = std::max(Clock::now(), line.free);
    if (now.bytes_per_second > 0) {
      if (line.bytes > kQueueBytes) return;
      sent += std::chrono::nanoseconds(
          static_cast<std::int64_t>(1e9 * static_cast<double>(size) / now.bytes_per_second));
    }
    line.free = sent;
    line.bytes += size;
    line.packets.push_back({sent + now.delay, {bytes, bytes + size}});
  }

  void deliver() {
    const auto now = Clock::now();
    for (Line& line : lines_) {
      while (!line.packets.empty() && line.packets.front().due <= now) {
        const std::vector<char>& bytes = line.packets.front().bytes;
        if (!parted_ && write(device_, bytes.data(), bytes.size()) < 0) {
          // Lost, as on any network.
        }
        line.bytes -= bytes.size();
        line.packets.pop_front();
      }
    }
  }

  inline static bool available_ = false;

  const int device_;
  const int wake_ = eventfd(0, EFD_CLOEXEC);
  std::atomic<bool> stopping_ = false, parted_ = false;
  std::mutex mutex_;
  Conditions conditions_;
  std::array<Line, 2> lines_;
  std::mt19937 random_{1};
  std::thread thread_;
};

}  // namespace meshsmooth::testing
