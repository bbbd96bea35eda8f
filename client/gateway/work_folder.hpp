#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace meshsmooth::gateway {

/// The folder in which all files of this process lie, for its user alone. It goes with the object;
/// what a process left that was killed is removed by the next one with the same parent.
class WorkFolder {
 public:
  /// `parent` empty: the system's folder of temporary files. Throws `std::system_error`.
  explicit WorkFolder(const std::filesystem::path& parent);
  ~WorkFolder();
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// A name that no request of this process had.
  [[nodiscard]] std::filesystem::path next() { return path_ / std::to_string(++count_); }

 private:
  std::filesystem::path path_;
  int lock_ = -1;  // held while the process lives
  std::atomic<std::uint64_t> count_{0};
};

/// The files of one request, which go with it.
class RequestFolder {
 public:
  /// Throws `Problem` (FILE_NOT_WRITABLE).
  explicit RequestFolder(WorkFolder& work);
  ~RequestFolder();
  RequestFolder(const RequestFolder&) = delete;
  RequestFolder& operator=(const RequestFolder&) = delete;

  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const {
    return path_ / name;
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// A file that is written from its beginning. Throws `Problem` (FILE_NOT_WRITABLE), as on a full
/// disk.
class NewFile {
 public:
  explicit NewFile(const std::filesystem::path& path);
  ~NewFile() { close(); }
  NewFile(NewFile&& other) noexcept;
  NewFile& operator=(NewFile&&) = delete;

  void write(std::string_view bytes) const;
  void close();

 private:
  int number_;
};

/// A file to be sent: it may lose its name meanwhile, and its space goes with the object.
class OpenFile {
 public:
  /// Throws `Problem` (FILE_NOT_READABLE).
  explicit OpenFile(const std::filesystem::path& path);
  ~OpenFile();
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Up to `count` bytes from `offset`; 0: the end, or an error.
  [[nodiscard]] std::size_t read(char* to, std::size_t count, std::uint64_t offset) const;

 private:
  int number_;
  std::uint64_t size_ = 0;
};

}  // namespace meshsmooth::gateway
