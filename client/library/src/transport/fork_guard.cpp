#include "transport/fork_guard.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <unistd.h>

#include <mutex>
#include <set>

namespace meshsmooth::client {
namespace {

/// Of the whole process: what happens at a fork is set for all of it.
struct Sockets {
  std::mutex mutex;
  std::set<int> open;
};

Sockets& sockets() {
  static Sockets& all = *new Sockets;  // never destroyed: a fork may come at any time
  static const int registered = pthread_atfork([] { all.mutex.lock(); }, [] { all.mutex.unlock(); },
                                               [] {
                                                 // Another file takes the place, so that whoever
                                                 // closes it later closes nothing else.
                                                 const int nothing =
                                                     open("/dev/null", O_RDONLY | O_CLOEXEC);
                                                 for (const int socket : all.open)
                                                   dup3(nothing, socket, O_CLOEXEC);
                                                 close(nothing);
                                                 all.mutex.unlock();
                                               });
  static_cast<void>(registered);
  return all;
}

}  // namespace

ForkGuard::ForkGuard(int socket) : socket_(socket) {
  const std::lock_guard lock(sockets().mutex);
  sockets().open.insert(socket_);
}

ForkGuard::~ForkGuard() {
  const std::lock_guard lock(sockets().mutex);
  sockets().open.erase(socket_);
}

}  // namespace meshsmooth::client
