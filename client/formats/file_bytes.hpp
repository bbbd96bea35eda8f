#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

namespace meshsmooth::formats {

/// The name of standard input, as a file to read, and of standard output, as one to write.
inline constexpr const char* kStandardStream = "-";

/// An open file that is closed at the end. `path` is for messages.
class FileDescriptor {
 public:
  /// Does not close it where it is not `owned`.
  explicit FileDescriptor(int number, bool owned = true) : number_(number), owned_(owned) {}
  ~FileDescriptor();
  FileDescriptor(FileDescriptor&& other) noexcept
      : number_(std::exchange(other.number_, -1)), owned_(other.owned_) {}
  FileDescriptor& operator=(FileDescriptor&&) = delete;

  /// As many bytes as there are, up to `count`; 0 at the end. Throws FILE_NOT_READABLE.
  [[nodiscard]] std::size_t read(char* to, std::size_t count,
                                 const std::filesystem::path& path) const;
  /// All of them. Throws FILE_NOT_WRITABLE.
  void write(std::string_view bytes, const std::filesystem::path& path) const;
  /// Waits until a file is on its disk: some file systems notice only then that they are full.
  /// Throws FILE_NOT_WRITABLE.
  void synchronize(const std::filesystem::path& path) const;
  /// The last chance to hear of an error. Throws FILE_NOT_WRITABLE.
  void close(const std::filesystem::path& path);

  [[nodiscard]] int number() const { return number_; }

 private:
  int number_;
  bool owned_;
};

/// Throws FILE_NOT_FOUND, FILE_NOT_READABLE.
[[nodiscard]] FileDescriptor open_to_read(const std::filesystem::path& path);
/// Replaces what the file holds; makes it where there is none. Throws FILE_NOT_WRITABLE.
[[nodiscard]] FileDescriptor open_to_write(const std::filesystem::path& path);

/// What messages call an output: "standard output" for "-".
[[nodiscard]] std::filesystem::path output_name(const std::filesystem::path& path);

/// Whether a path names the program's standard output: "-", /dev/stdout and the like.
[[nodiscard]] bool is_standard_output(const std::filesystem::path& path);
/// The same of standard input.
[[nodiscard]] bool is_standard_input(const std::filesystem::path& path);

/// Whether a path names no file or folder but a pipe, a device or an open file.
[[nodiscard]] bool is_pipe(const std::filesystem::path& path);

/// The number of the open file of this process that a path names (/dev/fd/N), or -1.
[[nodiscard]] int descriptor_of(const std::filesystem::path& path);

}  // namespace meshsmooth::formats
