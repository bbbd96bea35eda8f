#include <CLI/Option.hpp>
#include <memory>
#include <optional>

#include "commands.hpp"
#include "job_command.hpp"
#include "smooth_options.hpp"

namespace meshsmooth::cli {
namespace {

struct SmoothCommand {
  JobFlags job;
  SmoothFlags smoothing;
  std::optional<std::filesystem::path> reference;
};

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
  run_job(command.job, to_smooth_options(command.smoothing),
          [&](const formats::MeshFile& file, const formats::CoincidentNodes*, JobInput& input) {
            reference = read_reference(command, file);
            if (reference) input.reference = reference->mesh.positions_view();
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
  sub->add_option("--reference", command->reference,
                  "optimize: mesh file with the same elements, whose shapes they take; what slides "
                  "where is read from it too");
  sub->callback([&action, command] { action = [command] { return run(*command); }; });
}

}  // namespace meshsmooth::cli
