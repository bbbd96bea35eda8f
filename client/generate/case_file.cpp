#include "generate/case_file.hpp"

#include <sstream>

#include "formats/content.hpp"
#include "generate/cases.hpp"
#include "meshsmooth/error.hpp"

namespace meshsmooth::formats {
namespace {

template <class Number>
Column whole_column(const char* name, const std::vector<Number>& numbers) {
  return {name, true, {numbers.begin(), numbers.end()}};
}

}  // namespace

MeshFile make_case_file(Mesh mesh, const std::vector<std::uint8_t>& fixed,
                        const std::vector<std::int32_t>& layers) {
  auto dataset = std::make_shared<PlainDataset>(mesh);
  if (!fixed.empty()) dataset->add_node_column(whole_column(kFixedArray, fixed));
  if (!layers.empty()) dataset->add_cell_column(whole_column(kLayerArray, layers));
  FileContent content;
  content.dataset = std::move(dataset);
  return make_mesh_file("generated mesh", std::move(content));
}

void check_option(const std::string& field, double value, double lower, double upper) {
  if (value >= lower && value <= upper) return;
  std::ostringstream text;
  text.precision(12);
  text << field << ' ' << value << " is not in [" << lower << ", " << upper << ']';
  throw InvalidOption("OPTION_OUT_OF_RANGE", text.str(), {{"field", field}});
}

void check_mesh_size(double node_count, const std::string& fields) {
  constexpr double kMost = 1e8;
  if (node_count <= kMost) return;
  std::ostringstream text;
  text << node_count << " nodes are more than " << kMost << ": reduce " << fields;
  throw InvalidOption("OPTION_OUT_OF_RANGE", text.str(), {{"field", fields}});
}

}  // namespace meshsmooth::formats
