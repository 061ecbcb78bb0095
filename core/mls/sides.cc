#include "core/mls/sides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/common/hash_map.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

// The surface around a point is judged in cubes of this edge [m], and is none where points spread
// more about it [m].
constexpr double kCubeM = 1.0;
constexpr double kMaxSpreadM = 0.05;
constexpr int kMinSurfacePoints = 4;
// Of the normal to the vertical, as a cosine: what is level, and what leans too much to be.
constexpr double kLevel = 0.9;
// A ceiling shows in layers of this height [m] with as many points as this.
constexpr double kCeilingLayerM = 0.25;
constexpr int kMinCeilingPoints = 50;

// Moments of points, from the first of them.
struct Moments {
  int n = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();

  void Add(const Eigen::Vector3d& p) {
    if (n++ == 0) first = p;
    const Eigen::Vector3d d = p - first;
    sum += d;
    squares += d * d.transpose();
  }
};

// Which side of what its points span is seen from the origin. What spans no surface, or one that is
// not level, is taken for a top: leaves, a hillside, the lines that beams draw on a wall.
Side SideOf(const Moments& m) {
  if (m.n < kMinSurfacePoints) return Side::kUnknown;
  const Eigen::Vector3d mean = m.sum / m.n;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(m.squares / m.n - mean * mean.transpose());
  const Eigen::Vector3d variances = eigen.eigenvalues();
  if (variances[0] > kMaxSpreadM * kMaxSpreadM) return Side::kTop;
  if (variances[1] < kMaxSpreadM * kMaxSpreadM) return Side::kUnknown;  // a line
  Eigen::Vector3d normal = eigen.eigenvectors().col(0);
  if (normal.dot(m.first + mean) > 0.0) normal = -normal;
  return normal.z() < -kLevel ? Side::kUnderside : Side::kTop;
}

// Heights at which a scan shows undersides.
class Ceilings {
 public:
  void Add(double z_m) { ++counts_[LayerOf(z_m)]; }
  bool MayBeAt(double z_m) const {
    const int layer = LayerOf(z_m);
    return IsAt(layer - 1) || IsAt(layer) || IsAt(layer + 1);
  }

 private:
  static int LayerOf(double z_m) { return static_cast<int>(std::floor(z_m / kCeilingLayerM)); }
  bool IsAt(int layer) const {
    const auto found = counts_.find(layer);
    return found != counts_.end() && found->second >= kMinCeilingPoints;
  }
  HashMap<int, int> counts_;
};

// Horizontal patches above the sensor, from it, and the cubes that they lie in.
class Overhead {
 public:
  void Add(std::uint32_t patch, const Eigen::Vector3d& p) {
    const Eigen::Array3d at = (p / kCubeM).array().floor();
    const auto number = static_cast<std::uint32_t>(cubes_.size());
    const std::uint32_t cube =
        numbers_.try_emplace(Cube{at.x(), at.y(), at.z()}, number).first->second;
    if (cube == number) cubes_.emplace_back();
    cubes_[cube].Add(p);
    points_.push_back({patch, cube, p.z()});
  }

  void Judge(std::vector<Side>& sides) const {
    std::vector<Side> of_cubes;
    of_cubes.reserve(cubes_.size());
    for (const Moments& moments : cubes_) of_cubes.push_back(SideOf(moments));
    Ceilings ceilings;
    for (const Point& point : points_) {
      if (of_cubes[point.cube] == Side::kUnderside) ceilings.Add(point.z_m);
    }
    for (const Point& point : points_) {
      const Side side = of_cubes[point.cube];
      const bool doubtful = side == Side::kUnknown && ceilings.MayBeAt(point.z_m);
      sides[point.patch] = doubtful ? Side::kDoubtful : side;
    }
  }

 private:
  using Cube = std::array<double, 3>;
  struct Point {
    std::uint32_t patch, cube;
    double z_m;
  };

  HashMap<Cube, std::uint32_t> numbers_;
  std::vector<Moments> cubes_;
  std::vector<Point> points_;
};

Eigen::Vector3d PlaceOf(const MlsMap& map, const MlsTile& tile, const Patch& patch) {
  const CellIndex cell = CellOf(tile.key, static_cast<std::uint16_t>(patch.cell));
  const double cell_size_m = map.parameters.cell_size_m;
  return {(cell.x + 0.5) * cell_size_m, (cell.y + 0.5) * cell_size_m, patch.mean_m()};
}

// What there is below the sensor and below what it saw overhead: the lowest patch in squares of 1
// m. A cloud that was merged from many scans, or a terrain, has its origin anywhere: level ground
// that is higher is no underside.
class Floor {
 public:
  Floor(const MlsMap& map, const Eigen::Vector3d& p_sensor) {
    for (const MlsTile& tile : map.tiles) {
      for (const Patch& patch : tile.patches) {
        const Eigen::Vector3d p = PlaceOf(map, tile, patch) - p_sensor;
        if (!IsNear(p)) continue;
        float& lowest_m = lowest_m_[SquareOf(p)];
        lowest_m = std::min(lowest_m, static_cast<float>(patch.bottom_m() - p_sensor.z()));
        if (p.z() < -kSensorHeightM && p.head<2>().norm() < kFloorReachM) ++below_sensor_;
      }
    }
  }

  bool IsBelowSensor() const { return below_sensor_ >= kMinPatches; }
  // True if the sensor looked up to p, from it, and something lies below p.
  bool IsBelow(const Eigen::Vector3d& p) const {
    if (p.z() < kMinSine * p.norm() || !IsNear(p)) return false;
    const std::size_t middle = SquareOf(p);
    for (const std::size_t row : {middle - kSquares, middle, middle + kSquares}) {
      for (const std::size_t at : {row - 1, row, row + 1}) {
        if (lowest_m_[at] < p.z() - kRoomM) return true;
      }
    }
    return false;
  }

 private:
  static constexpr double kSensorHeightM = 0.15;
  static constexpr double kFloorReachM = 20.0;
  static constexpr int kMinPatches = 20;
  static constexpr double kMinSine = 0.05;
  static constexpr double kRoomM = 1.5;  // more than a level slope of 26° falls over 2 m and a bit
  static constexpr std::size_t kSquares = 256;  // along an edge, the sensor in the middle

  static bool IsNear(const Eigen::Vector3d& p) {
    return p.head<2>().cwiseAbs().maxCoeff() < static_cast<double>(kSquares) / 2 - 1;
  }
  static std::size_t SquareOf(const Eigen::Vector3d& p) {
    const Eigen::Array2d at = p.head<2>().array() + static_cast<double>(kSquares) / 2;
    return static_cast<std::size_t>(at.y()) * kSquares + static_cast<std::size_t>(at.x());
  }

  std::vector<float> lowest_m_ =
      std::vector<float>(kSquares * kSquares, std::numeric_limits<float>::infinity());
  int below_sensor_ = 0;
};

}  // namespace

std::vector<Side> SidesOf(const MlsMap& map, const Eigen::Vector3d& p_sensor) {
  std::vector<Side> sides;
  sides.reserve(map.patch_count());
  Overhead overhead;
  for (const MlsTile& tile : map.tiles) {
    for (const Patch& patch : tile.patches) {
      const double z_m = patch.mean_m();
      const bool below = z_m <= p_sensor.z();
      if (!below && !patch.vertical()) {
        overhead.Add(static_cast<std::uint32_t>(sides.size()),
                     PlaceOf(map, tile, patch) - p_sensor);
      }
      sides.push_back(below ? Side::kTop : Side::kUnknown);
    }
  }
  overhead.Judge(sides);
  return sides;
}

void MarkSides(const Eigen::Vector3d& p_sensor, MlsMap& map) {
  const std::vector<Side> sides = SidesOf(map, p_sensor);
  const Floor floor(map, p_sensor);
  if (!floor.IsBelowSensor()) return;
  std::size_t next = 0;
  for (MlsTile& tile : map.tiles) {
    for (Patch& patch : tile.patches) {
      const Side side = sides[next++];
      if (side == Side::kTop) {
        patch.sides = Patch::kSeenFromAbove;
      } else if (side != Side::kUnknown && floor.IsBelow(PlaceOf(map, tile, patch) - p_sensor)) {
        patch.sides = Patch::kSeenFromBelow;
      }
    }
  }
}

}  // namespace strata
