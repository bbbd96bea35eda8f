// What a server may answer, in any order, and how it may end the call.
#include <grpcpp/support/status.h>

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "fuzz/choices.hpp"
#include "fuzz/fill_message.hpp"
#include "result_assembler.hpp"
#include "service_error.hpp"
#include "smooth_call.hpp"
#include "wire/crc32c.hpp"
#include "wire/status_details.hpp"

namespace {

using namespace meshsmooth;
using meshsmooth::testing::Choices;
using meshsmooth::testing::fill_message;
using meshsmooth::testing::printable;
using meshsmooth::testing::require;

Mesh make_mesh(Choices& choices) {
  Mesh mesh;
  const std::size_t node_count = choices.below(9);
  if (choices.flag()) {
    mesh.positions = std::vector<Vec3f>(node_count);
  } else {
    mesh.positions = std::vector<Vec3d>(node_count);
  }
  mesh.blocks = {{ElementType::triangle, {0, 1, 2, 0, 2, 3}}};
  return mesh;
}

std::size_t coordinates_bytes(const Mesh& mesh) {
  const bool float64 = std::holds_alternative<std::vector<Vec3d>>(mesh.positions);
  return mesh.node_count() * (float64 ? sizeof(Vec3d) : sizeof(Vec3f));
}

v1::ResultHeader make_header(const Mesh& mesh, Choices& choices) {
  const bool float64 = std::holds_alternative<std::vector<Vec3d>>(mesh.positions);
  v1::ResultHeader header;
  header.set_node_count(static_cast<std::int64_t>(mesh.node_count()));
  header.set_coordinate_type(float64 ? v1::SCALAR_TYPE_FLOAT64 : v1::SCALAR_TYPE_FLOAT32);
  std::size_t bytes = coordinates_bytes(mesh);
  const std::size_t kind = choices.below(4);
  if (kind == 2) {
    header.add_element_quality_metrics(static_cast<v1::QualityMetric>(choices.below(9)));
    bytes += mesh.element_count() * sizeof(float);
  }
  header.set_size_bytes(static_cast<std::int64_t>(bytes));
  if (kind == 1) fill_message(header, choices);
  return header;
}

/// The part of the result that is due, or about it.
v1::Chunk make_chunk(const Mesh& mesh, std::size_t received_bytes, Choices& choices) {
  v1::Chunk chunk;
  const std::uint8_t kind = choices.byte();
  const std::size_t positions_bytes = coordinates_bytes(mesh);
  const bool positions_due = received_bytes < positions_bytes;
  chunk.set_array_id((kind & 7) == 1 ? static_cast<v1::ArrayId>(choices.number())
                     : positions_due ? v1::ARRAY_ID_COORDINATES
                                     : v1::ARRAY_ID_ELEMENT_QUALITY);
  chunk.set_offset_bytes(
      (kind & 7) == 2 ? choices.number()
                      : static_cast<std::int64_t>(
                            positions_due ? received_bytes : received_bytes - positions_bytes));
  std::string data = choices.text(100);
  if ((kind & 8) != 0) {
    chunk.set_crc32c((kind & 16) != 0 ? static_cast<std::uint32_t>(choices.number())
                                      : wire::crc32c(std::as_bytes(std::span(data))));
  }
  chunk.set_data(std::move(data));
  return chunk;
}

void take_answers(const Mesh& mesh, Choices& choices) {
  client::ResultAssembler result(mesh.positions_view(), mesh.element_count());
  std::string sent;
  try {
    for (std::size_t left = choices.below(12); left > 0 && !choices.empty(); --left) {
      switch (choices.below(4)) {
        case 0:
          result.begin(make_header(mesh, choices));
          break;
        case 1: {
          const v1::Chunk chunk = make_chunk(mesh, result.received_bytes(), choices);
          result.add(wire::ChunkView(chunk));
          sent += chunk.data();
          break;
        }
        case 2: {
          v1::Progress progress;
          fill_message(progress, choices);
          (void)client::decode_progress(progress);
          break;
        }
        default: {
          v1::Summary summary;
          summary.set_stop_reason(v1::STOP_REASON_CONVERGED);
          fill_message(summary, choices);
          require(!client::decode_report(summary, "jobs/1", "").to_json().empty(),
                  "a report has its JSON");
        }
      }
    }
    const auto positions = result.take();
    require(positions.index() == mesh.positions.index(), "a result has its mesh's precision");
    const auto bytes =
        std::visit([](const auto& nodes) { return std::as_bytes(std::span(nodes)); }, positions);
    const auto quality = result.take_element_quality();
    const auto values = std::as_bytes(std::span(quality.values));
    const auto all = std::as_bytes(std::span(sent));
    require(all.size() == bytes.size() + values.size() &&
                std::ranges::equal(bytes, all.first(bytes.size())) &&
                std::ranges::equal(values, all.last(values.size())),
            "the bytes are those sent");
  } catch (const client::ServiceError& error) {
    require(static_cast<int>(error.code()) != 0, "an error has a code");
  }
}

/// Details of the status: those of a server, or any bytes.
grpc::Status make_end(Choices& choices) {
  const auto code = static_cast<grpc::StatusCode>(1 + choices.below(16));
  const std::string message = printable(choices.text(60));
  if (choices.flag()) return {code, message, choices.rest()};
  const std::string reason = printable(choices.text(20));
  return {code, message,
          wire::encode_status_details({.code = code,
                                       .message = message,
                                       .reason = reason,
                                       .metadata = {{"element", printable(choices.text(20))}},
                                       .retry_delay = std::nullopt})};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Choices choices({data, size});
  const Mesh mesh = make_mesh(choices);
  take_answers(mesh, choices);
  const client::ServiceError error = client::to_service_error(
      make_end(choices),
      {.server = "the server", .cancelled_by_caller = choices.flag(), .timeout_seconds = 1});
  require(static_cast<int>(error.code()) != 0, "an error has a code");
  return 0;
}
