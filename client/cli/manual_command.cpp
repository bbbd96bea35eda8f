#include <CLI/CLI.hpp>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>

#include "command_tree.hpp"
#include "completion.hpp"
#include "file_bytes.hpp"
#include "man_page.hpp"
#include "manual_command.hpp"
#include "mesh_file.hpp"
#include "meshsmooth/server_program.hpp"
#include "node_sets.hpp"
#include "text_file.hpp"

namespace meshsmooth::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kProgram = "meshsmooth";
constexpr const char* kServer = "meshsmooth-server";

/// A switch without a default, so that the compiler names an exit code that is not described.
std::string meaning(ExitCode code) {
  switch (code) {
    case ExitCode::done:
      return "Done";
    case ExitCode::failed:
      return "Failed";
    case ExitCode::usage:
      return "Wrong command line or option";
    case ExitCode::bad_mesh:
      return "The mesh or its file is bad";
    case ExitCode::refused:
      return "Refused by the server, or the server is unavailable";
    case ExitCode::stopped:
      return "Deadline exceeded or cancelled";
    case ExitCode::incomplete:
      return "The result is short of what was asked for";
  }
  return "";
}

std::string exit_status() {
  std::string text;
  for (int code = 0; !meaning(static_cast<ExitCode>(code)).empty(); ++code) {
    text += man_item(std::to_string(code), meaning(static_cast<ExitCode>(code)));
  }
  return text;
}

std::string server_exit_status() {
  return man_item("0", "Drained after SIGTERM, or the output that was asked for was printed") +
         man_item("2", "Wrong setting or command line") +
         man_item("69", "The device was lost; another process may find it again") +
         man_item("75", "Not drained in time");
}

/// Lines of a shell for the page of a command; empty where there are none.
std::string examples(const std::string& path) {
  struct Example {
    const char* path;
    const char* lines;
  };
  constexpr Example kExamples[] = {
      {"meshsmooth",
       "meshsmooth generate hub --degrees 60 -o part.vtu\n"
       "meshsmooth smooth part.vtu -o better.vtu\n"
       "meshsmooth quality better.vtu\n"},
      {"meshsmooth smooth",
       "meshsmooth smooth part.vtu -o better.vtu\n"
       "meshsmooth smooth part.vtu -o better.vtu --goal worst --movement-limit 1%\n"
       "meshsmooth smooth part.msh -o better.msh --fixed-set inlet\n"
       "meshsmooth smooth part.msh -o better.msh --server 127.0.0.1:50051 --report summary.json\n"},
      {"meshsmooth move", "meshsmooth move part.vtu --to moved.vtu -o followed.vtu\n"},
      {"meshsmooth quality",
       "meshsmooth quality part.vtu\n"
       "meshsmooth quality part.vtu -o quality.vtu\n"},
      {"meshsmooth generate", "meshsmooth generate hub --degrees 60 -o part.vtu\n"},
      {"meshsmooth health", "meshsmooth health --server 127.0.0.1:50051\n"},
      {"meshsmooth info", "meshsmooth info --server 127.0.0.1:50051 --json\n"},
      {"meshsmooth jobs", "meshsmooth jobs --server 127.0.0.1:50051\n"},
      {"meshsmooth completion", "source <(meshsmooth completion bash)\n"},
      {"meshsmooth-server",
       "meshsmooth-server --listen 127.0.0.1:50051\n"
       "meshsmooth-server --config /etc/meshsmooth/server.toml --print-config\n"},
  };
  for (const Example& example : kExamples) {
    if (example.path == path) return example.lines;
  }
  return "";
}

/// Today, or the day of SOURCE_DATE_EPOCH where the same bytes are wanted again.
std::string today() {
  const char* epoch = std::getenv("SOURCE_DATE_EPOCH");
  const std::time_t now = epoch != nullptr ? std::strtoll(epoch, nullptr, 10) : std::time(nullptr);
  char text[16];
  std::tm utc{};
  std::strftime(text, sizeof text, "%Y-%m-%d", ::gmtime_r(&now, &utc));
  return text;
}

std::string client_page(const Command& command, const ManPageFacts& base) {
  ManPageFacts facts = base;
  facts.exit_status = exit_status();
  facts.examples = examples(command.path);
  facts.see_also =
      command.path == kProgram ? "meshsmooth-server(8)" : "meshsmooth(1), meshsmooth-server(8)";
  return man_page(command, facts);
}

std::string server_page(const Command& server, const ManPageFacts& base) {
  ManPageFacts facts = base;
  facts.section = "8";
  facts.exit_status = server_exit_status();
  facts.examples = examples(server.path);
  facts.environment =
      man_item("MESHSMOOTH_...",
               "Every setting has a variable, named with its flag. A flag overrides the "
               "environment, the environment the file, and the file the default; an empty "
               "variable means unset") +
      man_item("MESHSMOOTH_CONFIG", "The configuration file, as by --config");
  facts.files = man_item("/etc/meshsmooth/server.toml",
                         "Settings of the systemd unit meshsmooth-server.service");
  facts.see_also = "meshsmooth(1), systemctl(1)";
  return man_page(server, facts);
}

/// FOLDER/man1, man8 and, as the shells look for them, bash, zsh and fish.
void write_manual(const fs::path& folder, const Command& client, const Command& server,
                  const ManPageFacts& facts) {
  write_text_file(folder / "man1" / (man_page_name(client) + ".1"), client_page(client, facts));
  for (const Command& command : client.commands) {
    write_text_file(folder / "man1" / (man_page_name(command) + ".1"), client_page(command, facts));
  }
  write_text_file(folder / "man8" / (server.name + ".8"), server_page(server, facts));
  for (const Command* program : {&client, &server}) {
    write_text_file(folder / "bash" / program->name, bash_completion(*program));
    write_text_file(folder / "zsh" / ("_" + program->name), zsh_completion(*program));
    write_text_file(folder / "fish" / (program->name + ".fish"), fish_completion(*program));
  }
}

std::string completion(const Command& program, const std::string& shell) {
  if (shell == "zsh") return zsh_completion(program);
  return shell == "fish" ? fish_completion(program) : bash_completion(program);
}

}  // namespace

void add_manual_commands(CLI::App& app, Action& action, const std::string& version) {
  auto shell = std::make_shared<std::string>();
  CLI::App* scripts =
      app.add_subcommand("completion", "Print the completion script of a shell; `source` it there");
  scripts->add_option("SHELL", *shell, "The shell")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  scripts->callback([&, shell] {
    action = [&app, shell] {
      std::cout << completion(describe_program(app, kProgram), *shell) << std::flush;
      return ExitCode::done;
    };
  });

  auto folder = std::make_shared<fs::path>();
  CLI::App* pages = app.add_subcommand("write-manual", "Write manual pages and completion scripts");
  pages->group("")->add_option("FOLDER", *folder, "Folder to write to")->required();
  pages->callback([&, folder, version] {
    action = [&app, folder, version] {
      ManPageFacts facts;
      facts.version = version;
      facts.date = today();
      write_manual(*folder, describe_program(app, kProgram),
                   describe_program(*server::make_program_app(), kServer), facts);
      return ExitCode::done;
    };
  });

  auto mesh = std::make_shared<fs::path>();
  CLI::App* sets = app.add_subcommand("list-sets", "Print the names of a mesh file's node sets");
  sets->group("")->add_option("IN", *mesh, "Mesh file")->required();
  sets->callback([&, mesh] {
    action = [mesh] {
      // A shell asks while the user types; its standard input is the user's.
      if (formats::is_pipe(*mesh)) return ExitCode::done;
      for (const std::string& name : formats::node_set_names(formats::read_mesh_file(*mesh))) {
        std::cout << name << '\n';
      }
      std::cout << std::flush;
      return ExitCode::done;
    };
  });
}

}  // namespace meshsmooth::cli
