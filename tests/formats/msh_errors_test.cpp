// What is wrong in an MSH file is named, and nothing of it is left out.

#include <gmock/gmock.h>

#include "scratch.hpp"

namespace meshsmooth::formats {
namespace {

using test::error_of;
using test::put_bytes;
using test::Scratch;
using ::testing::HasSubstr;

const std::string kFormat = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
const std::string kNodes = "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 1 1 0\n$EndNodes\n";

std::string elements(const std::string& rows) { return "$Elements\n" + rows + "$EndElements\n"; }

class MshErrors : public ::testing::Test {
 protected:
  [[nodiscard]] std::pair<std::string, std::string> error(const std::string& bytes) const {
    put_bytes(scratch_.path("in.msh"), bytes);
    return error_of([&] { (void)read_mesh_file(scratch_.path("in.msh")); });
  }
  void expect_error(const std::string& bytes, const std::string& reason,
                    const std::string& text) const {
    const auto [found, message] = error(bytes);
    EXPECT_EQ(found, reason) << message;
    EXPECT_THAT(message, HasSubstr(text));
  }

  const Scratch scratch_;
};

TEST_F(MshErrors, TheFirstElementThatIsMissingIsNamed) {
  expect_error(kFormat + kNodes + elements("3\n1 2 2 0 1 1 2 3\n2 2 2 0 1 2 4 3\n"), "FORMAT_ERROR",
               "line 15: expected element 3 of the 3 that the section announces, found "
               "\"$EndElements\"");
  expect_error(kFormat + "$Nodes\n5\n" + kNodes.substr(9) + elements("1\n1 2 2 0 1 1 2 3\n"),
               "FORMAT_ERROR", "expected node 5 of the 5 that the section announces");
}

TEST_F(MshErrors, MoreElementsThanAnnouncedAreRefused) {
  expect_error(kFormat + kNodes + elements("1\n1 2 2 0 1 1 2 3\n2 2 2 0 1 2 4 3\n"), "FORMAT_ERROR",
               "expected $EndElements after all that the section announces, found \"2\"");
}

TEST_F(MshErrors, BlocksThatDoNotMakeUpTheTotalAreRefused) {
  const std::string format = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
  const std::string nodes =
      "$Nodes\n1 4 1 4\n2 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n$EndNodes\n";
  expect_error(format + nodes + elements("1 3 1 3\n2 1 2 2\n1 1 2 3\n2 2 4 3\n"), "FORMAT_ERROR",
               "$Elements announces 3 elements, its blocks have 2: element 3 is missing");
  expect_error(format + nodes + elements("1 2 1 2\n2 1 2 2\n1 1 2 3\n"), "FORMAT_ERROR",
               "expected element 2 of the 2");
  std::string fewer = nodes;
  fewer.replace(fewer.find("1 4 1 4"), 7, "1 5 1 5");
  expect_error(format + fewer + elements("1 1 1 1\n2 1 2 1\n1 1 2 3\n"), "FORMAT_ERROR",
               "$Nodes announces 5 nodes, its blocks have 4");
}

TEST_F(MshErrors, ALineWithTooManyOrTooFewNumbersIsNamed) {
  expect_error(kFormat + kNodes + elements("2\n1 2 2 0 1 1 2 3 4\n2 2 2 0 1 2 4 3\n"),
               "FORMAT_ERROR", "line 13: expected the end of the line of element 1, found \"4\"");
  expect_error(kFormat + kNodes + elements("2\n1 2 2 0 1 1 2\n2 2 2 0 1 2 4 3\n"), "FORMAT_ERROR",
               "line 14: expected the end of the line of element 1");
  expect_error(kFormat + "$Nodes\n4\n1 0 0\n" + kNodes.substr(17), "FORMAT_ERROR",
               "expected the end of the line of node 1");
  expect_error(
      "$MeshFormat\n3 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0 0\n2 1 0 0 0\n3 0 1 0 0\n"
      "$EndNodes\n$Elements\n1\n7 2 0 2 1 2\n$EndElements\n",
      "FORMAT_ERROR", "expected at least 3 numbers of element 7 by its type, found \"2\"");
  expect_error("$NOD\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$ENDNOD\n$ELM\n1\n1 2 0 1 4 1 2 3 3\n$ENDELM\n",
               "FORMAT_ERROR", "expected 3 nodes of element 1 by its type, found \"4\"");
}

// Gmsh's own API tells only of the order of the first element of an entity.
TEST_F(MshErrors, OrdersMixedInOneEntityAreSeen) {
  put_bytes(scratch_.path("in.msh"),
            kFormat +
                "$Nodes\n10\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 2 1 0\n5 2 0 0\n6 1 1 0\n7 1.5 0 0\n"
                "8 2 .5 0\n9 1.5 1 0\n10 1 .5 0\n$EndNodes\n" +
                elements("2\n1 3 2 0 1 1 2 6 3\n2 16 2 0 1 2 5 4 6 7 8 9 10\n"));
  const MeshFile file = read_mesh_file(scratch_.path("in.msh"));
  EXPECT_EQ(file.mesh.element_count(), 2U);
  const auto [reason, text] =
      error_of([&] { validate(MeshTopology(file.mesh).view(), file.mesh.positions_view()); });
  EXPECT_EQ(reason, "MIXED_ORDERS");
}

TEST_F(MshErrors, NodesAreThereOnce) {
  std::string nodes = kNodes;
  nodes.replace(nodes.find("\n4 1 1"), 2, "\n2");
  expect_error(kFormat + nodes + elements("1\n1 2 2 0 1 1 2 3\n"), "FORMAT_ERROR",
               "two nodes have the number 2");
  expect_error(kFormat + kNodes + elements("1\n17 2 2 0 1 1 2 8\n"), "FORMAT_ERROR",
               "element 17 uses node 8, which is not in the file");
  expect_error(kFormat + kNodes + kNodes, "FORMAT_ERROR", "expected $Nodes once");
}

TEST_F(MshErrors, WhatIsNotReadIsNamed) {
  const std::string row = "1\n1 2 2 0 1 1 2 3\n";
  expect_error("$MeshFormat\n5.0 0 8\n$EndMeshFormat\n", "FORMAT_ERROR",
               "MSH version 5.0 is not supported; 1.0, 2.0 to 2.2, 3.0, 4.0 and 4.1 are");
  expect_error("$MeshFormat\n3 1 8\n", "FORMAT_ERROR", "an ASCII file of MSH version 3");
  expect_error(kFormat + kNodes + elements("1\n5 26 2 0 1 1 2 3 4\n"), "MESH_EMPTY",
               "no surface or volume elements in it, only 1 of the type Line 4");
  expect_error(kFormat + kNodes + elements("1\n5 777 2 0 1 1 2 3 4\n"), "ELEMENT_NOT_SUPPORTED",
               "element 5 is of Gmsh's type 777");
  expect_error(kFormat + kNodes, "MESH_EMPTY", "there is no $Elements section");
  expect_error(kFormat + elements(row), "MESH_EMPTY", "there is no $Nodes section");
  expect_error(kFormat, "FILE_TRUNCATED", "there is no $Nodes section");
  expect_error(kFormat + kNodes + "$Comments\n1\n", "FILE_TRUNCATED",
               "there is no $EndComments after $Comments");
  expect_error(kFormat + kNodes + "$Periodic\n1\n", "FILE_TRUNCATED", "the file ends too early");
  expect_error(kFormat + kNodes + elements(row).substr(0, 20), "FILE_TRUNCATED",
               "the file ends too early");
}

TEST_F(MshErrors, MeshesOfOtherProgramsAreNamed) {
  const auto expect_name = [&](const std::string& text, const std::string& name) {
    expect_error(text, "FORMAT_ERROR", "this is " + name + ", not Gmsh's");
  };
  expect_name("4 2 4\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n1 2 3 0\n1 3 4 0\n", "a FreeFEM mesh");
  expect_name("MESH dimension 3 ElemType Tetrahedra Nnode 4\nCoordinates\n",
              "a GiD or Kratos mesh");
  expect_name("# by GiD\nMESH \"layer\" dimension 2 ElemType Triangle\n", "a GiD or Kratos mesh");
  expect_name("!HEADER\n test\n!NODE\n1, 0, 0, 0\n", "a FrontISTR mesh");
  expect_name("!!\n!! comment\n!NODE\n", "a FrontISTR mesh");
  expect_name("(0 \"GAMBIT to Fluent File\")\n\n(2 3)\n", "a Fluent mesh");
  expect_name("(2 3)\n(10 (0 1 4 0))\n", "a Fluent mesh");
  expect_name("Brick 3 x 3 mesh\n2D-Nodes 9\n0 0 0 0.0 0.0\n", "an escript (Finley) mesh");
  expect_name("$Id$\n2D-Nodes 9\n0 0 0 0.0 0.0\n", "an escript (Finley) mesh");
  expect_name("MeshVersionFormatted 2\nDimension 3\n", "a Medit mesh (.mesh)");
  EXPECT_THAT(error("Dear reader,\n").second,
              HasSubstr("this is not Gmsh's MSH format: it has no $MeshFormat and no $NOD"));
  EXPECT_EQ(error("\n \n").first, "FILE_TRUNCATED");
}

}  // namespace
}  // namespace meshsmooth::formats
