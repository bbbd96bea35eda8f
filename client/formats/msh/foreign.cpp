#include "msh/foreign.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <vector>

#include "text.hpp"

namespace meshsmooth::formats {
namespace {

struct Signature {
  std::string_view begin;  // of a line, in lower case, gaps of one blank
  std::string_view name;
};

// The longer ones first where one begins another.
constexpr auto kSignatures = std::to_array<Signature>({
    {"mesh dimension", "a GiD or Kratos mesh"},
    {"mesh \"", "a GiD or Kratos mesh"},
    {"begin modelpartdata", "a Kratos model part (.mdpa)"},
    {"!header", "a FrontISTR mesh"},
    {"!node", "a FrontISTR mesh"},
    {"!!", "a FrontISTR mesh"},
    {"!element", "a FrontISTR mesh"},
    {"!initial condition", "a FrontISTR mesh"},
    {"(0", "a Fluent mesh"},
    {"(1", "a Fluent mesh"},
    {"(2", "a Fluent mesh"},
    {"\x89hdf", "an HDF5 file, such as a Fluent mesh (.msh.h5)"},
    {"meshversionformatted", "a Medit mesh (.mesh)"},
    {"mfem mesh", "an MFEM mesh"},
    {"mfem nc mesh", "an MFEM mesh"},
    {"% getfem mesh file", "a GetFEM mesh"},
    {"begin points list", "a GetFEM mesh"},
    {"2d-nodes", "an escript (Finley) mesh"},
    {"3d-nodes", "an escript (Finley) mesh"},
    {"version https://git-lfs", "a Git LFS pointer to a file, which git lfs pull fetches"},
    {"# vtk datafile", "a VTK file (.vtk)"},
    {"# created by comsol", "a COMSOL mesh (.mphtxt)"},
    {"ndime=", "an SU2 mesh (.su2)"},
    {"*heading", "an Abaqus or CalculiX deck (.inp)"},
    {"*node", "an Abaqus or CalculiX deck (.inp)"},
    {"mesh3d", "a Netgen mesh (.vol)"},
    {"<?xml", "an XML file, such as a DOLFIN mesh"},
    {"/prep7", "an ANSYS input file"},
    {"/batch", "an ANSYS input file"},
    {"/com", "an ANSYS input file"},
    {"$parameters", "a Gmsh post-processing file"},
    {"$postformat", "a Gmsh post-processing file (.pos)"},
});

/// Lines with anything but blanks, the first `count` of them.
std::vector<std::string_view> first_lines(std::string_view text, std::size_t count) {
  std::vector<std::string_view> lines;
  while (!text.empty() && lines.size() < count) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    if (!line.empty()) lines.push_back(line);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

std::string normalized(std::string_view line) {
  std::string text;
  for (const char letter : line.substr(0, 80)) {
    const auto code = static_cast<unsigned char>(letter);
    if (letter == ' ' || letter == '\t') {
      if (!text.ends_with(' ')) text += ' ';
    } else {
      text += static_cast<char>(std::tolower(code));
    }
  }
  return text;
}

std::size_t whole_numbers(std::string_view line) {
  std::size_t count = 0;
  while (!(line = trimmed(line)).empty()) {
    const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
    const std::string_view word = line.substr(0, end);
    if (word.find_first_not_of("0123456789") != std::string_view::npos) return 0;
    ++count;
    line.remove_prefix(end);
  }
  return count;
}

}  // namespace

std::string foreign_mesh_name(std::string_view text) {
  const std::vector<std::string_view> lines = first_lines(text, 4);  // some have a title first
  for (const std::string_view line : lines) {
    const std::string begin = normalized(line);
    const auto* found = std::ranges::find_if(
        kSignatures, [&](const Signature& one) { return begin.starts_with(one.begin); });
    if (found != kSignatures.end()) return std::string(found->name);
  }
  // "nodes triangles edges": three counts and nothing else.
  return !lines.empty() && whole_numbers(lines.front()) == 3 ? "a FreeFEM mesh" : "";
}

}  // namespace meshsmooth::formats
