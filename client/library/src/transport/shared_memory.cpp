#include <algorithm>
#include <cstring>
#include <functional>
#include <utility>
#include <vector>

#include "transport/placement.hpp"
#include "transport/segment_pool.hpp"
#include "transport/transfer.hpp"

namespace meshsmooth::client {
namespace {

/// How far into memory other memory begins; behind its end: it does not lie there.
std::size_t offset_in(std::span<const std::byte> memory, const std::byte* other) {
  const std::less<> before;
  if (before(other, memory.data()) || !before(other, memory.data() + memory.size())) {
    return memory.size();
  }
  return static_cast<std::size_t>(other - memory.data());
}

/// In a segment of shared memory.
class SharedMemoryTransfer final : public Transfer {
 public:
  explicit SharedMemoryTransfer(SegmentPool::Borrowed segment) : segment_(std::move(segment)) {}

  bool upload(std::span<const ArrayPart> parts, std::size_t result_bytes,
              v1::JobSpec& spec) override;
  [[nodiscard]] std::span<const std::byte> download() const override { return result_; }
  void hold_positions(std::size_t bytes) override { positions_ = result_.first(bytes); }
  [[nodiscard]] std::span<std::byte> positions() const override { return positions_; }
  [[nodiscard]] bool ended() const override { return segment_.get()->ended(); }
  void keep() override { segment_.keep(); }

 private:
  SegmentPool::Borrowed segment_;
  std::span<std::byte> result_, positions_;
};

bool SharedMemoryTransfer::upload(std::span<const ArrayPart> parts, std::size_t result_bytes,
                                  v1::JobSpec& spec) {
  const std::span<std::byte> all = segment_.get()->bytes();
  const std::size_t kept_at = positions_.empty() ? 0 : offset_in(all, positions_.data());
  Placement placement(kept_at, kept_at + positions_.size());
  v1::SharedMemoryUse use;
  use.set_segment_name(segment_.get()->name());
  std::vector<std::size_t> offsets;  // of the parts
  for (auto part = parts.rbegin(); part != parts.rend();) {
    const auto next = std::find_if(part + 1, parts.rend(),
                                   [](const ArrayPart& p) { return p.offset_bytes == 0; });
    std::size_t bytes = 0;  // of the blocks of an array
    for (auto block = part; block != next; ++block) bytes += block->rest.size();
    std::size_t at = offset_in(all, part->rest.data());
    if (at == all.size()) at = placement.place(bytes);
    v1::SharedMemoryArray* array = use.add_inputs();
    array->set_array_id(part->id);
    array->set_offset_bytes(static_cast<std::int64_t>(at));
    for (; part != next; at += part++->rest.size()) offsets.push_back(at);
  }
  const std::size_t result_at = placement.place(result_bytes);
  if (placement.used() > all.size()) return false;
  use.set_result_offset_bytes(static_cast<std::int64_t>(result_at));
  auto part = parts.rbegin();
  for (const std::size_t at : offsets) {
    const std::span<const std::byte> from = part++->rest;
    if (from.data() != all.data() + at) std::memcpy(all.data() + at, from.data(), from.size());
  }
  result_ = all.subspan(result_at, result_bytes);
  *spec.mutable_shared_memory() = std::move(use);
  return true;
}

class SharedMemoryTransport final : public Transport {
 public:
  explicit SharedMemoryTransport(v1::SmoothingService::Stub& stub) : segments_(stub) {}

  std::unique_ptr<Transfer> open(std::size_t bytes) override {
    SegmentPool::Borrowed segment = segments_.borrow(bytes);
    if (segment.get() == nullptr) return nullptr;
    return std::make_unique<SharedMemoryTransfer>(std::move(segment));
  }

  [[nodiscard]] bool refused(const ServiceError& error) const override {
    if (error.reason().starts_with("SHARED_MEMORY_")) return true;
    return std::ranges::any_of(error.details(), [](const auto& detail) {
      return detail.first == "field" && detail.second.starts_with("shared_memory");
    });
  }

 private:
  SegmentPool segments_;
};

}  // namespace

std::unique_ptr<Transport> make_transport(const std::string& target,
                                          v1::SmoothingService::Stub& stub) {
  // Callers on other hosts could not map it.
  if (!target.starts_with("unix:")) return nullptr;
  return std::make_unique<SharedMemoryTransport>(stub);
}

}  // namespace meshsmooth::client
