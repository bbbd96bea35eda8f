#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace meshsmooth::server {

/// Bearer tokens and whose they are, from a file with a line `IDENTITY:TOKEN` or
/// `IDENTITY:sha256:HEX` (of the token) each, and # comments. The file is looked
/// at again when it changes; while it is wrong, the tokens before count. Only
/// digests are kept. Thread-safe.
class TokenFile {
 public:
  /// Throws InvalidOption (OPTION_OUT_OF_RANGE) when the file cannot be read or a
  /// line is wrong; the error names the line, never a token.
  TokenFile(std::filesystem::path path, std::chrono::nanoseconds reload_interval);

  /// Whose token it is. Takes as long for a wrong one as for a right one. O(tokens).
  [[nodiscard]] std::optional<std::string> identity_of(std::string_view token);

 private:
  struct Entry {
    std::string identity;
    std::string digest;  // hexadecimal
  };
  /// Differs when the file does.
  struct Stamp {
    std::int64_t modified_nanoseconds = 0;
    std::int64_t size = 0;
    std::uint64_t inode = 0;
    bool operator==(const Stamp&) const = default;
  };

  [[nodiscard]] static Entry parse(const std::string& line, const std::string& place);
  [[nodiscard]] Stamp stamp() const;
  [[nodiscard]] std::vector<Entry> read() const;
  void reload_if_changed();

  const std::filesystem::path path_;
  const std::chrono::steady_clock::duration interval_;
  std::mutex mutex_;
  Stamp stamp_;
  std::chrono::steady_clock::time_point next_look_;
  std::vector<Entry> entries_;
};

}  // namespace meshsmooth::server
