#include "socket_folder.hpp"

#include <stdlib.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "config.hpp"
#include "socket_path.hpp"

namespace meshsmooth::server {
namespace {

constexpr char kFolder[] = "/meshsmooth-XXXXXX";
constexpr char kSocket[] = "/socket";
constexpr char kSecondSocket[] = "/leases";
static_assert(sizeof(kSecondSocket) <= sizeof(kSocket), "the length of the first is checked");
constexpr std::size_t kMaxParentLength =
    sizeof(sockaddr_un::sun_path) - sizeof(kFolder) - sizeof(kSocket);

std::string parent_folder() {
  std::error_code error;
  const std::string path = std::filesystem::temp_directory_path(error).string();
  return error || path.size() > kMaxParentLength ? "/tmp" : path;
}

// Folders that servers of this user had which were killed: with dead sockets and nothing else.
void remove_dead_folders(const std::string& parent) {
  const std::string_view prefix = std::string_view(kFolder).substr(1, sizeof(kFolder) - 8);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(parent, error)) {
    const std::string path = entry.path().string();
    if (!entry.path().filename().string().starts_with(prefix)) continue;
    struct stat facts {};
    if (lstat(path.c_str(), &facts) != 0 || !S_ISDIR(facts.st_mode) || facts.st_uid != geteuid() ||
        !is_dead_socket(path + kSocket)) {
      continue;
    }
    unlink((path + kSocket).c_str());
    unlink((path + kSecondSocket).c_str());
    rmdir(path.c_str());
  }
}

}  // namespace

SocketFolder::SocketFolder(const std::string& setting) : folder_(parent_folder() + kFolder) {
  remove_dead_folders(parent_folder());
  if (mkdtemp(folder_.data()) == nullptr) {  // with mode 0700
    throw_wrong_setting(setting,
                        "cannot create the folder " + folder_ + ": " + std::strerror(errno));
  }
  socket_ = folder_ + kSocket;
  second_socket_ = folder_ + kSecondSocket;
}

void SocketFolder::remove() noexcept {
  if (removed_.exchange(true)) return;
  unlink(socket_.c_str());
  unlink(second_socket_.c_str());
  rmdir(folder_.c_str());
}

}  // namespace meshsmooth::server
