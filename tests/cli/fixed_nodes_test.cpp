#include "fixed_nodes.hpp"

#include <gmock/gmock.h>

#include <sstream>

#include "meshsmooth/error.hpp"

namespace meshsmooth::cli {
namespace {

using ::testing::ElementsAre;

std::vector<NodeId> read(const std::string& text) {
  std::istringstream stream(text);
  return read_fixed_nodes(stream, "fixed.txt", 10);
}

std::string error_of(const std::string& text) {
  try {
    read(text);
  } catch (const InvalidOption& error) {
    EXPECT_EQ(error.reason(), "FIXED_NODES_INVALID");
    return error.what();
  }
  return "no error";
}

TEST(ReadFixedNodes, TakesAnIdALineAndSkipsCommentsAndBlanks) {
  EXPECT_THAT(read("# held\n3\n\n  7  # corner\r\n0"), ElementsAre(3, 7, 0));
  EXPECT_THAT(read(""), ElementsAre());
}

TEST(ReadFixedNodes, NamesTheLineOfWhatIsNoId) {
  EXPECT_EQ(error_of("1\n# x\n2 3\n"), "fixed.txt:3: \"2 3\" is not a node id; write one a line");
  EXPECT_EQ(error_of("1.5"), "fixed.txt:1: \"1.5\" is not a node id; write one a line");
  EXPECT_EQ(error_of("99999999999999999999"),
            "fixed.txt:1: \"99999999999999999999\" is not a node id; write one a line");
}

TEST(ReadFixedNodes, NamesTheLineOfANodeThatIsNotInTheMesh) {
  EXPECT_EQ(error_of("9\n10"),
            "fixed.txt:2: node 10 is not in the mesh; its nodes count from 0 to 9");
  EXPECT_EQ(error_of("-1"), "fixed.txt:1: node -1 is not in the mesh; its nodes count from 0 to 9");
}

TEST(ReadFixedNodes, SaysThatAFileIsMissing) {
  EXPECT_THROW((void)read_fixed_nodes(std::filesystem::path("/nowhere/fixed.txt"), 10), Error);
}

TEST(MarkFixed, AddsToTheMaskThatIsThere) {
  std::vector<std::uint8_t> mask;

  mark_fixed(mask, {}, 3);
  EXPECT_THAT(mask, ElementsAre());
  mark_fixed(mask, {1}, 3);
  mark_fixed(mask, {2}, 3);

  EXPECT_THAT(mask, ElementsAre(0, 1, 1));
}

}  // namespace
}  // namespace meshsmooth::cli
