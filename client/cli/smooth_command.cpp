#include <CLI/Option.hpp>
#include <memory>
#include <optional>

#include "add_flag.hpp"
#include "commands.hpp"
#include "job_command.hpp"
#include "meshsmooth/surface_of.hpp"
#include "smooth_options.hpp"

namespace meshsmooth::cli {
namespace {

struct SmoothCommand {
  JobFlags job;
  SmoothFlags smoothing;
  std::optional<std::filesystem::path> reference;
  std::optional<std::filesystem::path> surface;
};

/// The surface on which boundary nodes shall lie.
std::optional<SurfaceMesh> read_surface(const SmoothCommand& command) {
  if (!command.surface) return std::nullopt;
  const auto& flags = command.smoothing;
  if (flags.boundary != "slide") {
    throw InvalidOption(
        "OPTION_MISPLACED",
        "--surface lets boundary nodes slide on it, but there is --boundary " + flags.boundary,
        {{"field", "--surface"}});
  }
  check_standard_input(*command.surface, command.job.input.path);
  const formats::MeshFile file = read_mesh(beside(*command.surface, command.job.input));
  try {
    return surface_of(file.mesh);
  } catch (const InvalidMesh& error) {
    throw InvalidMesh(error.reason(), command.surface->string() + ": " + error.what(),
                      {{"field", "--surface"}});
  }
}

/// The mesh that elements take their shape from.
std::optional<formats::MeshFile> read_reference(const SmoothCommand& command,
                                                const formats::MeshFile& input) {
  if (command.reference) {
    return read_same_elements(*command.reference, "reference", "--reference", command.job, input);
  }
  const auto& choices = command.smoothing.choices;
  const auto target = choices.find("--target");
  if (target == choices.end() || target->second != "reference") return std::nullopt;
  throw InvalidOption("OPTION_MISPLACED", "--target reference needs --reference FILE",
                      {{"field", "--reference"}});
}

ExitCode run(const SmoothCommand& command) {
  std::optional<formats::MeshFile> reference;
  const std::optional<SurfaceMesh> surface = read_surface(command);
  run_job(command.job, to_smooth_options(command.smoothing),
          [&](const formats::MeshFile& file, const formats::CoincidentNodes*, JobInput& input) {
            reference = read_reference(command, file);
            if (reference) input.reference = reference->mesh.positions_view();
            if (surface) input.surface = &*surface;
          });
  return ExitCode::done;
}

}  // namespace

void add_smooth_command(CLI::App& app, Action& action) {
  // Shared by the options, which fill it, and the action, which runs later.
  auto command = std::make_shared<SmoothCommand>();
  CLI::App* sub = app.add_subcommand("smooth", "Smooth a mesh file");
  add_job_flags(*sub, command->job, "IN");
  add_smooth_flags(*sub, command->smoothing);
  add_flag(*sub, flag::reference, command->reference);
  add_flag(*sub, flag::surface, command->surface);
  sub->callback([&action, command, sub] {
    if (command->surface && sub->count("--boundary") == 0) command->smoothing.boundary = "slide";
    action = [command] { return run(*command); };
  });
}

}  // namespace meshsmooth::cli
