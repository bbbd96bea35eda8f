#pragma once

#include <cstdint>
#include <filesystem>
#include <map>

#include "coordinate_fields.hpp"
#include "unv/lines.hpp"

namespace meshsmooth::formats::unv {

/// The nodes of data sets 15, 781 and 2411, and the coordinate systems that they are given in.
class Nodes {
 public:
  explicit Nodes(const std::filesystem::path& file) : file_(file) {
    fields_.style = NumberStyle::fortran;
  }

  /// Data set 15: a node a line.
  void read_single(Lines& lines);
  /// 781 and 2411: two lines a node.
  void read_double(Lines& lines);
  /// 2420: the coordinate systems of a part.
  void read_systems(Lines& lines);

  /// Throws FORMAT_ERROR unless all nodes are in one Cartesian system, wherever that is: smoothing
  /// turns and shifts with it.
  void check_systems() const;
  [[nodiscard]] CoordinateFields take_fields() { return std::move(fields_); }

 private:
  struct System {
    bool cartesian;
    bool global;  // its axes and origin are those of the part
  };

  void note_system(std::int64_t node, std::int64_t system) { first_node_.emplace(system, node); }

  const std::filesystem::path& file_;
  CoordinateFields fields_;
  std::map<std::int64_t, System> systems_;           // by label
  std::map<std::int64_t, std::int64_t> first_node_;  // of each system that is used
};

}  // namespace meshsmooth::formats::unv
