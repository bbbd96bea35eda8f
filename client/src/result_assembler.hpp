#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "buffer_cache.hpp"
#include "meshsmooth/quality.hpp"
#include "meshsmooth/v1/smoothing.pb.h"
#include "wire/raw_message.hpp"

namespace meshsmooth::client {

/// Puts the chunks of a result together, apart from the mesh it is for. Throws
/// `ServiceError` at whatever does not fit that mesh.
class ResultAssembler {
 public:
  explicit ResultAssembler(const Mesh& mesh) : mesh_(mesh) {}

  /// `memory` is filled instead of new where it is large enough.
  void begin(const v1::ResultHeader& header, Positions memory = {});
  void add(const wire::ChunkView& chunk);
  /// All arrays, one after the other.
  void add_all(std::span<const std::byte> bytes);
  [[nodiscard]] bool begun() const { return begun_; }
  [[nodiscard]] std::size_t received_bytes() const { return received_bytes_; }
  /// The metrics that the server announced.
  [[nodiscard]] const std::vector<QualityMetric>& metrics() const { return quality_.metrics; }
  /// The positions, in the mesh's precision; throws unless complete.
  [[nodiscard]] Positions take();
  /// After `take`.
  [[nodiscard]] ElementQualityArrays take_element_quality() { return std::move(quality_); }

 private:
  void make_room(Positions memory);

  const Mesh& mesh_;
  Positions positions_;  // behind `received_bytes_` anything
  ElementQualityArrays quality_;
  bool begun_ = false;
  std::size_t coordinates_bytes_ = 0;
  std::size_t size_bytes_ = 0;  // of all arrays, one after the other
  std::size_t received_bytes_ = 0;
};

}  // namespace meshsmooth::client
