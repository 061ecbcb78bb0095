#include "tests/integration/marked_yard.h"

#include <array>
#include <cmath>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"

namespace strata::testing {
namespace {

// Between the sheds.
constexpr std::array<double, kYardRobots> kLanes = {-12.0, -10.0, -3.0, -1.5, 0.0, 2.0, 9.0, 12.0};
// Marks of a robot lie at one height, in rows.
constexpr double kLowestMark = 20.0;
constexpr double kMarkLift = 3.0;
constexpr double kMarkSpacing = 4.0;
constexpr int kMarksInRow = 11;
constexpr double kHalfMark = 0.25;
const Eigen::Vector2d kFirstMark(-17.0, -12.0);
constexpr double kCell = MlsParameters().cell_size_m;

Eigen::Vector2d CentreOf(const CellIndex& cell) {
  return {(cell.x + 0.5) * kCell, (cell.y + 0.5) * kCell};
}

int RobotOf(const ScanId& id) {
  int robot = 0;
  return absl::SimpleAtoi(id.trajectory.substr(5), &robot) ? robot : 0;
}

Eigen::Vector3d TrueMark(const ScanId& id) {
  const auto k = static_cast<int>(id.sequence) - 1;
  return {kFirstMark.x() + kMarkSpacing * (k % kMarksInRow),
          kFirstMark.y() + kMarkSpacing * (k / kMarksInRow),
          kLowestMark + kMarkLift * RobotOf(id)};
}

// The scan whose mark is nearest.
ScanId ScanMarkedAt(const Eigen::Vector2d& place, double z_m) {
  const Eigen::Vector2d steps = (place - kFirstMark) / kMarkSpacing;
  const auto column = static_cast<int>(std::lround(steps.x()));
  const auto row = static_cast<int>(std::lround(steps.y()));
  return YardScan(static_cast<int>(std::lround((z_m - kLowestMark) / kMarkLift)),
                  static_cast<std::uint64_t>(row * kMarksInRow + column + 1));
}

}  // namespace

ScanId YardScan(int robot, std::uint64_t sequence) {
  return {absl::StrCat("robot", robot), sequence};
}

Pose YardTruth(const ScanId& id) {
  constexpr int kStopsInLane = 22;
  Pose pose = Pose::Identity();
  pose.translation() =
      Eigen::Vector3d(-16.0 + 2.0 * static_cast<double>((id.sequence - 1) % kStopsInLane),
                      kLanes.at(static_cast<std::size_t>(RobotOf(id) - 1)),
                      1.2);
  return pose;
}

PointCloud SeeYard(const ScanId& id) {
  static const Scene* const yard = new Scene(YardScene());
  SensorOptions sensor;
  sensor.rings = 24;
  sensor.columns = 240;
  const Pose truth = YardTruth(id);
  const auto seed = 1000 * id.sequence + static_cast<std::uint64_t>(RobotOf(id));
  PointCloud cloud = SimulateScan(*yard, sensor, truth, seed);
  const Eigen::Vector3d mark = TrueMark(id);
  constexpr double kStep = 0.05;
  for (double x = -kHalfMark; x <= kHalfMark; x += kStep) {
    for (double y = -kHalfMark; y <= kHalfMark; y += kStep) {
      const Eigen::Vector3d point = truth.inverse() * (mark + Eigen::Vector3d(x, y, 0.0));
      cloud.points.push_back(point.cast<float>());
    }
  }
  return cloud;
}

void CollectMarks(const SurfaceTile& tile, std::map<ScanId, Mark>& marks) {
  for (const Surface& surface : tile.surfaces) {
    if (surface.z_m < kLowestMark) continue;
    const CellIndex cell = CellOf(tile.key, surface.cell);
    marks[ScanMarkedAt(CentreOf(cell), surface.z_m)][cell] = surface.z_m;
  }
}

std::string Misplaced(const ScanId& id, const Pose& T_map_scan, const Mark& mark) {
  const Pose correction = T_map_scan * YardTruth(id).inverse();
  const Eigen::Vector3d centre = correction * TrueMark(id);
  const Eigen::Vector3d normal = correction.linear().col(2);
  const double reach = kHalfMark * std::sqrt(2.0) + kCell;
  for (const auto& [cell, z] : mark) {
    const Eigen::Vector2d at = CentreOf(cell);
    const Eigen::Vector3d offset = Eigen::Vector3d(at.x(), at.y(), z) - centre;
    const double off = std::abs(normal.dot(offset));
    if (off <= 0.01 && offset.norm() <= reach) continue;
    return absl::StrFormat("%.3f m above or below, %.3f m from the centre", off, offset.norm());
  }
  // A quarter of the plate may fall into cells that it covers a little of.
  const double cells = 4.0 * kHalfMark * kHalfMark / (kCell * kCell);
  if (static_cast<double>(mark.size()) >= 0.75 * cells) return "";
  return absl::StrCat(mark.size(), " cells of about ", cells);
}

}  // namespace strata::testing
