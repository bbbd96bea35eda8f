#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "meshsmooth/v1/smoothing.pb.h"
#include "transport/fork_guard.hpp"
#include "wire/descriptor.hpp"

namespace meshsmooth::client {

/// Memory shared with the server, as long as this lives. Forked processes do not get it.
class LeasedSegment {
 public:
  /// Fetches a segment from the server's socket and has its pages made, which takes about as long
  /// as sending them twice. Null where that is not possible, or when `cancel` becomes readable.
  [[nodiscard]] static std::unique_ptr<LeasedSegment> fetch(
      const v1::LeaseSharedMemoryResponse& lease, int cancel);
  ~LeasedSegment();
  LeasedSegment(const LeasedSegment&) = delete;
  LeasedSegment& operator=(const LeasedSegment&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::span<std::byte> bytes() const { return bytes_; }
  /// Becomes readable when the segment is lost or recalled.
  [[nodiscard]] int socket() const { return socket_.number(); }
  /// Whether it is lost or recalled: give it up. Does not wait.
  [[nodiscard]] bool ended() const;

 private:
  LeasedSegment(std::string name, wire::Descriptor socket, std::span<std::byte> bytes);

  const std::string name_;
  wire::Descriptor socket_;
  const ForkGuard guard_;  // of that socket
  const std::span<std::byte> bytes_;
  const int process_;  // that has mapped it
};

}  // namespace meshsmooth::client
