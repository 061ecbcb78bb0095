#include "tests/bench/planes/plane_cases.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>

#include "core/geometry/pose.h"
#include "core/planes/models/plane_raster.h"
#include "core/planes/moments.h"
#include "core/world/plane_model.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"

namespace strata::bench {
namespace {

namespace bg = boost::geometry;
using FlatPoint = bg::model::d2::point_xy<double>;
using BoostPolygon = bg::model::polygon<FlatPoint, /*ClockWise=*/false, /*Closed=*/false>;

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kMostAngleDeg = 10.0;
constexpr double kClutterShare = 0.03;
constexpr double kBandM = 0.1, kBandSigmas = 3.0;  // of the product's polygons

double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return kDegrees * std::acos(std::min(1.0, std::abs(a.dot(b))));
}

// The planes through the points of each number, and numbers without gaps; those with fewer than
// min_points are kUnknown. The former numbers.
std::vector<int> NumberPlanes(PlaneCase& out) {
  std::map<int, std::pair<Eigen::Matrix4d, std::size_t>> sums;
  for (std::size_t i = 0; i < out.truth.size(); ++i) {
    if (out.truth[i] < 0) continue;
    const auto [sum, is_new] =
        sums.try_emplace(out.truth[i], Eigen::Matrix4d(Eigen::Matrix4d::Zero()), 0);
    sum->second.first +=
        MomentsOf(1.0, out.points.points[i].cast<double>(), Eigen::Matrix3d::Zero());
    ++sum->second.second;
  }
  std::map<int, int> number_of;
  std::vector<int> former;
  for (const auto& [old, sum] : sums) {
    if (sum.second < out.min_points) continue;
    former.push_back(old);
    number_of[old] = static_cast<int>(out.planes.size());
    out.planes.push_back(FitMoments(sum.first).plane);
    out.support.push_back(sum.second);
  }
  for (int& number : out.truth) {
    if (number < 0) continue;
    const auto found = number_of.find(number);
    number = found == number_of.end() ? PlaneCase::kUnknown : found->second;
  }
  return former;
}

// Of all faces of solids; those in one plane are one.
class Faces {
 public:
  explicit Faces(const std::vector<testing::Solid>& solids)
      : solids_(solids), numbers_(solids.size()) {
    for (std::size_t s = 0; s < solids.size(); ++s) {
      for (const testing::Solid::Face& face : solids[s].faces)
        numbers_[s].push_back(NumberOf(face));
    }
  }

  // Of a point on solid `s`: the nearest of those that can be seen from `sensor`.
  int At(std::size_t s, const Eigen::Vector3d& p, const Eigen::Vector3d& sensor) const {
    const auto& faces = solids_[s].faces;
    double least = 1e9;
    int nearest = PlaneCase::kUnknown;
    for (std::size_t f = 0; f < faces.size(); ++f) {
      const double off = std::abs(faces[f].normal.dot(p) - faces[f].offset);
      if (faces[f].normal.dot(sensor) <= faces[f].offset || off >= least) continue;
      least = off;
      nearest = numbers_[s][f];
    }
    return nearest;
  }
  Plane PlaneOf(int number) const {
    const testing::Solid::Face& face = known_[static_cast<std::size_t>(number)];
    return {face.normal, face.offset};
  }

 private:
  int NumberOf(const testing::Solid::Face& face) {
    for (std::size_t i = 0; i < known_.size(); ++i) {
      if ((known_[i].normal - face.normal).norm() < 1e-6 &&
          std::abs(known_[i].offset - face.offset) < 1e-6) {
        return static_cast<int>(i);
      }
    }
    known_.push_back(face);
    return static_cast<int>(known_.size()) - 1;
  }

  const std::vector<testing::Solid> solids_;
  std::vector<std::vector<int>> numbers_;
  std::vector<testing::Solid::Face> known_;
};

// Those of found planes that belong to true ones.
struct Belonging {
  int to = PlaneCase::kClutter;
  std::size_t right = 0, counted = 0;
  double angle_deg = 90.0;
};

Belonging BelongingOf(const PlaneCase& truth, const FoundPlane& found) {
  std::map<int, std::size_t> counts;
  Belonging out;
  for (const std::uint32_t i : found.points) {
    if (truth.truth[i] == PlaneCase::kUnknown) continue;
    ++out.counted;
    ++counts[truth.truth[i]];
  }
  for (const auto& [number, count] : counts) {
    if (number < 0 || count <= out.right) continue;
    out.to = number;
    out.right = count;
  }
  if (out.to < 0) return out;
  out.angle_deg =
      AngleDeg(found.plane.normal, truth.planes[static_cast<std::size_t>(out.to)].normal);
  if (out.angle_deg <= kMostAngleDeg) return out;
  return {PlaneCase::kClutter, 0, out.counted, out.angle_deg};
}

void SortBySize(FoundPlanes& found) {
  std::stable_sort(found.begin(), found.end(), [](const FoundPlane& a, const FoundPlane& b) {
    return a.points.size() > b.points.size();
  });
}

// Adds found planes one by one.
class Counts {
 public:
  explicit Counts(const PlaneCase& truth)
      : truth_(truth), right_(truth.planes.size(), 0), angle_deg_(truth.planes.size(), -1.0) {}

  void Add(const FoundPlane& found) {
    const Belonging belonging = BelongingOf(truth_, found);
    all_ += belonging.counted;
    if (belonging.to < 0) return;
    const auto to = static_cast<std::size_t>(belonging.to);
    right_[to] += belonging.right;
    sum_ += belonging.right;
    if (angle_deg_[to] < 0.0) angle_deg_[to] = belonging.angle_deg;  // the first is the largest
  }
  double Precision() const {
    return all_ == 0 ? 1.0 : static_cast<double>(sum_) / static_cast<double>(all_);
  }
  double Recall() const {
    double sum = 0.0;
    for (std::size_t t = 0; t < right_.size(); ++t) {
      sum += static_cast<double>(right_[t]) / static_cast<double>(truth_.support[t]);
    }
    return sum / static_cast<double>(right_.size());
  }
  double MedianDeg() const {
    std::vector<double> angles;
    for (const double angle : angle_deg_) {
      if (angle >= 0.0) angles.push_back(angle);
    }
    if (angles.empty()) return 90.0;
    std::sort(angles.begin(), angles.end());
    return angles[angles.size() / 2];
  }

 private:
  const PlaneCase& truth_;
  std::vector<std::size_t> right_;
  std::vector<double> angle_deg_;
  std::size_t sum_ = 0, all_ = 0;
};

struct FlatPiece {
  BoostPolygon shape;
  bg::model::box<FlatPoint> box;
};

std::vector<FlatPiece> PiecesOf(const ModelPlane& plane, const PlaneFrame& frame, double reach_m) {
  const auto flat = [&frame](const Eigen::Vector3d& p) {
    const Eigen::Vector2d at = frame.Flat(p);
    return FlatPoint(at.x(), at.y());
  };
  std::vector<FlatPiece> pieces;
  for (const PlanePolygon& polygon : plane.polygons) {
    FlatPiece piece;
    for (const Eigen::Vector3d& p : polygon.outer) piece.shape.outer().push_back(flat(p));
    for (const PlaneHole& hole : polygon.holes) {
      piece.shape.inners().emplace_back();
      for (const Eigen::Vector3d& p : hole.ring) piece.shape.inners().back().push_back(flat(p));
    }
    bg::correct(piece.shape);
    bg::envelope(piece.shape, piece.box);
    bg::model::box<FlatPoint> wide;
    bg::buffer(piece.box, wide, reach_m);
    piece.box = wide;
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

}  // namespace

PlaneCase DrawnRooms(std::uint64_t seed, int stands) {
  const testing::World world = testing::RoomsWorld(0.1, seed);
  testing::Scene scene;
  for (std::size_t s = 0; s < world.scene.solids().size(); ++s) {
    scene.Add(testing::Labelled(world.scene.solids()[s], static_cast<std::uint16_t>(s + 1)));
  }
  const Faces faces(scene.solids());  // building changes their order
  scene.Build();
  testing::SensorOptions sensor;
  sensor.min_range_m = 0.3;
  sensor.labelled = true;
  const std::vector<Pose> way = testing::Drive(scene, world.robots.front().waypoints, 0.5, 1.2);
  PlaneCase out;
  out.name = "drawn rooms, seed " + std::to_string(seed);
  out.near_m = 0.04;
  out.min_points = 50;
  out.min_area_m2 = 0.1;
  testing::Random random(seed + 1000);
  for (int i = 0; i < stands; ++i) {
    const Pose& T =
        way[way.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(stands)];
    const PointCloud scan =
        testing::SimulateScan(scene, sensor, T, seed + 100 + static_cast<std::uint64_t>(i));
    for (std::size_t k = 0; k < scan.points.size(); ++k) {
      const double lot = random.Uniform(0.0, 1.0);
      const double shorter = random.Uniform(0.3, 0.95);
      const bool clutter = lot < kClutterShare;
      const Eigen::Vector3d p = T * scan.points[k].cast<double>();
      const Eigen::Vector3d at =
          T.translation() + (clutter ? shorter : 1.0) * (p - T.translation());
      out.points.points.push_back(at.cast<float>());
      out.truth.push_back(clutter ? PlaneCase::kClutter
                                  : faces.At(scan.label[k] - 1U, p, T.translation()));
    }
    out.points.views.push_back({T.translation().cast<float>(), out.points.points.size()});
  }
  const std::vector<int> numbers = NumberPlanes(out);
  for (std::size_t t = 0; t < numbers.size(); ++t) out.planes[t] = faces.PlaneOf(numbers[t]);
  return out;
}

PlaneCase RecordedBuilding(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::size_t count = 0;
  while (std::getline(in, line) && line != "end_header") {
    if (line.rfind("element vertex ", 0) == 0) count = std::stoul(line.substr(15));
  }
  PlaneCase out;
  out.name = "recorded building";
  out.near_m = 0.1;
  out.min_points = 15;  // the smallest segment has 18
  out.min_area_m2 = 0.1;
  for (; count > 0; --count) {
    Eigen::Vector3f p, normal;
    int segment = PlaneCase::kUnknown;
    in >> p.x() >> p.y() >> p.z() >> normal.x() >> normal.y() >> normal.z() >> segment;
    out.points.points.push_back(p);
    out.truth.push_back(segment < 0 ? PlaneCase::kUnknown : segment);
  }
  // Nobody says where the sensor stood; none was inside.
  out.points.views = {{Eigen::Vector3f(100.0F, 100.0F, 10.0F), out.points.points.size()}};
  NumberPlanes(out);
  return out;
}

PlaneScore ScoreOf(const PlaneCase& truth, FoundPlanes found) {
  SortBySize(found);
  Counts counts(truth);
  for (const FoundPlane& plane : found) counts.Add(plane);
  return {found.size(), counts.Precision(), counts.Recall(), counts.MedianDeg()};
}

double RecallAt(const PlaneCase& truth, FoundPlanes found, double precision) {
  SortBySize(found);
  Counts counts(truth);
  double best = 0.0;
  for (const FoundPlane& plane : found) {
    counts.Add(plane);
    if (counts.Precision() >= precision) best = std::max(best, counts.Recall());
  }
  return best;
}

FoundPlanes PointsOn(const PlaneModel& model, const PosedPoints& points, double epsilon_m) {
  FoundPlanes found(model.planes.size());
  std::vector<double> nearest(points.points.size(), 1e9);
  std::vector<int> of(points.points.size(), -1);
  for (std::size_t m = 0; m < model.planes.size(); ++m) {
    const ModelPlane& plane = model.planes[m];
    found[m].plane = {plane.plane.normal,
                      plane.plane.distance - plane.plane.normal.dot(points.origin)};
    if (plane.polygons.empty()) continue;
    const PlaneFrame frame = FrameOf(plane.plane, plane.polygons.front().outer.front());
    const std::vector<FlatPiece> pieces = PiecesOf(plane, frame, epsilon_m / 2.0);
    const double band = std::max(kBandM, kBandSigmas * plane.rms_m);
    for (std::size_t i = 0; i < points.points.size(); ++i) {
      const Eigen::Vector3d p = points.points[i].cast<double>();
      const double off = Distance(p, found[m].plane);
      if (off > band || off >= nearest[i]) continue;
      const Eigen::Vector2d flat = frame.Flat(points.origin + p);
      const FlatPoint at(flat.x(), flat.y());
      const bool on = std::any_of(pieces.begin(), pieces.end(), [&](const FlatPiece& piece) {
        return bg::covered_by(at, piece.box) && bg::distance(at, piece.shape) <= epsilon_m / 2.0;
      });
      if (!on) continue;
      nearest[i] = off;
      of[i] = static_cast<int>(m);
    }
  }
  for (std::uint32_t i = 0; i < of.size(); ++i) {
    if (of[i] >= 0) found[static_cast<std::size_t>(of[i])].points.push_back(i);
  }
  return found;
}

}  // namespace strata::bench
