#include "meshsmooth/smoother.hpp"

#include "meshsmooth/error.hpp"
#include "smooth/cpu/cpu_smoother.hpp"

namespace meshsmooth {

std::vector<BackendInfo> list_backends() { return {{"cpu", true, "CPU"}}; }

std::unique_ptr<Smoother> make_smoother(std::string_view backend, int thread_count) {
  if (backend == "auto" || backend == "cpu") return detail::make_cpu_smoother(thread_count);
  throw NotSupported(
      "BACKEND_NOT_AVAILABLE",
      "backend '" + std::string(backend) + "' is not available here; this build has: cpu",
      {{"field", "backend"}});
}

}  // namespace meshsmooth
