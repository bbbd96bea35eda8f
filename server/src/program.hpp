#pragma once

namespace CLI {
class App;
}

namespace meshsmooth::server {

/// The switches of the program that are no settings.
struct ProgramFlags {
  bool as_json = false;
  bool print_config = false;
};

/// Names the program, describes it and binds its switches. `flags` must outlive `app`.
void add_program_flags(CLI::App& app, ProgramFlags& flags);

}  // namespace meshsmooth::server
