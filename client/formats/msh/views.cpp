#include <algorithm>

#include "msh/msh_content.hpp"

namespace meshsmooth::formats {
namespace {

constexpr std::size_t kMostComponents = 9;  // of a tensor; no program has more

struct ViewHeader {
  std::string name;
  int step = 0;
  std::size_t components = 0;
  std::size_t count = 0;
};

/// Lines of text, in binary files also: names, real numbers (the time), whole numbers (step,
/// components, entries, partition).
ViewHeader read_header(Scanner& scanner) {
  ViewHeader header;
  const std::size_t names = scanner.count();
  scanner.line();
  for (std::size_t index = 0; index < names; ++index) {
    if (scanner.at_end()) scanner.truncated();
    std::string_view name = trimmed(scanner.line());
    if (name.starts_with('"') && name.ends_with('"') && name.size() > 1) {
      name = name.substr(1, name.size() - 2);
    }
    if (index == 0) header.name = name;
  }
  const std::size_t reals = scanner.count();
  for (std::size_t index = 0; index < reals; ++index) scanner.token();
  const std::size_t integers = scanner.count();
  for (std::size_t index = 0; index < integers; ++index) {
    if (index == 1 || index == 2) {
      (index == 1 ? header.components : header.count) = scanner.count();
    } else {
      const int number = scanner.number<int>();
      if (index == 0) header.step = number;
    }
  }
  scanner.line();
  if (integers < 3 || header.components == 0) {
    scanner.refuse(
        "a step, the number of components and of values of the view \"" + header.name + "\"",
        std::to_string(integers) + " numbers");
  }
  return header;
}

}  // namespace

void read_msh_view(MshNumbers& numbers, bool on_nodes, MshContent& content) {
  Scanner& scanner = numbers.scanner();
  const ViewHeader header = read_header(scanner);
  const bool is_carried = header.components <= kMostComponents;
  auto view = std::ranges::find_if(content.views, [&](const MshView& other) {
    return other.on_nodes == on_nodes && other.name == header.name;
  });
  if (is_carried && view == content.views.end()) {
    content.views.push_back({on_nodes, header.name, header.step, header.components, {}, {}});
    view = content.views.end() - 1;
  }
  // The first step only, of which every partition may have a section.
  const bool is_first =
      is_carried && view->step == header.step && view->components == header.components;
  const char* const what = on_nodes ? "node" : "element";
  for (std::size_t row = 0; row < header.count; ++row) {
    const std::int64_t tag =
        numbers.binary() ? numbers.integer() : numbers.first_tag(what, row, header.count);
    if (is_first) {
      view->tags.push_back(tag);
      for (std::size_t part = 0; part < header.components; ++part) {
        view->values.push_back(numbers.real());
      }
    } else {
      numbers.skip_reals(header.components);
    }
    numbers.end_of_record(what, tag);
  }
}

}  // namespace meshsmooth::formats
