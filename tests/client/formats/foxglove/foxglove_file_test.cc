#include "client/formats/foxglove/foxglove_file.h"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/bags/bag_reader.h"
#include "client/formats/foxglove/foxglove_messages.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using testing::IsOk;
using testing::StatusIs;
using testing::TempDir;

using Messages = std::map<std::string, std::vector<std::pair<std::int64_t, nlohmann::json>>>;

// As our own reader has the file: it holds every chunk's checksum.
Messages Read(const std::string& bytes) {
  const TempDir directory;
  const std::string path = (directory.path() / "map.mcap").string();
  std::ofstream(path, std::ios::binary) << bytes;
  Messages messages;
  const auto bag = OpenBagFile(path);
  EXPECT_THAT(bag, IsOk());
  EXPECT_THAT((*bag)->Visit([&](const BagMessage& message) {
    const BagTopic& topic = (*bag)->topics()[message.topic];
    messages[topic.name + " " + topic.type].push_back(
        {message.time_ns, nlohmann::json::parse(message.bytes)});
    return absl::OkStatus();
  }),
              IsOk());
  EXPECT_THAT((*bag)->damage(), ::testing::IsEmpty());
  return messages;
}

Eigen::Vector3d PlaceIn(const nlohmann::json& p) {
  return {p["x"].get<double>(), p["y"].get<double>(), p["z"].get<double>()};
}

Pose PoseIn(const nlohmann::json& place, const nlohmann::json& q) {
  const Eigen::Vector3d axis = PlaceIn(q);
  return MakePose(Eigen::Quaterniond(q["w"].get<double>(), axis.x(), axis.y(), axis.z()),
                  PlaceIn(place));
}

PoseNode NodeAt(const std::string& trajectory, std::uint64_t sequence, double seconds, double x_m) {
  PoseNode node;
  node.id = {trajectory, sequence};
  node.time = absl::FromUnixMillis(1'790'000'000'000) + absl::Seconds(seconds);
  node.T_map_scan = MakePose(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * x_m, Eigen::Vector3d(1, 2, 3).normalized())),
      {x_m, -2.0, 0.5});
  node.T_map_scan_uploaded = Pose::Identity();
  return node;
}

TEST(FoxgloveFileTest, PosesComeBackWithTheirStamps) {
  const std::vector<PoseNode> nodes = {
      NodeAt("b", 1, 0.25, 3.0), NodeAt("a", 2, 1.0, 2.0), NodeAt("a", 1, 0.5, 1.0)};
  FoxgloveScene scene;
  scene.trajectories = TrajectoriesOf(nodes, false);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, FoxgloveBytes(scene));
  Messages messages = Read(bytes);
  const auto& moments = messages["/tf foxglove.FrameTransform"];
  ASSERT_EQ(moments.size(), 3U);
  const std::vector<const PoseNode*> ordered = {&nodes[0], &nodes[2], &nodes[1]};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& [time_ns, json] = moments[i];
    EXPECT_EQ(time_ns, absl::ToUnixNanos(ordered[i]->time));
    EXPECT_EQ(json["timestamp"]["sec"].get<std::int64_t>() * 1'000'000'000 +
                  json["timestamp"]["nsec"].get<std::int64_t>(),
              time_ns);
    EXPECT_EQ(json["parent_frame_id"], "map");
    EXPECT_EQ(json["child_frame_id"], "trajectories/" + ordered[i]->id.trajectory);
    EXPECT_TRUE(
        PoseIn(json["translation"], json["rotation"]).isApprox(ordered[i]->T_map_scan, 1e-9));
  }
  const auto& whole = messages["/trajectories/a foxglove.PosesInFrame"];
  ASSERT_EQ(whole.size(), 1U);
  EXPECT_EQ(whole[0].first, absl::ToUnixNanos(nodes[0].time));  // from the first stamp of all on
  ASSERT_EQ(whole[0].second["poses"].size(), 2U);
  const auto& pose = whole[0].second["poses"][1];
  EXPECT_TRUE(PoseIn(pose["position"], pose["orientation"]).isApprox(nodes[1].T_map_scan, 1e-9));
  EXPECT_TRUE(TrajectoriesOf(nodes, true)["a"][0].T_map_scan.isApprox(Pose::Identity()));
}

// 100,000 of them fill chunks of their own, far from the map's origin.
TEST(FoxgloveFileTest, PointsComeBackWithColoursAndLabels) {
  testing::Random random(11);
  FoxgloveScene scene;
  for (int i = 0; i < 100'000; ++i) {
    const double x = random.Uniform(-50.0, 50.0), y = random.Uniform(-50.0, 50.0);
    scene.surfaces.vertices.emplace_back(500'000.0 + x, y, 0.1 * i);
    const auto bits = random.Bits();
    scene.surfaces.colour.push_back({.r = static_cast<std::uint8_t>(bits),
                                     .g = static_cast<std::uint8_t>(bits >> 8),
                                     .b = static_cast<std::uint8_t>(bits >> 16)});
    scene.surfaces.label.push_back(static_cast<std::uint16_t>(bits >> 24));
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, FoxgloveBytes(scene));
  Messages messages = Read(bytes);
  const auto& clouds = messages["/surfaces foxglove.PointCloud"];
  ASSERT_EQ(clouds.size(), 1U);
  const nlohmann::json& cloud = clouds[0].second;
  std::vector<std::string> fields;
  for (const auto& field : cloud["fields"]) fields.push_back(field["name"]);
  EXPECT_THAT(fields,
              ::testing::ElementsAre("x", "y", "z", "red", "green", "blue", "alpha", "label"));
  ASSERT_EQ(cloud["point_stride"], 18);
  EXPECT_EQ(cloud["fields"][7]["offset"], 16);
  std::string data;
  ASSERT_TRUE(absl::Base64Unescape(cloud["data"].get<std::string>(), &data));
  ASSERT_EQ(data.size(), 18U * scene.surfaces.vertices.size());
  const Eigen::Vector3d middle = PlaceIn(cloud["pose"]["position"]);
  for (std::size_t i = 0; i < scene.surfaces.vertices.size(); ++i) {
    Eigen::Vector3f p;
    std::memcpy(p.data(), &data[18 * i], 12);
    EXPECT_LT((middle + p.cast<double>() - scene.surfaces.vertices[i]).norm(), 1e-3);
    EXPECT_EQ(static_cast<std::uint8_t>(data[18 * i + 13]), scene.surfaces.colour[i].g);
    EXPECT_EQ(static_cast<std::uint8_t>(data[18 * i + 15]), 255);
    std::uint16_t label = 0;
    std::memcpy(&label, &data[18 * i + 16], 2);
    EXPECT_EQ(label, scene.surfaces.label[i]);
  }
}

TEST(FoxgloveFileTest, APathIsPosesThatFaceTheNext) {
  FoxgloveScene scene;
  scene.path = {{0, 0, 0}, {0, 1, 0}, {0, 1, 0}, {-1, 1, 1}};
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, FoxgloveBytes(scene));
  Messages messages = Read(bytes);
  const nlohmann::json poses = messages["/path foxglove.PosesInFrame"][0].second["poses"];
  ASSERT_EQ(poses.size(), 4U);
  const auto ahead = [&](std::size_t i) -> Eigen::Vector3d {
    return PoseIn(poses[i]["position"], poses[i]["orientation"]).rotation().col(0);
  };
  EXPECT_TRUE(ahead(0).isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_TRUE(ahead(1).isApprox(Eigen::Vector3d::UnitY()));  // nowhere to go
  EXPECT_TRUE(ahead(3).isApprox(Eigen::Vector3d(-1, 0, 1).normalized()));
}

TEST(FoxgloveFileTest, AnEmptySceneIsAFile) {
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string bytes, FoxgloveBytes({}));
  EXPECT_TRUE(Read(bytes).empty());
}

TEST(FoxgloveFileTest, SchemasAreJson) {
  for (const McapSchema* schema :
       {&kFrameTransformSchema, &kPosesInFrameSchema, &kPointCloudSchema}) {
    const auto json = nlohmann::json::parse(schema->text, nullptr, false);
    EXPECT_EQ(json["title"], std::string(schema->name));
    for (const auto& name : json["required"]) {
      EXPECT_TRUE(json["properties"].contains(name.get<std::string>())) << name;
    }
  }
}

}  // namespace
}  // namespace strata
