#include "event_threads.hpp"

#include <grpcpp/version_info.h>
#include <unistd.h>

#include <algorithm>

#if GRPC_CPP_VERSION_MAJOR > 1 || GRPC_CPP_VERSION_MINOR >= 54

extern "C" long __sysconf(int name);  // NOLINT: glibc's own name of it

// gRPC asks for the number of processors by it, already when the program is loaded. oneTBB and our
// lanes ask for those that the process may use, which stay as they are.
extern "C" long sysconf(int name) noexcept {
  constexpr long kMaxEventThreads = 16;  // gRPC takes no more
  const long value = __sysconf(name);
  return name == _SC_NPROCESSORS_CONF ? std::max(value, kMaxEventThreads) : value;
}

#endif

namespace meshsmooth::server {

void reserve_event_threads() {}  // the linker takes the above with it

}  // namespace meshsmooth::server
