#include "socket_folder.hpp"

#include <stdlib.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "config.hpp"

namespace meshsmooth::server {
namespace {

constexpr char kFolder[] = "/meshsmooth-XXXXXX";
constexpr char kSocket[] = "/socket";
constexpr std::size_t kMaxParentLength =
    sizeof(sockaddr_un::sun_path) - sizeof(kFolder) - sizeof(kSocket);

std::string parent_folder() {
  std::error_code error;
  const std::string path = std::filesystem::temp_directory_path(error).string();
  return error || path.size() > kMaxParentLength ? "/tmp" : path;
}

}  // namespace

SocketFolder::SocketFolder(const std::string& setting) : folder_(parent_folder() + kFolder) {
  if (mkdtemp(folder_.data()) == nullptr) {  // with mode 0700
    throw_wrong_setting(setting,
                        "cannot create the folder " + folder_ + ": " + std::strerror(errno));
  }
  socket_ = folder_ + kSocket;
}

void SocketFolder::remove() noexcept {
  if (removed_.exchange(true)) return;
  unlink(socket_.c_str());
  rmdir(folder_.c_str());
}

}  // namespace meshsmooth::server
