// Where VTK's files have their numbers. First byte: legacy, .vtu or .vtp.
#include "fuzz/mesh_file.hpp"
#include "vtk/captured_errors.hpp"
#include "vtk/layout.hpp"

namespace {

using namespace meshsmooth;

constexpr const char* kNames[] = {"a.vtk", "a.vtu", "a.vtp"};

formats::VtkLayout scan(std::size_t name, std::string_view file) {
  return name == 0 ? formats::scan_legacy(kNames[name], file)
                   : formats::scan_xml(kNames[name], file);
}

/// Puts other numbers in place of the points, and finds them again.
void replace_points(std::size_t name, std::string_view file, const formats::VtkLayout& layout) {
  for (std::size_t piece = 0; piece < layout.pieces.size(); ++piece) {
    const formats::NumberBlock& block = layout.pieces[piece].points;
    auto numbers = formats::read_numbers(file, block);
    if (!numbers || block.type.kind != formats::NumberType::Kind::real) continue;
    for (std::size_t place = 0; place < numbers->size(); ++place) {
      (*numbers)[place] = 0.5 * static_cast<double>(place) - 1;
    }
    auto edits = formats::replace_numbers(file, block, *numbers, block.type);
    const bool moves_others = layout.appended && block.begin >= layout.appended_begin;
    const std::string written = formats::apply_edits(file, edits);
    if (moves_others) continue;
    const auto again = scan(name, written);
    testing::require(formats::read_numbers(written, again.pieces.at(piece).points) == numbers,
                     "numbers that were replaced are found");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const formats::CapturedErrors quiet;
  testing::Choices choices({data, size});
  const std::size_t name = choices.below(std::size(kNames));
  const std::string file(choices.rest());
  try {
    const formats::VtkLayout layout = scan(name, file);
    for (const formats::VtkPiece& piece : layout.pieces) {
      for (const auto& block : {piece.connectivity, piece.offsets, piece.types}) {
        if (block) (void)formats::read_numbers(file, *block);
      }
      for (const formats::NumberBlock& block : piece.faces) {
        (void)formats::read_numbers(file, block);
      }
    }
    replace_points(name, file, layout);
  } catch (const Error& error) {
    testing::require(std::string(error.what()).starts_with(kNames[name]),
                     "an error says which file");
  }
  return 0;
}
