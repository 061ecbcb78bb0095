#include "server/last_end.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temp_dir.h"

namespace strata::server {
namespace {

using ::strata::testing::TempDir;

class LastEndTest : public ::testing::Test {
 protected:
  std::string Noted() const {
    std::string line;
    std::getline(std::ifstream(file_), line);
    return line;
  }
  void Note(const std::string& text) const { std::ofstream(file_) << text; }

  TempDir directory_;
  const std::filesystem::path file_ = directory_.path() / "stratad.run";
};

TEST_F(LastEndTest, OnlyARunWithoutAFaultWasEndedFromOutside) {
  EXPECT_FALSE(BeginRun(directory_.path()));  // nobody noted anything
  EXPECT_TRUE(BeginRun(directory_.path()));
  std::ofstream(file_, std::ios::app) << "fault\n";
  EXPECT_FALSE(BeginRun(directory_.path()));
  EXPECT_TRUE(BeginRun(directory_.path()));
}

TEST_F(LastEndTest, TheKernelsKillsAreNotFromOutside) {
  BeginRun(directory_.path());
  const std::string noted = Noted();
  const std::string boot = noted.substr(0, noted.find(' '));
  Note(boot + " " + std::to_string(std::stol(noted.substr(boot.size())) + 1) + "\n");
  EXPECT_FALSE(BeginRun(directory_.path()));
  Note("another-boot 7\n");
  EXPECT_TRUE(BeginRun(directory_.path()));
  Note("");
  EXPECT_FALSE(BeginRun(directory_.path()));
}

TEST_F(LastEndTest, WhereThereIsNoFolderItCannotBeTold) {
  EXPECT_FALSE(BeginRun(directory_.path() / "none"));
}

TEST_F(LastEndTest, AFaultIsNotedAndEndsTheProcessAsBefore) {
  for (const int fault : {SIGSEGV, SIGABRT}) {
    EXPECT_EXIT(
        {
          BeginRun(directory_.path());
          std::raise(fault);
        },
        ::testing::KilledBySignal(fault),
        "");
    std::ifstream run(file_);
    std::string line;
    std::getline(run, line);
    std::getline(run, line);
    EXPECT_EQ(line, "fault");
    EXPECT_FALSE(BeginRun(directory_.path()));
  }
}

}  // namespace
}  // namespace strata::server
