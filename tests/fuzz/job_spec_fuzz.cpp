// Specs of jobs, as messages of any content: options, limits, estimates.
#include <memory>
#include <string>

#include "engine.hpp"
#include "fuzz/choices.hpp"
#include "fuzz/fill_message.hpp"
#include "meshsmooth/error.hpp"
#include "rpc/messages.hpp"
#include "wire/codec.hpp"

namespace {

using namespace meshsmooth;
using meshsmooth::testing::Choices;
using meshsmooth::testing::require;

/// Decodes only: no job is admitted, its one lane sleeps.
server::Engine& engine() {
  static server::Engine engine({.listen = "",
                                .backend = "cpu",
                                .lanes = 1,
                                .threads_per_lane = 1,
                                .host_memory_limit_bytes = 1 << 30,
                                .warm_up = false,
                                .log_level = "off"},
                               [] { return make_smoother("cpu", 1); });
  return engine;
}

v1::JobSpec make_spec(Choices& choices) {
  v1::JobSpec spec;
  if (choices.byte() < 32) {
    spec.ParseFromString(choices.rest());
    return spec;
  }
  // What a job needs, so that the rest is looked at.
  v1::TopologySpec* topology = spec.mutable_inline_topology();
  topology->set_node_count(choices.number());
  v1::ElementBlock* block = topology->add_element_blocks();
  block->set_element_type(static_cast<v1::ElementType>(1 + choices.below(6)));
  block->set_element_count(choices.number());
  spec.set_coordinate_type(choices.flag() ? v1::SCALAR_TYPE_FLOAT64 : v1::SCALAR_TYPE_FLOAT32);
  testing::fill_message(*spec.mutable_options(), choices);
  testing::fill_message(spec, choices);
  return spec;
}

void check(const server::DecodedSpec& decoded) {
  const server::ServerConfig& config = engine().config();
  const SmoothOptions& options = decoded.job.options;
  validate(options);
  const v1::SmoothingOptions message = wire::encode_options(options);
  require(wire::encode_options(wire::decode_options(message)).SerializeAsString() ==
              message.SerializeAsString(),
          "options survive the way");
  require(decoded.call.result_chunk_bytes > 0 &&
              decoded.call.result_chunk_bytes <=
                  std::max(config.result_chunk_bytes, config.max_chunk_bytes),
          "a chunk has a size that the server can send");
  require(decoded.job.queue_timeout->count() >= 0, "a wait is not negative");
  const wire::MeshLayout& layout = decoded.job.layout;
  require(layout.node_count > 0 && layout.node_count <= config.max_node_count &&
              layout.element_count() > 0 && layout.element_count() <= config.max_element_count,
          "a mesh is within the limits");
  try {
    const MemoryEstimate estimate = engine().estimate(decoded.job);
    require(estimate.host_bytes >= layout.total_bytes() && estimate.device_bytes >= 0,
            "a job needs its arrays at least");
  } catch (const OutOfMemory& error) {
    require(error.reason() == "MESH_TOO_LARGE", "too large is called too large");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Choices choices({data, size});
  const v1::JobSpec spec = make_spec(choices);
  try {
    check(server::decode_spec(spec, "somebody", engine()));
  } catch (const InvalidMesh&) {
  } catch (const InvalidOption&) {
  } catch (const NotSupported&) {
  } catch (const OutOfMemory&) {
  } catch (const Error& error) {
    require(error.reason() == "TOPOLOGY_NOT_FOUND", error.what());
  }
  return 0;
}
