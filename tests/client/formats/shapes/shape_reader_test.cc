// Shapes as other programs write them.
#include "client/formats/shapes/shape_reader.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <tuple>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::strata::testing::TempDir;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using Code = absl::StatusCode;

constexpr char kObj[] =
    "v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nv 0 0 3\n"
    "f 1 2 3 4\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
constexpr char kPly[] =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
    "z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 2 3\n3 0 "
    "1 2\n";

// One triangle, binary.
std::string Stl() {
  std::string bytes(80, ' ');
  const std::uint32_t count = 1;
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  const float numbers[12] = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 2, 3};
  bytes.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
  return bytes + std::string(2, '\0');
}

// The same, with y up.
std::string Glb() {
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,)"
      R"("componentType":5126,"count":3,"type":"VEC3","min":[0,0,-2],"max":[1,3,0]}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  const auto add = [&bytes](std::uint32_t number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
  };
  add(2);
  add(static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + 36));
  add(static_cast<std::uint32_t>(json.size()));
  bytes += "JSON" + json;
  add(36);
  bytes.append("BIN\0", 4);
  const float numbers[9] = {0, 0, 0, 1, 0, 0, 0, 3, -2};
  bytes.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
  return bytes;
}

class ShapeReaderTest : public ::testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& bytes) {
    const std::filesystem::path path = dir_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << bytes;
    return path.string();
  }
  static Eigen::AlignedBox3f BoxOf(const CollisionShape& shape) {
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& v : shape.vertices) box.extend(v);
    return box;
  }

  TempDir dir_;
};

TEST_F(ShapeReaderTest, MeshesOfAllKinds) {
  for (const auto& [name, bytes, triangles] :
       {std::tuple<std::string, std::string, std::size_t>{"a.obj", kObj, 6U},
        {"a.ply", kPly, 1U},
        {"a.STL", Stl(), 1U}}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const CollisionShape shape, ReadShape(Write(name, bytes)));
    EXPECT_THAT(shape.triangles, SizeIs(triangles)) << name;
    EXPECT_TRUE(BoxOf(shape).min().isZero(1e-6F)) << name;
    EXPECT_TRUE(BoxOf(shape).max().isApprox(Eigen::Vector3f(1, 2, 3), 1e-6F)) << name;
  }
}

// Libraries give some files with y up, whatever those say: shapes lay on their side.
TEST_F(ShapeReaderTest, UpIsUp) {
  const auto dae = [](const std::string& axis, const std::string& points) {
    return "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' "
           "version='1.4.1'><asset><unit meter='1'/><up_axis>" +
           axis +
           "</up_axis></asset><library_geometries><geometry id='g'><mesh><source id='p'>"
           "<float_array id='pa' count='9'>" +
           points +
           "</float_array><technique_common><accessor source='#pa' count='3' stride='3'>"
           "<param name='X' type='float'/><param name='Y' type='float'/>"
           "<param name='Z' type='float'/></accessor></technique_common></source>"
           "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices>"
           "<triangles count='1'><input semantic='VERTEX' source='#v' offset='0'/>"
           "<p>0 1 2</p></triangles></mesh></geometry></library_geometries>"
           "<library_visual_scenes><visual_scene id='s'><node><instance_geometry url='#g'/></node>"
           "</visual_scene></library_visual_scenes><scene><instance_visual_scene url='#s'/></scene>"
           "</COLLADA>";
  };
  for (const auto& [name, bytes] :
       {std::pair<std::string, std::string>{"z.dae", dae("Z_UP", "0 0 0 1 0 0 0 2 3")},
        {"y.dae", dae("Y_UP", "0 0 0 1 0 0 0 3 -2")},
        {"a.glb", Glb()}}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const CollisionShape shape, ReadShape(Write(name, bytes)));
    EXPECT_TRUE(BoxOf(shape).min().isZero(1e-6F)) << name;
    EXPECT_TRUE(BoxOf(shape).max().isApprox(Eigen::Vector3f(1, 2, 3), 1e-6F))
        << name << ": " << BoxOf(shape).max().transpose();
  }
}

TEST_F(ShapeReaderTest, ARobotWithItsJoints) {
  Write("robot/meshes/hand.obj", kObj);
  const std::string file = Write(
      "robot/urdf/arm.urdf",
      "<robot name='arm'><link name='base'><collision><origin xyz='0 0 0.5'/><geometry>"
      "<box size='1 0.6 1'/></geometry></collision></link>"
      "<link name='upper'><collision><geometry><cylinder radius='0.1' length='0.8'/></geometry>"
      "</collision></link><link name='hand'><collision><geometry>"
      "<mesh filename='package://robot/meshes/hand.obj' scale='0.1 0.1 "
      "0.1'/></geometry></collision>"
      "</link><joint name='shoulder' type='revolute'><parent link='base'/><child link='upper'/>"
      "<origin xyz='0 0 1'/><axis xyz='0 0 1'/><limit lower='-3' upper='3' effort='1' "
      "velocity='1'/>"
      "</joint><joint name='slide' type='prismatic'><parent link='upper'/><child link='hand'/>"
      "<origin xyz='1 0 0'/><axis xyz='1 0 0'/><limit lower='0' upper='3' effort='1' velocity='1'/>"
      "</joint></robot>");
  STRATA_ASSERT_OK_AND_ASSIGN(const CollisionShape shape, ReadShape(file));
  ASSERT_THAT(shape.parts, SizeIs(2));
  EXPECT_TRUE(shape.parts[0].size_m.isApprox(Eigen::Vector3d(1, 0.6, 1)));
  EXPECT_NEAR(shape.parts[0].T_shape_part.translation().z(), 0.5, 1e-9);
  EXPECT_EQ(shape.parts[1].kind, ShapePart::Kind::kCylinder);
  EXPECT_TRUE(BoxOf(shape).min().isApprox(Eigen::Vector3f(1, 0, 1), 1e-5F));
  EXPECT_TRUE(BoxOf(shape).max().isApprox(Eigen::Vector3f(1.1F, 0.2F, 1.3F), 1e-5F));
  STRATA_ASSERT_OK_AND_ASSIGN(const CollisionShape moved,
                              ReadShape(file, {{"shoulder", M_PI / 2}, {"slide", 0.5}}));
  EXPECT_TRUE(BoxOf(moved).min().isApprox(Eigen::Vector3f(-0.2F, 1.5F, 1.0F), 1e-5F))
      << BoxOf(moved).min().transpose();
  EXPECT_THAT(ReadShape(file, {{"elbow", 1.0}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("it has shoulder, slide")));
}

TEST_F(ShapeReaderTest, WhatIsNoShapeSaysWhy) {
  EXPECT_THAT(ReadShape("nowhere.stl"), StatusIs(Code::kNotFound, HasSubstr("nowhere.stl")));
  EXPECT_THAT(ReadShape(Write("a.doc", "x")),
              StatusIs(Code::kInvalidArgument, HasSubstr(".stl, .obj")));
  EXPECT_THAT(ReadShape(Write("b.stl", "nonsense")),
              StatusIs(Code::kInvalidArgument, HasSubstr("b.stl")));
  EXPECT_THAT(ReadShape(Write("c.urdf", "<robot name='x'><link name='base'/></robot>")),
              StatusIs(Code::kInvalidArgument, HasSubstr("collision geometry")));
  EXPECT_THAT(ReadShape(Write("d.urdf", "<x")),
              StatusIs(Code::kInvalidArgument, HasSubstr("URDF")));
  EXPECT_THAT(ReadShape(Write("e.obj", kObj), {{"joint", 1.0}}),
              StatusIs(Code::kInvalidArgument, HasSubstr("no joints")));
}

}  // namespace
}  // namespace strata
