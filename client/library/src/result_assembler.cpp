#include "result_assembler.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "service_error.hpp"
#include "wire/codec.hpp"
#include "wire/mesh_layout.hpp"

namespace meshsmooth::client {
void ResultAssembler::begin(const v1::ResultHeader& header, Positions memory) {
  if (begun_) throw broken_answer("the server announced its result twice");
  const v1::ScalarType type = wire::encode_position_type(like_);
  const std::size_t node_count = position_count(like_);
  if (header.node_count() != static_cast<std::int64_t>(node_count) ||
      header.coordinate_type() != type) {
    throw broken_answer("the server announced a result of " + std::to_string(header.node_count()) +
                        " nodes in " + v1::ScalarType_Name(header.coordinate_type()) + " for " +
                        std::to_string(node_count) + " nodes in " + v1::ScalarType_Name(type));
  }
  try {
    quality_.metrics = wire::decode_metrics(header.element_quality_metrics());
  } catch (const Error& error) {
    throw broken_answer("cannot decode the result's header: " + std::string(error.what()));
  }
  const std::size_t value_count = quality_.metrics.size() * element_count_;
  coordinates_bytes_ = bytes_of(like_).size();
  size_bytes_ = coordinates_bytes_ + value_count * sizeof(float);
  begun_ = true;
  if (header.size_bytes() != static_cast<std::int64_t>(size_bytes_)) {
    throw broken_answer("the server announced a result of " + std::to_string(header.size_bytes()) +
                        " bytes, it must have " + std::to_string(size_bytes_));
  }
  quality_.values.reserve(value_count);
  if (header.in_place()) return;
  positions_ = std::move(memory);
  make_room(positions_, like_);
}

void ResultAssembler::add(const wire::ChunkView& chunk) {
  const bool positions_due = received_bytes_ < coordinates_bytes_ || metrics().empty();
  const v1::ArrayId array_id =
      positions_due ? v1::ARRAY_ID_COORDINATES : v1::ARRAY_ID_ELEMENT_QUALITY;
  const std::size_t offset_bytes = received_bytes_ - (positions_due ? 0 : coordinates_bytes_);
  if (!begun_ || chunk.array_id != array_id ||
      chunk.offset_bytes != static_cast<std::int64_t>(offset_bytes)) {
    throw broken_answer("the server sent result bytes at " + std::to_string(chunk.offset_bytes) +
                        " where those at " + std::to_string(offset_bytes) + " were due");
  }
  if (chunk.size_bytes > (positions_due ? coordinates_bytes_ : size_bytes_) - received_bytes_) {
    throw broken_answer("the server sent more result bytes than the " +
                        std::to_string(size_bytes_) + " announced");
  }
  if (!chunk.has_right_checksum()) {
    throw broken_answer("the checksum of the result bytes at " + std::to_string(received_bytes_) +
                        " is wrong");
  }
  const auto append = [&](auto& values) {
    // Grown chunk by chunk: values zeroed all at once would leave the caches before they are
    // filled.
    constexpr std::size_t kValueBytes = sizeof(values[0]);
    const std::size_t end = offset_bytes + chunk.size_bytes;
    values.resize(std::max(values.size(), (end + kValueBytes - 1) / kValueBytes));
    chunk.copy_to(std::as_writable_bytes(std::span(values)).data() + offset_bytes);
  };
  if (positions_due) {
    std::visit(append, positions_);
  } else {
    append(quality_.values);
  }
  received_bytes_ += chunk.size_bytes;
}

void ResultAssembler::add_behind_positions(std::span<const std::byte> bytes) {
  if (!begun_ || bytes.size() < size_bytes_) throw broken_answer("the result is incomplete");
  quality_.values.resize((size_bytes_ - coordinates_bytes_) / sizeof(float));
  std::ranges::copy(bytes.subspan(coordinates_bytes_, size_bytes_ - coordinates_bytes_),
                    std::as_writable_bytes(std::span(quality_.values)).begin());
  received_bytes_ = size_bytes_;
}

Positions ResultAssembler::take() {
  if (!begun_ || received_bytes_ != size_bytes_) {
    throw broken_answer("the result is incomplete: " + std::to_string(received_bytes_) + " of " +
                        std::to_string(size_bytes_) + " bytes arrived");
  }
  return std::move(positions_);
}

}  // namespace meshsmooth::client
