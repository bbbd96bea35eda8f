// What decompresses files of gzip: it takes them whole or names the error, and takes what it
// compressed.
#include <algorithm>

#include "fuzz/choices.hpp"
#include "fuzz/scratch_file.hpp"
#include "gzip.hpp"
#include "meshsmooth/error.hpp"
#include "text.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace meshsmooth;
  static const testing::ScratchFiles files;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  std::string plain;
  try {
    plain = formats::decompress_gzip("given", bytes);
  } catch (const Error& error) {
    testing::require(std::string(error.what()).starts_with("given: "), "an error says which file");
    return 0;
  }
  const auto path = files.write("plain", plain);
  formats::compress_gzip(path, files.path("packed.gz"));
  testing::require(formats::read_bytes(files.path("packed.gz")) == plain,
                   "compressed and decompressed it is the same");
  return 0;
}
