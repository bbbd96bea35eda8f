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
  /// @param like positions as those of the result shall be: as many, in that precision.
  ResultAssembler(PositionsView like, std::size_t element_count)
      : like_(like), element_count_(element_count) {}

  /// `memory` is filled instead of new where it is large enough, and nothing is where the result
  /// stays in place.
  void begin(const v1::ResultHeader& header, Positions memory = {});
  void add(const wire::ChunkView& chunk);
  /// Takes all arrays but the positions from where they lie one after the other; those stay there.
  void add_behind_positions(std::span<const std::byte> bytes);
  [[nodiscard]] bool begun() const { return begun_; }
  [[nodiscard]] std::size_t received_bytes() const { return received_bytes_; }
  /// The metrics that the server announced.
  [[nodiscard]] const std::vector<QualityMetric>& metrics() const { return quality_.metrics; }
  /// The positions, in the mesh's precision; throws unless complete.
  [[nodiscard]] Positions take();
  /// After `take`.
  [[nodiscard]] ElementQualityArrays take_element_quality() { return std::move(quality_); }

 private:
  const PositionsView like_;
  const std::size_t element_count_;
  Positions positions_;  // behind `received_bytes_` anything
  ElementQualityArrays quality_;
  bool begun_ = false;
  std::size_t coordinates_bytes_ = 0;
  std::size_t size_bytes_ = 0;  // of all arrays, one after the other
  std::size_t received_bytes_ = 0;
};

}  // namespace meshsmooth::client
