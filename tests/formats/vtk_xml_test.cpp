// ".vtu" and ".vtp" files come back as they were, but for their coordinates: encoding, compressor,
// byte order, pieces, comments.

#include <gmock/gmock.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridReader.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include "compare.hpp"
#include "content.hpp"
#include "generate/generate.hpp"
#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::bytes_of;
using test::error_of;
using test::move_nodes;
using test::put_bytes;
using test::Scratch;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

enum class Mode { ascii, inline_base64, appended_base64, appended_raw };
enum class Compressor { none, zlib, lz4, lzma };

struct Settings {
  const char* name;
  Mode mode;
  Compressor compressor;
  int header_bits;
  bool big_endian;
  int pieces;
};

void PrintTo(const Settings& settings, std::ostream* to) { *to << settings.name; }

template <class Writer, class Data>
void write(const std::filesystem::path& path, Data* data, const Settings& settings) {
  const vtkNew<Writer> writer;
  writer->SetFileName(path.c_str());
  writer->SetInputData(data);
  if (settings.mode == Mode::ascii) writer->SetDataModeToAscii();
  if (settings.mode == Mode::inline_base64) writer->SetDataModeToBinary();
  writer->SetEncodeAppendedData(settings.mode != Mode::appended_raw);
  switch (settings.compressor) {
    case Compressor::none:
      writer->SetCompressorTypeToNone();
      break;
    case Compressor::zlib:
      writer->SetCompressorTypeToZLib();
      break;
    case Compressor::lz4:
      writer->SetCompressorTypeToLZ4();
      break;
    case Compressor::lzma:
      writer->SetCompressorTypeToLZMA();
      break;
  }
  writer->SetBlockSize(1024);  // so that there are several
  writer->SetHeaderType(settings.header_bits);
  writer->SetByteOrder(settings.big_endian ? vtkXMLWriter::BigEndian : vtkXMLWriter::LittleEndian);
  writer->SetNumberOfPieces(settings.pieces);
  ASSERT_EQ(writer->Write(), 1);
}

/// As the settings say, of a mesh that has several types of elements and data.
void write_grid(const std::filesystem::path& path, const Settings& settings) {
  const Scratch scratch;
  write_mesh_file(scratch.path("a.vtu"), MeshFile(generate_mixed(60, 1)));
  const vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName(scratch.path("a.vtu").c_str());
  reader->Update();
  vtkUnstructuredGrid* const grid = reader->GetOutput();
  const vtkNew<vtkDoubleArray> points, cells;
  points->SetName("of points");
  cells->SetName("of cells");
  for (vtkIdType n = 0; n < grid->GetNumberOfPoints(); ++n)
    points->InsertNextValue(0.1 * static_cast<double>(n));
  for (vtkIdType n = 0; n < grid->GetNumberOfCells(); ++n)
    cells->InsertNextValue(0.2 * static_cast<double>(n));
  grid->GetPointData()->AddArray(points);
  grid->GetCellData()->AddArray(cells);
  write<vtkXMLUnstructuredGridWriter>(path, grid, settings);
  std::string bytes = bytes_of(path);
  const std::string comment = "<!-- made by hand: <Piece> -->\n";
  put_bytes(path, bytes.insert(bytes.find("<VTKFile"), comment));
}

class XmlEncoding : public ::testing::TestWithParam<Settings> {};

INSTANTIATE_TEST_SUITE_P(
    Vtu, XmlEncoding,
    ::testing::Values(Settings{"ascii", Mode::ascii, Compressor::none, 32, false, 1},
                      Settings{"ascii_pieces", Mode::ascii, Compressor::zlib, 32, false, 3},
                      Settings{"base64", Mode::inline_base64, Compressor::none, 32, false, 1},
                      Settings{"base64_big_endian", Mode::inline_base64, Compressor::none, 64, true,
                               3},
                      Settings{"base64_zlib", Mode::inline_base64, Compressor::zlib, 32, true, 1},
                      Settings{"base64_lzma", Mode::inline_base64, Compressor::lzma, 64, false, 2},
                      Settings{"appended", Mode::appended_base64, Compressor::none, 64, false, 1},
                      Settings{"appended_lz4", Mode::appended_base64, Compressor::lz4, 32, true, 3},
                      Settings{"raw", Mode::appended_raw, Compressor::none, 32, true, 1},
                      Settings{"raw_pieces", Mode::appended_raw, Compressor::none, 64, false, 3},
                      Settings{"raw_zlib", Mode::appended_raw, Compressor::zlib, 64, false, 3},
                      Settings{"raw_lzma", Mode::appended_raw, Compressor::lzma, 32, true, 1}),
    [](const auto& param) { return std::string(param.param.name); });

TEST_P(XmlEncoding, StaysWithAllElse) {
  const Scratch scratch;
  write_grid(scratch.path("in.vtu"), GetParam());
  const std::string bytes = bytes_of(scratch.path("in.vtu"));
  const MeshFile before = read_mesh_file(scratch.path("in.vtu"));
  write_mesh_file(scratch.path("same.vtu"), before);
  EXPECT_EQ(bytes_of(scratch.path("same.vtu")), bytes);

  MeshFile moved = before;
  move_nodes(moved.mesh);
  write_mesh_file(scratch.path("out.vtu"), moved);
  const std::string written = bytes_of(scratch.path("out.vtu"));
  const MeshFile after = read_mesh_file(scratch.path("out.vtu"));
  EXPECT_TRUE(after.mesh.positions == moved.mesh.positions);
  const FileDifference difference = compare_files(before, after);
  EXPECT_THAT(difference.differences, IsEmpty());
  EXPECT_EQ(difference.compared_by, ComparedBy::bytes);
  // The header, the comment and the pieces.
  EXPECT_EQ(written.substr(0, written.find("<Points")).size(), bytes.find("<Points"));
  EXPECT_THAT(written, HasSubstr("<!-- made by hand: <Piece> -->"));
  const auto count = [](const std::string& text, const std::string& word) {
    int found = 0;
    for (auto at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count(written, "<Piece "), GetParam().pieces);

  MeshFile back = after;
  back.mesh.positions = before.mesh.positions;
  write_mesh_file(scratch.path("back.vtu"), back);
  if (GetParam().compressor == Compressor::none) {
    EXPECT_EQ(bytes_of(scratch.path("back.vtu")), bytes);
  }
  EXPECT_TRUE(read_mesh_file(scratch.path("back.vtu")).mesh.positions == before.mesh.positions);
}

TEST_P(XmlEncoding, TakesAnotherPrecision) {
  const Scratch scratch;
  write_grid(scratch.path("in.vtu"), GetParam());
  MeshFile file = read_mesh_file(scratch.path("in.vtu"));
  std::vector<Vec3f> singles;
  for (const Vec3d& node : std::get<std::vector<Vec3d>>(file.mesh.positions)) {
    singles.push_back(vec3_cast<float>(node));
  }
  file.mesh.positions = singles;
  write_mesh_file(scratch.path("out.vtu"), file);
  const MeshFile after = read_mesh_file(scratch.path("out.vtu"));
  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
  EXPECT_EQ(after.content()->dataset->cell_column("of cells")->values,
            file.content()->dataset->cell_column("of cells")->values);
}

TEST_P(XmlEncoding, StaysWhereCellArraysAreAdded) {
  const Scratch scratch;
  write_grid(scratch.path("in.vtu"), GetParam());
  MeshFile file = read_mesh_file(scratch.path("in.vtu"));
  file.element_arrays = {{"mine", std::vector<float>(file.mesh.element_count(), 0.5F)}};
  write_mesh_file(scratch.path("out.vtu"), file);
  const auto head = [&](const char* name) {
    std::string text = bytes_of(scratch.path(name));
    text = text.substr(text.find("<VTKFile"));
    text = text.substr(0, text.find('>'));
    return text.substr(text.find("byte_order"));  // byte order, header and compressor
  };
  const auto encoding = [&](const char* name) {
    const std::string text = bytes_of(scratch.path(name));
    const auto at = text.find("<AppendedData");
    return at == std::string::npos ? "" : text.substr(at, text.find('>', at) - at);
  };
  EXPECT_EQ(head("out.vtu"), head("in.vtu"));
  EXPECT_EQ(encoding("out.vtu"), encoding("in.vtu"));
  const MeshFile after = read_mesh_file(scratch.path("out.vtu"));
  EXPECT_EQ(after.content()->dataset->cell_column("mine")->values[0], 0.5);
  EXPECT_TRUE(after.mesh.positions == file.mesh.positions);
}

// --- written by hand --------------------------------------------------------------

std::string points(const std::string& numbers, const std::string& type = "Float64") {
  return "<Points><DataArray type=\"" + type + "\" NumberOfComponents=\"3\" format=\"ascii\">" +
         numbers + "</DataArray></Points>";
}

std::string cells(const std::string& connectivity, const std::string& offsets,
                  const std::string& types, const std::string& more = "") {
  return "<Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">" + connectivity +
         "</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">" + offsets +
         "</DataArray><DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">" + types +
         "</DataArray>" + more + "</Cells>";
}

std::string piece(int nodes, int cells, const std::string& content) {
  return "<Piece NumberOfPoints=\"" + std::to_string(nodes) + "\" NumberOfCells=\"" +
         std::to_string(cells) + "\">" + content + "</Piece>";
}

std::string vtu(const std::string& pieces) {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" "
         "byte_order=\"LittleEndian\">\n<UnstructuredGrid>" +
         pieces + "</UnstructuredGrid>\n</VTKFile>\n";
}

class Vtu : public ::testing::Test {
 protected:
  [[nodiscard]] MeshFile read(const std::string& text, const char* name = "in.vtu") const {
    put_bytes(scratch_.path(name), text);
    return read_mesh_file(scratch_.path(name));
  }
  [[nodiscard]] std::pair<std::string, std::string> refusal(const std::string& text,
                                                            const char* name = "in.vtu") const {
    return error_of([&] { (void)read(text, name); });
  }
  [[nodiscard]] std::string written(const MeshFile& file) const {
    write_mesh_file(scratch_.path("out.vtu"), file);
    return bytes_of(scratch_.path("out.vtu"));
  }

  const Scratch scratch_;
};

const std::string kCube = "0 0 0 1 0 0 0 1 0 1 1 0\n0 0 1 1 0 1 0 1 1 1 1 1";

TEST_F(Vtu, VoxelsOfWhichANodeMovesBecomeHexahedra) {
  const std::string voxel = piece(8, 1, points(kCube) + cells("0 1 2 3 4 5 6 7", "8", "11"));
  const std::string text = vtu(voxel + piece(0, 0, points("") + cells("", "", "")) + voxel);
  MeshFile file = read(text);
  const MeshFile before = file;
  EXPECT_EQ(file.mesh.element_count(), 2u);
  EXPECT_THAT(std::vector(file.mesh.blocks[0].nodes.begin(), file.mesh.blocks[0].nodes.begin() + 8),
              ElementsAre(0, 1, 3, 2, 4, 5, 7, 6));
  EXPECT_EQ(written(file), text);
  std::get<std::vector<Vec3d>>(file.mesh.positions)[8].x = -0.5;
  const std::string turned =
      piece(8, 1, points("-0.5" + kCube.substr(1)) + cells("0 1 3 2 4 5 7 6", "8", "12"));
  EXPECT_EQ(written(file), vtu(voxel + piece(0, 0, points("") + cells("", "", "")) + turned));
  EXPECT_THAT(compare_files(before, read_mesh_file(scratch_.path("out.vtu"))).differences,
              IsEmpty());
  file.element_arrays = {{"mine", {1, 2}}};  // by VTK's writer
  write_mesh_file(scratch_.path("more.vtu"), file);
  const MeshFile more = read_mesh_file(scratch_.path("more.vtu"));
  test::expect_same_connectivity(before.mesh, more.mesh);
  EXPECT_THAT(bytes_of(scratch_.path("more.vtu")), HasSubstr("11 12"));
}

TEST_F(Vtu, HoldsPolyhedraWithTheFacesOfOlderAndNewerFiles) {
  const std::string tetrahedron = points("0 0 0 1 0 0 0 1 0 0 0 1 5 0 0 6 0 0 5 1 0 5 0 1");
  const auto array = [](const std::string& name, const std::string& numbers) {
    return "<DataArray type=\"Int64\" Name=\"" + name + "\" format=\"ascii\">" + numbers +
           "</DataArray>";
  };
  const std::string older =
      array("faces", "4 3 4 5 6 3 4 5 7 3 5 6 7 3 4 6 7") + array("faceoffsets", "-1 17");
  const std::string newer =
      array("face_connectivity", "4 5 6 4 5 7 5 6 7 4 6 7") + array("face_offsets", "3 6 9 12") +
      array("polyhedron_to_faces", "0 1 2 3") + array("polyhedron_offsets", "0 4");
  for (const std::string& faces : {older, newer}) {
    const std::string text =
        vtu(piece(8, 2, tetrahedron + cells("0 1 2 3 4 5 6 7", "4 8", "10 42", faces)));
    const MeshFile file = read(text);
    ASSERT_EQ(file.held_cells().size(), 1u);
    EXPECT_EQ(file.held_cells()[0].count, 1);
    EXPECT_THAT(file.mesh.fixed, ElementsAre(0, 0, 0, 0, 1, 1, 1, 1));
    EXPECT_EQ(written(file), text);
    // And to another format, by VTK's writer.
    write_mesh_file(scratch_.path("out.vtk"), file);
    const MeshFile legacy = read_mesh_file(scratch_.path("out.vtk"));
    EXPECT_EQ(legacy.held_cells()[0].count, 1);
    const auto faces_of = [](const MeshFile& from) {
      return from.content()->dataset->stored_arrays().back();
    };
    EXPECT_EQ(faces_of(legacy).name, "faces of polyhedra");
    EXPECT_EQ(faces_of(legacy).bytes, faces_of(file).bytes);
  }
}

TEST_F(Vtu, WholeNumbersBecomeReal) {
  const std::string tetrahedron = cells("0 1 2 3", "4", "10");
  const std::string text =
      vtu(piece(4, 1, points("0 0 0 1 0 0 0 1 0 0 0 1", "Int32") + tetrahedron));
  MeshFile file = read(text);
  EXPECT_EQ(written(file), text);
  std::get<std::vector<Vec3d>>(file.mesh.positions)[3].z = 1.5;
  EXPECT_EQ(written(file), vtu(piece(4, 1, points("0 0 0 1 0 0 0 1 0 0 0 1.5") + tetrahedron)));
}

TEST_F(Vtu, SaysWhatDoesNotFit) {
  const std::string square = points("0 0 0 1 0 0 1 1 0 0 1 0");
  EXPECT_EQ(refusal(vtu(piece(5, 1, square + cells("0 1 2 3", "4", "9")))).first, "FORMAT_ERROR");
  EXPECT_EQ(refusal(vtu(piece(4, 2, square + cells("0 1 2 3", "4", "9")))).first, "FORMAT_ERROR");
  EXPECT_THAT(refusal(vtu(piece(4, 1, square + "<Cells></Points>"))).second,
              HasSubstr("line 3: found </Points>, expected </Cells>"));
  EXPECT_THAT(refusal(vtu("<Piece NumberOfPoints=\"many\"></Piece>")).second,
              HasSubstr("line 3: NumberOfPoints=\"many\" is not a number"));
  EXPECT_THAT(refusal(vtu(""), "in.vtp").second,
              HasSubstr("it holds UnstructuredGrid; give it the extension .vtu"));
  const auto [reason, text] =
      refusal("<VTKFile type=\"ImageData\"><ImageData></ImageData></VTKFile>");
  EXPECT_EQ(reason, "ELEMENT_NOT_SUPPORTED");
  EXPECT_THAT(text, HasSubstr("it holds ImageData; only UnstructuredGrid (.vtu)"));
}

TEST(Vtp, KeepsPiecesAndListsOfEachKind) {
  const Scratch scratch;
  const std::string array = "<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">";
  const std::string ends =
      "</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">";
  const std::string piece =
      "<Piece NumberOfPoints='4' NumberOfVerts='1' NumberOfLines='1' NumberOfStrips='1' "
      "NumberOfPolys='1'>" +
      points("0 0 0 1 0 0 1 1 0 0 1 0", "Float32") + "<Verts>" + array + "0" + ends +
      "1</DataArray></Verts><Lines>" + array + "0 1" + ends + "2</DataArray></Lines><Strips>" +
      array + "0 1 3 2" + ends + "4</DataArray></Strips><Polys>" + array + "0 1 2" + ends +
      "3</DataArray></Polys></Piece>";
  const std::string text =
      "<VTKFile type='PolyData' version='0.1' byte_order='LittleEndian'>"
      "<PolyData>" +
      piece + "\n" + piece + "</PolyData></VTKFile>";
  put_bytes(scratch.path("in.vtp"), text);
  MeshFile file = read_mesh_file(scratch.path("in.vtp"));
  EXPECT_EQ(file.mesh.element_count(), 2u);
  EXPECT_EQ(file.lower_dimensional_cell_count(), 4);
  ASSERT_EQ(file.held_cells().size(), 1u);
  EXPECT_EQ(file.held_cells()[0].count, 2);
  std::get<std::vector<Vec3f>>(file.mesh.positions)[7].y = 1.1F;
  write_mesh_file(scratch.path("out.vtp"), file);
  std::string expected = text;
  expected.replace(expected.rfind("0 1 0<"), 5, "0 1.1 0");
  EXPECT_EQ(bytes_of(scratch.path("out.vtp")), expected);
}

}  // namespace
}  // namespace meshsmooth::formats
