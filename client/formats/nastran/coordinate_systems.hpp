#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "meshsmooth/mesh.hpp"

namespace meshsmooth::formats {

/// A coordinate system in space. Angles are in degrees, as Nastran has them.
struct CoordinateFrame {
  enum class Kind : std::uint8_t { rectangular, cylindrical, spherical };

  Kind kind = Kind::rectangular;
  Vec3d origin = {0, 0, 0};
  std::array<Vec3d, 3> axes = {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};

  friend bool operator==(const CoordinateFrame&, const CoordinateFrame&) = default;

  [[nodiscard]] Vec3d to_basic(const Vec3d& local) const;
  /// Of all local coordinates of the point those next to `before`: angles keep their branch, a
  /// radius its sign; at radius 0 the angle stays.
  [[nodiscard]] Vec3d to_local(const Vec3d& basic, const Vec3d& before) const;
};

/// The coordinate systems of a deck and the nodes that are defined in them.
class CoordinateSystems {
 public:
  struct Definition {
    std::int64_t id;
    CoordinateFrame::Kind kind;
    bool by_nodes;                      // CORD1R, CORD1C, CORD1S
    std::array<std::int64_t, 3> grids;  // then: the nodes' numbers in the deck
    std::int64_t reference;             // else the system of the points
    std::array<Vec3d, 3> points;        // origin, on the z axis, in the plane of x and z

    friend bool operator==(const Definition&, const Definition&) = default;
  };
  static constexpr std::int32_t kBasic = -1;

  /// A system, with what its definition means: of the systems here, of the nodes of the mesh.
  struct System {
    Definition definition;
    std::int32_t reference = kBasic;
    std::array<NodeId, 3> nodes = {};
    bool is_complete = true;  // false: what it refers to is not in the deck
  };
  std::vector<System> systems;
  std::vector<std::int32_t> of_node;  // kBasic, or the place of its system
  std::vector<Vec3d> local;           // by node, as read

  /// Is called with the place of a system that defines no frame, and why; must throw.
  using Failed = std::function<void(std::size_t system, const char* why)>;

  /// In the basic system. O(nodes).
  [[nodiscard]] std::vector<Vec3d> basic_positions(const Failed& failed) const;
  /// Where nodes that moved are in their own systems; those that did not keep what was read.
  /// Systems move with the nodes that define them. `read`: as of `basic_positions`. O(nodes).
  [[nodiscard]] std::vector<Vec3d> local_positions(std::span<const Vec3d> read,
                                                   std::span<const Vec3d> now,
                                                   const Failed& failed) const;
};

}  // namespace meshsmooth::formats
