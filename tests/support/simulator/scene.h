// Drawn worlds that rays can hit: convex solids and terrain. Every surface is known exactly, so a
// test knows what a map of it should say.
#ifndef STRATA_TESTS_SUPPORT_SIMULATOR_SCENE_H_
#define STRATA_TESTS_SUPPORT_SIMULATOR_SCENE_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

namespace strata::testing {

// The points with normal · p ≤ offset for every face. The bounding box must be finite.
struct Solid {
  struct Face {
    Eigen::Vector3d normal;  // unit, outwards
    double offset = 0.0;
  };
  std::vector<Face> faces;
  Eigen::AlignedBox3d box;
  std::uint16_t label = 0;  // what it is, for scans that say so; 0: nothing in particular
};

Solid Box(const Eigen::Vector3d& min, const Eigen::Vector3d& max);
// A box of edges `size` centred on the origin of its own frame.
Solid OrientedBox(const Eigen::Isometry3d& T_world_box, const Eigen::Vector3d& size);
// A ramp: the prism over the rectangle (x_low to x_high, y_min to y_max) from height z_base up to a
// plane that rises from z_base at x_low to z_top at x_high; x_low may be the larger one.
Solid RampX(double x_low, double x_high, double y_min, double y_max, double z_base, double z_top);
// An upright cylinder with `sides` faces around (x, y), circumscribed about `radius`.
Solid Post(double x, double y, double z_min, double z_max, double radius, int sides = 8);

// The points centre + axes · u with |u| ≤ 1.
struct Ellipsoid {
  Eigen::Vector3d centre;
  Eigen::Matrix3d axes;
};
// The convex hull of ellipsoids, circumscribed by `faces` planes: heads, limbs, tapered bodies.
Solid Hull(const std::vector<Ellipsoid>& ellipsoids, int faces = 96);

Solid Labelled(Solid solid, std::uint16_t label);

// Solids and at most one terrain. Add everything, then Build(), then ask; asking is const and
// thread-safe.
class Scene {
 public:
  void Add(Solid solid) { solids_.push_back(std::move(solid)); }
  // Terrain: `height` sampled at the corners of square cells over `area`, two triangles a cell.
  void SetTerrain(const Eigen::AlignedBox2d& area,
                  double cell_m,
                  const std::function<double(double, double)>& height,
                  std::uint16_t label = 0);
  void Build();

  struct Hit {
    double range = 0.0;
    std::uint16_t label = 0;  // of the solid or the terrain
  };
  // The first surface along the unit vector `direction` within `max_range`. A solid that holds
  // `origin` is not hit.
  std::optional<Hit> Trace(const Eigen::Vector3d& origin,
                           const Eigen::Vector3d& direction,
                           double max_range) const;
  // Its range.
  std::optional<double> Cast(const Eigen::Vector3d& origin,
                             const Eigen::Vector3d& direction,
                             double max_range) const;
  // The height of the first surface below (x, y, z).
  std::optional<double> GroundBelow(double x, double y, double z) const;

  const std::vector<Solid>& solids() const { return solids_; }
  // Every label that something in it has, in order; 0 is none.
  std::set<std::uint16_t> Labels() const;

 private:
  struct Node {  // children at `first` and `first + 1`, or `count` solids from `first`
    Eigen::AlignedBox3d box;
    std::size_t first = 0;
    std::size_t count = 0;
  };
  struct Terrain {
    Eigen::Vector2d origin = Eigen::Vector2d::Zero();
    double cell = 0.0;
    int columns = 0, rows = 0;    // of cells
    std::vector<double> heights;  // (rows + 1) × (columns + 1)
    double min_z = 0.0, max_z = 0.0;
    std::uint16_t label = 0;
    double At(int column, int row) const {
      return heights[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns + 1) +
                     static_cast<std::size_t>(column)];
    }
    // Whether some of the cell's ground may lie between the heights.
    bool Reaches(int column, int row, double low, double high) const {
      constexpr double kSlack = 1e-6;
      const auto [least, most] = std::minmax(
          {At(column, row), At(column + 1, row), At(column, row + 1), At(column + 1, row + 1)});
      return least <= high + kSlack && most >= low - kSlack;
    }
  };

  void Split(std::size_t node);
  Hit CastSolids(const Eigen::Vector3d& origin,
                 const Eigen::Vector3d& direction,
                 double limit) const;
  double CastTerrain(const Eigen::Vector3d& origin,
                     const Eigen::Vector3d& direction,
                     double limit) const;
  double CastTerrainCell(int column,
                         int row,
                         const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& direction,
                         double limit) const;

  std::vector<Solid> solids_;
  std::vector<Node> nodes_;  // a bounding volume hierarchy, root first
  std::optional<Terrain> terrain_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SIMULATOR_SCENE_H_
