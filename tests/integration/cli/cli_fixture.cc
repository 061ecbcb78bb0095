#include "tests/integration/cli/cli_fixture.h"

#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {

void CliTest::StartServer(const std::string& data) {
  server_.reset();
  server_ = std::make_unique<StratadProcess>(std::vector<std::string>{
      "--data", Path(data), "--listen", address_, "--optimize-every", "0"});
  address_ = server_->Address();
}

cli::Ran CliTest::Run(std::vector<std::string> arguments) const {
  arguments.insert(arguments.end(), {"--server", address_, "--output", "json"});
  return cli::RunStrata(arguments);
}

nlohmann::json CliTest::Json(const std::vector<std::string>& arguments, int exit_code) const {
  const cli::Ran ran = Run(arguments);
  EXPECT_EQ(ran.exit_code, exit_code) << ::testing::PrintToString(arguments) << ran.err;
  nlohmann::json json = nlohmann::json::parse(ran.out, nullptr, false);
  EXPECT_FALSE(json.is_discarded()) << ran.out;
  return json;
}

std::vector<std::string> CliTest::ImportArguments(const std::string& map,
                                                  const std::string& robot) const {
  const std::string folder = Path(robot);
  return {"scan",
          "import",
          map,
          folder + "/scans",
          "--poses",
          folder + "/poses_truth.txt",
          "--trajectory",
          robot,
          "--align",
          "off",
          "--wait"};
}

std::uint64_t CliTest::WriteDriveTo(const std::string& folder,
                                    const std::string& robot,
                                    const RobotFiles& files) {
  const World world = BridgeWorld();
  for (const Robot& driver : world.robots) {
    if (driver.name != robot) continue;
    const auto written = WriteRobot(world.scene, driver, 1, files, folder);
    EXPECT_THAT(written, IsOk());
    if (written.ok()) return written->scans;
  }
  return 0;
}

}  // namespace strata::testing
