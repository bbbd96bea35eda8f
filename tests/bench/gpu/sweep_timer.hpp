#pragma once

#include <algorithm>
#include <exception>
#include <optional>
#include <vector>

#include "gpu/cuda.hpp"
#include "gpu/report.hpp"

namespace meshsmooth::bench {

/// Median of the milliseconds that the work of `body` takes on the stream, after
/// one warm-up.
template <class Body>
double median_milliseconds(const Stream& stream, int repeats, const Body& body) {
  body();
  std::vector<double> times;
  Event begin, end;
  for (int run = 0; run < repeats; ++run) {
    begin.record(stream);
    body();
    end.record(stream);
    times.push_back(end.milliseconds_since(begin));
  }
  return median(times);
}

/// The same work as a CUDA graph; nothing where it cannot be captured.
template <class Body>
std::optional<double> median_graph_milliseconds(const Stream& stream, int repeats,
                                                const Body& body) {
  check_cuda(cudaStreamBeginCapture(stream.get(), cudaStreamCaptureModeThreadLocal),
             "beginning a capture");
  bool captured = true;
  try {
    body();
  } catch (const std::exception&) {
    captured = false;
  }
  cudaGraph_t graph = nullptr;
  captured = cudaStreamEndCapture(stream.get(), &graph) == cudaSuccess && captured;
  cudaGraphExec_t executable = nullptr;
  captured = captured && cudaGraphInstantiate(&executable, graph, 0) == cudaSuccess;
  static_cast<void>(cudaGetLastError());  // of a capture that failed
  std::optional<double> time;
  if (captured) {
    time = median_milliseconds(stream, repeats, [&] {
      check_cuda(cudaGraphLaunch(executable, stream.get()), "launching a graph");
    });
  }
  if (executable != nullptr) static_cast<void>(cudaGraphExecDestroy(executable));
  if (graph != nullptr) static_cast<void>(cudaGraphDestroy(graph));
  return time;
}

/// The quicker of both: a peer is not to be charged for our launching.
template <class Body>
double quickest_milliseconds(const Stream& stream, int repeats, const Body& body) {
  const double launched = median_milliseconds(stream, repeats, body);
  return std::min(launched, median_graph_milliseconds(stream, repeats, body).value_or(launched));
}

}  // namespace meshsmooth::bench
