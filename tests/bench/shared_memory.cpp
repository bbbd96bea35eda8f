#include "shared_memory.hpp"

#include <grpcpp/create_channel.h>
#include <sys/eventfd.h>

#include <chrono>
#include <cstring>
#include <span>
#include <stdexcept>
#include <utility>

#include "meshsmooth/v1/smoothing.grpc.pb.h"
#include "transport/leased_segment.hpp"
#include "wire/codec.hpp"
#include "wire/mesh_layout.hpp"

namespace meshsmooth::bench {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_of(const auto& body) {
  const auto begin = Clock::now();
  body();
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

client::RequestOptions sharing(bool shared) {
  client::RequestOptions request;
  request.shared_memory = shared;
  return request;
}

}  // namespace

/// A mesh whose arrays were built in a segment: a call moves no byte of them.
class SharedMemory::Inside {
 public:
  Inside(const std::string& address, const Mesh& mesh, const SmoothOptions& options)
      : stub_(v1::SmoothingService::NewStub(
            grpc::CreateChannel(address, grpc::InsecureChannelCredentials()))) {
    v1::JobSpec& spec = *request_.mutable_spec();
    *spec.mutable_inline_topology() = wire::encode_topology_spec(MeshTopology(mesh).view());
    spec.set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
    spec.set_quality_detail(v1::QUALITY_DETAIL_BRIEF);
    *spec.mutable_options() = wire::encode_options(options);
    const auto elements = std::as_bytes(std::span(mesh.blocks.front().nodes));
    const auto positions = std::as_bytes(std::span(std::get<std::vector<Vec3d>>(mesh.positions)));
    const std::size_t offset = (elements.size() + 63) / 64 * 64;
    lease(offset + positions.size());
    std::memcpy(segment_->bytes().data(), elements.data(), elements.size());
    std::memcpy(segment_->bytes().data() + offset, positions.data(), positions.size());
    v1::SharedMemoryUse& use = *spec.mutable_shared_memory();
    use.set_segment_name(segment_->name());
    use.add_inputs()->set_array_id(v1::ARRAY_ID_ELEMENTS);
    use.add_inputs()->set_array_id(v1::ARRAY_ID_COORDINATES);
    use.mutable_inputs(1)->set_offset_bytes(static_cast<std::int64_t>(offset));
    use.set_result_offset_bytes(static_cast<std::int64_t>(offset));  // in place
  }

  void call() {
    grpc::ClientContext context;
    const auto stream = stub_->Smooth(&context);
    stream->WriteLast(request_, {});
    bool in_segment = false;
    for (v1::SmoothResponse response; stream->Read(&response);) {
      in_segment |= response.has_result() && response.result().in_place();
    }
    if (!stream->Finish().ok() || !in_segment) throw std::runtime_error("the call failed");
  }

 private:
  void lease(std::size_t bytes) {
    grpc::ClientContext context;
    v1::LeaseSharedMemoryRequest request;
    request.set_size_bytes(static_cast<std::int64_t>(bytes));
    v1::LeaseSharedMemoryResponse lease;
    const wire::Descriptor never(eventfd(0, EFD_CLOEXEC));
    if (stub_->LeaseSharedMemory(&context, request, &lease).ok()) {
      segment_ = client::LeasedSegment::fetch(lease, never.number());
    }
    if (segment_ == nullptr) throw std::runtime_error("the server shares no memory");
  }

  std::unique_ptr<v1::SmoothingService::Stub> stub_;
  std::unique_ptr<client::LeasedSegment> segment_;
  v1::SmoothRequest request_;
};

SharedMemory::SharedMemory(const std::string& address) : client_(address), address_(address) {}
SharedMemory::~SharedMemory() = default;

void SharedMemory::warm_up(Mesh& mesh, const SmoothOptions& options) {
  const auto limit = Clock::now() + std::chrono::seconds(60);
  while (!client_.smooth(mesh, options).shared_memory) {
    if (Clock::now() > limit) throw std::runtime_error("the server shares no memory");
  }
  auto& inside = inside_[&mesh];
  if (!inside) inside = std::make_unique<Inside>(address_, mesh, options);
}

SharedMemory::Seconds SharedMemory::measure(Mesh& mesh, const SmoothOptions& options) {
  Seconds seconds{};
  seconds.chunks = seconds_of([&] { client_.smooth(mesh, options, sharing(false)); });
  bool shared = false;
  seconds.copied =
      seconds_of([&] { shared = client_.smooth(mesh, options, sharing(true)).shared_memory; });
  if (!shared) throw std::runtime_error("the segment was lost");
  seconds.inside = seconds_of([&] { inside_.at(&mesh)->call(); });
  return seconds;
}

}  // namespace meshsmooth::bench
