#include "result_assembler.hpp"

#include <algorithm>
#include <string>
#include <type_traits>
#include <utility>

#include "service_error.hpp"
#include "wire/crc32c.hpp"

namespace meshsmooth::client {

void ResultAssembler::begin(const v1::ResultHeader& header) {
  if (begun_) throw broken_answer("the server announced its result twice");
  const bool float64 = std::holds_alternative<std::vector<Vec3d>>(mesh_.positions);
  const v1::ScalarType type = float64 ? v1::SCALAR_TYPE_FLOAT64 : v1::SCALAR_TYPE_FLOAT32;
  if (header.node_count() != static_cast<std::int64_t>(mesh_.node_count()) ||
      header.coordinate_type() != type) {
    throw broken_answer("the server announced a result of " + std::to_string(header.node_count()) +
                        " nodes in " + v1::ScalarType_Name(header.coordinate_type()) + " for " +
                        std::to_string(mesh_.node_count()) + " nodes in " +
                        v1::ScalarType_Name(type));
  }
  std::visit(
      [this](const auto& input) {
        positions_ = std::remove_cvref_t<decltype(input)>(input.size());
      },
      mesh_.positions);
  begun_ = true;
  if (header.size_bytes() != static_cast<std::int64_t>(bytes().size())) {
    throw broken_answer("the server announced a result of " + std::to_string(header.size_bytes()) +
                        " bytes, it must have " + std::to_string(bytes().size()));
  }
}

void ResultAssembler::add(const v1::Chunk& chunk) {
  const std::string& data = chunk.data();
  if (!begun_ || chunk.array_id() != v1::ARRAY_ID_COORDINATES ||
      chunk.offset_bytes() != static_cast<std::int64_t>(received_bytes_)) {
    throw broken_answer("the server sent result bytes at " + std::to_string(chunk.offset_bytes()) +
                        " where those at " + std::to_string(received_bytes_) + " were due");
  }
  const std::span<std::byte> rest = bytes().subspan(received_bytes_);
  if (data.size() > rest.size()) {
    throw broken_answer("the server sent more result bytes than the " +
                        std::to_string(bytes().size()) + " announced");
  }
  if (chunk.has_crc32c() && chunk.crc32c() != wire::crc32c(std::as_bytes(std::span(data)))) {
    throw broken_answer("the checksum of the result bytes at " + std::to_string(received_bytes_) +
                        " is wrong");
  }
  std::ranges::copy(std::as_bytes(std::span(data)), rest.begin());
  received_bytes_ += data.size();
}

decltype(Mesh::positions) ResultAssembler::take() {
  if (!begun_ || received_bytes_ != bytes().size()) {
    throw broken_answer("the result is incomplete: " + std::to_string(received_bytes_) + " of " +
                        std::to_string(bytes().size()) + " bytes arrived");
  }
  return std::move(positions_);
}

std::span<std::byte> ResultAssembler::bytes() {
  return std::visit([](auto& positions) { return std::as_writable_bytes(std::span(positions)); },
                    positions_);
}

}  // namespace meshsmooth::client
