#include "wire/lease_socket.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>

namespace meshsmooth::wire {
namespace {

std::ptrdiff_t open_descriptors() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
}

void send_with(int socket, const std::array<int, 2>& descriptors) {
  LeaseMessage message = LeaseMessage::mapped;
  iovec data{&message, sizeof message};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof descriptors)> control{};
  msghdr header{};
  header.msg_iov = &data;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  cmsghdr* const rights = CMSG_FIRSTHDR(&header);
  rights->cmsg_level = SOL_SOCKET;
  rights->cmsg_type = SCM_RIGHTS;
  rights->cmsg_len = CMSG_LEN(sizeof descriptors);
  std::memcpy(CMSG_DATA(rights), descriptors.data(), sizeof descriptors);
  ASSERT_EQ(sendmsg(socket, &header, 0), static_cast<ssize_t>(sizeof message));
}

TEST(LeaseSocket, ClosesDescriptorsThatNobodyWants) {
  std::array<int, 2> ends{};
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()), 0);
  const Descriptor from(ends[0]), to(ends[1]);
  const auto before = open_descriptors();
  for (int i = 0; i < 5; ++i) {
    send_with(from.number(), {from.number(), to.number()});
    EXPECT_EQ(receive_message(to.number()).kind, ReceivedMessage::Kind::message);
  }
  EXPECT_EQ(open_descriptors(), before);
}

}  // namespace
}  // namespace meshsmooth::wire
