#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace meshsmooth::wire {

/// SHA-256 of bytes that come in pieces.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;

  void add(std::span<const std::byte> bytes);
  /// Of all that was added, as 64 hexadecimal digits. Once.
  [[nodiscard]] std::string finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace meshsmooth::wire
