#include "socket_path.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "config.hpp"
#include "wire/descriptor.hpp"
#include "wire/local_address.hpp"

namespace meshsmooth::server {
namespace {

// Between the check for another server and the bind nobody else may come.
wire::Descriptor lock_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  wire::Descriptor lock(
      open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (lock) flock(lock.number(), LOCK_EX);
  return lock;
}

}  // namespace

bool is_dead_socket(const std::string& path) {
  struct stat facts {};
  if (lstat(path.c_str(), &facts) != 0 || !S_ISSOCK(facts.st_mode)) return false;
  const auto address = wire::socket_address(path);
  // A datagram socket cannot connect to one of another type, but is told whether there is one.
  const wire::Descriptor probe(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  return address && probe &&
         connect(probe.number(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address) !=
             0 &&
         errno == ECONNREFUSED;
}

void listen_on_path(int socket, const std::string& path, const std::string& setting) {
  const auto fail = [&](const std::string& what) {
    throw_wrong_setting(setting, "cannot serve on " + path + ": " + what);
  };
  const auto address = wire::socket_address(path);
  if (!address) fail("the path is empty or too long for a socket");
  const wire::Descriptor lock = lock_folder_of(path);
  if (is_dead_socket(path)) unlink(path.c_str());
  // The owner alone may open it, from the moment when it exists.
  if (fchmod(socket, S_IRUSR | S_IWUSR) != 0 ||
      bind(socket, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0) {
    fail(errno == EADDRINUSE ? "another process listens there, or it is a file"
                             : std::strerror(errno));
  }
  // Before the lock is released: until it listens it would count as dead.
  if (listen(socket, SOMAXCONN) != 0) fail(std::strerror(errno));
}

}  // namespace meshsmooth::server
