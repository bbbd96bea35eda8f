#pragma once

#include <memory>

namespace CLI {
class App;
}

namespace meshsmooth::server {

/// The command line of the program meshsmooth-server, to be described in manuals and completed by
/// shells; what it parses is dropped.
[[nodiscard]] std::shared_ptr<CLI::App> make_program_app();

}  // namespace meshsmooth::server
