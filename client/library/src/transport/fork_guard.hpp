#pragma once

namespace meshsmooth::client {

/// While this exists, processes that are forked do not keep the socket open: a lease that a child
/// holds too would not end with its parent. Thread-safe.
class ForkGuard {
 public:
  explicit ForkGuard(int socket);
  ~ForkGuard();
  ForkGuard(const ForkGuard&) = delete;
  ForkGuard& operator=(const ForkGuard&) = delete;

 private:
  const int socket_;
};

}  // namespace meshsmooth::client
