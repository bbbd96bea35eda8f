#pragma once

#include <filesystem>
#include <string>

namespace meshsmooth::formats {

/// While one lives, its thread reads the mesh file `only`, and of a mesh in several files none of
/// the others: what opens files throws REFERENCE_REFUSED. For files of strangers, which could name
/// any file of this machine. A scope rather than a parameter, so that no reader can forget to pass
/// it on.
class SelfContainedReading {
 public:
  explicit SelfContainedReading(std::filesystem::path only);
  ~SelfContainedReading();
  SelfContainedReading(const SelfContainedReading&) = delete;
  SelfContainedReading& operator=(const SelfContainedReading&) = delete;

 private:
  friend void allow_copy(const std::filesystem::path&);
  friend void check_reference(const std::filesystem::path&, const std::string&);
  friend void check_allowed(const std::filesystem::path&);
  std::filesystem::path only_;
  std::filesystem::path copy_;
  SelfContainedReading* outer_;
};

/// To be called before anything is asked of a file that `from` refers to as `to`, even whether it
/// is there. Throws REFERENCE_REFUSED within such a scope.
void check_reference(const std::filesystem::path& from, const std::string& to);
/// To be called before a file is opened to be read. Throws REFERENCE_REFUSED within a scope of
/// another file.
void check_allowed(const std::filesystem::path& file);
/// Within a scope its file is also read from a plain copy.
void allow_copy(const std::filesystem::path& copy);

}  // namespace meshsmooth::formats
