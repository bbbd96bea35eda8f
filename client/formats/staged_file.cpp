#include "staged_file.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <typeinfo>

#include "content.hpp"
#include "file_bytes.hpp"
#include "gzip.hpp"
#include "self_contained.hpp"
#include "temporary_folder.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

bool begins_as_gzip(const path& file) {
  std::array<char, 3> first{};
  const std::size_t count = open_to_read(file).read(first.data(), first.size(), file);
  return is_gzip({first.data(), count});
}

path staged_name(const path& file, const Format& format) {
  path name = file == kStandardStream ? path("input") : file.filename();
  if (is_gzip_name(name)) name = name.stem();
  return name.replace_extension(format.extension);
}

}  // namespace

bool is_plain(const path& file, const Format& format) {
  std::error_code error;
  return file != kStandardStream && std::filesystem::is_regular_file(file, error) &&
         file.extension() == format.extension && !begins_as_gzip(file);
}

MeshFile read_staged(const path& file, const Format& format) {
  const TemporaryFolder folder;
  const path copy = folder.path() / staged_name(file, format);
  {
    const std::string bytes = read_bytes(file);
    if (bytes.empty()) fail("FILE_TRUNCATED", file, "the file is empty");
    write_bytes(copy, bytes);
  }
  allow_copy(copy);
  const std::string name = file == kStandardStream ? "standard input" : file.string();
  try {
    MeshFile result = format.read(copy);
    const auto names_copy = [&](const std::string& note) {
      return note.find(copy.string()) != std::string::npos;
    };
    if (std::ranges::none_of(result.notes(), names_copy)) return result;
    auto content = std::make_shared<FileContent>(*result.content());
    for (std::string& note : content->notes) note = replaced(note, copy.string(), name);
    return {std::move(result.mesh), std::move(content)};
  } catch (const Error& failure) {
    if (typeid(failure) != typeid(Error)) throw;
    throw Error(failure.reason(), replaced(failure.what(), copy.string(), name),
                {{"path", file.string()}});
  }
}

}  // namespace meshsmooth::formats
