// The programs as their users have them: a real stratad, and `strata` against it.
#ifndef STRATA_TESTS_INTEGRATION_CLI_FIXTURE_H_
#define STRATA_TESTS_INTEGRATION_CLI_FIXTURE_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/client/cli/run_strata.h"
#include "tests/integration/stratad_process.h"
#include "tests/support/simulator/robot_files.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {

class CliTest : public ::testing::Test {
 protected:
  // Starts stratad on `data`, a folder of the test's own, at the address of the one before, which
  // ends.
  void StartServer(const std::string& data = "maps");
  StratadProcess& server() { return *server_; }

  // `strata` with --server and --output json.
  cli::Ran Run(std::vector<std::string> arguments) const;
  // Its stdout, which must be one JSON value, of a run that exits with `exit_code`.
  nlohmann::json Json(const std::vector<std::string>& arguments, int exit_code = 0) const;

  std::string Path(const std::string& name) const { return (directory_.path() / name).string(); }
  // `strata scan import` of the drive in Path(robot) with its exact poses, taken as they are.
  std::vector<std::string> ImportArguments(const std::string& map, const std::string& robot) const;
  // Writes the drive of a robot of the bridge world to Path(robot); its number of scans.
  std::uint64_t WriteDrive(const std::string& robot, const RobotFiles& files) const {
    return WriteDriveTo(Path(robot), robot, files);
  }
  static std::uint64_t WriteDriveTo(const std::string& folder,
                                    const std::string& robot,
                                    const RobotFiles& files);

 private:
  TempDir directory_;
  std::string address_ = "127.0.0.1:0";
  std::unique_ptr<StratadProcess> server_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_INTEGRATION_CLI_FIXTURE_H_
