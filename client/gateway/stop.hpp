#pragma once

namespace meshsmooth::gateway {

/// Something that one thread tells others once, and that these can poll beside other descriptors.
class Stop {
 public:
  Stop();
  ~Stop();
  Stop(const Stop&) = delete;
  Stop& operator=(const Stop&) = delete;

  void request() noexcept;
  [[nodiscard]] bool requested() const noexcept;
  /// Readable once it is requested.
  [[nodiscard]] int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

}  // namespace meshsmooth::gateway
