#pragma once

#include <dictionary.H>
#include <meshsmooth.h>

#include <cfenv>
#include <memory>
#include <string>

#include "local_server.hpp"
#include "part.hpp"

namespace meshsmooth_foam {

/// OpenFOAM lets a process die of a floating-point exception, which libraries of others do not
/// expect: none is trapped while this exists, in threads that are started meanwhile neither.
class NoTraps {
 public:
  NoTraps() { std::feholdexcept(&before_); }
  ~NoTraps() { std::fesetenv(&before_); }
  NoTraps(const NoTraps&) = delete;
  NoTraps& operator=(const NoTraps&) = delete;

 private:
  std::fenv_t before_;
};

/// The server of a dictionary and the options of its motions. Entries: docs/openfoam.md.
class Service {
 public:
  /// Ends the program (FatalError) where the server cannot be started or an entry is wrong.
  explicit Service(const Foam::dictionary& entries);
  ~Service();
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  [[nodiscard]] meshsmooth_client* client() const { return client_; }
  [[nodiscard]] const meshsmooth_options& motion() const { return motion_; }
  /// The same, which gives up where it is not easy.
  [[nodiscard]] const meshsmooth_options& quick_motion() const { return quick_motion_; }
  [[nodiscard]] const meshsmooth_options& sweeps() const { return sweeps_; }
  /// Share of a step that must be reached.
  [[nodiscard]] double least_share() const { return least_share_; }

 private:
  std::unique_ptr<LocalServer> own_;
  meshsmooth_client* client_ = nullptr;
  meshsmooth_options motion_{};  // of the prescribed points
  meshsmooth_options quick_motion_{};
  meshsmooth_options sweeps_{};  // that bring the shapes back
  double least_share_ = 1;
};

/// Ends the program with the reason of the service, its hint, and the cell or face that is wrong;
/// frees the error. Returns where there is none.
/// @param part null: it has none
void check(meshsmooth_error* error, const Part* part);

}  // namespace meshsmooth_foam
