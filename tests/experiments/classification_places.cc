#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/geometry/pose.h"
#include "tests/experiments/classification_cases.h"
#include "tests/experiments/classification_scenes.h"
#include "tests/support/scene.h"
#include "tests/support/simulator.h"

namespace strata::testing {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::uint16_t kRoom = 1, kCorridor = 2, kLobby = 3;
constexpr double kWallM = 0.15;      // thickness
constexpr double kClearanceM = 0.2;  // of a cell from all that stands there

// A wing: the corridor along x from 0, rooms on both sides, the lobby at its end.
class Wing {
 public:
  explicit Wing(std::uint64_t seed) : random_(seed) {}

  Places Scan(std::uint64_t seed) {
    const double width = In(1.8, 2.6);
    const double length = In(20.0, 28.0);
    AddRegion(kCorridor, {0.0, -width / 2}, {length, width / 2});
    Block({-kWallM, -width / 2 - kWallM}, {0.0, width / 2 + kWallM});
    for (const double side : {-1.0, 1.0}) AddRooms(side, width / 2, length);
    AddLobby(length, width / 2);
    scene_.Build();
    return CastAll(seed);
  }

 private:
  struct Region {
    std::uint16_t label;
    Eigen::AlignedBox2d box;
  };

  double In(double low, double high) { return random_.Uniform(low, high); }
  void AddRegion(std::uint16_t label, const Vector2d& min, const Vector2d& max) {
    regions_.push_back({label, {min, max}});
  }
  void Block(const Vector2d& a, const Vector2d& b) {
    const Vector2d min = a.cwiseMin(b);
    const Vector2d max = a.cwiseMax(b);
    blocked_.emplace_back(min, max);
    scene_.Add(Box({min.x(), min.y(), 0.0}, {max.x(), max.y(), 2.5}));
  }

  // Along the corridor's wall at side · y, each with a door.
  void AddRooms(double side, double y, double length) {
    double x = 0.0;
    while (x < length - 1e-9) {
      double end = x + In(3.0, 6.5);
      if (length - end < 3.0) end = length;
      const double depth = In(3.5, 6.0);
      const double near = side * (y + kWallM);
      const double far = side * (y + kWallM + depth);
      AddRegion(kRoom,
                Vector2d(x, near).cwiseMin(Vector2d(end, far)),
                Vector2d(end - kWallM, near).cwiseMax(Vector2d(end - kWallM, far)));
      const double door = In(x + 0.3, end - kWallM - 1.3);
      Block({x, side * y}, {door, near});
      if (In(0, 1) < 0.7) {  // others are shut
        Block({door + 0.95, side * y}, {end, near});
      } else {
        Block({door, side * y}, {end, near});
      }
      Block({end - kWallM, near}, {end, far});
      Block({x, far}, {end, side * (y + 2 * kWallM + depth)});
      if (x == 0.0) Block({-kWallM, near}, {0.0, far});
      Furnish({x + 0.2, std::min(near, far) + 0.2},
              {end - kWallM - 0.2, std::max(near, far) - 0.2});
      x = end;
    }
  }

  // Desks and shelves anywhere.
  void Furnish(const Vector2d& min, const Vector2d& max) {
    const int pieces = 1 + static_cast<int>(In(0.0, 4.0));
    for (int k = 0; k < pieces; ++k) {
      const Vector2d size(In(0.4, 1.4), In(0.4, 1.4));
      const Vector2d at(In(min.x(), max.x() - size.x()), In(min.y(), max.y() - size.y()));
      Block(at, at + size);
    }
  }

  void AddLobby(double x, double corridor) {
    const double depth = In(7.0, 10.0);
    const double low = -corridor - In(2.0, 5.0);
    const double high = corridor + In(2.0, 5.0);
    AddRegion(kLobby, {x, low}, {x + depth, high});
    Block({x - kWallM, low}, {x, -corridor - kWallM});
    Block({x - kWallM, corridor + kWallM}, {x, high});
    Block({x, low - kWallM}, {x + depth, low});
    Block({x, high}, {x + depth, high + kWallM});
    Block({x + depth, low}, {x + depth + kWallM, high});
    for (int k = 0; k < 3; ++k) {  // columns and seats
      const Vector2d at(In(x + 1.0, x + depth - 1.5), In(low + 1.0, high - 1.5));
      Block(at, at + Vector2d(In(0.3, 0.8), In(0.3, 0.8)));
    }
  }

  bool IsFree(const Vector2d& p) const {
    return std::none_of(blocked_.begin(), blocked_.end(), [&](const Eigen::AlignedBox2d& box) {
      return box.exteriorDistance(p) < kClearanceM;
    });
  }

  Places CastAll(std::uint64_t seed) const {
    SensorOptions sensor;
    sensor.rings = 1;
    sensor.columns = 360;
    sensor.elevation_min_rad = sensor.elevation_max_rad = 0.0;
    sensor.min_range_m = 0.0;
    sensor.max_range_m = static_cast<double>(kPlaceMaxRangeM);
    sensor.sigma_m = 0.02;
    sensor.organised = true;
    Places places;
    for (const Region& region : regions_) {
      const Vector2d size = region.box.sizes() / kPlaceCellM;
      for (int i = 0; i < static_cast<int>(size.x()); ++i) {
        for (int j = 0; j < static_cast<int>(size.y()); ++j) {
          const Vector2d p = region.box.min() + kPlaceCellM * Vector2d(i + 0.5, j + 0.5);
          if (!IsFree(p)) continue;
          const Pose at = MakePose(Eigen::Quaterniond::Identity(), Vector3d(p.x(), p.y(), 1.0));
          const PointCloud scan =
              SimulateScan(scene_, sensor, at, seed ^ (places.cells.size() << 8));
          std::vector<float> ranges;
          for (const Eigen::Vector3f& hit : scan.points) {
            ranges.push_back(hit.allFinite() ? hit.norm() : kPlaceMaxRangeM);
          }
          places.cells.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0F);
          places.labels.push_back(region.label);
          places.ranges_m.push_back(std::move(ranges));
        }
      }
    }
    return places;
  }

  Random random_;
  Scene scene_;
  std::vector<Eigen::AlignedBox2d> blocked_;
  std::vector<Region> regions_;
};

}  // namespace

std::vector<std::string> PlaceClasses() { return {"room", "corridor", "lobby"}; }

Places ScanPlaces(std::uint64_t seed) { return Wing(seed).Scan(seed); }

}  // namespace strata::testing
