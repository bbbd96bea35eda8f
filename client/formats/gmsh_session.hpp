#pragma once

#include <gmsh.h>

#include <filesystem>
#include <string>
#include <vector>

#include "text.hpp"

namespace meshsmooth::formats {

/// Gmsh's one global state, quiet, from nothing and back to nothing.
class GmshSession {
 public:
  GmshSession() {
    gmsh::initialize(0, nullptr, false);
    gmsh::option::setNumber("General.Terminal", 0);
    gmsh::logger::start();
    gmsh::model::add("mesh");
  }
  ~GmshSession() {
    gmsh::logger::stop();
    gmsh::finalize();
  }
  GmshSession(const GmshSession&) = delete;
  GmshSession& operator=(const GmshSession&) = delete;

  /// Runs `action`; what Gmsh logs or throws as an error becomes `reason`.
  template <class Action>
  void run(const std::string& reason, const std::filesystem::path& path, Action action) {
    bool thrown = false;
    try {
      action();
    } catch (const Error&) {
      throw;
    } catch (...) {  // Gmsh throws ints and strings, depending on the function
      thrown = true;
    }
    std::vector<std::string> log;
    gmsh::logger::get(log);
    for (const std::string& line : log) {
      if (line.starts_with("Error: ")) fail(reason, path, "Gmsh: " + line.substr(7));
    }
    if (thrown) fail(reason, path, "Gmsh fails without saying why");
  }
};

}  // namespace meshsmooth::formats
