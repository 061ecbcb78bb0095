#include "core/planes/models/plane_model_finder.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/hash_map.h"
#include "core/common/option_checks.h"
#include "core/common/status.h"
#include "core/common/stop.h"
#include "core/planes/models/doubled_planes.h"
#include "core/planes/models/joined_planes.h"
#include "core/planes/models/plane_colour.h"
#include "core/planes/models/plane_mixture.h"
#include "core/planes/models/plane_polygons.h"
#include "core/planes/models/plane_raster.h"
#include "core/planes/models/square_planes.h"
#include "core/planes/moments.h"

namespace strata {
namespace {

constexpr double kSquaresInEpsilon = 4.0;  // 5.4.2: points are thinned to ε/4
constexpr double kBandM = 0.1;             // 5.4.2: how near a plane its points are, at least
constexpr double kBandSigmas = 3.0;
constexpr double kHitSigmaM = 0.02;         // of a point about its plane, against colours
constexpr double kOnePlaceCosine = 0.99;    // of planes that may be in one place
constexpr std::uint32_t kMajority = 2;      // so many times the hits
constexpr double kBeyondM = 0.3;            // that a ray has to go on behind a plane it crossed
constexpr std::size_t kMostRays = 1000000;  // of a square; of more, every so many
constexpr double kReachM = 20.0;            // beyond a square, of planes that its rays may cross
constexpr std::size_t kStopEvery = 8192;

bool Holds(const PlanSquare& square, const Eigen::Vector3d& p) {
  return (p.head<2>().array() >= square.min().array()).all() &&
         (p.head<2>().array() < square.max().array()).all();
}

// The planes that rays may cross, in columns, so that a ray is held against several at once.
class RayPlanes {
 public:
  explicit RayPlanes(std::vector<FacedPlane*> planes)
      : planes_(std::move(planes)),
        normals_(std::ssize(planes_), 3),
        distances_(std::ssize(planes_)) {
    for (Eigen::Index m = 0; m < distances_.size(); ++m) {
      const Plane& plane = planes_[static_cast<std::size_t>(m)]->seen.plane;
      normals_.row(m) = plane.normal.transpose();
      distances_(m) = plane.distance;
    }
  }

  void SetSensor(const Eigen::Vector3d& sensor) {
    sensor_ = sensor;
    from_ = DistancesOf(sensor);
  }

  void AddRay(const Eigen::Vector3d& p) {
    to_ = DistancesOf(p);
    for (Eigen::Index m = 0; m < to_.size(); ++m) {
      if (from_(m) * to_(m) >= 0.0) continue;
      FacedPlane& plane = *planes_[static_cast<std::size_t>(m)];
      if (std::abs(to_(m)) < std::max(kBeyondM, plane.band_m)) continue;
      const Eigen::Vector3d at = sensor_ + from_(m) / (from_(m) - to_(m)) * (p - sensor_);
      if (plane.seen.box.contains(at)) plane.seen.raster.AddLook(plane.seen.frame.Flat(at));
    }
  }

 private:
  Eigen::ArrayXd DistancesOf(const Eigen::Vector3d& p) const {
    return normals_.col(0) * p.x() + normals_.col(1) * p.y() + normals_.col(2) * p.z() - distances_;
  }

  std::vector<FacedPlane*> planes_;
  Eigen::ArrayX3d normals_;
  Eigen::ArrayXd distances_;
  Eigen::Vector3d sensor_ = Eigen::Vector3d::Zero();
  Eigen::ArrayXd from_, to_;  // of sensor and point, signed
};

void Flip(PlanePolygon& polygon) {
  std::reverse(polygon.outer.begin(), polygon.outer.end());
  for (PlaneHole& hole : polygon.holes) std::reverse(hole.ring.begin(), hole.ring.end());
}

}  // namespace

absl::Status PlaneModelOptions::Validate() const {
  OptionChecks checks("plane model");
  checks.InRange("rho_m", rho_m, 0.0, 1.0);
  checks.InRange("sigma_rad", sigma_rad, 0.001, 0.5);
  checks.InRange("max_planes", max_planes, 1, 10000);
  checks.InRange("cell_size_m", cell_size_m, 0.2, 20.0);
  checks.InRange("min_area_m2", min_area_m2, 0.01, 10000.0);
  checks.InRange("epsilon_m", epsilon_m, 0.05, 5.0);
  return checks.status();
}

struct PlaneModelFinder::State {
  PlaneModelOptions options;
  bool has_reference = false;
  Eigen::Vector3d reference = Eigen::Vector3d::Zero();  // of all that is inside
  std::vector<std::vector<SquarePlane>> squares;
  JoinedPlanes joined;
  std::vector<FacedPlane> faced;  // as joined.planes
  HashMap<Voxel, std::vector<std::uint32_t>> near;

  // `colour`: where colours count.
  void AddHit(const Eigen::Vector3d& p, const LabColour& colour, const Eigen::Vector3d& sensor);
  // The planes that rays to points in the square may cross.
  std::vector<FacedPlane*> PlanesAround(const PlanSquare& square);
  void BeginLooking();
  // Planes that are no surface of their own go into those that are.
  absl::Status MergeDoubled(const Stop& stop);
  // Points whose colour is another plane's lie among those of their own: reflections, and noise. Of
  // planes in one place each keeps where it has most.
  void DropMinorities();
  // RESOURCE_EXHAUSTED where what is known of the planes' surfaces takes more than it may.
  absl::Status CheckMemory() const;
};

PlaneModelFinder::PlaneModelFinder(const PlaneModelOptions& options)
    : state_(std::make_unique<State>()) {
  state_->options = options;
}

PlaneModelFinder::~PlaneModelFinder() = default;

absl::Status PlaneModelFinder::FindPlanes(const PosedPoints& points,
                                          const PlanSquare& square,
                                          const Stop& stop) {
  const std::size_t colours = state_->options.colour ? points.points.size() : 0;
  if (points.colour.size() != colours) {
    return absl::InvalidArgumentError(
        absl::StrCat(points.colour.size(), " colours of points where ", colours, " are needed"));
  }
  if (!state_->has_reference) state_->reference = points.origin;
  state_->has_reference = true;
  STRATA_ASSIGN_OR_RETURN(
      std::vector<SquarePlane> planes,
      FindSquarePlanes(points, square, state_->reference, state_->options, stop));
  state_->squares.push_back(std::move(planes));
  return absl::OkStatus();
}

absl::Status PlaneModelFinder::JoinPlanes(const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(state_->joined, JoinSquares(state_->squares, state_->options, stop));
  state_->squares.clear();
  state_->BeginLooking();
  return absl::OkStatus();
}

void PlaneModelFinder::State::BeginLooking() {
  const double square = options.epsilon_m / kSquaresInEpsilon;
  faced.reserve(joined.planes.size());
  for (std::uint32_t m = 0; m < joined.planes.size(); ++m) {
    const JoinedPlane& plane = joined.planes[m];
    const PlaneFrame frame = FrameOf(plane.model.plane, FitMoments(plane.sum.moments).mean);
    FacedPlane one{{plane.model.plane, frame, PlaneRaster(square, 2.0 * square), {}},
                   plane.sum.colour,
                   std::max({kBandM, kBandSigmas * options.rho_m, kBandSigmas * plane.model.rms_m}),
                   0,
                   plane.sum.moments};
    for (const Voxel voxel : plane.sum.voxels) {
      one.seen.box.extend(BoxOf(voxel));
      for (const Voxel around : VoxelsAround(voxel)) {
        std::vector<std::uint32_t>& list = near[around];
        if (list.empty() || list.back() != m) list.push_back(m);
      }
    }
    faced.push_back(std::move(one));
  }
}

std::vector<FacedPlane*> PlaneModelFinder::State::PlanesAround(const PlanSquare& square) {
  const Eigen::Vector2d reach(kReachM, kReachM);
  const PlanSquare around(square.min() - reach, square.max() + reach);
  std::vector<FacedPlane*> planes;
  for (FacedPlane& one : faced) {
    const PlanSquare plan(one.seen.box.min().head<2>(), one.seen.box.max().head<2>());
    if (around.intersects(plan)) planes.push_back(&one);
  }
  return planes;
}

void PlaneModelFinder::State::AddHit(const Eigen::Vector3d& p,
                                     const LabColour& colour,
                                     const Eigen::Vector3d& sensor) {
  const auto found = near.find(VoxelOf(p));
  if (found == near.end()) return;
  FacedPlane* nearest = nullptr;
  double least = 1e9;
  for (const std::uint32_t m : found->second) {
    const double off = std::abs(SignedDistance(p, faced[m].seen.plane));
    if (off > faced[m].band_m) continue;
    // −ln of the likelihood but for what is the same of all (5.24).
    const double misfit = 0.5 * off * off / (kHitSigmaM * kHitSigmaM) -
                          ColourLog((colour - faced[m].colour).squaredNorm());
    if (misfit >= least) continue;
    least = misfit;
    nearest = &faced[m];
  }
  if (nearest == nullptr) return;
  nearest->seen.raster.AddHit(nearest->seen.frame.Flat(p));
  nearest->facing += SignedDistance(sensor, nearest->seen.plane) > 0.0 ? 1 : -1;
}

void PlaneModelFinder::State::DropMinorities() {
  for (FacedPlane& one : faced) {
    for (const FacedPlane& other : faced) {
      if (&one == &other || !one.seen.box.intersects(other.seen.box) ||
          std::abs(one.seen.plane.normal.dot(other.seen.plane.normal)) < kOnePlaceCosine) {
        continue;
      }
      const PlaneFrame &own = one.seen.frame, &others = other.seen.frame;
      one.seen.raster.DropHits([&](const Eigen::Vector2d& middle) {
        const Eigen::Vector3d at = own.Lift(middle);
        if (std::abs(SignedDistance(at, other.seen.plane)) > one.band_m) return false;
        return other.seen.raster.HitsAround(others.Flat(at), 1) >
               kMajority * one.seen.raster.HitsAround(middle, 1);
      });
    }
  }
}

absl::Status PlaneModelFinder::State::CheckMemory() const {
  std::size_t bytes = 0;
  for (const FacedPlane& one : faced) bytes += one.seen.raster.bytes();
  if (bytes <= options.max_outline_bytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("outlines of ",
                                                   faced.size(),
                                                   " planes take more than ",
                                                   options.max_outline_bytes >> 20,
                                                   " MiB; a larger epsilon_m (it is ",
                                                   options.epsilon_m,
                                                   ") or min_area_m2 takes less"));
}

absl::Status PlaneModelFinder::Look(const PosedPoints& points,
                                    const PlanSquare& square,
                                    const Stop& stop) {
  const Eigen::Vector3d shift = points.origin - state_->reference;
  const PlanSquare own(square.min() - state_->reference.head<2>(),
                       square.max() - state_->reference.head<2>());
  const std::size_t every = points.points.size() / kMostRays + 1;
  RayPlanes planes(state_->PlanesAround(own));
  const bool coloured = !points.colour.empty();
  std::size_t i = 0;
  for (const PosedPoints::View& view : points.views) {
    const Eigen::Vector3d sensor = view.sensor.cast<double>() + shift;
    planes.SetSensor(sensor);
    for (; i < view.end; ++i) {
      if (i % kStopEvery == 0) {
        STRATA_RETURN_IF_ERROR(stop.status());
        STRATA_RETURN_IF_ERROR(state_->CheckMemory());
      }
      const Eigen::Vector3d p = points.points[i].cast<double>() + shift;
      if (!Holds(own, p)) continue;
      state_->AddHit(p, coloured ? LabOf(points.colour[i]) : LabColour(0, 0, 0), sensor);
      if (i % every == 0) planes.AddRay(p);
    }
  }
  return absl::OkStatus();
}

absl::Status PlaneModelFinder::State::MergeDoubled(const Stop& stop) {
  const std::vector<std::size_t> owners = OwnersOf(faced);
  std::vector<FacedPlane> left;
  left.reserve(owners.size());  // to move one would be to copy it
  for (std::size_t m = 0; m < owners.size(); ++m) {
    if (owners[m] != m) AddSeen(faced[m], faced[owners[m]]);
  }
  for (std::size_t m = 0; m < owners.size(); ++m) {
    if (owners[m] == m) left.push_back(std::move(faced[m]));
  }
  const bool any = left.size() < owners.size();
  faced = std::move(left);
  if (!any) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(joined, WithOwned(std::move(joined), owners, options, stop));
  for (std::size_t m = 0; m < faced.size(); ++m) {
    // By less than its noise: what was seen stays where it is in the plane.
    SeenPlane& seen = faced[m].seen;
    Plane& plane = joined.planes[m].model.plane;
    if (plane.normal.dot(seen.plane.normal) < 0.0) plane = {-plane.normal, -plane.distance};
    seen.plane = plane;
    seen.frame = TurnedInto(plane, seen.frame);
  }
  return absl::OkStatus();
}

absl::StatusOr<PlaneModel> PlaneModelFinder::Finish(const Stop& stop) {
  STRATA_RETURN_IF_ERROR(state_->MergeDoubled(stop));
  if (state_->options.colour) state_->DropMinorities();
  std::vector<SeenPlane> seen;
  seen.reserve(state_->faced.size());
  for (FacedPlane& one : state_->faced) seen.push_back(std::move(one.seen));
  const PolygonOptions options{state_->options.epsilon_m, state_->options.min_area_m2};
  PlaneModel model;
  model.directions = state_->joined.directions;
  for (std::size_t m = 0; m < seen.size(); ++m) {
    STRATA_RETURN_IF_ERROR(stop.status());
    ModelPlane plane = state_->joined.planes[m].model;
    plane.polygons = PolygonsOf(seen, m, options);
    double area_m2 = 0.0;
    for (const PlanePolygon& polygon : plane.polygons) area_m2 += polygon.area_m2;
    // A surface on the border of two layers of cells was measured in both.
    if (area_m2 > 0.0) plane.area_m2 = area_m2;
    if (state_->faced[m].facing < 0) {
      plane.plane = {-plane.plane.normal, -plane.plane.distance};
      for (PlanePolygon& polygon : plane.polygons) Flip(polygon);
    }
    plane.plane.distance += plane.plane.normal.dot(state_->reference);
    for (PlanePolygon& polygon : plane.polygons) {
      for (Eigen::Vector3d& p : polygon.outer) p += state_->reference;
      for (PlaneHole& hole : polygon.holes) {
        for (Eigen::Vector3d& p : hole.ring) p += state_->reference;
      }
    }
    model.planes.push_back(std::move(plane));
  }
  std::stable_sort(model.planes.begin(), model.planes.end(), [](const auto& a, const auto& b) {
    return a.area_m2 > b.area_m2;
  });
  for (std::size_t m = 0; m < model.planes.size(); ++m) model.planes[m].id = m + 1;
  return model;
}

absl::StatusOr<PlaneModel> FindPlaneModel(const PosedPoints& points,
                                          const PlaneModelOptions& options,
                                          const Stop& stop) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  const PlanSquare everything(points.origin.head<2>().array() - 1e4,
                              points.origin.head<2>().array() + 1e4);
  PlaneModelFinder finder(options);
  STRATA_RETURN_IF_ERROR(finder.FindPlanes(points, everything, stop));
  STRATA_RETURN_IF_ERROR(finder.JoinPlanes(stop));
  STRATA_RETURN_IF_ERROR(finder.Look(points, everything, stop));
  return finder.Finish(stop);
}

}  // namespace strata
