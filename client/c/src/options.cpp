#include "options.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "error.hpp"
#include "structures.hpp"

namespace meshsmooth::c {
namespace {

void read(std::int64_t in, const char*, bool& out) { out = in != 0; }

void read(double in, const char*, double& out) { out = in; }

void read(double in, const char*, std::optional<double>& out) {
  if (in != 0) out = in;
}

void read(std::int64_t in, const char* name, int& out) {
  constexpr int kMost = std::numeric_limits<int>::max();
  if (in < 0 || in > kMost) {
    throw out_of_range(name, static_cast<double>(in), "from 0 to " + std::to_string(kMost));
  }
  out = static_cast<int>(in);
}

void read(std::int64_t in, const char* name, std::optional<int>& out) {
  if (in != -1) read(in, name, out.emplace());
}

void read(double in, const char* name, std::optional<std::chrono::nanoseconds>& out) {
  constexpr double kMost = 9e9;  // nanoseconds have 63 bits
  if (!(in >= 0 && in <= kMost)) throw out_of_range(name, in, "from 0 to 9e9 seconds");
  if (in == 0) return;
  out = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(in));
}

void read(const char* in, const char*, std::string& out) {
  if (in != nullptr) out = in;
}

template <class Enum>
Enum choice(std::int64_t in, const char* name, int first) {
  constexpr auto kValues = enum_values<Enum>();
  const std::int64_t index = in - first;
  if (index < 0 || index >= std::ssize(kValues)) {
    throw out_of_range(name, static_cast<double>(in),
                       "from 0 to " + std::to_string(std::ssize(kValues) + first - 1));
  }
  return kValues[static_cast<std::size_t>(index)];
}

// 0 is the default, which `out` has.
template <class Enum>
void read_choice(std::int64_t in, const char* name, int first, Enum& out) {
  if (in != 0) out = choice<Enum>(in, name, first);
}

template <class Enum>
void read_choice(std::int64_t in, const char* name, int first, std::optional<Enum>& out) {
  if (in != 0) out = choice<Enum>(in, name, first);
}

#include "options.inc"

}  // namespace

Job read_options(const meshsmooth_options* options, const Method& method) {
  Job job;
  if (options == nullptr) {
    job.smooth.method = method;
    return job;
  }
  const meshsmooth_options in = read_structure(options, "options", kDefaults);
  read_declared(in, job);
  job.smooth.tolerance = in.absolute_tolerance == -1 ? Tolerance{in.tolerance, true}
                                                     : Tolerance{in.absolute_tolerance, false};
  if (in.movement_limit != 0) {
    job.smooth.movement_limit = {in.movement_limit, in.movement_limit_relative != 0};
  }
  if (in.only_below != 0) {
    read(in.only_below_rings, "only_below_rings",
         job.smooth.only_below.emplace(OnlyBelow{.quality = in.only_below}).rings);
  }
  job.request.backend = enum_name(choice<BackendKind>(in.backend, "backend", 0));
  return job;
}

}  // namespace meshsmooth::c

int meshsmooth_options_init(meshsmooth_options* options, size_t size, meshsmooth_error** error) {
  using namespace meshsmooth::c;
  return guarded(error, [&] { write_structure(kDefaults, size, options, "options"); });
}
