// Random sequences of what callers do with shared memory: good jobs and bad ones, attacks, callers
// that are killed, threads that write meanwhile. Good jobs have their result, bad ones are refused,
// and in the end everything is returned. MESHSMOOTH_RANDOM_SEQUENCES=10000 for the long form.
#include <gtest/gtest.h>
#include <linux/falloc.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <optional>
#include <random>
#include <sstream>
#include <thread>

#include "server/conservation.hpp"
#include "server/segment_caller.hpp"
#include "support/in_process_server.hpp"
#include "support/process.hpp"
#include "support/server_program.hpp"

namespace meshsmooth::testing {
namespace {

using grpc::StatusCode;
using InSegment = TwoTetrahedraInSegment;

/// A process that fetches and maps a segment, as a caller of its own that can be killed.
class OtherCaller {
 public:
  explicit OtherCaller(SegmentCaller& segment) {
    std::array<int, 2> done{};
    EXPECT_EQ(pipe(done.data()), 0);
    id_ = fork();
    if (id_ == 0) {
      // Nothing of gRPC from here on: its threads are not in this process.
      char code = 0;
      if (segment.fetch()) {
        segment.map();
        wire::send_message(segment.socket().number(), wire::LeaseMessage::mapped);
        code = next_message(segment.socket()).message == wire::LeaseMessage::ready ? 1 : 0;
        InSegment().write(segment);
      }
      static_cast<void>(!write(done[1], &code, 1));
      for (;;) pause();
    }
    close(done[1]);
    char code = 0;
    EXPECT_TRUE(read(done[0], &code, 1) == 1 && code == 1);
    close(done[0]);
  }
  ~OtherCaller() {
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
  }
  OtherCaller(const OtherCaller&) = delete;
  OtherCaller& operator=(const OtherCaller&) = delete;

 private:
  pid_t id_ = -1;
};

/// One caller with one segment at a time.
class Sequence {
 public:
  Sequence(InProcessServer& server, Stub& stub, unsigned seed)
      : server_(server), stub_(stub), random_(seed) {}
  ~Sequence() { server_.fake().release(); }

  void step() {
    switch (draw(9)) {
      case 0:
        return lease();
      case 1:
      case 2:
        return good_job();
      case 3:
        return bad_job();
      case 4:
        return attack();
      case 5:
        return cancelled_job();
      case 6:
        return killed_caller();
      case 7:
        return scribbled_job();
      case 8:
        return lose();
    }
  }
  [[nodiscard]] std::string story() const { return story_.str(); }

 private:
  int draw(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  void tell(const std::string& what) { story_ << what << "; "; }
  SegmentCaller& segment() {
    if (!segment_) lease();
    return *segment_;
  }
  [[nodiscard]] v1::JobSpec spec(const SegmentCaller& segment) const {
    return InSegment::spec(segment.lease().segment_name());
  }

  void lease() {
    tell("lease");
    segment_.reset();
    segment_.emplace(SegmentCaller::ready(stub_, InSegment::kBytes + draw(1 << 20)));
  }

  void good_job() {
    tell("good job");
    mesh_.write(segment());
    SmoothCall call(stub_);
    call.send(spec(*segment_));
    call.half_close();
    EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
    EXPECT_EQ(mesh_.result(*segment_), mesh_.mesh.moved());
  }

  void bad_job() {
    v1::JobSpec bad = spec(segment());
    v1::SharedMemoryUse& use = *bad.mutable_shared_memory();
    // In or behind the last bytes, anywhere, or so that a sum overflows.
    const std::int64_t size = segment_->lease().size_bytes();
    const std::int64_t offsets[] = {size - draw(30),       size,
                                    size + draw(1000),     -1 - draw(1000),
                                    INT64_MAX - draw(100), INT64_MIN + draw(100)};
    const std::int64_t offset = offsets[draw(6)];
    const int kind = draw(5);
    tell("bad job " + std::to_string(kind) + " at " + std::to_string(offset));
    if (kind == 0) use.mutable_inputs(0)->set_offset_bytes(offset);
    if (kind == 1) use.set_result_offset_bytes(offset);
    if (kind == 2) use.set_segment_name("segments/" + std::string(32, '0'));
    if (kind == 3) use.mutable_inputs()->RemoveLast();
    if (kind == 4) use.mutable_inputs()->SwapElements(0, 2);
    SmoothCall call(stub_);
    call.send(bad);
    call.half_close();
    EXPECT_FALSE(call.finish().ok());
    EXPECT_NE(call.details().reason, "INTERNAL");
  }

  void attack() {
    const int kind = draw(5);
    tell("attack " + std::to_string(kind));
    const int file = segment().file().number();
    constexpr int kHole = FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE;
    int result = 0;
    if (kind == 0) result = ftruncate(file, draw(100));
    if (kind == 1) result = ftruncate(file, segment_->lease().size_bytes() * 2);
    if (kind == 2) result = fallocate(file, kHole, 0, segment_->lease().size_bytes());
    if (kind == 3)
      result = madvise(segment_->bytes().data(), segment_->bytes().size(), MADV_REMOVE);
    if (kind == 4) result = static_cast<int>(pwrite(file, "x", 1, 0));
    EXPECT_EQ(result, -1);
  }

  void cancelled_job() {
    tell("cancelled job");
    const bool held = draw(2) == 0;
    if (held) server_.fake().hold();
    mesh_.write(segment());
    {
      SmoothCall call(stub_);
      call.send(spec(*segment_));
      if (draw(2) == 0) call.half_close();
      if (draw(2) == 0) call.read();
      call.cancel();
      call.finish();
    }
    server_.fake().release();
    segment_.reset();  // the server may still write to it
  }

  void killed_caller() {
    const bool in_job = draw(2) == 0;
    tell(in_job ? "caller killed during its job" : "caller killed");
    SegmentCaller other(stub_, InSegment::kBytes);
    std::optional<OtherCaller> process(std::in_place, other);
    if (!in_job) return;
    server_.fake().hold();
    SmoothCall call(stub_);
    call.send(spec(other));
    call.half_close();
    if (draw(2) == 0) call.read();
    process.reset();
    server_.fake().release();
    // Accepted or not, by when the lease ended.
    const bool refused = !call.finish().ok();
    EXPECT_EQ(call.details().reason, refused ? "SHARED_MEMORY_NOT_FOUND" : "");
  }

  void scribbled_job() {
    tell("scribbled job");
    mesh_.write(segment());
    std::atomic<bool> stopped = false;
    const std::span<std::byte> bytes = segment_->bytes();
    std::thread scribbler([&stopped, bytes, seed = random_()] {
      std::minstd_rand random(static_cast<unsigned>(seed));
      auto* const values = reinterpret_cast<volatile unsigned char*>(bytes.data());
      while (!stopped) values[random() % InSegment::kBytes] = static_cast<unsigned char>(random());
    });
    SmoothCall call(stub_);
    call.send(spec(*segment_));
    call.half_close();
    EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();  // the fake takes any mesh
    stopped = true;
    scribbler.join();
  }

  void lose() {
    tell("lose");
    const std::string name = segment().lease().segment_name();
    const int kind = draw(3);
    if (kind == 0) segment_->close_socket();
    if (kind == 1) segment_->close_file();
    if (kind == 2) segment_->unmap();
    segment_.reset();
  }

  InProcessServer& server_;
  Stub& stub_;
  std::mt19937 random_;
  const InSegment mesh_;
  std::optional<SegmentCaller> segment_;
  std::ostringstream story_;
};

TEST(SharedMemorySequences, LoseNothing) {
  const char* const wanted = std::getenv("MESHSMOOTH_RANDOM_SEQUENCES");
  const unsigned count = wanted == nullptr ? 100 : static_cast<unsigned>(std::atoi(wanted));
  InProcessServer server(sharing_config(quiet_config()));
  Stub stub(server.channel());
  expect_healthy_service(stub);
  Conservation conservation(stub);
  for (unsigned seed = 0; seed < count; ++seed) {
    {
      Sequence sequence(server, stub, seed);
      for (int i = 0; i < 8 && !::testing::Test::HasFailure(); ++i) sequence.step();
      ASSERT_FALSE(::testing::Test::HasFailure()) << "seed " << seed << ": " << sequence.story();
    }
    if (seed % 50 == 0) conservation.check();
  }
  conservation.check();
}

TEST(SharedMemorySequences, SurviveTheServer) {
  std::optional<ServerProgram> server(std::in_place);
  std::string path;
  {
    Stub stub(server->connect());
    const InSegment mesh;
    const SegmentCaller segment = SegmentCaller::ready(stub, InSegment::kBytes);
    path = segment.lease().socket_path();
    mesh.write(segment);
    server->kill();
    // The memory stays its caller's, who hears that the lease has ended.
    EXPECT_EQ(next_message(segment.socket()).kind, wire::ReceivedMessage::Kind::end);
    EXPECT_EQ(segment.read(InSegment::kElements, mesh.mesh.elements.size()), mesh.mesh.elements);
  }
  server.emplace();
  Stub stub(server->connect());
  EXPECT_NE(SegmentCaller::ready(stub, InSegment::kBytes).lease().socket_path(), path);
}

}  // namespace
}  // namespace meshsmooth::testing
