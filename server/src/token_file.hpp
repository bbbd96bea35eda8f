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

/// Bearer tokens and their callers, from a file of lines `CALLER:TOKEN` or
/// `CALLER:sha256:HEX` (of the token) and # comments. The file is reloaded when it changes;
/// while it is invalid, the previous tokens stay in effect. Only digests are stored.
/// Thread-safe.
class TokenFile {
 public:
  /// Throws InvalidOption (OPTION_OUT_OF_RANGE) when the file cannot be read or a
  /// line is invalid; the error names the line, never a token.
  TokenFile(std::filesystem::path path, std::chrono::nanoseconds reload_interval);

  /// The caller with this token. Takes the same time for wrong and right tokens. O(tokens).
  [[nodiscard]] std::optional<std::string> find_caller(std::string_view token);

 private:
  struct Entry {
    std::string caller;
    std::string digest;  // hexadecimal
  };
  /// Differs when the file changes.
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
