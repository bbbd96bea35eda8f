#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gpu/report.hpp"
#include "paper/system.hpp"

namespace meshsmooth::bench {

/// What is true of a result whatever it took to make it.
struct Findings {
  double largest_move = 0;  // of the sweep of form A that would come next
  std::int64_t inverted_count = 0;
};

/// Medians.
struct SerialFigures {
  double neighbours_ms = 0;
  double boundary_ms = 0;
  double form_a_ms = 0;
  double form_b_ms = 0;
  int form_a_sweeps = 0;
  int form_b_sweeps = 0;
  Findings form_a;
  Findings form_b;

  [[nodiscard]] double total_ms(IterationForm form) const {
    return neighbours_ms + boundary_ms + (form == IterationForm::a ? form_a_ms : form_b_ms);
  }
};

/// Sweeps alone with one number of blocks.
struct BlockCountFigures {
  int block_count = 0;
  double iterate_ms = 0;
};

struct VariantFigures {
  Variant variant;           // of many blocks the number that was fastest
  StageMilliseconds pooled;  // medians, stage by stage
  StageMilliseconds plain;   // with temporaries by cudaMalloc
  int least_sweeps = 0;      // of the last run
  int most_sweeps = 0;
  bool converged = true;  // in every run
  Findings worst;         // over the runs
  bool same_bits = true;  // of all runs
  std::vector<BlockCountFigures> block_counts;

  [[nodiscard]] bool many_blocks() const { return variant.block_count > 1; }
  /// Without the copies.
  [[nodiscard]] double stages_ms() const {
    return pooled.neighbours + pooled.boundary + pooled.iterate;
  }
};

struct GpuFigures {
  std::size_t peak_bytes = 0;            // of neighbours and boundary
  std::vector<VariantFigures> variants;  // twelve
  /// The fastest whole run, copies included, memory pooled.
  [[nodiscard]] const VariantFigures& best() const;
};

struct PaperFigures {
  std::string mesh;
  std::size_t node_count = 0;
  std::size_t tetrahedron_count = 0;
  std::size_t entry_count = 0;  // of all rings
  std::size_t boundary_count = 0;
  double tolerance = 0;
  Findings before;
  SerialFigures serial;
  GpuFigures gpu;                   // empty without a device
  std::vector<std::string> errors;  // where GPU and serial algorithm differ
};

struct PaperSettings {
  float tolerance = 1e-4F;
  int repeats = 5;
  bool with_gpu = true;
  bool with_plain_memory = true;
};

/// The serial algorithm and the twelve variants on one mesh, each compared with
/// the serial one. `host` receives the serial topology.
[[nodiscard]] PaperFigures measure_paper(const BenchMesh& mesh, const PaperSettings& settings,
                                         HostTopology& host);

[[nodiscard]] Findings evaluate(const BenchMesh& mesh, const HostTopology& host,
                                const std::vector<Vec3f>& positions);

[[nodiscard]] Json to_json(const PaperFigures& figures);

}  // namespace meshsmooth::bench
