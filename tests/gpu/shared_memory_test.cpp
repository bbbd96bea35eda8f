// Jobs of the service whose coordinates lie in a segment that the device reads and writes by
// itself.

#include <gmock/gmock.h>

#include <atomic>
#include <limits>
#include <optional>
#include <random>
#include <thread>

#include "core/smoothing.hpp"
#include "gpu/gpu_meshes.hpp"
#include "meshsmooth/server.hpp"
#include "server/conservation.hpp"
#include "server/segment_caller.hpp"
#include "support/cuda_device.hpp"
#include "support/in_process_server.hpp"
#include "support/second_order.hpp"
#include "wire/codec.hpp"
#include "wire/mesh_layout.hpp"

namespace meshsmooth {
namespace {

using testing::SegmentCaller;
using testing::SmoothCall;
using testing::Stub;

server::ServerConfig config(int lanes) {
  server::ServerConfig config = testing::sharing_config(testing::quiet_config());
  config.backend = "cuda";
  config.lanes = lanes;
  config.warm_up = false;
  return config;
}

std::size_t aligned(std::size_t bytes) { return (bytes + 63) / 64 * 64; }

/// A mesh in a segment: elements, coordinates, and the result behind them.
class MeshInSegment {
 public:
  MeshInSegment(Stub& stub, const Mesh& mesh, const SmoothOptions& options)
      : mesh_(mesh),
        elements_(as_text(mesh.blocks[0].nodes)),
        coordinates_(
            std::visit([](const auto& points) { return as_text(points); }, mesh.positions)),
        segment_(SegmentCaller::ready(
            stub, static_cast<std::int64_t>(result_offset() + coordinates_.size()))) {
    segment_.write(0, elements_);
    write(coordinates_);
    *spec_.mutable_inline_topology() = wire::encode_topology_spec(MeshTopology(mesh).view());
    spec_.set_coordinate_type(wire::encode_position_type(mesh.positions_view()));
    *spec_.mutable_options() = wire::encode_options(options);
    v1::SharedMemoryUse* const use = spec_.mutable_shared_memory();
    use->set_segment_name(segment_.lease().segment_name());
    add_input(v1::ARRAY_ID_ELEMENTS, 0);
    add_input(v1::ARRAY_ID_COORDINATES, coordinates_offset());
    use->set_result_offset_bytes(static_cast<std::int64_t>(result_offset()));
  }

  [[nodiscard]] const v1::JobSpec& spec() const { return spec_; }
  void write(const std::string& coordinates) const {
    segment_.write(coordinates_offset(), coordinates);
  }
  [[nodiscard]] std::span<std::byte> coordinates() const {
    return segment_.bytes().subspan(coordinates_offset(), coordinates_.size());
  }
  [[nodiscard]] const std::string& own_coordinates() const { return coordinates_; }
  [[nodiscard]] bool has_result(const Mesh& expected) const {
    return segment_.read(result_offset(), coordinates_.size()) ==
           std::visit([](const auto& points) { return as_text(points); }, expected.positions);
  }
  [[nodiscard]] SegmentCaller& segment() { return segment_; }

 private:
  template <class T>
  static std::string as_text(const std::vector<T>& values) {
    return testing::bytes_of(values);
  }
  void add_input(v1::ArrayId id, std::size_t offset) {
    v1::SharedMemoryArray* const array = spec_.mutable_shared_memory()->add_inputs();
    array->set_array_id(id);
    array->set_offset_bytes(static_cast<std::int64_t>(offset));
  }
  [[nodiscard]] std::size_t coordinates_offset() const { return aligned(elements_.size()); }
  [[nodiscard]] std::size_t result_offset() const {
    return coordinates_offset() + aligned(coordinates_.size());
  }

  const Mesh mesh_;
  const std::string elements_, coordinates_;
  SegmentCaller segment_;
  v1::JobSpec spec_;
};

/// Sends a job that needs no more than its spec.
void begin(SmoothCall& call, const MeshInSegment& mesh) {
  call.send(mesh.spec());
  call.half_close();
  call.read_accepted();
}

class CudaSharedMemory : public test::CudaTest {
 protected:
  void SetUp() override {
    CudaTest::SetUp();
    if (IsSkipped()) return;
    server_.emplace(config(1));
    server_->start();
    stub_.emplace(server_->in_process_channel());
  }

  std::optional<server::Server> server_;
  std::optional<Stub> stub_;
};

TEST_F(CudaSharedMemory, GiveTheBitsOfASmootherAlone) {
  const auto smoother = make_smoother("cuda:0");
  const Mesh cube = test::noisy(test::lattice(ElementType::tetrahedron, 20), 0.15, 1);
  for (const Mesh& mesh : {cube, test::as_float32(cube),
                           test::noisy(test::lattice(ElementType::hexahedron, 12), 0.1, 2),
                           test::noisy(test::sphere(4), 0.01, 3), test::second_order(cube)}) {
    for (const Method& method : {Method(Laplacian{}), Method(Optimize{})}) {
      const SmoothOptions options{.method = method, .max_iterations = 5};
      const MeshInSegment shared(*stub_, mesh, options);
      for (int i = 0; i < 2; ++i) {
        SmoothCall call(*stub_);
        begin(call, shared);
        EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
        EXPECT_TRUE(shared.has_result(test::smooth_on(*smoother, mesh, options).mesh));
      }
    }
  }
}

TEST_F(CudaSharedMemory, AreReadWhenTheJobRuns) {
  const SmoothOptions options{.method = Laplacian{}, .max_iterations = 3};
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 12), 0.1, 1);
  const Mesh later = test::noisy(mesh, 0.05, 2);
  const SmoothOptions endless = test::sweeps(1'000'000'000, Laplacian{.relaxation = 0.25});
  const MeshInSegment busy(*stub_, test::noisy(test::lattice(ElementType::tetrahedron, 30), 0.1, 3),
                           endless);
  const MeshInSegment shared(*stub_, mesh, options);
  SmoothCall first(*stub_);
  begin(first, busy);
  SmoothCall second(*stub_);
  begin(second, shared);  // queued behind it
  shared.write(testing::bytes_of(std::get<std::vector<Vec3d>>(later.positions)));
  first.cancel();
  first.finish();
  EXPECT_TRUE(second.finish().ok()) << second.finish().error_message();
  EXPECT_TRUE(shared.has_result(test::smooth_on(*make_smoother("cuda:0"), later, options).mesh));
}

// What is written at the same time spoils a job's numbers, or has it refused; the next is right.
TEST_F(CudaSharedMemory, MayBeWrittenByOthersMeanwhile) {
  const SmoothOptions options{.method = Optimize{}, .max_iterations = 3};
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 20), 0.1, 1);
  const MeshInSegment shared(*stub_, mesh, options);
  {
    std::atomic<bool> stopped = false;
    std::thread scribbler([&] {
      std::mt19937 random(1);
      const auto all = shared.coordinates();
      auto* const values = reinterpret_cast<volatile double*>(all.data());
      const std::size_t count = all.size() / sizeof(double);
      while (!stopped) {
        const std::size_t at = random() % count;
        values[at] = std::numeric_limits<double>::quiet_NaN();
        values[at] = 0.5;
        values[random() % count] = 1e300;
      }
    });
    for (int i = 0; i < 100; ++i) {
      shared.write(shared.own_coordinates());
      SmoothCall call(*stub_);
      begin(call, shared);
      const grpc::Status& status = call.finish();
      EXPECT_TRUE(status.ok() || status.error_code() == grpc::StatusCode::INVALID_ARGUMENT ||
                  status.error_code() == grpc::StatusCode::FAILED_PRECONDITION)
          << status.error_code() << ": " << status.error_message();
    }
    stopped = true;
    scribbler.join();
  }
  shared.write(shared.own_coordinates());
  SmoothCall call(*stub_);
  begin(call, shared);
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_TRUE(shared.has_result(test::smooth_on(*make_smoother("cuda:0"), mesh, options).mesh));
  EXPECT_FALSE(server_->device_lost());
}

TEST_F(CudaSharedMemory, OutliveTheirCallers) {
  testing::Conservation conservation(*stub_);
  const Mesh mesh = test::noisy(test::lattice(ElementType::tetrahedron, 20), 0.1, 1);
  for (int i = 0; i < 20; ++i) {
    MeshInSegment shared(*stub_, mesh, {.method = Optimize{}, .max_iterations = 20});
    SmoothCall call(*stub_);
    begin(call, shared);
    if (i % 2 == 0) call.cancel();
    shared.segment().end();
    EXPECT_TRUE(call.finish().ok() || i % 2 == 0);
  }
  conservation.check();
}

}  // namespace
}  // namespace meshsmooth
