#include "self_contained.hpp"

#include <utility>

#include "file_bytes.hpp"
#include "text.hpp"

namespace meshsmooth::formats {
namespace {

using std::filesystem::path;

thread_local SelfContainedReading* innermost = nullptr;

[[noreturn]] void refuse(const path& from, const std::string& to) {
  fail("REFERENCE_REFUSED", from,
       "it needs the file \"" + to + "\"; here one file must hold the whole mesh");
}

}  // namespace

SelfContainedReading::SelfContainedReading(path only)
    : only_(is_standard_input(only) ? path(kStandardStream) : std::move(only)),
      outer_(std::exchange(innermost, this)) {}

SelfContainedReading::~SelfContainedReading() { innermost = outer_; }

void allow_copy(const path& copy) {
  if (innermost != nullptr) innermost->copy_ = copy;
}

void check_reference(const path& from, const std::string& to) {
  if (innermost == nullptr) return;
  // The caller knows the file, not its copy.
  refuse(from == innermost->copy_ ? innermost->only_ : from, to);
}

void check_allowed(const path& file) {
  if (innermost == nullptr || file == innermost->only_ || file == innermost->copy_) return;
  refuse(innermost->only_, file.filename().string());
}

}  // namespace meshsmooth::formats
