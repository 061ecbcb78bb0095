// A mesh of 10,000 triangles along a way over a million patches: time a pose, and what of it goes
// where nothing is near. Arguments: looks, 1 to print.
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "core/collision/shape_way.h"
#include "core/common/stop.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"

namespace strata {
namespace {

constexpr double kCell = 0.1;
constexpr int kEdge = 1000;  // cells: a million patches

// Ground with posts, a wall every 10 m with a gap, and a ceiling over a part.
testing::DrawnMap World() {
  std::mt19937 random(4);
  testing::DrawnMap map;
  for (int y = 0; y < kEdge; ++y) {
    for (int x = 0; x < kEdge; ++x) {
      auto& column = map[{x, y}];
      column.push_back({0.0});
      if (x % 100 == 0 && y % 100 > 20) column.push_back({2.0, 2.0});
      if (random() % 200 == 0) column.push_back({0.5, 0.5});
      if (y > kEdge / 2) column.push_back({2.4});
    }
  }
  return map;
}

// An egg of 1.2 m × 0.8 m × 1.6 m of 100 × 50 faces, two triangles each.
CollisionShape Egg() {
  CollisionShape shape;
  constexpr std::uint32_t kAround = 100, kUp = 51;
  for (std::uint32_t i = 0; i < kUp; ++i) {
    const double polar = M_PI * (i + 0.5) / kUp;
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const double azimuth = 2.0 * M_PI * k / kAround;
      shape.vertices.emplace_back(Eigen::Vector3d(0.6 * std::sin(polar) * std::cos(azimuth),
                                                  0.4 * std::sin(polar) * std::sin(azimuth),
                                                  1.0 + 0.8 * std::cos(polar))
                                      .cast<float>());
    }
  }
  for (std::uint32_t i = 0; i + 1 < kUp; ++i) {
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const std::uint32_t a = i * kAround + k;
      const std::uint32_t b = i * kAround + (k + 1) % kAround;
      shape.triangles.push_back({a, a + kAround, b});
      shape.triangles.push_back({b, a + kAround, b + kAround});
    }
  }
  return shape;
}

int Run(int poses, bool print) {
  testing::MemoryTiles tiles(World().Tiles());
  std::mt19937 random(5);
  ShapeQuery query;
  query.shape = Egg();
  const auto tile_of = [&tiles](const TileKey& key) { return tiles.Load(key); };
  double seconds = 0.0;
  std::uint64_t looks = 0, contacts = 0;
  for (int i = 0; i < poses; ++i) {
    const double x = 1.0 + 98.0 * static_cast<double>(random()) / 4294967296.0;
    const double y = 1.0 + 98.0 * static_cast<double>(random()) / 4294967296.0;
    const double yaw = 2.0 * M_PI * static_cast<double>(random()) / 4294967296.0;
    query.waypoints = {{x, y, 0.0}, {x + std::cos(yaw), y + std::sin(yaw), 0.0}};
    const auto begin = std::chrono::steady_clock::now();
    const auto check = CheckShapeAlong(tile_of, kCell, query, Stop());
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    if (!check.ok()) {
      std::fprintf(stderr, "%s\n", check.status().ToString().c_str());
      return 1;
    }
    looks += check->looks;
    contacts += check->contacts.size();
  }
  if (looks == 0 || contacts == 0) return 1;  // the world has posts
  if (print) {
    std::printf(
        "%zu triangles, %d patches and more, %llu poses in %d ways, %llu contacts: %.3f ms a "
        "pose\n",
        query.shape.triangles.size(),
        kEdge * kEdge,
        static_cast<unsigned long long>(looks),
        poses,
        static_cast<unsigned long long>(contacts),
        1e3 * seconds / static_cast<double>(looks));
  }
  return 0;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) {
  const int poses = argc > 1 ? std::atoi(argv[1]) : 200;
  return strata::Run(poses, argc <= 2 || std::atoi(argv[2]) != 0);
}
