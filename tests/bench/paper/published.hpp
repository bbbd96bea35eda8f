#pragma once

#include <array>
#include <optional>
#include <string_view>

/// What Xiao, Yang, Zhao, Mei publish (Applied Sciences 9(24), 5437, 2019), as
/// far as it was to be had when this was written: the figures that others quote.
/// A figure that is not here is printed as "-". Whoever has the paper's tables
/// adds lines here; nothing else changes.
namespace meshsmooth::bench::published {

inline constexpr std::string_view kMachine = "Quadro P6000; serial: one core of a Xeon Gold 5118";

struct Figure {
  std::string_view mesh;      // "100k"
  std::string_view quantity;  // "tetrahedra", "serial A", "B aligned AoS many" …
  double value;               // milliseconds where it is a time
};

inline constexpr auto kFigures = std::to_array<Figure>({
    {"100k", "tetrahedra", 727e3},
    {"slope77k", "tetrahedra", 388e3},
    {"100k", "best serial", 22.4e3},
    {"100k", "B aligned AoS many", 485},
    {"100k", "B aligned AoS many speedup", 46},
});

[[nodiscard]] constexpr std::optional<double> find(std::string_view mesh,
                                                   std::string_view quantity) {
  for (const Figure& figure : kFigures) {
    if (figure.mesh == mesh && figure.quantity == quantity) return figure.value;
  }
  return std::nullopt;
}

}  // namespace meshsmooth::bench::published
