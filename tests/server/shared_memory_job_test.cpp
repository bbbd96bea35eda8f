// Jobs whose arrays lie in a segment.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <random>
#include <thread>

#include "server/conservation.hpp"
#include "server/row.hpp"
#include "server/segment_caller.hpp"
#include "support/in_process_server.hpp"

namespace meshsmooth::testing {
namespace {

using grpc::StatusCode;
using InSegment = TwoTetrahedraInSegment;

constexpr const char* kId = "01234567-89ab-cdef-0123-456789abcdef";

class SharedMemoryJobTest : public ::testing::Test {
 protected:
  static server::ServerConfig config() { return sharing_config(quiet_config()); }

  [[nodiscard]] v1::JobSpec spec() const {
    return InSegment::spec(segment_.lease().segment_name());
  }

  /// The status of a job with this spec.
  std::string reason(const v1::JobSpec& spec) {
    SmoothCall call(stub_);
    call.send(spec);
    call.half_close();
    EXPECT_FALSE(call.finish().ok());
    return call.details().reason;
  }

  InProcessServer server_{config()};
  Stub stub_{server_.channel()};
  const SegmentCaller segment_ = SegmentCaller::ready(stub_, InSegment::kBytes);
  const InSegment mesh_;
};

TEST_F(SharedMemoryJobTest, TakesItsInputsAndWritesItsResult) {
  mesh_.write(segment_);
  SmoothCall call(stub_);
  call.send(spec());
  call.half_close();
  call.read_accepted();
  const auto taken = call.read();
  ASSERT_TRUE(taken && taken->has_input_taken());
  const auto header = call.read();
  ASSERT_TRUE(header && header->has_result());
  EXPECT_TRUE(header->result().in_place());
  EXPECT_EQ(header->result().size_bytes(), 120);
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(call.chunk_count(), 0);
  EXPECT_TRUE(call.summary());
  EXPECT_EQ(mesh_.result(segment_), mesh_.mesh.moved());
}

TEST_F(SharedMemoryJobTest, ReadsNothingAfterInputTaken) {
  server_.fake().hold();
  mesh_.write(segment_);
  SmoothCall call(stub_);
  call.send(spec());
  call.half_close();
  call.read_accepted();
  const auto taken = call.read();
  ASSERT_TRUE(taken && taken->has_input_taken());
  std::memset(segment_.bytes().data(), 0xff, segment_.bytes().size());
  server_.fake().release();
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(mesh_.result(segment_), mesh_.mesh.moved());
}

TEST_F(SharedMemoryJobTest, MayWriteItsResultOverItsInputs) {
  mesh_.write(segment_);
  v1::JobSpec in_place = spec();
  in_place.mutable_shared_memory()->set_result_offset_bytes(InSegment::kCoordinates);
  SmoothCall call(stub_);
  call.send(in_place);
  call.half_close();
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(segment_.read(InSegment::kCoordinates, 120), mesh_.mesh.moved());
}

TEST_F(SharedMemoryJobTest, NamesATopologyThatWasKeptFromASegment) {
  server_.keeps_something();
  mesh_.write(segment_);
  v1::JobSpec kept = spec();
  kept.set_topology_kept(true);
  SmoothCall first(stub_);
  first.send(kept);
  first.half_close();
  const std::string job = first.read_accepted();
  std::string name;
  while (const auto response = first.read()) {
    if (response->has_result()) name = response->result().topology_name();
  }
  ASSERT_NE(name, "");

  v1::JobSpec by_name = spec();
  by_name.set_topology_name(name);
  by_name.mutable_shared_memory()->mutable_inputs()->DeleteSubrange(0, 2);
  SmoothCall second(stub_);
  second.send(by_name);
  second.half_close();
  EXPECT_TRUE(second.finish().ok()) << second.finish().error_message();
  EXPECT_EQ(mesh_.result(segment_), mesh_.mesh.moved());
}

TEST_F(SharedMemoryJobTest, JoinsAJobThatCameInChunks) {
  server_.fake().hold();
  v1::JobSpec chunks = TwoTetrahedra::spec();
  chunks.set_request_id(kId);
  SmoothCall first(stub_);
  first.send_all(mesh_.mesh, chunks);
  const std::string name = first.read_accepted();

  v1::JobSpec same = spec();
  same.set_request_id(kId);
  SmoothCall second(stub_);
  second.send(same);
  second.half_close();
  EXPECT_EQ(second.read_accepted(), name);
  server_.fake().release();
  EXPECT_TRUE(second.finish().ok()) << second.finish().error_message();
  EXPECT_TRUE(first.finish().ok()) << first.finish().error_message();
  EXPECT_EQ(first.result(), mesh_.mesh.moved());
  EXPECT_EQ(mesh_.result(segment_), mesh_.mesh.moved());
}

TEST_F(SharedMemoryJobTest, RefusesChunksBesides) {
  server_.fake().hold();  // so that the chunk comes before the end
  mesh_.write(segment_);
  SmoothCall call(stub_);
  call.send(spec());
  call.read_accepted();
  call.send(chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh_.mesh.elements));
  EXPECT_EQ(call.finish().error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(call.details().reason, "ARRAY_SIZE_MISMATCH");
}

TEST_F(SharedMemoryJobTest, RefusesArraysThatEndBehindTheSegment) {
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
  for (const std::int64_t offset :
       {InSegment::kBytes - 31, InSegment::kBytes, InSegment::kBytes + 1, kMax, kMax - 31, kMin,
        std::int64_t{-1}, std::int64_t{-32}}) {
    v1::JobSpec bad = spec();
    bad.mutable_shared_memory()->mutable_inputs(0)->set_offset_bytes(offset);
    EXPECT_EQ(reason(bad), "SHARED_MEMORY_OUT_OF_RANGE") << offset;
    bad = spec();
    bad.mutable_shared_memory()->set_result_offset_bytes(
        offset == InSegment::kBytes - 31 ? InSegment::kBytes - 119 : offset);
    EXPECT_EQ(reason(bad), "SHARED_MEMORY_OUT_OF_RANGE") << offset;
  }
  v1::JobSpec last = spec();  // that just fits
  last.mutable_shared_memory()->set_result_offset_bytes(InSegment::kBytes - 120);
  mesh_.write(segment_);
  SmoothCall call(stub_);
  call.send(last);
  call.half_close();
  EXPECT_TRUE(call.finish().ok());
}

TEST_F(SharedMemoryJobTest, RefusesOtherArraysThanTheJobs) {
  v1::JobSpec missing = spec();
  missing.mutable_shared_memory()->mutable_inputs()->RemoveLast();
  EXPECT_EQ(reason(missing), "OPTION_OUT_OF_RANGE");
  v1::JobSpec more = spec();
  *more.mutable_shared_memory()->add_inputs() = more.shared_memory().inputs(0);
  EXPECT_EQ(reason(more), "OPTION_OUT_OF_RANGE");
  v1::JobSpec other_order = spec();
  other_order.mutable_shared_memory()->mutable_inputs()->SwapElements(0, 1);
  EXPECT_EQ(reason(other_order), "OPTION_OUT_OF_RANGE");
}

TEST_F(SharedMemoryJobTest, RefusesSegmentsThatAreNotThereYet) {
  EXPECT_EQ(reason(InSegment::spec("segments/0123")), "SHARED_MEMORY_NOT_FOUND");
  SegmentCaller early(stub_, InSegment::kBytes);
  EXPECT_EQ(reason(InSegment::spec(early.lease().segment_name())), "SHARED_MEMORY_NOT_FOUND");
  early.fetch();
  early.map();
  EXPECT_EQ(reason(InSegment::spec(early.lease().segment_name())), "SHARED_MEMORY_NOT_FOUND");
}

TEST_F(SharedMemoryJobTest, RefusesSegmentsWhereItHasNone) {
  server::ServerConfig config = quiet_config();
  InProcessServer server(config);
  Stub stub(server.channel());
  SmoothCall call(stub);
  call.send(spec());
  call.half_close();
  EXPECT_EQ(call.finish().error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(call.details().reason, "OPTION_NOT_SUPPORTED");
}

TEST_F(SharedMemoryJobTest, FinishesAJobWhoseLeaseEndedMeanwhile) {
  server_.fake().hold();
  SegmentCaller other = SegmentCaller::ready(stub_, InSegment::kBytes);
  mesh_.write(other);
  SmoothCall call(stub_);
  call.send(InSegment::spec(other.lease().segment_name()));
  call.half_close();
  call.read_accepted();
  const auto taken = call.read();
  ASSERT_TRUE(taken && taken->has_input_taken());
  other.close_socket();
  other.close_file();
  server_.fake().release();
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(mesh_.result(other), mesh_.mesh.moved());  // the map is there as long as its caller
}

TEST_F(SharedMemoryJobTest, ReleasesASegmentWhoseCallerCancels) {
  Conservation conservation(stub_);
  server_.fake().hold();
  {
    SegmentCaller other = SegmentCaller::ready(stub_, InSegment::kBytes);
    mesh_.write(other);
    SmoothCall call(stub_);
    call.send(InSegment::spec(other.lease().segment_name()));
    call.half_close();
    call.read_accepted();
    call.cancel();
    call.finish();
  }
  server_.fake().release();
  conservation.check(segment_.lease().size_bytes());
}

/// On a device that reads and writes the segment by itself.
class DeviceSharedMemoryJobTest : public SharedMemoryJobTest {
 protected:
  DeviceSharedMemoryJobTest() { server_.fake().read_positions_once(); }
};

TEST_F(DeviceSharedMemoryJobTest, GivesItsInputsBackWithTheResult) {
  server_.fake().report_progress(1);
  server_.fake().hold();
  mesh_.write(segment_);
  v1::JobSpec with_progress = spec();
  with_progress.mutable_progress_interval()->set_nanos(1);
  SmoothCall call(stub_);
  call.send(with_progress);
  call.half_close();
  call.read_accepted();
  const auto header = call.read();
  ASSERT_TRUE(header && header->has_result());
  EXPECT_TRUE(header->result().in_place());
  const auto progress = call.read();
  ASSERT_TRUE(progress && progress->has_progress());
  // The job has not read them yet.
  std::vector<double> other = mesh_.mesh.coordinates;
  for (double& x : other) x *= 2;
  segment_.write(InSegment::kCoordinates, bytes_of(other));
  server_.fake().release();
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(call.chunk_count(), 0);
  TwoTetrahedra moved;
  moved.coordinates = other;
  EXPECT_EQ(mesh_.result(segment_), moved.moved());
  EXPECT_EQ(segment_.read(InSegment::kCoordinates, 120), bytes_of(other));
}

TEST_F(DeviceSharedMemoryJobTest, MayWriteItsResultOverItsInputs) {
  mesh_.write(segment_);
  v1::JobSpec in_place = spec();
  in_place.mutable_shared_memory()->set_result_offset_bytes(InSegment::kCoordinates);
  SmoothCall call(stub_);
  call.send(in_place);
  call.half_close();
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(segment_.read(InSegment::kCoordinates, 120), mesh_.mesh.moved());
}

TEST_F(DeviceSharedMemoryJobTest, CopiesWhatNoDeviceCanReach) {
  server_.fake().hold();
  v1::JobSpec odd = spec();  // no address of a number
  odd.mutable_shared_memory()->mutable_inputs(2)->set_offset_bytes(InSegment::kCoordinates + 1);
  mesh_.write(segment_);
  segment_.write(InSegment::kCoordinates + 1, bytes_of(mesh_.mesh.coordinates));
  SmoothCall call(stub_);
  call.send(odd);
  call.half_close();
  call.read_accepted();
  const auto taken = call.read();
  ASSERT_TRUE(taken && taken->has_input_taken());
  server_.fake().release();
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(mesh_.result(segment_), mesh_.mesh.moved());
}

TEST_F(DeviceSharedMemoryJobTest, WritesTheQualityBehindThePositions) {
  mesh_.write(segment_);
  v1::JobSpec asks = spec();
  asks.add_element_quality_metrics(v1::QUALITY_METRIC_MEAN_RATIO);
  SmoothCall call(stub_);
  call.send(asks);
  call.half_close();
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(mesh_.result(segment_), mesh_.mesh.moved());
  const std::vector<float> quality = {FakeSmoother::element_quality(QualityMetric::mean_ratio, 0),
                                      FakeSmoother::element_quality(QualityMetric::mean_ratio, 1)};
  EXPECT_EQ(segment_.read(InSegment::kResult + 120, 8), bytes_of(quality));
}

TEST_F(DeviceSharedMemoryJobTest, SendsItsResultToACallThatJoins) {
  server_.fake().hold();
  mesh_.write(segment_);
  v1::JobSpec named = spec();
  named.set_request_id(kId);
  SmoothCall first(stub_);
  first.send(named);
  first.half_close();
  const std::string name = first.read_accepted();

  v1::JobSpec same = TwoTetrahedra::spec();
  same.set_request_id(kId);
  SmoothCall second(stub_);
  second.send(same);
  EXPECT_EQ(second.read_accepted(), name);
  server_.fake().release();
  EXPECT_TRUE(first.finish().ok()) << first.finish().error_message();
  EXPECT_TRUE(second.finish().ok()) << second.finish().error_message();
  EXPECT_EQ(second.result(), mesh_.mesh.moved());
  EXPECT_EQ(mesh_.result(segment_), mesh_.mesh.moved());
}

TEST_F(DeviceSharedMemoryJobTest, KeepsNoSegmentForAKeptResult) {
  server_.keeps_something();
  server_.fake().hold();
  mesh_.write(segment_);
  v1::JobSpec kept = spec();
  kept.set_request_id(kId);
  kept.mutable_result_ttl()->set_seconds(60);
  SmoothCall call(stub_);
  call.send(kept);
  call.half_close();
  call.read_accepted();
  const auto taken = call.read();
  ASSERT_TRUE(taken && taken->has_input_taken());
  server_.fake().release();
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(mesh_.result(segment_), mesh_.mesh.moved());
}

TEST_F(DeviceSharedMemoryJobTest, FinishesAJobWhoseLeaseEndedMeanwhile) {
  server_.fake().hold();
  SegmentCaller other = SegmentCaller::ready(stub_, InSegment::kBytes);
  mesh_.write(other);
  SmoothCall call(stub_);
  call.send(InSegment::spec(other.lease().segment_name()));
  call.half_close();
  call.read_accepted();
  other.close_socket();
  other.close_file();
  server_.fake().release();
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(mesh_.result(other), mesh_.mesh.moved());
}

TEST_F(DeviceSharedMemoryJobTest, ReleasesASegmentWhoseCallerIsGone) {
  Conservation conservation(stub_);
  server_.fake().hold_deaf();  // the job does not hear of it, and writes its result
  {
    SegmentCaller other = SegmentCaller::ready(stub_, InSegment::kBytes);
    mesh_.write(other);
    SmoothCall call(stub_);
    call.send(InSegment::spec(other.lease().segment_name()));
    call.half_close();
    call.read_accepted();
    server_.fake().wait_started(1);
    call.cancel();
    call.finish();
  }
  server_.fake().release();
  conservation.check(segment_.lease().size_bytes());
}

/// A job too large to be copied on a thread of gRPC.
class LargeSharedMemoryJobTest : public SharedMemoryJobTest {
 protected:
  static constexpr std::int32_t kNodes = 400'000;

  LargeSharedMemoryJobTest() {
    for (std::int32_t n = 0; n + 4 <= kNodes; n += 4) {
      for (const std::int32_t i : {0, 1, 2, 3}) elements_.push_back(n + i);
    }
    coordinates_.resize(3 * std::size_t{kNodes}, 1.5);
    large_.write(0, bytes_of(elements_));
    large_.write(elements_bytes(), bytes_of(coordinates_));
  }

  [[nodiscard]] std::size_t elements_bytes() const { return elements_.size() * 4; }
  [[nodiscard]] v1::JobSpec large_spec() const {
    v1::JobSpec spec;
    v1::TopologySpec* topology = spec.mutable_inline_topology();
    topology->set_node_count(kNodes);
    topology->add_element_blocks()->set_element_type(v1::ELEMENT_TYPE_TETRAHEDRON);
    topology->mutable_element_blocks(0)->set_element_count(kNodes / 4);
    spec.set_coordinate_type(v1::SCALAR_TYPE_FLOAT64);
    v1::SharedMemoryUse* use = spec.mutable_shared_memory();
    use->set_segment_name(large_.lease().segment_name());
    use->add_inputs()->set_array_id(v1::ARRAY_ID_ELEMENTS);
    use->add_inputs()->set_array_id(v1::ARRAY_ID_COORDINATES);
    use->mutable_inputs(1)->set_offset_bytes(static_cast<std::int64_t>(elements_bytes()));
    use->set_result_offset_bytes(static_cast<std::int64_t>(elements_bytes()));
    return spec;
  }

  std::vector<std::int32_t> elements_;
  std::vector<double> coordinates_;
  const SegmentCaller large_ = SegmentCaller::ready(stub_, 16 << 20);
};

TEST_F(LargeSharedMemoryJobTest, IsCopiedByOtherThreads) {
  SmoothCall call(stub_);
  call.send(large_spec());
  call.half_close();
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  std::vector<double> moved = coordinates_;
  for (std::size_t n = 0; n < kNodes; ++n) moved[3 * n] += 1;
  EXPECT_TRUE(large_.read(elements_bytes(), moved.size() * 8) == bytes_of(moved));
}

TEST_F(LargeSharedMemoryJobTest, TakesOneValueOfWhatIsWrittenMeanwhile) {
  // The arrays that a job computes on are its own: what a thread scribbles at the same time may
  // spoil the numbers, but not the server.
  std::atomic<bool> stopped = false;
  std::thread scribbler([&] {
    std::mt19937 random(1);
    auto* const values = reinterpret_cast<volatile std::uint32_t*>(large_.bytes().data());
    while (!stopped) {
      values[random() % (large_.bytes().size() / 4)] = static_cast<std::uint32_t>(random());
    }
  });
  for (int i = 0; i < 20; ++i) {
    SmoothCall call(stub_);
    call.send(large_spec());
    call.half_close();
    EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  }
  stopped = true;
  scribbler.join();
}

TEST_F(LargeSharedMemoryJobTest, IsCancelledWhileItIsCopied) {
  Conservation conservation(stub_);
  for (int i = 0; i < 30; ++i) {
    SmoothCall call(stub_);
    call.send(large_spec());
    if (i % 3 != 0) call.read_accepted();
    if (i % 3 == 2) call.read();
    call.cancel();
    call.finish();
  }
  conservation.check(segment_.lease().size_bytes() + large_.lease().size_bytes());
}

}  // namespace
}  // namespace meshsmooth::testing
