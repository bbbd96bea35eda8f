// What a container may use, from files as the kernel writes them.

#include "machine_limits.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "support/scratch_folder.hpp"

namespace meshsmooth::server {
namespace {

class MachineLimits : public ::testing::Test {
 protected:
  MachineLimits() {
    std::filesystem::create_directory(group_.path("cpu"));
    std::filesystem::create_directory(group_.path("memory"));
  }
  int cores() { return available_cores(group_.path()); }
  std::int64_t bytes() { return available_host_bytes(group_.path()); }

  testing::ScratchFolder group_;
  const int all_cores_ = static_cast<int>(std::thread::hardware_concurrency());
  const std::int64_t all_bytes_ = bytes();
};

TEST_F(MachineLimits, AreThoseOfTheMachineWhereNothingLimits) {
  EXPECT_EQ(cores(), all_cores_);
  group_.write("cpu.max", "max 100000\n");
  group_.write("memory.max", "max\n");
  group_.write("cpu/cpu.cfs_quota_us", "-1\n");
  group_.write("cpu/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(cores(), all_cores_);
  EXPECT_EQ(bytes(), all_bytes_);
  EXPECT_GT(all_bytes_, 0);
}

TEST_F(MachineLimits, AreThoseOfTheContainer) {
  group_.write("cpu.max", "100000 100000\n");
  group_.write("memory.max", "1048576\n");
  EXPECT_EQ(cores(), 1);
  EXPECT_EQ(bytes(), 1048576);
}

TEST_F(MachineLimits, AreThoseOfTheContainerInTheFirstVersionOfGroups) {
  group_.write("cpu/cpu.cfs_quota_us", "50000\n");
  group_.write("cpu/cpu.cfs_period_us", "100000\n");
  group_.write("memory/memory.limit_in_bytes", "2097152\n");
  EXPECT_EQ(cores(), 1);
  EXPECT_EQ(bytes(), 2097152);
}

TEST_F(MachineLimits, RoundPartsOfACoreUp) {
  group_.write("cpu.max", "110000 100000\n");
  EXPECT_EQ(cores(), std::min(2, all_cores_));
  group_.write("cpu.max", "1000 100000\n");
  EXPECT_EQ(cores(), 1);
  group_.write("cpu.max", "900000000 100000\n");
  EXPECT_EQ(cores(), all_cores_);
}

TEST_F(MachineLimits, AreNotReadFromWhatIsNoNumber) {
  group_.write("cpu.max", "100000\n");
  group_.write("memory.max", "much\n");
  EXPECT_EQ(cores(), all_cores_);
  EXPECT_EQ(bytes(), all_bytes_);
}

}  // namespace
}  // namespace meshsmooth::server
