#include "ensemble/claims.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace cohort {
namespace {

class ClaimsTest : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(store_.string() + ".claims"); }
  std::filesystem::path store_ =
      std::filesystem::path(::testing::TempDir()) / ("claims_" + std::to_string(getpid()) + ".h5");
};

TEST_F(ClaimsTest, WorkOnALocalDisk) {
  EXPECT_TRUE(Claims(store_).work());
}

TEST_F(ClaimsTest, OneMemberHasOneHolder) {
  Claims a(store_), b(store_);
  EXPECT_TRUE(a.try_claim(3));
  EXPECT_FALSE(b.try_claim(3));
  EXPECT_TRUE(b.is_claimed_elsewhere(3));
  EXPECT_FALSE(a.is_claimed_elsewhere(3));
  EXPECT_TRUE(b.try_claim(4));
  a.release(3);
  EXPECT_TRUE(b.try_claim(3));
}

TEST_F(ClaimsTest, TheKernelReleasesWhatAKilledProcessHeld) {
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    Claims claims(store_);
    const char ok = claims.try_claim(3) ? 'y' : 'n';
    [[maybe_unused]] const auto written = write(ready[1], &ok, 1);
    pause();
    _exit(0);
  }
  char answer = 0;
  ASSERT_EQ(read(ready[0], &answer, 1), 1);
  EXPECT_EQ(answer, 'y');
  Claims claims(store_);
  EXPECT_FALSE(claims.try_claim(3));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(claims.try_claim(3));
}

TEST_F(ClaimsTest, KillsAreCountedAndForgottenWithTheStore) {
  Claims a(store_);
  EXPECT_EQ(a.kills(0), 0);
  a.count_kill(1000);
  a.count_kill(1000);
  a.count_kill(3);
  EXPECT_TRUE(a.try_claim(1000));
  const Claims b(store_);
  EXPECT_EQ(b.kills(1000), 2);
  EXPECT_EQ(b.kills(3), 1);
  EXPECT_EQ(b.kills(999), 0);
  EXPECT_EQ(b.kills(1001), 0);
  for (int i = 0; i < 300; ++i) a.count_kill(3);
  EXPECT_EQ(b.kills(3), 255);
  a.forget_kills();
  EXPECT_EQ(b.kills(1000), 0);
  EXPECT_TRUE(b.is_claimed_elsewhere(1000));
}

TEST_F(ClaimsTest, PerformanceSlotsAreTakenOnce) {
  Claims a(store_), b(store_);
  EXPECT_EQ(a.claim_performance_slot(1, 2), 1);
  EXPECT_EQ(b.claim_performance_slot(1, 2), 0);
  EXPECT_EQ(Claims(store_).claim_performance_slot(1, 2), -1);
}

TEST_F(ClaimsTest, WhatTheSystemRefusesIsNotTakenForHeldElsewhere) {
  Claims claims(store_);
  try {
    claims.try_claim(-1);  // no byte of a file: EINVAL
    FAIL() << "no exception";
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code().value(), EINVAL);
    EXPECT_NE(std::string(error.what()).find(store_.string() + ".claims"), std::string::npos) << error.what();
  }
}

TEST_F(ClaimsTest, TheProbeIsSeenByOthersAlone) {
  Claims a(store_), b(store_);
  EXPECT_FALSE(b.probe_is_held());
  EXPECT_TRUE(a.hold_probe(true));
  EXPECT_TRUE(b.probe_is_held());
  EXPECT_FALSE(a.probe_is_held());
  a.hold_probe(false);
  EXPECT_FALSE(b.probe_is_held());
}

}  // namespace
}  // namespace cohort
