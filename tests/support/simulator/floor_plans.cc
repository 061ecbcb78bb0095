#include "tests/support/simulator/floor_plans.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <Eigen/Geometry>

#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

using Eigen::Vector2d;

constexpr double kDoorReachM = 0.2;  // of a doorway's label beside its wall
constexpr double kWornCells = 0.05;  // wall cells beside open ones that are taken for open

// Painted over what was there: open, of a kind, or something that stands there.
struct Shape {
  Vector2d middle;
  Vector2d half;
  double turn_rad;
  std::optional<PlaceKind> kind;

  bool Contains(const Vector2d& p) const {
    const Vector2d d = Eigen::Rotation2Dd(-turn_rad) * (p - middle);
    return std::abs(d.x()) <= half.x() && std::abs(d.y()) <= half.y();
  }
};

// The storey before it is turned: the corridor along x from 0, its middle at y = 0.
class Plan {
 public:
  explicit Plan(std::uint64_t seed) : random_(seed) {
    half_m_ = 0.5 * In(1.5, 3.3);
    wall_m_ = In(0.1, 0.3);
    length_m_ = In(14.0, 34.0);
    room_m_ = In(2.6, 6.5);
    depth_m_ = In(3.2, 7.0);
    furniture_ = In(0.02, 0.3);
    Carve(PlaceKind::kCorridor, {0.0, -half_m_}, {length_m_, half_m_});
    for (const double side : {-1.0, 1.0}) AddSlots(side);
    if (Chance(0.5)) AddCrossing();
    if (Chance(0.5)) AddFireDoor();
    Furnish({0.0, -half_m_}, {length_m_, half_m_}, 0.03);
    for (const Shape& door : doors_) shapes_.push_back(door);
  }

  // Later ones lie above earlier ones.
  const std::vector<Shape>& shapes() const { return shapes_; }
  Random& random() { return random_; }

 private:
  double In(double low, double high) { return random_.Uniform(low, high); }
  bool Chance(double share) { return In(0.0, 1.0) < share; }

  void Carve(std::optional<PlaceKind> kind, const Vector2d& a, const Vector2d& b) {
    shapes_.push_back({0.5 * (a + b), 0.5 * (a - b).cwiseAbs(), 0.0, kind});
  }
  void Fill(const Vector2d& middle, const Vector2d& half, double turn_rad) {
    shapes_.push_back({middle, half, turn_rad, std::nullopt});
  }
  // Through a wall, from a to b. Nothing stands in it.
  void AddDoor(const Vector2d& a, const Vector2d& b) {
    doors_.push_back({0.5 * (a + b), 0.5 * (a - b).cwiseAbs(), 0.0, PlaceKind::kDoorway});
  }

  // What opens from the corridor on one side, one after the other.
  void AddSlots(double side) {
    double x = In(-1.0, 0.5);
    bool beside_room = false;
    while (x + 2.0 < length_m_) {
      if (Chance(0.12)) {  // a side corridor
        const double wide = In(1.5, 2.5);
        const double far = side * (half_m_ + In(4.0, 9.0));
        Carve(PlaceKind::kCorridor, {std::max(0.0, x), 0.0}, {std::max(0.0, x) + wide, far});
        x = std::max(0.0, x) + wide + wall_m_;
        beside_room = false;
        continue;
      }
      const double rooms = Chance(0.25) ? 2.0 : 1.0;
      const double width = std::max(2.0, room_m_ * rooms * In(0.8, 1.2));
      const double depth = depth_m_ * In(0.85, 1.2);
      AddRoom(x, x + width, side, depth);
      if (beside_room && Chance(0.2)) AddDoorBetween(x, side);
      beside_room = true;
      x += width + wall_m_;
    }
  }

  void AddRoom(double left, double right, double side, double depth) {
    const double near = side * (half_m_ + wall_m_);
    const double far = side * (half_m_ + wall_m_ + depth);
    Carve(PlaceKind::kRoom, {left, near}, {right, far});
    const double pieces = furniture_ * In(0.5, 1.5);
    Furnish({left, near}, {right, far}, pieces);
    if (Chance(0.15)) return;  // the door is shut: no floor of ours
    const double door = Chance(0.15) ? In(1.1, 1.4) : In(0.8, 1.05);
    const double low = std::max(left, 0.0) + 0.1;
    const double high = std::min(right, length_m_) - 0.1 - door;
    if (high <= low) return;
    const double x = In(low, high);
    AddDoor({x, side * (half_m_ - kDoorReachM)},
            {x + door, side * (half_m_ + wall_m_ + kDoorReachM)});
    if (!Chance(0.6)) return;
    // Its leaf stands open into the room.
    const double swing = In(1.2, 2.2);
    const Vector2d leaf(std::cos(swing), side * std::sin(swing));
    Fill(Vector2d(x, near) + 0.5 * door * leaf, {0.5 * door, 0.03}, side * swing);
  }

  // In the wall that ends at x.
  void AddDoorBetween(double x, double side) {
    const double y = side * (half_m_ + wall_m_ + In(1.0, 2.0));
    const double door = In(0.8, 1.05);
    AddDoor({x - wall_m_ - kDoorReachM, y}, {x + kDoorReachM, y + side * door});
  }

  // At the corridor's end, with or without a door between.
  void AddCrossing() {
    const double wide = In(1.5, 3.3);
    const bool door = Chance(0.5);
    const double x = length_m_ + (door ? wall_m_ : 0.0);
    const double low = -half_m_ - In(2.0, 9.0);
    const double high = half_m_ + In(2.0, 9.0);
    Carve(PlaceKind::kCorridor, {x, low}, {x + wide, high});
    const double half = 0.5 * In(0.8, 1.4);
    if (door) AddDoor({length_m_ - kDoorReachM, -half}, {x + kDoorReachM, half});
  }

  void AddFireDoor() {
    const double x = In(0.3, 0.7) * length_m_;
    const double door = In(0.85, 1.6);
    const double half = 0.5 * std::min(2.0 * half_m_ - 0.2, door);
    Fill({x, 0.0}, {0.08, half_m_}, 0.0);
    AddDoor({x - 0.08 - kDoorReachM, -half}, {x + 0.08 + kDoorReachM, half});
  }

  // So many pieces a square metre; people are fewer.
  void Furnish(const Vector2d& a, const Vector2d& b, double pieces) {
    const Eigen::AlignedBox2d area(a.cwiseMin(b), a.cwiseMax(b));
    const double count = pieces * area.volume();
    for (double k = In(0.0, 1.0); k < count; k += 1.0) AddPiece(area);
    for (double k = In(0.0, 1.0); k < 0.2 * count; k += 1.0) {
      Fill(Somewhere(area), {0.15, 0.15}, 0.0);
    }
  }

  void AddPiece(const Eigen::AlignedBox2d& area) {
    Vector2d at = Somewhere(area);
    const double kind = In(0.0, 1.0);
    if (kind < 0.55) {  // along a wall
      const double deep = In(0.15, 0.3);
      const double wide = In(0.3, 0.9);
      at.y() = Chance(0.5) ? area.min().y() + deep : area.max().y() - deep;
      Fill(at, {wide, deep}, 0.0);
    } else if (kind < 0.8) {  // a table
      const double wide = In(0.4, 0.9);
      const double deep = In(0.3, 0.5);
      const double turn = In(0.0, std::numbers::pi);
      Fill(at, {wide, deep}, turn);
    } else {
      const double half = In(0.08, 0.25);
      const double turn = In(0.0, 0.5 * std::numbers::pi);
      Fill(at, {half, half}, turn);
    }
  }

  Vector2d Somewhere(const Eigen::AlignedBox2d& area) {
    const double x = In(area.min().x(), area.max().x());
    const double y = In(area.min().y(), area.max().y());
    return {x, y};
  }

  Random random_;
  double half_m_, wall_m_, length_m_, room_m_, depth_m_, furniture_;
  std::vector<Shape> shapes_;
  std::vector<Shape> doors_;
};

// A storey's cells around the origin.
class Raster {
 public:
  Raster(double cell_m, int half) : cell_m_(cell_m), half_(half) {
    open_.assign(size() * size(), 0);
    kind_.assign(size() * size(), PlaceKind::kRoom);
  }

  void Paint(const std::vector<Shape>& shapes, double turn_rad, const Vector2d& middle) {
    for (int y = -half_; y < half_; ++y) {
      for (int x = -half_; x < half_; ++x) {
        const Vector2d p =
            middle + Eigen::Rotation2Dd(turn_rad) * (cell_m_ * Vector2d(x + 0.5, y + 0.5));
        const auto top = std::find_if(
            shapes.rbegin(), shapes.rend(), [&p](const Shape& s) { return s.Contains(p); });
        if (top == shapes.rend() || !top->kind.has_value()) continue;
        open_[At(x, y)] = 1;
        kind_[At(x, y)] = *top->kind;
      }
    }
  }
  void Wear(Random& random) {
    const std::vector<std::uint8_t> before = open_;
    for (int y = -half_ + 1; y < half_ - 1; ++y) {
      for (int x = -half_ + 1; x < half_ - 1; ++x) {
        if (before[At(x, y)] != 0 || random.Uniform(0.0, 1.0) >= kWornCells) continue;
        open_[At(x, y)] = before[At(x - 1, y)] | before[At(x + 1, y)];
      }
    }
  }

  DrawnFloor Floor(double radius_m) const {
    DrawnFloor floor;
    floor.cell_size_m = cell_m_;
    for (int by = -half_ / kFloorBlockCells; by < half_ / kFloorBlockCells; ++by) {
      for (int bx = -half_ / kFloorBlockCells; bx < half_ / kFloorBlockCells; ++bx) {
        const FloorBlock block = Block(bx, by, radius_m, floor);
        if ((block.free | block.ground | block.occupied) != 0) floor.blocks.push_back(block);
      }
    }
    return floor;
  }

 private:
  std::size_t size() const { return 2 * static_cast<std::size_t>(half_); }
  std::size_t At(int x, int y) const {
    return static_cast<std::size_t>(y + half_) * size() + static_cast<std::size_t>(x + half_);
  }
  bool IsOpen(int x, int y) const {
    return std::min(x, y) >= -half_ && std::max(x, y) < half_ && open_[At(x, y)] != 0;
  }
  // Whether a cell within so many around is open, or all of them are.
  bool AnyOpen(int x, int y, double cells) const { return Look(x, y, cells, true); }
  bool AllOpen(int x, int y, double cells) const { return !Look(x, y, cells, false); }
  bool Look(int x, int y, double cells, bool open) const {
    const int reach = static_cast<int>(cells);
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        if (std::hypot(dx, dy) <= cells && IsOpen(x + dx, y + dy) == open) return true;
      }
    }
    return false;
  }

  FloorBlock Block(int bx, int by, double radius_m, DrawnFloor& floor) const {
    FloorBlock block = {bx, by, 0, 0, 0};
    for (int cell = 0; cell < kFloorBlockCells * kFloorBlockCells; ++cell) {
      const int x = bx * kFloorBlockCells + cell % kFloorBlockCells;
      const int y = by * kFloorBlockCells + cell / kFloorBlockCells;
      const std::uint64_t bit = std::uint64_t{1} << cell;
      if (!IsOpen(x, y)) {
        if (AnyOpen(x, y, 2.0)) block.occupied |= bit;
      } else if (AllOpen(x, y, radius_m / cell_m_)) {
        block.free |= bit;
        floor.kinds[{x, y}] = kind_[At(x, y)];
      } else {
        block.ground |= bit;
      }
    }
    return block;
  }

  double cell_m_;
  int half_;
  std::vector<std::uint8_t> open_;
  std::vector<PlaceKind> kind_;
};

}  // namespace

std::optional<PlaceKind> DrawnFloor::KindAt(std::int32_t x, std::int32_t y) const {
  const auto found = kinds.find({x, y});
  return found == kinds.end() ? std::nullopt : std::optional(found->second);
}

DrawnFloor DrawFloor(double cell_size_m, std::uint64_t seed) {
  Plan plan(seed);
  const double turn = plan.random().Uniform(0.0, 2.0 * std::numbers::pi);
  const double radius_m = plan.random().Uniform(0.2, 0.35);
  Eigen::AlignedBox2d box;
  for (const Shape& shape : plan.shapes()) {
    if (!shape.kind.has_value()) continue;
    box.extend(shape.middle - shape.half);
    box.extend(shape.middle + shape.half);
  }
  const int half = static_cast<int>(std::ceil((0.5 * box.diagonal().norm() + 0.5) / cell_size_m));
  Raster raster(cell_size_m, (half / kFloorBlockCells + 1) * kFloorBlockCells);
  raster.Paint(plan.shapes(), turn, box.center());
  raster.Wear(plan.random());
  return raster.Floor(radius_m);
}

}  // namespace strata::testing
