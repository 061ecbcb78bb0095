// A robot's scans of a bridge as files, and as one file that a program of tests/support writes.
#ifndef STRATA_TESTS_CLIENT_CLI_SCAN_IMPORT_OF_ONE_FILE_H_
#define STRATA_TESTS_CLIENT_CLI_SCAN_IMPORT_OF_ONE_FILE_H_

#include <cstddef>
#include <cstdlib>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gtest/gtest.h>

#include "tests/client/cli/run_strata.h"
#include "tests/support/simulator/robot_files.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {

class ImportOfOneFile : public ::testing::Test {
 protected:
  ImportOfOneFile(std::size_t scans, int columns) {
    const testing::World world = testing::BridgeWorld();
    testing::RobotFiles files;
    files.max_scans = scans;
    files.noise.translation_sigma_m = 0.02;
    files.sensor.columns = columns;
    STRATA_EXPECT_OK(
        testing::WriteRobot(world.scene, world.robots.at(0), 1, files, dir_.path() / "robot"));
  }
  std::string Path(const std::string& name) const { return (dir_.path() / name).string(); }
  // The file that `program` (Python) makes of the robot's scans and poses.
  std::string Write(const std::string& program,
                    const std::string& name,
                    const std::string& arguments = "") const {
    const std::string command = absl::StrCat("/usr/bin/python3 ",
                                             program,
                                             " ",
                                             Path("robot/scans"),
                                             " ",
                                             Path("robot/poses_initial.txt"),
                                             " ",
                                             Path(name),
                                             " ",
                                             arguments,
                                             " > /dev/null");
    EXPECT_EQ(std::system(command.c_str()), 0);
    return Path(name);
  }
  Ran Run(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--embedded", Path("db"), "--output", "json"});
    return RunStrata(arguments);
  }
  // Makes a map of its own of what is said, at the uploaded poses or aligned.
  Ran Import(const std::string& map, const std::vector<std::string>& words) const {
    EXPECT_EQ(Run({"map", "create", map, "--cell-size", "1"}).exit_code, 0);
    std::vector<std::string> all = {"scan", "import", map};
    all.insert(all.end(), words.begin(), words.end());
    all.insert(all.end(), {"--trajectory", "t", "--wait"});
    return Run(all);
  }

  testing::TempDir dir_;
};

}  // namespace strata::cli

#endif  // STRATA_TESTS_CLIENT_CLI_SCAN_IMPORT_OF_ONE_FILE_H_
