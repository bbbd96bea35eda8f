#include "transport/segment_pool.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

namespace meshsmooth::client {
namespace {

constexpr auto kLeaseTimeout = std::chrono::seconds(5);
constexpr auto kRetryAfter = std::chrono::seconds(30);

void raise(const wire::Descriptor& event) {
  const std::uint64_t one = 1;
  static_cast<void>(!write(event.number(), &one, sizeof one));
}

}  // namespace

SegmentPool::SegmentPool(v1::SmoothingService::Stub& stub)
    : stub_(stub),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      stop_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

SegmentPool::~SegmentPool() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    if (leasing_ != nullptr) leasing_->TryCancel();
  }
  raise(stop_);
  if (thread_.joinable()) thread_.join();
}

SegmentPool::Borrowed SegmentPool::borrow(std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  std::erase_if(idle_, [](const auto& segment) { return segment->ended(); });
  const auto found = std::ranges::find_if(
      idle_, [&](const auto& segment) { return segment->bytes().size() >= bytes; });
  if (found != idle_.end()) {
    Borrowed borrowed(*this, std::move(*found));
    idle_.erase(found);
    return borrowed;
  }
  idle_.clear();  // too small: a larger one takes their place
  if (Clock::now() < next_try_) return {};
  wanted_bytes_ = std::max(wanted_bytes_, bytes + bytes / 8);
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  raise(wake_);
  return {};
}

void SegmentPool::give_back(std::unique_ptr<LeasedSegment> segment) {
  const std::lock_guard lock(mutex_);
  if (!segment->ended()) idle_.push_back(std::move(segment));
  raise(wake_);  // to watch it
}

void SegmentPool::run() {
  std::vector<pollfd> events;
  for (;;) {
    std::size_t bytes = 0;
    {
      const std::lock_guard lock(mutex_);
      if (stopped_) return;
      std::erase_if(idle_, [](const auto& segment) { return segment->ended(); });
      bytes = wanted_bytes_;
      events = {{stop_.number(), POLLIN, 0}, {wake_.number(), POLLIN, 0}};
      for (const auto& segment : idle_) events.push_back({segment->socket(), POLLIN, 0});
    }
    if (bytes > 0) {
      auto segment = make(bytes);
      const std::lock_guard lock(mutex_);
      wanted_bytes_ = 0;
      if (segment == nullptr) next_try_ = Clock::now() + kRetryAfter;
      if (segment != nullptr) idle_.push_back(std::move(segment));
      continue;
    }
    // A segment that is borrowed meanwhile is at worst polled once too often.
    poll(events.data(), events.size(), -1);
    std::uint64_t ignored = 0;
    static_cast<void>(!read(wake_.number(), &ignored, sizeof ignored));
  }
}

std::unique_ptr<LeasedSegment> SegmentPool::make(std::size_t bytes) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kLeaseTimeout);
  v1::LeaseSharedMemoryRequest request;
  request.set_size_bytes(static_cast<std::int64_t>(bytes));
  v1::LeaseSharedMemoryResponse lease;
  const auto set_leasing = [this](grpc::ClientContext* call) {
    const std::lock_guard lock(mutex_);
    if (stopped_ && call != nullptr) call->TryCancel();
    leasing_ = call;
  };
  set_leasing(&context);
  const grpc::Status status = stub_.LeaseSharedMemory(&context, request, &lease);
  set_leasing(nullptr);
  return status.ok() ? LeasedSegment::fetch(lease, stop_.number()) : nullptr;
}

}  // namespace meshsmooth::client
