#include "format_lookup.hpp"

#include <algorithm>
#include <cctype>

#include "file_bytes.hpp"
#include "gzip.hpp"
#include "mesh_file.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

template <class Has>
std::string extensions(Has has) {
  std::string list;
  for (const Format& format : kFormats) {
    if (!has(format)) continue;
    if (!list.empty()) list += ' ';
    list += format.extension;
  }
  return list;
}

std::string in_lower_case(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char letter) {
    return static_cast<char>(std::tolower(letter));
  });
  return text;
}

const Format* find_extension(const std::string& extension) {
  const auto* found = std::ranges::find(kFormats, std::string_view(extension), &Format::extension);
  return found == kFormats.end() ? nullptr : found;
}

const Format* find_source(const path& source) {
  const bool is_extension = source.native().starts_with('.') && !source.has_extension();
  const Format* found = find_format(source, "");
  return found == nullptr && is_extension ? find_format(path("x") += source, "") : found;
}

[[noreturn]] void fail_unknown(const path& file, const Format* format, const std::string& named,
                               const std::string& what, const std::string& known) {
  const std::string extension = named.empty() ? extension_of(file) : named;
  if (extension.empty()) {
    fail("FORMAT_UNKNOWN", file,
         "its name does not tell its format; --format names it, one of " + known);
  }
  const std::string missing = format == nullptr || format->library.empty()
                                  ? ""
                                  : ": this build is without " + std::string(format->library);
  fail("FORMAT_UNKNOWN", file,
       "cannot " + what + " \"" + extension + "\" files" + missing + "; known are " + known);
}

/// Throws where other files belong to the format that cannot be beside this one.
void check_companion(const path& file, const Format& format, bool pipe) {
  if (format.companion.empty() || !(pipe || is_gzip_name(file))) return;
  fail("FORMAT_UNKNOWN", file,
       "\"" + std::string(format.extension) + "\" files come with " +
           std::string(format.companion) +
           (pipe ? ", so a pipe cannot carry them" : ", so they cannot be compressed alone"));
}

}  // namespace

std::string extension_of(const path& file) {
  const path name = is_gzip_name(file) && file.stem().has_extension() ? file.stem() : file;
  return in_lower_case(name.extension().string());
}

std::string readable_extensions() {
  return extensions([](const Format& format) { return format.read != nullptr; });
}

std::string writable_extensions() {
  return extensions([](const Format& format) { return format.is_written(); });
}

std::string array_extensions() {
  return extensions([](const Format& format) { return format.cell_arrays; });
}

std::string find_format_name(const path& file, const std::string& named) {
  const Format* format = find_format(file, named);
  return format == nullptr ? std::string() : std::string(format->extension);
}

const Format* find_format(const path& file, const std::string& named) {
  if (!named.empty()) {
    return find_extension(in_lower_case(named.starts_with('.') ? named : '.' + named));
  }
  const Format* found = find_extension(extension_of(file));
  if (found == nullptr && !poly_mesh_folder(file).empty()) found = find_extension(".foam");
  return found;
}

const Format& readable_format(const path& file, const std::string& named) {
  const Format* format = find_format(file, named);
  std::error_code error;
  if (std::filesystem::is_directory(file, error) && (format == nullptr || !format->is_case)) {
    fail("FILE_NOT_READABLE", file, "this is a folder, and no OpenFOAM case");
  }
  if (format == nullptr || format->read == nullptr) {
    fail_unknown(file, format, named, "read", readable_extensions());
  }
  check_companion(file, *format, is_pipe(file));
  return *format;
}

const Format& writable_format(const path& file, const std::string& named, const path& source) {
  const Format* format = find_format(file, named);
  const bool to_pipe = is_pipe(file);
  const path shown = output_name(file);
  if (format == nullptr && named.empty() && to_pipe) format = find_source(source);
  if (format == nullptr || !format->is_written()) {
    fail_unknown(shown, format, named, "write", writable_extensions());
  }
  check_companion(shown, *format, to_pipe);
  if (!format->only_changed) return *format;
  const Format* read = find_source(source);
  if (read != nullptr && read->read == format->read) return *format;
  fail("FORMAT_UNKNOWN", shown,
       "\"" + std::string(format->extension) +
           "\" files are written only with the contents of a file of the "
           "same format, of which the coordinates change; written from any are " +
           extensions(
               [](const Format& other) { return other.is_written() && !other.only_changed; }) +
           (format->library.empty() ? ""
                                    : "; this build is without " + std::string(format->library)));
}

}  // namespace meshsmooth::formats
