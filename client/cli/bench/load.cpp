#include "bench/load.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {
namespace {

constexpr std::size_t kSteadyWindows = 3;
constexpr double kSteadyShare = 0.1;

bool are_close(std::span<const LoadFigures> windows, double LoadFigures::*value) {
  double mean = 0;
  for (const LoadFigures& window : windows) mean += window.*value;
  mean /= static_cast<double>(windows.size());
  return std::ranges::all_of(windows, [&](const LoadFigures& window) {
    return std::abs(window.*value - mean) <= kSteadyShare * mean;
  });
}

}  // namespace

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const double rank = std::ceil(share * static_cast<double>(values.size()));
  const auto place = static_cast<std::ptrdiff_t>(std::max(rank, 1.0)) - 1;
  std::ranges::nth_element(values, values.begin() + place);
  return values[static_cast<std::size_t>(place)];
}

LoadFigures figures_of(std::span<const LoadSample> samples, double from, double to) {
  LoadFigures figures;
  figures.seconds = to - from;
  std::vector<double> latencies;
  std::int64_t up = 0, down = 0;
  for (const LoadSample& sample : samples) {
    if (sample.end < from || sample.end >= to) continue;
    switch (sample.outcome) {
      case Outcome::ok:
        ++figures.ok_count;
        latencies.push_back(sample.latency);
        up += sample.bytes_up;
        down += sample.bytes_down;
        break;
      case Outcome::refused:
        ++figures.refused_count;
        ++figures.refused[sample.reason];
        break;
      case Outcome::failed:
        ++figures.failed_count;
        ++figures.failed[sample.reason];
        break;
    }
  }
  if (figures.seconds > 0) {
    figures.jobs_per_second = static_cast<double>(figures.ok_count) / figures.seconds;
    figures.megabytes_up_per_second = 1e-6 * static_cast<double>(up) / figures.seconds;
    figures.megabytes_down_per_second = 1e-6 * static_cast<double>(down) / figures.seconds;
  }
  figures.p50 = percentile(latencies, 0.5);
  figures.p90 = percentile(latencies, 0.9);
  figures.p99 = percentile(latencies, 0.99);
  figures.p999 = percentile(latencies, 0.999);
  figures.max = percentile(latencies, 1);
  return figures;
}

bool is_steady(std::span<const LoadFigures> windows) {
  if (windows.size() < kSteadyWindows) return false;
  const auto last = windows.last(kSteadyWindows);
  if (std::ranges::any_of(last, [](const LoadFigures& window) { return window.ok_count == 0; })) {
    return false;
  }
  return are_close(last, &LoadFigures::jobs_per_second) && are_close(last, &LoadFigures::p50);
}

LoadSize parse_load_size(const std::string& text) {
  LoadSize size;
  const char* const end = text.data() + text.size();
  auto [next, error] = std::from_chars(text.data(), end, size.node_count);
  if (error == std::errc{} && next != end && *next == ':') {
    const auto weight = std::from_chars(next + 1, end, size.weight);
    next = weight.ptr;
    error = weight.ec;
  }
  const bool in_range = size.node_count >= 216 && size.node_count <= 100'000'000 &&
                        size.weight > 0 && size.weight <= 1e6;
  if (error != std::errc{} || next != end || !in_range) {
    throw InvalidOption("OPTION_OUT_OF_RANGE",
                        "--nodes " + text +
                            ": not NODES or NODES:WEIGHT, with 216 to 100000000 "
                            "nodes and a weight above 0",
                        {{"field", "nodes"}});
  }
  return size;
}

}  // namespace meshsmooth::cli
