// Meshes written by us and read by others: GLB by tinygltf, PLY, OBJ and STL by small readers of
// their own that share nothing with the writers.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include "client/formats/geometry_writer.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

// An octahedron around `centre`.
Geometry Octahedron(const Vector3d& centre) {
  Geometry geometry;
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 2, 0), Vector3d(0, 0, 3)}) {
    geometry.vertices.push_back(centre + axis);
    geometry.vertices.push_back(centre - axis);
  }
  for (const Vector3d& v : geometry.vertices) {
    geometry.normals.emplace_back((v - centre).normalized().cast<float>());
    geometry.colour.push_back({static_cast<std::uint8_t>(geometry.colour.size()), 100, 255});
  }
  geometry.triangles = {
      {0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  return geometry;
}

template <typename T>
T At(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}
Vector3d FloatsAt(const std::string& bytes, std::size_t offset) {
  return {At<float>(bytes, offset), At<float>(bytes, offset + 4), At<float>(bytes, offset + 8)};
}

TEST(MeshWritersTest, StlHasEveryTriangle) {
  const Geometry geometry = Octahedron({4000.25, -3.5, 7});
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string stl, StlBytes(geometry));
  ASSERT_EQ(stl.size(), 84 + 50 * geometry.triangles.size());
  EXPECT_NE(stl.substr(0, 5), "solid");  // that is how text begins
  ASSERT_EQ(At<std::uint32_t>(stl, 80), geometry.triangles.size());
  for (std::size_t t = 0; t < geometry.triangles.size(); ++t) {
    const std::size_t facet = 84 + 50 * t;
    const Vector3d a = FloatsAt(stl, facet + 12);
    const Vector3d b = FloatsAt(stl, facet + 24);
    const Vector3d c = FloatsAt(stl, facet + 36);
    EXPECT_EQ(a, geometry.vertices[geometry.triangles[t][0]]);
    EXPECT_EQ(b, geometry.vertices[geometry.triangles[t][1]]);
    EXPECT_EQ(c, geometry.vertices[geometry.triangles[t][2]]);
    const Vector3d normal = FloatsAt(stl, facet);
    EXPECT_NEAR(normal.norm(), 1.0, 1e-6);
    EXPECT_NEAR(normal.dot(b - a), 0.0, 1e-5);
    EXPECT_GT(normal.dot(a - Vector3d(4000.25, -3.5, 7)), 0.0);
  }
  EXPECT_THAT(StlBytes(Octahedron({500'000, 0, 0})),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("--relative-to")));
}

TEST(MeshWritersTest, ObjHasEveryTriangle) {
  const Geometry geometry = Octahedron({500'000.25, 0, 7});
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string obj, ObjText(geometry));
  std::vector<Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::istringstream lines(obj);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      Vector3d& v = vertices.emplace_back();
      words >> v.x() >> v.y() >> v.z();
    } else if (kind == "f") {
      auto& t = triangles.emplace_back();
      words >> t[0] >> t[1] >> t[2];
      for (std::uint32_t& index : t) --index;
    }
  }
  EXPECT_EQ(vertices, geometry.vertices);
  EXPECT_EQ(triangles, geometry.triangles);
}

TEST(MeshWritersTest, PlyHasNormalsAndEveryTriangle) {
  const Geometry geometry = Octahedron({1, 2, 3});
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string ply, PlyBytes(geometry));
  EXPECT_THAT(ply, HasSubstr("property float z\nproperty float nx\nproperty float ny\n"));
  std::size_t at = ply.find("end_header\n") + 11;
  for (std::size_t v = 0; v < 6; ++v, at += 12 + 12 + 3) {
    EXPECT_EQ(FloatsAt(ply, at), geometry.vertices[v]);
    EXPECT_EQ(FloatsAt(ply, at + 12), geometry.normals[v].cast<double>());
    EXPECT_EQ(static_cast<std::uint8_t>(ply[at + 24]), geometry.colour[v].r);
  }
  for (const auto& triangle : geometry.triangles) {
    EXPECT_EQ(ply[at], 3);
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_EQ(At<std::uint32_t>(ply, at + 1 + 4 * i), triangle[i]);
    at += 13;
  }
  EXPECT_EQ(at, ply.size());
}

tinygltf::Model ReadGlb(const std::string& bytes) {
  tinygltf::Model model;
  std::string error;
  std::string warning;
  EXPECT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromMemory(
      &model,
      &error,
      &warning,
      reinterpret_cast<const unsigned char*>(bytes.data()),
      static_cast<unsigned>(bytes.size())));
  EXPECT_EQ(error + warning, "");
  return model;
}

// The bytes of an accessor, which this test wants packed.
std::string Column(const tinygltf::Model& model, int accessor) {
  const tinygltf::Accessor& a = model.accessors[static_cast<std::size_t>(accessor)];
  const tinygltf::BufferView& view = model.bufferViews[static_cast<std::size_t>(a.bufferView)];
  EXPECT_EQ(view.byteStride, 0U);
  const auto& data = model.buffers[0].data;
  const auto begin = data.begin() + static_cast<std::ptrdiff_t>(view.byteOffset + a.byteOffset);
  return std::string(begin, begin + static_cast<std::ptrdiff_t>(view.byteLength));
}

TEST(MeshWritersTest, TinyGltfReadsWhatWasWritten) {
  const Geometry geometry = Octahedron({500'000.25, 4'000'000.5, 123.75});
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string glb, GlbBytes(geometry));
  const tinygltf::Model model = ReadGlb(glb);
  ASSERT_EQ(model.scenes.size(), 1U);
  ASSERT_EQ(model.nodes.size(), 1U);
  const tinygltf::Node& node = model.nodes[0];
  const Eigen::Quaterniond turn(
      node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
  const Vector3d shift(node.translation[0], node.translation[1], node.translation[2]);
  const tinygltf::Primitive& primitive = model.meshes.at(0).primitives.at(0);
  const std::string positions = Column(model, primitive.attributes.at("POSITION"));
  const std::string normals = Column(model, primitive.attributes.at("NORMAL"));
  const std::string colours = Column(model, primitive.attributes.at("COLOR_0"));
  ASSERT_EQ(positions.size(), 12 * geometry.vertices.size());
  for (std::size_t v = 0; v < geometry.vertices.size(); ++v) {
    const Vector3d world = turn * FloatsAt(positions, 12 * v) + shift;
    const Vector3d& p = geometry.vertices[v];
    EXPECT_LT((world - Vector3d(p.x(), p.z(), -p.y())).norm(), 1e-4);  // y up
    EXPECT_EQ(FloatsAt(normals, 12 * v), geometry.normals[v].cast<double>());
    EXPECT_EQ(static_cast<std::uint8_t>(colours[4 * v]), geometry.colour[v].r);
    EXPECT_EQ(static_cast<std::uint8_t>(colours[4 * v + 3]), 255);
  }
  const std::string indices = Column(model, primitive.indices);
  ASSERT_EQ(indices.size(), 12 * geometry.triangles.size());
  for (std::size_t t = 0; t < geometry.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(At<std::uint32_t>(indices, 12 * t + 4 * i), geometry.triangles[t][i]);
    }
  }
  const auto& bounds =
      model.accessors[static_cast<std::size_t>(primitive.attributes.at("POSITION"))];
  EXPECT_EQ(bounds.minValues.size(), 3U);
  EXPECT_NEAR(bounds.maxValues[2] - bounds.minValues[2], 6.0, 1e-6);
}

TEST(MeshWritersTest, NothingIsAFileToo) {
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string glb, GlbBytes({}));
  EXPECT_TRUE(ReadGlb(glb).meshes.empty());
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string stl, StlBytes({}));
  EXPECT_EQ(stl.size(), 84U);
}

TEST(MeshWritersTest, FormatsByTheirEnding) {
  EXPECT_THAT(MeshFormatOf("a/b.c/yard.GLB"), testing::IsOkAndHolds(MeshFormat::kGlb));
  EXPECT_THAT(MeshFormatOf("stl"), testing::IsOkAndHolds(MeshFormat::kStl));
  EXPECT_THAT(MeshFormatOf("yard.fbx"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(".ply, .obj, .stl and .glb")));
}

}  // namespace
}  // namespace strata
