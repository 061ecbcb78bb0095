// Python, the command line and the SDK at one server: each sees what the others did.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/sdk/client.h"
#include "core/codec/surface_tile_codec.h"
#include "tests/integration/cli/cli_fixture.h"
#include "tests/support/paths.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

using nlohmann::json;

class ThreeClientsTest : public CliTest {
 protected:
  void SetUp() override {
    StartServer();
    ClientOptions options;
    options.target = server().Address();
    STRATA_ASSERT_OK_AND_ASSIGN(db_, Connect(options));
  }

  // What three_clients.py prints.
  json Python(const std::string& what) {
    const std::string command = absl::StrCat("PYTHONPATH=",
                                             BuiltPath("client/python"),
                                             " /usr/bin/python3 ",
                                             SourcePath("tests/integration/cli/three_clients.py"),
                                             " ",
                                             what,
                                             " ",
                                             server().Address(),
                                             " m");
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(popen(command.c_str(), "r"), pclose);
    std::string printed;
    std::array<char, 4096> buffer{};
    while (std::fgets(buffer.data(), buffer.size(), pipe.get()) != nullptr)
      printed += buffer.data();
    json parsed = json::parse(printed, nullptr, false);
    EXPECT_FALSE(parsed.is_discarded()) << printed;
    return parsed;
  }

  // A square of 4 m, seen from 1 m above.
  bool UploadBySdk() {
    ScanHeader header;
    header.id = {"sdk", 1};
    header.T_map_scan.translation() << -30.0, 30.0, 1.0;
    header.alignment = Alignment::kOff;
    PointCloud cloud;
    for (int i = 0; i < 80; ++i) {
      for (int k = 0; k < 80; ++k) {
        cloud.points.emplace_back(
            0.05F * static_cast<float>(i - 40), 0.05F * static_cast<float>(k - 40), -1.0F);
      }
    }
    header.point_count = cloud.size();
    const auto upload = db_->scans().Upload({}, "m", header);
    EXPECT_THAT(upload, IsOk());
    EXPECT_THAT((*upload)->Write(cloud), IsOk());
    const auto ack = (*upload)->Finish();
    EXPECT_THAT(ack, IsOk());
    return ack->already_present;
  }

  // As three_clients.py shows them.
  json TilesBySdk() {
    json tiles = json::object();
    EXPECT_THAT(
        db_->tiles().Fetch({},
                           "m",
                           {},
                           {},
                           [&tiles](const api::TileUpdate& update) {
                             const auto tile = DecodeSurfaceTile(update.tile.bytes);
                             EXPECT_THAT(tile, IsOk());
                             std::int64_t sum = 0;
                             for (const Surface& surface : tile->surfaces)
                               sum += std::lround(surface.z_m * 512);
                             tiles[update.tile.key.ToString()] = {tile->surfaces.size(), sum};
                             return absl::OkStatus();
                           }),
        IsOk());
    return tiles;
  }

  std::unique_ptr<api::Database> db_;
};

TEST_F(ThreeClientsTest, EachSeesWhatTheOthersDid) {
  STRATA_ASSERT_OK(db_->maps().Create({}, "m", {}));
  RobotFiles files;
  files.step_m = 12.0;
  files.sensor.columns = 360;
  const std::uint64_t driven = WriteDrive("over", files);
  ASSERT_EQ(Json(ImportArguments("m", "over")).at("integrated"), driven);
  EXPECT_FALSE(UploadBySdk());
  EXPECT_FALSE(Python("upload").at("already_present"));

  const json shown = Python("show");
  std::vector<std::string> expected;
  for (const json& scan : Json({"scan", "list", "m"})) expected.push_back(scan.at("id"));
  EXPECT_THAT(expected, ::testing::SizeIs(driven + 2));
  EXPECT_THAT(expected, ::testing::IsSupersetOf({"over/0", "sdk/1", "python/1"}));
  EXPECT_EQ(shown.at("scans"), json(expected));
  std::vector<std::string> listed;
  STRATA_ASSERT_OK(db_->scans().List({}, "m", {}, [&listed](const ScanInfo& scan) {
    listed.push_back(scan.header.id.ToString());
    return absl::OkStatus();
  }));
  EXPECT_EQ(listed, expected);

  STRATA_ASSERT_OK_AND_ASSIGN(const MapStats stats, db_->maps().Stats({}, "m"));
  EXPECT_EQ(shown.at("digest"), stats.content_digest);
  EXPECT_EQ(Json({"map", "show", "m"}).at("content_digest"), stats.content_digest);
  EXPECT_EQ(shown.at("tiles"), TilesBySdk());

  // Nothing is sent twice, whoever asks.
  EXPECT_TRUE(UploadBySdk());
  EXPECT_TRUE(Python("upload").at("already_present"));
  Json({"scan", "delete", "m", "python/1"});
  Json({"scan", "delete", "m", "sdk/1"});
  Json(ImportArguments("m", "over"));
  const json left = Python("show");
  EXPECT_EQ(left.at("scans").size(), driven);
  EXPECT_NE(left.at("digest"), shown.at("digest"));
  EXPECT_EQ(left.at("digest"), Json({"map", "show", "m"}).at("content_digest"));
}

}  // namespace
}  // namespace strata::testing
