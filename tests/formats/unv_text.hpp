#pragma once

#include <cstdint>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "meshsmooth/vec3.hpp"

namespace meshsmooth::formats::test::unv {

inline const std::string kMark = "    -1\n";

inline std::string data_set(const std::string& number, const std::string& text) {
  return kMark + "  " + number + "\n" + text + kMark;
}

inline std::string integers(const std::vector<std::int64_t>& numbers) {
  std::ostringstream text;
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    if (n > 0 && n % 8 == 0) text << '\n';
    text.width(10);
    text << numbers[n];
  }
  return text.str() + "\n";
}

inline std::string real(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%25.16E", value);
  std::string number = text;
  number[number.find('E')] = 'D';
  return number;
}

struct Node {
  std::int64_t label;
  Vec3d at;
};

inline std::string nodes_2411(const std::vector<Node>& nodes) {
  std::string text;
  for (const Node& node : nodes) {
    text += integers({node.label, 1, 1, 11}) + real(node.at.x) + real(node.at.y) + real(node.at.z);
    text += '\n';
  }
  return data_set("2411", text);
}

inline std::string element(std::int64_t label, int descriptor,
                           const std::vector<std::int64_t>& nodes, int property = 1) {
  const bool beam = descriptor <= 24;
  return integers({label, descriptor, property, 1, 7, static_cast<std::int64_t>(nodes.size())}) +
         (beam ? integers({0, 1, 1}) : "") + integers(nodes);
}

/// A square of two triangles around node 50, and node 7, of no element.
inline const std::vector<Node> kSquare = {
    {10, {0, 0, 0}}, {20, {1, 0, 0}}, {30, {1, 1, 0}}, {40, {0, 1, 0}}, {50, {0.4, 0.6, 0}}};
inline const std::string kTriangles =
    element(1, 91, {10, 20, 50}) + element(2, 91, {20, 30, 50}, 2) +
    element(3, 91, {30, 40, 50}, 2) + element(4, 91, {40, 10, 50});
inline const std::string kPlane = nodes_2411(kSquare) + data_set("2412", kTriangles);

}  // namespace meshsmooth::formats::test::unv
