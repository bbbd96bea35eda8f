// A mesh of any size goes through messages of 4 MiB, over TCP. The test has
// MESHSMOOTH_LARGE_MESH_BYTES of coordinates and holds none of them: it makes what it sends and
// knows what must come back.
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "server/smooth_call.hpp"
#include "support/in_process_server.hpp"

namespace meshsmooth::testing {
namespace {

constexpr std::int64_t kNodeBytes = 3 * sizeof(double);
constexpr std::int64_t kChunkBytes = kNodeBytes << 15;  // 768 KiB
constexpr std::int64_t kMessageLimitBytes = 4 << 20;

std::int64_t node_count() {
  const char* const bytes = std::getenv("MESHSMOOTH_LARGE_MESH_BYTES");
  return (bytes == nullptr ? std::int64_t{64} << 20 : std::atoll(bytes)) / kNodeBytes;
}

/// Those of node `first` and its followers; `shift` is added to each x.
std::string coordinates(std::int64_t first, std::int64_t count, double shift) {
  std::string bytes(static_cast<std::size_t>(count * kNodeBytes), '\0');
  for (std::int64_t i = 0; i < count; ++i) {
    const auto x = static_cast<double>(first + i);
    const double node[] = {x + shift, 0.5 * x, -x};
    std::memcpy(bytes.data() + i * kNodeBytes, node, sizeof node);
  }
  return bytes;
}

TEST(LargeMesh, GoesThroughMessagesOfFourMebibytes) {
  const std::int64_t nodes = node_count();
  const std::int64_t bytes = nodes * kNodeBytes;
  server::ServerConfig config = quiet_config();
  config.listen = "127.0.0.1:0";
  config.host_memory_limit_bytes = bytes + (std::int64_t{1} << 30);
  config.max_receive_message_bytes = kMessageLimitBytes;
  InProcessServer server(config);
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMessageLimitBytes);
  const auto stub = v1::SmoothingService::NewStub(
      grpc::CreateCustomChannel("127.0.0.1:" + std::to_string(server.server().port()),
                                grpc::InsecureChannelCredentials(), arguments));

  const TwoTetrahedra mesh;
  v1::JobSpec spec = TwoTetrahedra::spec();
  spec.mutable_inline_topology()->set_node_count(nodes);
  spec.mutable_inline_topology()->set_fixed_mask_present(false);
  SmoothCall call(*stub);
  ASSERT_TRUE(call.send(spec));
  call.read_accepted();
  ASSERT_TRUE(call.send(chunk(v1::ARRAY_ID_ELEMENTS, 0, mesh.elements)));
  for (std::int64_t at = 0; at < bytes; at += kChunkBytes) {
    const std::int64_t size = std::min(kChunkBytes, bytes - at);
    ASSERT_TRUE(call.send(
        chunk(v1::ARRAY_ID_COORDINATES, at, coordinates(at / kNodeBytes, size / kNodeBytes, 0))));
  }
  call.half_close();

  std::int64_t received = 0;
  std::string ahead;  // of a chunk that ends within a node
  while (const auto response = call.read()) {
    if (!response->has_chunk()) continue;
    ASSERT_EQ(response->chunk().offset_bytes(), received);
    ahead += response->chunk().data();
    received += static_cast<std::int64_t>(response->chunk().data().size());
    const std::int64_t whole = static_cast<std::int64_t>(ahead.size()) / kNodeBytes;
    const std::int64_t first = received / kNodeBytes - whole;
    ASSERT_EQ(ahead.substr(0, static_cast<std::size_t>(whole * kNodeBytes)),
              coordinates(first, whole, 1))
        << "nodes from " << first << " on";
    ahead.erase(0, static_cast<std::size_t>(whole * kNodeBytes));
  }
  EXPECT_TRUE(call.finish().ok()) << call.finish().error_message();
  EXPECT_EQ(received, bytes);
}

}  // namespace
}  // namespace meshsmooth::testing
