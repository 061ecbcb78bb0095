#include "core/mls/surface_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "tests/core/mls/surface_world.h"

namespace strata {
namespace {

using testing::Draw;
using testing::Drawing;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::Level;
using testing::SurfaceWorld;

constexpr double kCell = 0.1;

SurfaceMesh MeshOf(const SurfaceWorld& world, const SurfaceMeshOptions& options = {}) {
  std::vector<const SurfaceTile*> tiles;
  for (const auto& [key, tile] : world) tiles.push_back(&tile);
  return MakeSurfaceMesh(tiles, kCell, options);
}

// A picture of flat ground: rows from high y to low y, '#' is a cell with a surface at 0.
SurfaceMesh MeshOfPicture(const std::vector<std::string>& rows) {
  const int height = static_cast<int>(rows.size());
  const int width = static_cast<int>(rows[0].size());
  return MeshOf(Draw(
      [&](CellIndex cell) {
        return rows[height - 1 - cell.y][cell.x] == '#' ? std::vector<Level>{{}}
                                                        : std::vector<Level>{};
      },
      0,
      width,
      0,
      height));
}

struct Counts {
  std::size_t quads, triangles, lines, points;
  friend bool operator==(const Counts&, const Counts&) = default;
};
Counts CountsOf(const SurfaceMesh& mesh) {
  return {mesh.quads.size(), mesh.triangles.size(), mesh.lines.size(), mesh.points.size()};
}

TEST(SurfaceMeshTest, HandCountedPictures) {
  EXPECT_EQ(CountsOf(MeshOfPicture({"#"})), (Counts{0, 0, 0, 1}));
  EXPECT_EQ(CountsOf(MeshOfPicture({"##"})), (Counts{0, 0, 1, 0}));
  EXPECT_EQ(CountsOf(MeshOfPicture({"#", "#"})), (Counts{0, 0, 1, 0}));
  EXPECT_EQ(CountsOf(MeshOfPicture({".#", "#."})), (Counts{0, 0, 1, 0}));
  EXPECT_EQ(CountsOf(MeshOfPicture({"#.", ".#"})), (Counts{0, 0, 1, 0}));
  EXPECT_EQ(CountsOf(MeshOfPicture({"#.#"})), (Counts{0, 0, 0, 2}));
  for (const std::vector<std::string>& corner :
       {std::vector<std::string>{"##", "#."}, {"##", ".#"}, {"#.", "##"}, {".#", "##"}}) {
    EXPECT_EQ(CountsOf(MeshOfPicture(corner)), (Counts{0, 1, 0, 0}));
  }
  EXPECT_EQ(CountsOf(MeshOfPicture({"##", "##"})), (Counts{1, 0, 0, 0}));
  EXPECT_EQ(CountsOf(MeshOfPicture({"###", "#.#", "###"})), (Counts{0, 4, 0, 0}));
  EXPECT_EQ(CountsOf(MeshOfPicture({"##...#", "##.#..", "......", "####.#"})),
            (Counts{1, 0, 3, 3}));
}

TEST(SurfaceMeshTest, VerticesAreTheSurfacesAtTheMiddleOfTheirCells) {
  SurfaceWorld world =
      Draw([](CellIndex cell) { return std::vector<Level>{{.z_m = 1.0 + cell.x}}; }, -1, 1, 5, 6);
  const SurfaceMesh mesh = MeshOf(world);
  EXPECT_THAT(mesh.first_vertex, ElementsAre(0, 1));
  ASSERT_EQ(mesh.vertices.size(), 2U);
  EXPECT_LT((mesh.vertices[0] - Eigen::Vector3d(-0.05, 0.55, 0.0)).norm(), 1e-9);
  EXPECT_LT((mesh.vertices[1] - Eigen::Vector3d(0.05, 0.55, 1.0)).norm(), 1e-9);
}

TEST(SurfaceMeshTest, CellsOfCoarseLevelsAreWider) {
  SurfaceTile tile = {.key = {3, 0, 0}, .surfaces = {{.cell = 1, .z_m = 2.0F}}};
  tile.IndexRows();
  const SurfaceTile* const tiles[] = {&tile};
  const SurfaceMesh mesh = MakeSurfaceMesh(tiles, kCell);
  EXPECT_LT((mesh.vertices.at(0) - Eigen::Vector3d(1.2, 0.4, 2.0)).norm(), 1e-9);
}

TEST(SurfaceMeshTest, GateIsNoisePlusTheSlopeOfOneCell) {
  const auto links = [](double dz, double sigma) {
    const SurfaceMesh mesh =
        MeshOf(Draw(
                   [=](CellIndex cell) {
                     return std::vector<Level>{{.z_m = dz * cell.x, .sigma_m = sigma}};
                   },
                   0,
                   2,
                   0,
                   1),
               {.max_slope_rad = std::atan(0.5)});
    return mesh.lines.size() == 1;
  };
  EXPECT_TRUE(links(0.0499, 0.0));
  EXPECT_FALSE(links(0.0501, 0.0));
  const double noise = 3.0 * std::sqrt(2.0) * 0.02;
  EXPECT_TRUE(links(0.0499 + noise, 0.02));
  EXPECT_FALSE(links(0.0501 + noise, 0.02));
}

TEST(SurfaceMeshTest, LevelsOfADeckAreMeshesOfTheirOwn) {
  const SurfaceMesh mesh = MeshOf(Draw(
      [](CellIndex cell) {
        std::vector<Level> levels = {{.z_m = 0.0}};
        if (cell.x >= 3 && cell.x < 7) levels.push_back({.z_m = 3.0, .depth_m = 0.4});
        return levels;
      },
      0,
      10,
      0,
      6));
  EXPECT_EQ(CountsOf(mesh), (Counts{9 * 5 + 3 * 5, 0, 0, 0}));
  for (const auto& quad : mesh.quads) {
    const double z = mesh.vertices[quad[0]].z();
    for (const std::uint32_t v : quad) EXPECT_EQ(mesh.vertices[v].z(), z);
  }
  ASSERT_EQ(mesh.verticals.size(), 4U * 6);
  for (const SurfaceMesh::VerticalSegment& segment : mesh.verticals) {
    EXPECT_EQ(mesh.vertices[segment.vertex].z(), 3.0);
    EXPECT_NEAR(segment.bottom_m, 2.6, 1e-6);
  }
}

TEST(SurfaceMeshTest, SpiralRampDoesNotCloseOnItself) {
  // Four cells around a corner, each 0.3 m above the one before; the fourth is 0.9 m above the
  // first.
  const double z[2][2] = {{0.0, 0.05}, {0.15, 0.10}};  // [y][x], counter-clockwise
  const SurfaceMesh closed = MeshOf(
      Draw([&](CellIndex c) { return std::vector<Level>{{.z_m = z[c.y][c.x]}}; }, 0, 2, 0, 2),
      {.max_slope_rad = 1.0});
  EXPECT_EQ(CountsOf(closed), (Counts{1, 0, 0, 0}));
  const SurfaceMesh open = MeshOf(
      Draw([&](CellIndex c) { return std::vector<Level>{{.z_m = z[c.y][c.x]}}; }, 0, 2, 0, 2),
      {.max_slope_rad = std::atan(0.6)});
  EXPECT_EQ(CountsOf(open), (Counts{0, 1, 1, 0}));
}

std::pair<std::uint32_t, std::uint32_t> Edge(std::uint32_t a, std::uint32_t b) {
  return std::minmax(a, b);
}

TEST(SurfaceMeshTest, RandomWorldsHaveTheInvariantsOfAMesh) {
  for (const int seed : {1, 2, 3}) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    const SurfaceWorld world = Draw(
        [&](CellIndex) {
          std::vector<Level> levels;
          for (const double z : {0.0, 1.5, 3.0}) {
            if (uniform(random) < 0.6) levels.push_back({.z_m = z + 0.25 * uniform(random)});
          }
          return levels;
        },
        -20,
        20,
        -20,
        20);
    const SurfaceMesh mesh = MeshOf(world);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> faces_at;
    std::set<std::uint32_t> seen;
    const auto check = [&](const auto& face) {
      double area = 0.0;
      for (std::size_t i = 0; i < face.size(); ++i) {
        const Eigen::Vector3d& a = mesh.vertices[face[i]];
        const Eigen::Vector3d& b = mesh.vertices[face[(i + 1) % face.size()]];
        area += 0.5 * (a.x() * b.y() - a.y() * b.x());
        ++faces_at[Edge(face[i], face[(i + 1) % face.size()])];
        EXPECT_LE((a - b).head<2>().cwiseAbs().maxCoeff(), kCell + 1e-9);
        seen.insert(face[i]);
      }
      EXPECT_NEAR(area, face.size() == 4 ? kCell * kCell : 0.5 * kCell * kCell, 1e-9);
    };
    for (const auto& quad : mesh.quads) check(quad);
    for (const auto& triangle : mesh.triangles) check(triangle);
    for (const auto& [edge, count] : faces_at) EXPECT_LE(count, 2);
    for (const auto& line : mesh.lines) {
      EXPECT_EQ(faces_at.count(Edge(line[0], line[1])), 0U);
      seen.insert(line.begin(), line.end());
    }
    // Every surface is drawn: in a face, on a line, or as a point, and then in nothing else.
    for (const std::uint32_t v : mesh.points) EXPECT_TRUE(seen.insert(v).second);
    EXPECT_EQ(seen.size(), mesh.vertices.size());
    EXPECT_FALSE(mesh.quads.empty() || mesh.triangles.empty() || mesh.lines.empty());
  }
}

TEST(SurfaceMeshTest, HillAcrossFourTilesIsADiscInEulersSense) {
  const SurfaceWorld world = Draw(
      [](CellIndex cell) {
        if (cell.x * cell.x + cell.y * cell.y > 900) return std::vector<Level>{};
        return std::vector<Level>{{.z_m = std::sin(0.1 * cell.x) + 0.5 * std::cos(0.1 * cell.y)}};
      },
      -40,
      40,
      -40,
      40);
  ASSERT_EQ(world.size(), 4U);
  const SurfaceMesh mesh = MeshOf(world);
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& q : mesh.quads) {
    for (int i = 0; i < 4; ++i) edges.insert(Edge(q[i], q[(i + 1) % 4]));
  }
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) edges.insert(Edge(t[i], t[(i + 1) % 3]));
  }
  for (const auto& line : mesh.lines) edges.insert(Edge(line[0], line[1]));
  const auto V = static_cast<int>(mesh.vertices.size());
  const auto F = static_cast<int>(mesh.quads.size() + mesh.triangles.size());
  EXPECT_EQ(V - static_cast<int>(edges.size()) + F, 1);
  EXPECT_THAT(mesh.points, IsEmpty());
}

TEST(SurfaceMeshTest, NothingGivesNothing) {
  EXPECT_TRUE(MakeSurfaceMesh({}, kCell).vertices.empty());
}

}  // namespace
}  // namespace strata
