#include "core/mls/sides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/common/hash_map.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

// The surface around a point is judged in cubes of the first of these edges [m], and is none where
// points spread more about it [m]. Of a ceiling that beams of a sparse scan draw lines on, a few
// metres apart, a cube of 1 m holds one line: the larger ones are for what the smaller leave open.
constexpr std::array kCubesM = {1.0, 2.0, 4.0};
constexpr double kMaxSpreadM = 0.05;
constexpr int kMinSurfacePoints = 4;  // of the smallest; more of larger ones, like their edge
// Of the normal to the vertical, as a cosine: what is level, and what leans too much to be.
constexpr double kLevel = 0.9;
// A ceiling shows in layers of this height [m] with as many points as this.
constexpr double kCeilingLayerM = 0.25;
constexpr int kMinCeilingPoints = 20;

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
Side SideOf(const Moments& m, double cube_m, const Eigen::Vector3d& up) {
  if (m.n < kMinSurfacePoints * cube_m / kCubesM.front()) return Side::kUnknown;
  const Eigen::Vector3d mean = m.sum / m.n;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(m.squares / m.n - mean * mean.transpose());
  const Eigen::Vector3d variances = eigen.eigenvalues();
  if (variances[0] > kMaxSpreadM * kMaxSpreadM) return Side::kTop;
  if (variances[1] < kMaxSpreadM * kMaxSpreadM) return Side::kUnknown;  // a line
  Eigen::Vector3d normal = eigen.eigenvectors().col(0);
  if (normal.dot(m.first + mean) > 0.0) normal = -normal;
  return normal.dot(up) < -kLevel ? Side::kUnderside : Side::kTop;
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

// Horizontal patches above the sensor, from it.
class Overhead {
 public:
  explicit Overhead(const Eigen::Vector3d& up) : up_(up) {}

  void Add(std::uint32_t patch, const Eigen::Vector3f& p) {
    points_.push_back({patch, p, Side::kUnknown});
  }

  void Judge(std::vector<Side>& sides) {
    for (const double cube_m : kCubesM) JudgeCubes(cube_m);
    Ceilings ceilings;
    for (const Point& point : points_) {
      if (point.side == Side::kUnderside) ceilings.Add(HeightOf(point));
    }
    for (const Point& point : points_) {
      const bool doubtful = point.side == Side::kUnknown && ceilings.MayBeAt(HeightOf(point));
      sides[point.patch] = doubtful ? Side::kDoubtful : point.side;
    }
  }

 private:
  struct Point {
    std::uint32_t patch;
    Eigen::Vector3f p;
    Side side;
  };

  // 21 bits an axis.
  static std::uint64_t CubeOf(const Eigen::Vector3f& p, double cube_m) {
    std::uint64_t cube = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<std::int64_t>(std::floor(p[axis] / static_cast<float>(cube_m)));
      cube = cube << 21 | (static_cast<std::uint64_t>(at) & 0x1FFFFF);
    }
    return cube;
  }

  double HeightOf(const Point& point) const { return up_.dot(point.p.cast<double>()); }

  // Points of which nothing is known yet. A large cube in which they are no plane may hold several
  // surfaces, and says nothing.
  void JudgeCubes(double cube_m) {
    HashMap<std::uint64_t, std::uint32_t> numbers;
    std::vector<Moments> cubes;
    std::vector<std::uint32_t> cube_of;
    for (const Point& point : points_) {
      if (point.side != Side::kUnknown) continue;
      const auto number = static_cast<std::uint32_t>(cubes.size());
      const std::uint32_t cube = numbers.try_emplace(CubeOf(point.p, cube_m), number).first->second;
      if (cube == number) cubes.emplace_back();
      cubes[cube].Add(point.p.cast<double>());
      cube_of.push_back(cube);
    }
    std::vector<Side> of_cubes;
    of_cubes.reserve(cubes.size());
    for (const Moments& moments : cubes) {
      const Side side = SideOf(moments, cube_m, up_);
      const bool is_open = side == Side::kTop && cube_m > kCubesM.front();
      of_cubes.push_back(is_open ? Side::kUnknown : side);
    }
    std::size_t next = 0;
    for (Point& point : points_) {
      if (point.side == Side::kUnknown) point.side = of_cubes[cube_of[next++]];
    }
  }

  const Eigen::Vector3d up_;
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
  Floor(const MlsMap& map, const Eigen::Vector3d& p_sensor)
      : cell_size_m_(map.parameters.cell_size_m), p_sensor_(p_sensor) {
    for (const MlsTile& tile : map.tiles) {
      const CellIndex corner = CellOf(tile.key, 0);
      for (int i = 0; i < kTileCells; ++i) {
        columns_[i] = SquareOf((corner.x + i + 0.5) * cell_size_m_ - p_sensor.x());
        rows_[i] = SquareOf((corner.y + i + 0.5) * cell_size_m_ - p_sensor.y());
      }
      for (const Patch& patch : tile.patches) Add(patch);
    }
  }

  bool IsBelowSensor() const {
    const std::int32_t sensor = TicksOf(p_sensor_.z() - kSensorHeightM);
    constexpr int kMiddle = kSquares / 2;
    int squares = 0;
    for (int y = kMiddle - kFloorReach; y < kMiddle + kFloorReach; ++y) {
      for (int x = kMiddle - kFloorReach; x < kMiddle + kFloorReach; ++x) {
        squares += lowest_[At(x, y)] < sensor ? 1 : 0;
      }
    }
    return squares >= kMinSquares;
  }

  // True if the sensor looked up to `p`, and something lies below it.
  bool IsBelow(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d up = p - p_sensor_;
    const int column = SquareOf(up.x());
    const int row = SquareOf(up.y());
    if (up.z() < kMinSine * up.norm() || column <= kFar + 1 || row <= kFar + 1) return false;
    const std::int32_t room = TicksOf(p.z() - kRoomM);
    for (int y = row - 1; y <= row + 1; ++y) {
      for (int x = column - 1; x <= column + 1; ++x) {
        if (lowest_[At(x, y)] < room) return true;
      }
    }
    return false;
  }

 private:
  static constexpr double kSensorHeightM = 0.15;
  static constexpr int kFloorReach = 16;  // squares
  static constexpr int kMinSquares = 8;
  static constexpr double kMinSine = 0.05;
  static constexpr double kRoomM = 1.5;  // more than a level slope of 26° falls over 2 m and a bit
  static constexpr int kSquares = 256;   // along an edge, the sensor in the middle
  static constexpr int kFar = 0;

  static std::size_t At(int x, int y) { return static_cast<std::size_t>(y) * kSquares + x; }
  static std::int32_t TicksOf(double z_m) {
    return static_cast<std::int32_t>(std::clamp(z_m * kTicksPerMetre, -1e9, 1e9));
  }
  // Row or column of what is so far from the sensor; kFar for all that is outside.
  static int SquareOf(double offset_m) {
    const double at = std::floor(offset_m) + kSquares / 2;
    return at > kFar && at < kSquares - 1 ? static_cast<int>(at) : kFar;
  }

  void Add(const Patch& patch) {
    const auto cell = static_cast<int>(patch.cell);
    std::int32_t& lowest = lowest_[At(columns_[cell % kTileCells], rows_[cell / kTileCells])];
    lowest = std::min(lowest, static_cast<std::int32_t>(patch.z_min));
  }

  double cell_size_m_;
  Eigen::Vector3d p_sensor_;
  std::array<int, kTileCells> columns_{};  // of the tile that is being added
  std::array<int, kTileCells> rows_{};
  // [ticks]
  std::vector<std::int32_t> lowest_ = std::vector<std::int32_t>(
      std::size_t{kSquares} * kSquares, std::numeric_limits<std::int32_t>::max());
};

}  // namespace

std::vector<Side> SidesOf(const MlsMap& map,
                          const Eigen::Vector3d& p_sensor,
                          double max_range_m,
                          const Eigen::Vector3d& up) {
  std::vector<Side> sides;
  sides.reserve(map.patch_count());
  Overhead overhead(up);
  for (const MlsTile& tile : map.tiles) {
    for (const Patch& patch : tile.patches) {
      const Eigen::Vector3d p = PlaceOf(map, tile, patch);
      const Eigen::Vector3d lowest(p.x(), p.y(), std::min(p.z(), patch.top_m()));
      const bool below = up.dot(lowest - p_sensor) <= 0.0;
      if (!below && !patch.vertical()) {
        if (p.head<2>().norm() <= max_range_m) {
          overhead.Add(static_cast<std::uint32_t>(sides.size()), (p - p_sensor).cast<float>());
        }
      }
      sides.push_back(below ? Side::kTop : Side::kUnknown);
    }
  }
  overhead.Judge(sides);
  return sides;
}

void MarkSides(const Eigen::Vector3d& p_sensor, MlsMap& map) {
  const std::vector<Side> sides = SidesOf(map, p_sensor);
  const bool looked_up = std::any_of(sides.begin(), sides.end(), [](Side side) {
    return side == Side::kUnderside || side == Side::kDoubtful;
  });
  std::optional<Floor> floor;
  if (looked_up) floor.emplace(map, p_sensor);
  if (looked_up && !floor->IsBelowSensor()) return;
  std::size_t next = 0;
  for (MlsTile& tile : map.tiles) {
    for (Patch& patch : tile.patches) {
      const Side side = sides[next++];
      if (side == Side::kTop) {
        patch.sides = Patch::kSeenFromAbove;
      } else if (side != Side::kUnknown && floor->IsBelow(PlaceOf(map, tile, patch))) {
        patch.sides = Patch::kSeenFromBelow;
      }
    }
  }
}

}  // namespace strata
