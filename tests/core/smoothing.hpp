#pragma once

// Running jobs, for the tests of the smoother.

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <cstring>
#include <stdexcept>
#include <string>

#include "meshsmooth/smoother.hpp"
#include "support/oracle.hpp"

namespace meshsmooth::test {

struct Job {
  Mesh mesh;
  SmoothSummary summary;
};

inline Job smooth(Mesh mesh, const SmoothOptions& options, int threads = 2,
                  const JobControl& control = {}, const JobInput& input = {}) {
  const tbb::global_control enough(tbb::global_control::max_allowed_parallelism, 8);
  Job job{std::move(mesh), {}};
  job.summary = make_smoother("cpu", threads)->smooth(job.mesh, options, control, input);
  return job;
}
inline Job smooth(Mesh mesh, const SmoothOptions& options, const JobInput& input, int threads = 2) {
  return smooth(std::move(mesh), options, threads, {}, input);
}

/// How often a job begins: twice where it starts anew on a canonical topology.
inline int count_starts(Mesh mesh, const std::string& backend = "cpu") {
  int starts = 0;
  Stage last = Stage::evaluate;
  JobControl control;
  control.on_progress = [&](const Progress& progress) {
    starts += progress.stage == Stage::find_neighbours && last != Stage::find_neighbours ? 1 : 0;
    last = progress.stage;
  };
  make_smoother(backend, 1)->smooth(mesh, {.max_iterations = 2}, control);
  return starts;
}

inline Job smooth_on(Smoother& smoother, Mesh mesh, const SmoothOptions& options,
                     const JobInput& input = {}) {
  Job job{std::move(mesh), {}};
  job.summary = smoother.smooth(job.mesh, options, {}, input);
  return job;
}

/// Of a metric that the mesh has.
inline const MetricStats& stats_of(const QualityStats& quality, QualityMetric metric) {
  for (const MetricStats& stats : quality.metrics) {
    if (stats.metric == metric) return stats;
  }
  throw std::logic_error("no " + std::string(metric_name(metric)));
}
inline const MetricStats& mean_ratio(const QualityStats& quality) {
  return stats_of(quality, QualityMetric::mean_ratio);
}
inline const MetricStats& scaled_jacobian(const QualityStats& quality) {
  return stats_of(quality, QualityMetric::scaled_jacobian);
}

/// Byte by byte: tells -0.0 from 0.0.
inline bool same_bits(const Mesh& a, const Mesh& b) {
  if (a.positions.index() != b.positions.index() || a.node_count() != b.node_count()) return false;
  return std::visit(
      [&]<class Points>(const Points& p) {
        const auto& q = std::get<Points>(b.positions);
        return p.empty() || std::memcmp(p.data(), q.data(), p.size() * sizeof(p[0])) == 0;
      },
      a.positions);
}

inline double diagonal(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const oracle::Point& p : oracle::to_points(mesh)) box.extend(p);
  return box.diagonal().norm();
}

/// How far the mesh is from the oracle's positions, as a share of its box.
inline double difference(const Mesh& mesh, const oracle::Points& expected) {
  return oracle::max_distance(oracle::to_points(mesh), expected) / diagonal(mesh);
}

/// Whether every element that is valid in `before` is in `after`.
inline bool keeps_valid_elements(const Mesh& before, const Mesh& after) {
  const oracle::Points x = oracle::to_points(before);
  const oracle::Points y = oracle::to_points(after);
  for (const oracle::Element& e : oracle::elements(before)) {
    const auto ratio = [&](const oracle::Points& at) {
      return oracle::quality(e.type, oracle::corners(e, at)).mean_ratio;
    };
    if (ratio(x) > 1e-6 && !(ratio(y) > 0)) return false;
  }
  return true;
}

/// A surface mesh is curved, since sizes do not tell it from a plane one, of which Optimize needs
/// less; a volume mesh stays as it is.
inline Mesh wavy_if_surface(const Mesh& mesh) {
  if (!oracle::is_surface(mesh.blocks[0].type)) return mesh;
  return mapped(mesh, [](Vec3d p) { return Vec3d{p.x, p.y, 3 * std::sin(0.1 * p.x)}; });
}

/// A lattice of `n` cells a side with a smooth error as long as the mesh: its descent is
/// accelerated.
inline Mesh long_error(ElementType type, int n) {
  const double wave = 3.14159265358979 / n;
  const bool plane = oracle::is_surface(type);
  return wavy_if_surface(mapped(lattice(type, n), [&](Vec3d p) {
    const double bump = std::sin(wave * p.x) * std::sin(wave * p.y);
    p.x += 0.2 * n * bump * (plane ? 1 : std::sin(wave * p.z));
    return p;
  }));
}

/// `brief` has all that `full` has but the metrics.
inline void expect_brief_of(const QualityStats& full, const QualityStats& brief) {
  EXPECT_TRUE(brief.metrics.empty());
  EXPECT_EQ(full.element_count, brief.element_count);
  EXPECT_EQ(full.inverted_count, brief.inverted_count);
  EXPECT_EQ(full.degenerate_count, brief.degenerate_count);
  EXPECT_EQ(full.sum_absolute_volume, brief.sum_absolute_volume);
  EXPECT_EQ(full.enclosed_volume, brief.enclosed_volume);
  ASSERT_EQ(full.worst.size(), brief.worst.size());
  for (std::size_t i = 0; i < full.worst.size(); ++i) {
    EXPECT_EQ(full.worst[i].element, brief.worst[i].element);
    EXPECT_EQ(full.worst[i].mean_ratio, brief.worst[i].mean_ratio);
    EXPECT_EQ(full.worst[i].scaled_jacobian, brief.worst[i].scaled_jacobian);
  }
}

/// Options that do exactly `count` sweeps of the bare method.
inline SmoothOptions sweeps(int count, const Method& method, Form form = Form::jacobi) {
  return {.method = method,
          .form = form,
          .max_iterations = count,
          .tolerance = {0},
          .guard = false,
          .never_worse = false};
}

/// A method in a form, by name.
struct Way {
  std::string name;
  Method method;
  Form form;
};

inline std::string way_name(const ::testing::TestParamInfo<Way>& way) { return way.param.name; }

/// Every method in every form that it has.
inline std::vector<Way> ways(bool with_asynchronous) {
  const std::vector<std::pair<std::string, Method>> methods = {
      {"uniform", Laplacian{}},
      {"relaxed", Laplacian{.relaxation = 0.4}},
      {"inverse_length", Laplacian{.weighting = Weighting::inverse_edge_length}},
      // long edges pull most: a whole step overshoots
      {"length", Laplacian{.weighting = Weighting::edge_length, .relaxation = 0.5}},
      {"volume", Laplacian{.weighting = Weighting::ball_volume}},
      {"smart", SmartLaplacian{}},
      {"smart_volume", SmartLaplacian{Weighting::ball_volume, 0.7}},
      {"taubin", Taubin{}},
      {"hc", HcLaplacian{}},
      {"hc_held", HcLaplacian{.alpha = 0.2, .beta = 0.6}},
      {"windowed_sinc", WindowedSinc{}},
      {"optimize_average", Optimize{.goal = Goal::average}},
      {"optimize_balanced", Optimize{}},
      {"optimize_worst", Optimize{.goal = Goal::worst}}};
  std::vector<Way> result;
  for (const auto& [name, method] : methods) {
    if (std::holds_alternative<Optimize>(method)) {
      result.push_back({name, method, Form::gauss_seidel});
      continue;
    }
    result.push_back({name + "_jacobi", method, Form::jacobi});
    if (forms_of(method).size() == 1) continue;
    result.push_back({name + "_gauss_seidel", method, Form::gauss_seidel});
    if (with_asynchronous) result.push_back({name + "_asynchronous", method, Form::asynchronous});
  }
  return result;
}

}  // namespace meshsmooth::test
