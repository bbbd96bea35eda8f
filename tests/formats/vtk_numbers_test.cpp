// Numbers in the bytes of VTK files.

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "vtk/base64.hpp"
#include "vtk/number_block.hpp"
#include "vtk/number_text.hpp"

namespace meshsmooth::formats {
namespace {

using ::testing::ElementsAre;

TEST(Base64, IsThatOfRfc4648) {
  EXPECT_EQ(encode_base64(""), "");
  EXPECT_EQ(encode_base64("f"), "Zg==");
  EXPECT_EQ(encode_base64("fo"), "Zm8=");
  EXPECT_EQ(encode_base64("foobar\xFF"), "Zm9vYmFy/w==");
  EXPECT_EQ(decode_base64("Zm9vYmFy/w==", 7), "foobar\xFF");
  EXPECT_EQ(decode_base64("Zm9vYmFy/w==", 4), "foob");
  EXPECT_EQ(decode_base64("Zg==", 2), std::nullopt);
  EXPECT_EQ(decode_base64("Zg", 1), "f");
  EXPECT_EQ(decode_base64("Z", 1), std::nullopt);
  EXPECT_EQ(decode_base64("Z \n", 1), std::nullopt);
}

TEST(NumberText, ReadsWhatProgramsWrite) {
  EXPECT_EQ(parse_number("+1.5e+2", false), 150);
  EXPECT_EQ(parse_number("1.5D-1", false), 0.15);
  EXPECT_EQ(parse_number("0.1", true), double(0.1F));
  EXPECT_EQ(parse_number("-1e-400", false), 0);
  EXPECT_EQ(parse_number("-1e40", true), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(parse_number("1.#INF", false), std::numeric_limits<double>::infinity());
  for (const char* none : {"nan", "-NaN", "nan(ind)", "-1.#IND00", "1.#QNAN"}) {
    EXPECT_TRUE(std::isnan(parse_number(none, false).value_or(0))) << none;
  }
  for (const char* other : {"", "one", "1,5", "d", "1e", "--1", "0x10"}) {
    EXPECT_EQ(parse_number(other, false), std::nullopt) << other;
  }
}

TEST(NumberBlock, KeepsTheDigitsOfWhatStays) {
  const std::string file = "x 1.50\n\t0002  -0 y";
  NumberBlock block;
  block.begin = 1;
  block.limit = file.size() - 1;
  block.count = 3;
  EXPECT_THAT(read_numbers(file, block).value(), ElementsAre(1.5, 2, 0));
  auto edits = replace_numbers(file, block, std::vector<double>{1.5, 0.25, -0.0}, kFloat64);
  EXPECT_EQ(apply_edits(file, edits), "x 1.50\n\t0.25  -0 y");
  EXPECT_TRUE(replace_numbers(file, block, std::vector<double>{1.5, 2, -0.0}, kFloat64).empty());
  block.count = NumberBlock::kAll;
  EXPECT_EQ(read_numbers(file, block).value().size(), 3u);
}

TEST(NumberBlock, RefusesSizesThatDoNotFit) {
  const std::string eight("\x08\0\0\0abcdefgh", 12);
  NumberBlock block;
  block.limit = eight.size();
  block.encoding = NumberBlock::Encoding::raw;
  block.header_bytes = 4;
  block.count = 1;
  EXPECT_TRUE(read_numbers(eight, block));
  block.count = 2;
  EXPECT_FALSE(read_numbers(eight, block));
  block.count = NumberBlock::kAll;
  EXPECT_EQ(read_numbers(eight, block).value().size(), 1u);
  EXPECT_FALSE(read_numbers("\xFF\xFF\xFF\xFF" + eight.substr(4), block));
  block.header_bytes = 8;
  EXPECT_FALSE(read_numbers(std::string(8, '\xFF') + "abcd", block));
  for (const auto compressor : {NumberBlock::Compressor::zlib, NumberBlock::Compressor::lz4,
                                NumberBlock::Compressor::lzma}) {
    block.compressor = compressor;
    for (const char byte : {'\0', '\1', '\x7F', '\xFF'}) {
      const std::string file(12 * 8, byte);
      block.limit = file.size();
      (void)read_numbers(file, block);
    }
  }
}

}  // namespace
}  // namespace meshsmooth::formats
