#include "meshsmooth/smoother.hpp"

#include <charconv>

#include "meshsmooth/error.hpp"
#include "smooth/cpu/cpu_smoother.hpp"
#ifdef MESHSMOOTH_CUDA
#include "smooth/cuda/cuda_smoother.hpp"
#endif

namespace meshsmooth {
namespace {

/// N of "cuda:N", 0 of "cuda", else -1.
int cuda_device(std::string_view backend) {
  if (backend == "cuda") return 0;
  int device = -1;
  if (!backend.starts_with("cuda:")) return -1;
  const char* const end = backend.data() + backend.size();
  const auto [rest, error] = std::from_chars(backend.data() + 5, end, device);
  return error == std::errc() && rest == end ? device : -1;
}

[[noreturn]] void throw_not_available(std::string_view backend) {
  std::string names;
  for (const BackendInfo& info : list_backends()) {
    if (info.available) names += (names.empty() ? "" : ", ") + info.name;
  }
#ifdef MESHSMOOTH_CUDA
  const std::string build;
#else
  const std::string build = " (this build has no CUDA)";
#endif
  throw NotSupported("BACKEND_NOT_AVAILABLE",
                     "backend '" + std::string(backend) + "' is not available here" + build +
                         "; there is: " + names,
                     {{"field", "backend"}});
}

}  // namespace

std::vector<BackendInfo> list_backends() {
  std::vector<BackendInfo> backends;
#ifdef MESHSMOOTH_CUDA
  backends = detail::list_cuda_backends();
#endif
  backends.push_back({"cpu", true, "CPU"});
  return backends;
}

std::unique_ptr<Smoother> make_smoother(std::string_view backend, int thread_count) {
  std::string name(backend);
  if (backend == "auto") {
    for (const BackendInfo& info : list_backends()) {
      if (!info.available) continue;
      name = info.name;
      break;
    }
  }
  if (name == "cpu") return detail::make_cpu_smoother(thread_count);
#ifdef MESHSMOOTH_CUDA
  for (const BackendInfo& info : detail::list_cuda_backends()) {
    const int device = cuda_device(name);
    if (info.available && info.name == "cuda:" + std::to_string(device)) {
      return detail::make_cuda_smoother(device);
    }
  }
#endif
  throw_not_available(backend);
}

}  // namespace meshsmooth
