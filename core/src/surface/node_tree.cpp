#include "surface/node_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace meshsmooth::detail {
namespace {

constexpr double kLikely = 0.3;  // times the mismatch where the creases fit

[[nodiscard]] std::array<double, 3> coordinates(Vec3d p) { return {p.x, p.y, p.z}; }

}  // namespace

NodeTree::NodeTree(const BoundaryMesh& boundary, const std::function<void()>& check)
    : boundary_(boundary), order_(boundary.node_count()) {
  Checkpoint checkpoint(check);
  creases_.reserve(order_.size());
  for (std::size_t n = 0; n < order_.size(); ++n) {
    checkpoint();
    creases_.push_back(boundary.crease_count(static_cast<std::int32_t>(n)));
  }
  std::iota(order_.begin(), order_.end(), 0);
  if (!order_.empty()) add_boxes(0, order_.size(), checkpoint);
}

void NodeTree::add_boxes(std::size_t first, std::size_t last, Checkpoint& checkpoint) {
  Box box{{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, 0, first, last, 0};
  for (std::size_t i = first; i < last; ++i) {
    checkpoint();
    const auto x = coordinates(boundary_.points()[std::size_t(order_[i])]);
    for (std::size_t k = 0; k < 3; ++k) {
      box.lower[k] = std::min(box.lower[k], x[k]);
      box.upper[k] = std::max(box.upper[k], x[k]);
    }
    box.largest_size = std::max(box.largest_size, boundary_.size_at(order_[i]));
  }
  const std::size_t own = boxes_.size();
  boxes_.push_back(box);
  if (last - first <= kLeaf) return;
  std::size_t longest = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (box.upper[k] - box.lower[k] > box.upper[longest] - box.lower[longest]) longest = k;
  }
  const std::size_t middle = first + (last - first) / 2;
  const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(first), at(middle), at(last), [&](std::int32_t a, std::int32_t b) {
    checkpoint();
    const double x = coordinates(boundary_.points()[std::size_t(a)])[longest];
    const double y = coordinates(boundary_.points()[std::size_t(b)])[longest];
    return x != y ? x < y : a < b;
  });
  add_boxes(first, middle, checkpoint);
  boxes_[own].right = boxes_.size();
  add_boxes(middle, last, checkpoint);
}

double NodeTree::bound(const Box& box, Vec3d at) const {
  const auto x = coordinates(at);
  double squared = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double off = std::max({box.lower[k] - x[k], x[k] - box.upper[k], 0.0});
    squared += off * off;
  }
  // Less than rounding may make of a node's own.
  return (1 - 1e-12) * kLikely * std::sqrt(squared) / std::max(box.largest_size, 1e-300);
}

double NodeTree::mismatch(std::int32_t n, Vec3d at, bool corner) const {
  const int creases = creases_[std::size_t(n)];
  const bool like = corner ? creases > 2 || creases == 1 : creases > 0;
  const double size = boundary_.size_at(n);
  return (norm(boundary_.points()[std::size_t(n)] - at) + 1e-9 * size) *
         (like          ? kLikely
          : creases > 0 ? 0.6
                        : 1) /
         std::max(size, 1e-300);
}

std::vector<Match> NodeTree::likeliest(Vec3d at, bool corner, std::size_t count,
                                       const std::function<bool(std::int32_t)>& is_free) const {
  std::vector<Match> best;  // sorted
  if (boxes_.empty() || count == 0) return best;
  std::vector<std::size_t> open{0};
  for (std::size_t visited = 0; !open.empty() && visited < kMostBoxes; ++visited) {
    const std::size_t own = open.back();
    open.pop_back();
    const Box& box = boxes_[own];
    if (best.size() == count && bound(box, at) > best.back().mismatch) continue;
    if (box.right != 0) {
      const std::size_t left = own + 1, right = box.right;
      const bool left_first = bound(boxes_[left], at) <= bound(boxes_[right], at);
      open.push_back(left_first ? right : left);
      open.push_back(left_first ? left : right);
      continue;
    }
    for (std::size_t i = box.first; i < box.last; ++i) {
      if (!is_free(order_[i])) continue;
      const Match match{mismatch(order_[i], at, corner), order_[i]};
      if (best.size() == count && !(match < best.back())) continue;
      if (best.size() == count) best.pop_back();
      best.insert(std::ranges::upper_bound(best, match), match);
    }
  }
  return best;
}

}  // namespace meshsmooth::detail
