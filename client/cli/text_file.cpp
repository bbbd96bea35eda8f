#include "text_file.hpp"

#include "meshsmooth/error.hpp"
#include "output_files.hpp"
#include "text.hpp"

namespace meshsmooth::cli {
namespace {

namespace fs = std::filesystem;

/// Writes all of it under another name. Errors name `path`.
void write_partial(formats::OutputFiles& files, const fs::path& path, std::string_view text) {
  try {
    formats::write_bytes(files.add(path), text);
  } catch (const Error& error) {
    formats::fail(error.reason(), path, files.without_partial_name(error.what()));
  }
}

}  // namespace

void check_text_file_writable(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (fs::is_directory(path)) formats::fail("FILE_NOT_WRITABLE", path, "this is a folder");
  if (!fs::is_directory(folder)) {
    formats::fail("FILE_NOT_WRITABLE", path, "there is no folder " + folder.string());
  }
  formats::OutputFiles files;  // removed at the end, for it was not given its name
  write_partial(files, path, "");
}

void write_text_file(const fs::path& path, std::string_view text) {
  formats::OutputFiles files;
  write_partial(files, path, text);
  files.commit();
}

}  // namespace meshsmooth::cli
