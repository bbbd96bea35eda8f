#include "text_file.hpp"

#include <string>

#include "file_bytes.hpp"
#include "meshsmooth/error.hpp"
#include "output_files.hpp"
#include "text.hpp"

namespace meshsmooth::cli {
namespace {

namespace fs = std::filesystem;

/// Runs `write`, which makes `path` in `files`. Errors name `path`.
template <class Write>
void name_errors(const formats::OutputFiles& files, const fs::path& path, const Write& write) try {
  write();
} catch (const Error& error) {
  const fs::path name = formats::output_name(path);
  std::string text = files.with_caller_names(error.what());
  if (text.starts_with(name.string() + ": ")) text.erase(0, name.string().size() + 2);
  formats::fail(error.reason(), name, text);
}

}  // namespace

void check_text_file_writable(const fs::path& path) {
  formats::check_output(path);
  formats::OutputFiles files;  // removed at the end, for it was not given its name
  name_errors(files, path, [&] { formats::write_bytes(files.add(path), ""); });
}

void write_text_file(const fs::path& path, std::string_view text) {
  formats::OutputFiles files;
  name_errors(files, path, [&] {
    formats::write_bytes(files.add(path), text);
    files.commit();
  });
}

}  // namespace meshsmooth::cli
