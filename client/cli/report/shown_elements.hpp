#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "meshsmooth/quality.hpp"

namespace meshsmooth::cli {

/// What a report draws of a mesh: its elements, and where they are and were.
struct DrawnMesh {
  TopologyView topology;
  PositionsView positions;              // of the result, or of the only state
  std::optional<PositionsView> before;  // of the input, where there is a result
  SurfaceOrientation orientation;       // of the input
  // [element count] or empty; non-zero = an interface element, which has no shape to show
  std::vector<std::uint8_t> interfaces = {};
};

/// Why an element is as it is, as bits.
enum ElementMark : std::uint8_t {
  kLocked = 1,        // all its nodes are fixed
  kBlocksMotion = 2,  // a longer step would invert it
  kNotMoved = 4,      // all its nodes lie where they were
  kLimited = 128,     // by connectivity: see `PoorElements`; the bits between are states
};

struct ShownElement {
  std::size_t element = 0;  // the caller's id
  ElementType type = ElementType::tetrahedron;
  const NodeId* nodes = nullptr;  // in VTK's order, of the type's number
  ElementMeasure measure = {};    // of the result, or of the only state
  ElementMeasure before = {};     // the same where there is but one state
  std::uint8_t marks = 0;
};

/// Chooses the elements of the worst mean ratios; inverted ones come first. Of a result half of
/// them are its own worst and half the input's.
/// @param blocking elements to take in any case
/// @param fixed [node_count], non-zero = fixed; or empty
/// @returns at most `count` and the blocking ones, the worst of the result first. O(elements)
[[nodiscard]] std::vector<ShownElement> choose_elements(const DrawnMesh& mesh, std::size_t count,
                                                        std::span<const std::int64_t> blocking,
                                                        std::span<const std::uint8_t> fixed);

/// @returns the position of a node in double
[[nodiscard]] Vec3d position_of(const PositionsView& positions, NodeId node);
/// @returns the mean of the positions of an element's nodes
[[nodiscard]] Vec3d centre_of(const PositionsView& positions, std::span<const NodeId> nodes);

}  // namespace meshsmooth::cli
