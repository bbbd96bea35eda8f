#include "token_file.hpp"

#include <openssl/crypto.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <span>
#include <utility>

#include "log.hpp"
#include "meshsmooth/error.hpp"
#include "wire/sha256.hpp"

namespace meshsmooth::server {
namespace {

[[noreturn]] void throw_wrong(const std::string& what) {
  throw InvalidOption("OPTION_OUT_OF_RANGE", "token-file: " + what, {{"field", "token-file"}});
}

bool is_visible(std::string_view text) {
  return !text.empty() &&
         std::ranges::all_of(text, [](unsigned char c) { return c > 0x20 && c < 0x7f; });
}

std::string digest_of(std::string_view token) {
  wire::Sha256 sha256;
  sha256.add(std::as_bytes(std::span(token)));
  return sha256.finish();
}

bool is_digest(std::string_view text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

}  // namespace

TokenFile::TokenFile(std::filesystem::path path, std::chrono::nanoseconds reload_interval)
    : path_(std::move(path)),
      interval_(reload_interval),
      stamp_(stamp()),
      next_look_(std::chrono::steady_clock::now() + interval_),
      entries_(read()) {
  struct stat status {};
  if (::stat(path_.c_str(), &status) == 0 && (status.st_mode & S_IWOTH) != 0) {
    log_error("token_file_writable", path_.string() + ": every user of this host can write to it");
  }
}

std::optional<std::string> TokenFile::find_caller(std::string_view token) {
  const std::string digest = digest_of(token);
  const std::lock_guard lock(mutex_);
  reload_if_changed();
  const Entry* found = nullptr;
  for (const Entry& entry : entries_) {  // always all of them: constant time
    if (CRYPTO_memcmp(entry.digest.data(), digest.data(), digest.size()) == 0) found = &entry;
  }
  if (found == nullptr) return std::nullopt;
  return found->caller;
}

TokenFile::Entry TokenFile::parse(const std::string& line, const std::string& place) {
  constexpr std::string_view kHash = "sha256:";
  const std::size_t colon = line.find(':');
  if (colon == std::string::npos) throw_wrong(place + " has no colon: CALLER:TOKEN");
  Entry entry;
  entry.caller = line.substr(0, colon);
  std::string_view token = std::string_view(line).substr(colon + 1);
  if (!is_visible(entry.caller) || !is_visible(token)) {
    throw_wrong(place + " needs a caller and a token of visible ASCII characters");
  }
  if (token.starts_with(kHash)) {
    entry.digest = token.substr(kHash.size());
    if (!is_digest(entry.digest)) throw_wrong(place + " needs 64 lower-case hex digits");
  } else {
    entry.digest = digest_of(token);
  }
  return entry;
}

TokenFile::Stamp TokenFile::stamp() const {
  struct stat status {};
  if (::stat(path_.c_str(), &status) != 0) return {};
  return {.modified_nanoseconds =
              std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec,
          .size = status.st_size,
          .inode = status.st_ino};
}

std::vector<TokenFile::Entry> TokenFile::read() const {
  std::ifstream file(path_);
  if (!file) throw_wrong("cannot read " + path_.string());
  std::vector<Entry> entries;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty() || line.front() == '#') continue;
    const std::string place = "line " + std::to_string(number) + " of " + path_.string();
    Entry entry = parse(line, place);
    const auto same = std::ranges::find(entries, entry.digest, &Entry::digest);
    if (same != entries.end() && same->caller != entry.caller) {
      throw_wrong(place + " has the token of another caller");
    }
    entries.push_back(std::move(entry));
  }
  if (entries.empty()) throw_wrong(path_.string() + " has no tokens: every call would be refused");
  return entries;
}

void TokenFile::reload_if_changed() {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_look_) return;
  next_look_ = now + interval_;
  const Stamp found = stamp();
  if (found == stamp_) return;
  try {
    entries_ = read();
    log_event("tokens_reloaded");
  } catch (const Error& error) {
    log_error("tokens_not_reloaded", error.what());
  }
  stamp_ = found;
}

}  // namespace meshsmooth::server
