#pragma once

#include <cstddef>
#include <span>

#include "meshsmooth/mesh.hpp"
#include "meshsmooth/v1/smoothing.pb.h"

namespace meshsmooth::client {

/// Puts the chunks of a result together, apart from the mesh it is for. Throws
/// `ServiceError` at whatever does not fit that mesh.
class ResultAssembler {
 public:
  explicit ResultAssembler(const Mesh& mesh) : mesh_(mesh) {}

  void begin(const v1::ResultHeader& header);
  void add(const v1::Chunk& chunk);
  [[nodiscard]] bool begun() const { return begun_; }
  [[nodiscard]] std::size_t received_bytes() const { return received_bytes_; }
  /// The positions, in the mesh's precision; throws unless complete.
  [[nodiscard]] decltype(Mesh::positions) take();

 private:
  [[nodiscard]] std::span<std::byte> bytes();

  const Mesh& mesh_;
  decltype(Mesh::positions) positions_;
  bool begun_ = false;
  std::size_t received_bytes_ = 0;
};

}  // namespace meshsmooth::client
