#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "gpu/commands.hpp"
#include "gpu/report.hpp"
#include "gpu/result_hash.hpp"
#include "gpu/result_meshes.hpp"
#include "meshsmooth/smoother.hpp"

namespace meshsmooth::bench {
namespace {

constexpr int kSweeps = 12;

struct HashesCommand {
  std::vector<std::string> backends;  // empty: all that are there
  std::vector<std::string> meshes;    // empty: all
  std::filesystem::path json;
  std::filesystem::path against;
};

/// One way to smooth a mesh. Every option that decides the result is set here, so that a change
/// of a default changes no hash.
struct Case {
  std::string name;
  SmoothOptions options;
  bool prepared = false;  // on a topology prepared before
};

SmoothOptions options_of(const Method& method, Form form) {
  SmoothOptions options;
  options.method = method;
  options.form = form;
  options.max_iterations = kSweeps;
  options.tolerance = {.value = 1e-4, .relative = true};
  options.boundary = BoundaryPolicy::fixed;
  options.feature_angle = 30;
  options.guard = true;
  options.never_worse = false;
  options.tangled = TangledPolicy::repair;
  return options;
}

/// Every method with its choices, in its deterministic forms, with and without the guard where
/// that makes a difference.
std::vector<Case> method_cases() {
  constexpr std::pair<Weighting, const char*> kWeightings[] = {
      {Weighting::uniform, "uniform"},
      {Weighting::inverse_edge_length, "inverse edge length"},
      {Weighting::edge_length, "edge length"},
      {Weighting::ball_volume, "ball volume"}};
  constexpr std::pair<Form, const char*> kForms[] = {{Form::jacobi, "jacobi"},
                                                     {Form::gauss_seidel, "gauss_seidel"}};
  constexpr std::pair<Goal, const char*> kGoals[] = {
      {Goal::average, "average"}, {Goal::balanced, "balanced"}, {Goal::worst, "worst"}};
  std::vector<Case> cases;
  const auto add = [&](const std::string& name, const Method& method, Form form) {
    cases.push_back({name, options_of(method, form)});
  };
  const auto add_with_and_without_guard = [&](const std::string& name, const Method& method,
                                              Form form) {
    add(name, method, form);
    add(name + ", no guard", method, form);
    cases.back().options.guard = false;
  };
  for (const auto& [form, form_name] : kForms) {
    const std::string suffix = std::string(", ") + form_name;
    for (const auto& [weighting, name] : kWeightings) {
      // A whole step by edge lengths overshoots.
      const double relaxation = weighting == Weighting::edge_length ? 0.5 : 1.0;
      add_with_and_without_guard(std::string("laplacian ") + name + suffix,
                                 Laplacian{weighting, relaxation}, form);
      add(std::string("smart_laplacian ") + name + suffix, SmartLaplacian{weighting, relaxation},
          form);
    }
    add_with_and_without_guard("taubin" + suffix, Taubin{0.6307, -0.6732}, form);
  }
  add_with_and_without_guard("hc_laplacian, jacobi", HcLaplacian{0.1, 0.6}, Form::jacobi);
  for (const auto& [goal, name] : kGoals) {
    add(std::string("optimize ") + name, Optimize{goal, 0}, Form::gauss_seidel);
  }
  return cases;
}

/// What `method_cases` leaves out: other ways through the same steps.
std::vector<Case> further_cases() {
  std::vector<Case> cases;
  const auto add = [&](const std::string& name, const Method& method, Form form) -> Case& {
    cases.push_back({name, options_of(method, form)});
    return cases.back();
  };
  const Laplacian laplacian{Weighting::uniform, 1.0};
  const SmartLaplacian smart{Weighting::uniform, 1.0};
  const Optimize optimize{Goal::balanced, 0};
  constexpr MovementLimit kLimit = {.value = 0.004, .relative = true};
  {
    SmoothOptions& options =
        add("laplacian uniform, jacobi, no guard, history", laplacian, Form::jacobi).options;
    options.guard = false;
    options.history = true;
  }
  add("laplacian uniform, gauss_seidel, limited", laplacian, Form::gauss_seidel)
      .options.movement_limit = kLimit;
  add("laplacian uniform, jacobi, prepared", laplacian, Form::jacobi).prepared = true;
  add("smart_laplacian uniform, gauss_seidel, free boundary", smart, Form::gauss_seidel)
      .options.boundary = BoundaryPolicy::free;
  add("optimize balanced, history", optimize, Form::gauss_seidel).options.history = true;
  add("optimize balanced, limited", optimize, Form::gauss_seidel).options.movement_limit = kLimit;
  add("optimize balanced, prepared", optimize, Form::gauss_seidel).prepared = true;
  add("optimize worst, target 0.3", Optimize{Goal::worst, 0.3}, Form::gauss_seidel);
  {
    SmoothOptions& options =
        add("laplacian uniform, jacobi, no guard, to its end", laplacian, Form::jacobi).options;
    options.guard = false;
    options.max_iterations = 1000;
  }
  add("optimize worst, to its end", Optimize{Goal::worst, 0}, Form::gauss_seidel)
      .options.max_iterations = 200;
  return cases;
}

/// Of one job; `problem` instead where it was refused.
struct Result {
  std::string positions;
  std::string quality;
  std::string course;
  int sweeps = 0;
  std::string stop_reason;
  std::string problem;

  [[nodiscard]] Json to_json() const {
    Json json;
    if (!problem.empty()) return json.set("problem", problem);
    return json.set("positions", positions)
        .set("quality", quality)
        .set("course", course)
        .set("sweeps", sweeps)
        .set("stop_reason", stop_reason);
  }
};

Result run_job(Smoother& smoother, Mesh mesh, const Case& how) {
  Result result;
  try {
    SmoothSummary summary;
    if (how.prepared) {
      const MeshTopology topology(mesh);
      const auto prepared = smoother.prepare(topology.view());
      summary = smoother.smooth(*prepared, mesh.positions_span(), how.options, {});
    } else {
      summary = smoother.smooth(mesh, how.options);
    }
    result.positions = positions_hash(mesh);
    result.quality = quality_hash(summary);
    result.course = course_hash(summary);
    result.sweeps = summary.convergence.iteration_count;
    result.stop_reason = stop_reason_name(summary.stop_reason);
  } catch (const std::exception& error) {
    result.problem = error.what();
  }
  return result;
}

Mesh in_float32(const Mesh& mesh) {
  Mesh result = mesh;
  std::vector<Vec3f> rounded;
  for (const Vec3d& p : std::get<std::vector<Vec3d>>(mesh.positions)) {
    rounded.push_back(vec3_cast<float>(p));
  }
  result.positions = std::move(rounded);
  return result;
}

using Results = std::vector<std::pair<std::string, Result>>;  // by "backend: mesh, case, …"

class HashesRun {
 public:
  explicit HashesRun(const HashesCommand& command) : command_(command) {}

  int run() {
    make_meshes();
    for (const std::string& backend : backends()) run_backend(backend);
    print();
    write_json(command_.json, to_json());
    return command_.against.empty() ? 0 : compare();
  }

 private:
  struct NamedMesh {
    std::string name;  // "cube, float32"
    Mesh mesh;
  };

  void make_meshes() {
    for (ResultMesh& each : make_result_meshes()) {
      const auto& wanted = command_.meshes;
      if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), each.name) == wanted.end()) {
        continue;
      }
      meshes_.push_back({each.name + ", float32", in_float32(each.mesh)});
      meshes_.push_back({each.name + ", float64", std::move(each.mesh)});
    }
  }

  [[nodiscard]] std::vector<std::string> backends() const {
    if (!command_.backends.empty()) return command_.backends;
    std::vector<std::string> names = {"cpu"};
    for (const BackendInfo& info : list_backends()) {
      if (!info.available || info.name == "cpu") continue;
      names.push_back("cuda");
      break;
    }
    return names;
  }

  void run_backend(const std::string& backend) {
    const auto smoother = make_smoother(backend);
    for (const NamedMesh& each : meshes_) {
      const auto add = [&](const Case& how, const char* boundary) {
        const std::string name = backend + ": " + each.name + ", " + how.name + boundary;
        results_.emplace_back(name, run_job(*smoother, each.mesh, how));
      };
      for (Case how : method_cases()) {
        add(how, ", fixed");
        how.options.boundary = BoundaryPolicy::slide;
        add(how, ", slide");
      }
      for (const Case& how : further_cases()) add(how, "");
    }
  }

  void print() const {
    constexpr std::size_t kDigits = 12;
    Table meshes({"mesh", "nodes", "elements", "SHA-256"});
    for (const NamedMesh& each : meshes_) {
      meshes.add({each.name, std::to_string(each.mesh.node_count()),
                  std::to_string(each.mesh.element_count()),
                  mesh_hash(each.mesh).substr(0, kDigits)});
    }
    meshes.print(std::cout);
    std::cout << '\n';
    Table table({"result", "positions", "quality", "course", "sweeps", "stop reason"});
    for (const auto& [name, result] : results_) {
      if (!result.problem.empty()) {
        table.add({name, "refused", result.problem, "", "", ""});
        continue;
      }
      table.add({name, result.positions.substr(0, kDigits), result.quality.substr(0, kDigits),
                 result.course.substr(0, kDigits), std::to_string(result.sweeps),
                 result.stop_reason});
    }
    table.print(std::cout);
  }

  [[nodiscard]] Json to_json() const {
    Json meshes, results, json;
    for (const NamedMesh& each : meshes_) meshes.set(each.name, mesh_hash(each.mesh));
    for (const auto& [name, result] : results_) results.set(name, result.to_json());
    return json.set("meshes", std::move(meshes)).set("results", std::move(results));
  }

  using Texts = std::map<std::string, std::string>;  // values by name

  [[nodiscard]] static Texts texts_of(const google::protobuf::Struct& object, const char* name) {
    Texts texts;
    const auto found = object.fields().find(name);
    if (found == object.fields().end()) return texts;
    for (const auto& [key, value] : found->second.struct_value().fields()) {
      if (!value.has_struct_value()) {
        texts[key] = value.string_value();
        continue;
      }
      for (const auto& [part, content] : value.struct_value().fields()) {
        texts[key + " [" + part + "]"] =
            content.has_number_value()
                ? std::to_string(static_cast<std::int64_t>(content.number_value()))
                : content.string_value();
      }
    }
    return texts;
  }

  [[nodiscard]] static google::protobuf::Struct parse(const std::string& text,
                                                      const std::string& file) {
    google::protobuf::Struct object;
    const auto status = google::protobuf::util::JsonStringToMessage(text, &object);
    if (!status.ok()) throw std::runtime_error(file + ": " + status.ToString());
    return object;
  }

  /// Whether an entry of a file belongs to what this run was asked for.
  [[nodiscard]] bool was_asked_for(const std::string& name) const {
    const auto has = [&](const std::string& prefix) { return name.starts_with(prefix); };
    const std::vector<std::string> ran = backends();
    return std::any_of(meshes_.begin(), meshes_.end(), [&](const NamedMesh& each) {
      if (has(each.name)) return true;
      return std::any_of(ran.begin(), ran.end(), [&](const std::string& backend) {
        return has(backend + ": " + each.name);
      });
    });
  }

  /// Prints every entry that differs from the file's, or that only one of both has.
  int compare() const {
    std::ifstream in(command_.against);
    std::ostringstream content;
    if (!(content << in.rdbuf())) {
      throw std::runtime_error(command_.against.string() + ": cannot be read");
    }
    const google::protobuf::Struct file = parse(content.str(), command_.against.string());
    std::ostringstream own;
    to_json().write(own);
    const google::protobuf::Struct run = parse(own.str(), "this run");

    std::cout << "\nagainst " << command_.against.string() << ":\n";
    std::size_t equal = 0, different = 0;
    for (const char* const part : {"meshes", "results"}) {
      Texts before = texts_of(file, part);
      for (const auto& [name, now] : texts_of(run, part)) {
        const auto found = before.find(name);
        const bool same = found != before.end() && found->second == now;
        ++(same ? equal : different);
        if (!same) {
          std::cout << name << ": " << (found == before.end() ? "none" : found->second) << " -> "
                    << now << '\n';
        }
        if (found != before.end()) before.erase(found);
      }
      for (const auto& [name, text] : before) {
        if (!was_asked_for(name)) continue;
        ++different;
        std::cout << name << ": " << text << " -> none\n";
      }
    }
    std::cout << equal << " values are equal, " << different << " differ" << std::endl;
    return different == 0 && equal > 0 ? 0 : 1;
  }

  const HashesCommand& command_;
  std::vector<NamedMesh> meshes_;
  Results results_;
};

}  // namespace

void add_result_hashes_command(CLI::App& app, Action& action) {
  auto command = std::make_shared<HashesCommand>();
  CLI::App* sub = app.add_subcommand("result-hashes",
                                     "SHA-256 of the results of every method on five small meshes");
  sub->add_option("--backend", command->backends, "cpu, cuda or cuda:N; all there are by default")
      ->delimiter(',');
  sub->add_option("--mesh", command->meshes, "Some of the meshes")
      ->delimiter(',')
      ->check(CLI::IsMember({"cube", "tangled", "mixed", "grid", "surface"}));
  sub->add_option("--json", command->json, "Output file");
  sub->add_option("--against", command->against,
                  "File of an earlier run: prints what differs, exit code 1 if anything does")
      ->check(CLI::ExistingFile);
  sub->callback([&action, command] { action = [command] { return HashesRun(*command).run(); }; });
}

}  // namespace meshsmooth::bench
