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
  ControlGroups groups() { return {group_.path(), group_.path("memberships")}; }
  int cores() { return available_cores(groups()); }
  std::int64_t bytes() { return available_host_bytes(groups()); }

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

TEST_F(MachineLimits, AreThoseOfTheServiceAndOfWhatItIsPartOf) {
  std::filesystem::create_directories(group_.path("system.slice/meshsmooth.service"));
  group_.write("memberships", "0::/system.slice/meshsmooth.service\n");
  group_.write("system.slice/meshsmooth.service/cpu.max", "100000 100000\n");
  group_.write("system.slice/memory.max", "4194304\n");
  EXPECT_EQ(cores(), 1);
  EXPECT_EQ(bytes(), 4194304);
}

TEST_F(MachineLimits, AreThoseOfTheBatchJobInTheFirstVersionOfGroups) {
  std::filesystem::create_directories(group_.path("cpu/slurm/job_1"));
  std::filesystem::create_directories(group_.path("memory/slurm/job_2"));
  group_.write("memberships", "no line\n4:cpuacct,cpu:/slurm/job_1\n3:memory:/slurm/job_2\n");
  group_.write("cpu/slurm/job_1/cpu.cfs_quota_us", "100000\n");
  group_.write("cpu/slurm/job_1/cpu.cfs_period_us", "100000\n");
  group_.write("memory/slurm/memory.limit_in_bytes", "8388608\n");
  EXPECT_EQ(cores(), 1);
  EXPECT_EQ(bytes(), 8388608);
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
