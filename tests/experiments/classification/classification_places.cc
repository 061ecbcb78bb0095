#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "core/classification/places/free_space.h"
#include "tests/experiments/classification/classification_cases.h"
#include "tests/experiments/classification/classification_scenes.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

using Eigen::Vector2d;

constexpr std::uint16_t kRoom = 1, kCorridor = 2, kLobby = 3;
constexpr double kWallM = 0.15;      // thickness
constexpr double kClearanceM = 0.2;  // of a cell from all that stands there
constexpr double kDoorM = 0.95;
constexpr double kTurn = 2.0 * std::numbers::pi;
// Of a beam. One that hits glass or something black does not come back.
constexpr double kBeamSigmaM = 0.03;
constexpr double kLostBeams = 0.02;
// What a robot's map has wrong: wall cells beside free ones that it takes for free.
constexpr double kWornCells = 0.1;

// The robot's occupancy grid: all is wall until it is carved out, and what stands there is put
// back.
class Grid {
 public:
  static constexpr double kCellM = 0.05;

  Grid(const Vector2d& min, const Vector2d& max)
      : space_(min,
               kCellM,
               static_cast<int>((max - min).x() / kCellM),
               static_cast<int>((max - min).y() / kCellM)),
        label_(space_.cells().size(), 0) {}

  template <typename Inside>
  void Fill(const Inside& inside) {
    ForEach([&](std::size_t cell, const Vector2d& p) {
      if (inside(p)) space_.At(cell) = 0;
    });
  }
  // `label` 0: free, but nothing that is asked about, as a doorway is.
  void Carve(std::uint16_t label, const Vector2d& a, const Vector2d& b) {
    const Eigen::AlignedBox2d box(a.cwiseMin(b), a.cwiseMax(b));
    ForEach([&](std::size_t cell, const Vector2d& p) {
      if (!box.contains(p)) return;
      space_.At(cell) = 1;
      label_[cell] = label;
    });
  }
  void Wear(Random& random) {
    const std::vector<std::uint8_t> before = space_.cells();
    for (int row = 1; row + 1 < space_.rows(); ++row) {
      for (int column = 1; column + 1 < space_.columns(); ++column) {
        const std::size_t cell = space_.Index(column, row);
        const auto wide = static_cast<std::size_t>(space_.columns());
        const bool edge =
            before[cell - 1] + before[cell + 1] + before[cell - wide] + before[cell + wide] > 0;
        if (before[cell] == 0 && edge && random.Uniform(0, 1) < kWornCells) space_.At(cell) = 1;
      }
    }
  }

  std::uint16_t LabelAt(const Vector2d& p) const {
    const int column = static_cast<int>(std::floor((p - min()).x() / kCellM));
    const int row = static_cast<int>(std::floor((p - min()).y() / kCellM));
    const bool inside = column >= 0 && column < space_.columns() && row >= 0 && row < space_.rows();
    return inside ? label_[space_.Index(column, row)] : std::uint16_t{0};
  }
  bool IsClear(const Vector2d& p) const {
    for (double angle = 0.0; angle < kTurn; angle += kTurn / 32) {
      const Vector2d along(std::cos(angle), std::sin(angle));
      for (double r = 0.0; r <= kClearanceM; r += kCellM) {
        if (!space_.IsOpen(p + r * along)) return false;
      }
    }
    return true;
  }
  double Cast(const Vector2d& from, double angle, double most) const {
    return space_.Cast(from, angle, most);
  }

  const Vector2d& min() const { return space_.min_m(); }
  Vector2d max() const { return min() + kCellM * Vector2d(space_.columns(), space_.rows()); }

 private:
  template <typename Use>
  void ForEach(const Use& use) {
    for (int row = 0; row < space_.rows(); ++row) {
      for (int column = 0; column < space_.columns(); ++column) {
        use(space_.Index(column, row), min() + kCellM * Vector2d(column + 0.5, row + 0.5));
      }
    }
  }

  FreeSpace space_;
  std::vector<std::uint16_t> label_;
};

// What the wings of one building have in common.
struct Building {
  explicit Building(std::uint64_t seed) {
    Random random(seed);
    half_corridor_m = 0.5 * random.Uniform(1.6, 3.4);
    room_m = random.Uniform(2.5, 4.5);
    room_depth_m = random.Uniform(3.5, 6.5);
    lobby_depth_m = random.Uniform(5.0, 9.0);
    lobby_aside_m = random.Uniform(1.0, 4.0);
  }

  double half_corridor_m = 0.0;
  double room_m = 0.0;  // length along the corridor of a single one
  double room_depth_m = 0.0;
  double lobby_depth_m = 0.0;
  double lobby_aside_m = 0.0;  // on both sides of the corridor
};

// A wing: the corridor along x from 0, rooms, side corridors and bays on both sides, the lobby at
// its end.
class Wing {
 public:
  Wing(const Building& building, std::uint64_t seed) : building_(building), random_(seed) {}

  Places Scan() {
    const double half = building_.half_corridor_m;
    const double length = In(20.0, 28.0);
    grid_.Carve(kCorridor, {0.0, -half}, {length, half});
    for (const double side : {-1.0, 1.0}) AddSlots(side, half, length);
    AddLobby(length, half);
    Furnish({0.0, -half}, {length, half}, 0.05, 0.12, true);
    grid_.Wear(random_);
    return CastAll();
  }

 private:
  double In(double low, double high) { return random_.Uniform(low, high); }
  double Near(double length) { return length * In(0.8, 1.25); }
  bool Chance(double share) { return In(0.0, 1.0) < share; }

  // What opens from the corridor at side · y, one after the other.
  void AddSlots(double side, double y, double length) {
    double x = 0.0;
    while (x < length - 1e-9) {
      // Whatever is left at the end is a room.
      const double kind = length - x < 8.0 ? 1.0 : In(0.0, 1.0);
      const double room = building_.room_m * (Chance(0.3) ? 2.0 : 1.0) + In(-0.2, 0.2);
      double end = x + (kind < 0.12 ? 2.0 * building_.half_corridor_m : room) + kWallM;
      if (length - end < 3.0) end = length;
      const double near = side * (y + kWallM);
      if (kind < 0.12) {  // a side corridor
        const double far = side * (y + In(4.0, 9.0));
        grid_.Carve(kCorridor, {x, side * y}, {end - kWallM, far});
      } else if (kind < 0.25) {  // a bay to wait in, open to the corridor
        const double far = side * (y + In(1.5, 4.0));
        grid_.Carve(kLobby, {x, side * y}, {end - kWallM, far});
        Furnish({x, side * y}, {end - kWallM, far}, 0.15, 0.1, false);
      } else {
        AddRoom(x, end - kWallM, near, side * (y + kWallM + Near(building_.room_depth_m)));
      }
      x = end;
    }
  }

  void AddRoom(double left, double right, double near, double far) {
    grid_.Carve(kRoom, {left, near}, {right, far});
    Furnish({left, near}, {right, far}, 0.25, 0.04, Chance(0.5));
    if (Chance(0.2)) return;  // the door is shut
    const double side = near > 0.0 ? 1.0 : -1.0;
    const double door = In(left + 0.2, right - 0.2 - kDoorM);
    grid_.Carve(0, {door, near - side * (kWallM + 0.01)}, {door + kDoorM, near});
    // Its leaf stands open into the room as it was left.
    const double swing = In(0.2, 1.9);
    const Vector2d leaf(std::cos(swing), side * std::sin(swing));
    const Vector2d hinge(door, near);
    Bar(hinge, hinge + kDoorM * leaf, 0.05);
  }

  void AddLobby(double x, double half) {
    const double depth = Near(building_.lobby_depth_m);
    const double low = -half - Near(building_.lobby_aside_m);
    const double high = half + Near(building_.lobby_aside_m);
    grid_.Carve(kLobby, {x, low}, {x + depth, high});
    if (Chance(0.5)) {  // an L
      const double far = Chance(0.5) ? high + In(2.0, 4.0) : low - In(2.0, 4.0);
      const double start = x + In(0.0, 0.4) * depth;
      grid_.Carve(kLobby, {start, 0.0}, {start + In(2.5, 4.0), far});
    }
    for (int k = 0; k < 3; ++k) {
      const Vector2d at(In(x + 1.0, x + depth - 0.5), In(low + 0.5, high - 0.5));
      Disc(at, In(0.15, 0.35));
    }
    Furnish({x, low}, {x + depth, high}, 0.1, 0.1, false);
  }

  // So many pieces and people a square metre; cupboards may stand along walls only.
  void Furnish(
      const Vector2d& a, const Vector2d& b, double pieces, double people, bool along_walls) {
    const Eigen::AlignedBox2d area(a.cwiseMin(b), a.cwiseMax(b));
    const double m2 = area.volume();
    for (double k = In(0.0, 1.0); k < pieces * m2; k += 1.0) AddPiece(area, along_walls);
    for (double k = In(0.0, 1.0); k < people * m2; k += 1.0) {  // their legs
      const double angle = In(0.0, kTurn);
      const Vector2d apart(0.14 * std::cos(angle), 0.14 * std::sin(angle));
      const Vector2d at = Somewhere(area);
      Disc(at - apart, 0.07);
      Disc(at + apart, 0.07);
    }
  }

  // A cupboard, a table's or chair's legs, or something round.
  void AddPiece(const Eigen::AlignedBox2d& area, bool along_walls) {
    const double kind = In(0.0, 1.0);
    Vector2d at = Somewhere(area);
    if (kind < 0.4) {
      const double long_m = In(0.6, 1.6);
      const double deep_m = In(0.3, 0.5);
      if (along_walls) {
        at.y() = Chance(0.5) ? area.min().y() + deep_m / 2 : area.max().y() - deep_m / 2;
      }
      const double angle = along_walls ? 0.0 : In(0.0, kTurn);
      const Vector2d along(std::cos(angle), std::sin(angle));
      Bar(at - 0.5 * long_m * along, at + 0.5 * long_m * along, deep_m);
    } else if (kind < 0.85) {
      const double angle = In(0.0, kTurn);
      const Vector2d u(std::cos(angle), std::sin(angle));
      const Vector2d v(-u.y(), u.x());
      const double x = In(0.2, 0.7);
      const double y = In(0.2, 0.4);
      for (const double s : {-1.0, 1.0}) {
        for (const double t : {-1.0, 1.0}) Disc(at + s * x * u + t * y * v, 0.04);
      }
    } else {
      Disc(at, In(0.12, 0.3));
    }
  }

  Vector2d Somewhere(const Eigen::AlignedBox2d& area) {
    return {In(area.min().x(), area.max().x()), In(area.min().y(), area.max().y())};
  }
  void Disc(const Vector2d& at, double radius) {
    grid_.Fill([&](const Vector2d& p) { return (p - at).norm() <= radius; });
  }
  // Along the line from a to b.
  void Bar(const Vector2d& a, const Vector2d& b, double width) {
    const double length = (b - a).norm();
    const Vector2d u = (b - a) / length;
    grid_.Fill([&](const Vector2d& p) {
      const Vector2d d = p - a;
      const double across = std::abs(u.x() * d.y() - u.y() * d.x());
      return d.dot(u) >= 0.0 && d.dot(u) <= length && across <= 0.5 * width;
    });
  }

  std::vector<float> RangesAt(const Vector2d& p) {
    std::vector<float> ranges;
    const auto most = static_cast<double>(kPlaceMaxRangeM);
    for (int degree = 0; degree < 360; ++degree) {
      const double range = grid_.Cast(p, kTurn * degree / 360.0, most);
      const double noisy = std::clamp(range + kBeamSigmaM * random_.Gaussian(), 0.0, most);
      ranges.push_back(Chance(kLostBeams) ? kPlaceMaxRangeM : static_cast<float>(noisy));
    }
    return ranges;
  }

  Places CastAll() {
    Places places;
    const Vector2d max = grid_.max();
    for (double x = grid_.min().x(); x < max.x(); x += kPlaceCellM) {
      for (double y = grid_.min().y(); y < max.y(); y += kPlaceCellM) {
        const Vector2d p(x, y);
        if (grid_.LabelAt(p) == 0 || !grid_.IsClear(p)) continue;
        places.cells.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.0F);
        places.labels.push_back(grid_.LabelAt(p));
        places.ranges_m.push_back(RangesAt(p));
      }
    }
    return places;
  }

  const Building building_;
  Random random_;
  Grid grid_{{-1.0, -12.0}, {40.0, 12.0}};
};

}  // namespace

std::vector<std::string> PlaceClasses() { return {"room", "corridor", "lobby"}; }

Places ScanPlaces(std::uint64_t building, std::uint64_t seed) {
  return Wing(Building(building), seed).Scan();
}

}  // namespace strata::testing
