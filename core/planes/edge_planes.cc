#include "core/planes/edge_planes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/common/random.h"
#include "core/geometry/plane_fit.h"
#include "core/geometry/primitives.h"
#include "core/planes/moments.h"
#include "core/planes/scan_planes.h"
#include "core/planes/shared_planes.h"

namespace strata {
namespace {

constexpr double kMinSpreadM = 0.5;  // σ of the support across its longest direction
constexpr double kLevel = 0.7;       // of the normal to the vertical, as a cosine
constexpr std::size_t kMinLines = 3;
constexpr double kMinAcross = 0.1;  // share of the length that runs across the main direction
constexpr double kMinContrast = 3.0;
constexpr double kMinNewShare = 0.5;  // of a plane's support, in no plane accepted before

struct PosedEdge {
  const EdgeFeature* edge = nullptr;
  std::size_t scan = 0;
  Line line;               // in the map, as the points
  Eigen::Vector3d sensor;  // which saw it
  std::vector<Eigen::Vector3d> points;
};

struct Candidate {
  Plane plane;
  std::vector<std::uint32_t> support;  // ascending
  double value_m = 0.0;
};

std::vector<PosedEdge> EdgesInMap(std::span<const PosedPlanes> scans) {
  std::vector<PosedEdge> edges;
  for (std::size_t scan = 0; scan < scans.size(); ++scan) {
    const Pose& T = scans[scan].T_map_scan;
    for (const EdgeFeature& edge : scans[scan].planes->edges) {
      PosedEdge posed = {.edge = &edge,
                         .scan = scan,
                         .line = {},
                         .sensor = T * scans[scan].sensor_origin,
                         .points = {}};
      posed.line = {.origin = T * edge.line.origin, .direction = T.linear() * edge.line.direction};
      for (const Eigen::Vector3d& p : edge.points) posed.points.push_back(T * p);
      edges.push_back(std::move(posed));
    }
  }
  return edges;
}

class EdgePlaneFinder {
 public:
  EdgePlaneFinder(std::span<const PosedEdge> edges, const SharedPlaneOptions& options)
      : edges_(edges), options_(options), random_(options.seed) {
    double sum = 0.0;
    for (const PosedEdge& edge : edges) cumulated_m_.push_back(sum += edge.edge->length_m);
  }

  std::vector<SharedPlane> Run() {
    std::vector<Candidate> candidates;
    if (edges_.size() < kMinLines) return {};
    for (int i = 0; i < options_.hypotheses; ++i) {
      std::optional<Candidate> candidate = Hypothesis();
      if (candidate.has_value()) candidates.push_back(*std::move(candidate));
    }
    std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
      return a.value_m > b.value_m;
    });
    std::vector<bool> used(edges_.size(), false);
    std::vector<SharedPlane> planes;
    for (Candidate& candidate : candidates) {
      if (NewLength(candidate, used) < kMinNewShare * candidate.value_m) continue;
      DropWhatDoesNotFit(candidate);
      if (!Stands(candidate)) continue;
      for (const std::uint32_t i : candidate.support) used[i] = true;
      planes.push_back(PlaneOf(candidate));
    }
    return planes;
  }

 private:
  std::uint32_t DrawByLength() {
    const double at = random_.Uniform() * cumulated_m_.back();
    const auto it = std::upper_bound(cumulated_m_.begin(), cumulated_m_.end(), at);
    return static_cast<std::uint32_t>(
        std::min(it - cumulated_m_.begin(), std::ssize(cumulated_m_) - 1));
  }

  std::optional<Candidate> Hypothesis() {
    const std::uint32_t a = DrawByLength();
    const std::uint32_t b = DrawByLength();
    if (a == b || Apart(a, b) > options_.max_extent_m) return std::nullopt;
    std::optional<Plane> plane = PlaneOfPair(a, b);
    if (!plane.has_value()) return std::nullopt;
    Candidate best = SupportOf(*plane, a);
    while (best.support.size() >= kMinLines) {  // hill climbing
      plane = FitTo(best.support);
      if (!plane.has_value()) break;
      Candidate next = SupportOf(*plane, a);
      if (next.value_m <= best.value_m) break;
      best = std::move(next);
    }
    if (best.value_m < options_.min_edge_support_m) return std::nullopt;
    return best;
  }

  double Apart(std::uint32_t a, std::uint32_t b) const {
    return Distance(edges_[a].line.origin, edges_[b].line.origin);
  }

  // The plane of a pair (5.2.3 step 2): along both lines (2.6.2), through the mean of what was
  // measured on them. Nothing where both lie on one line.
  std::optional<Plane> PlaneOfPair(std::uint32_t a, std::uint32_t b) const {
    const MomentsFit spread = FitMoments(MomentsOfEdge(a) + MomentsOfEdge(b));
    if (spread.eigenvalues(1) < kMinSpreadM * kMinSpreadM) return std::nullopt;
    std::vector<Eigen::Vector3d> points = edges_[a].points;
    points.insert(points.end(), edges_[b].points.begin(), edges_[b].points.end());
    const absl::StatusOr<LinesPlaneFit> fit =
        FitPlaneToLines(std::vector<Line>{edges_[a].line, edges_[b].line}, points);
    if (!fit.ok()) return std::nullopt;
    return Plane{.normal = fit->plane.normal, .distance = fit->plane.normal.dot(spread.mean)};
  }

  // The plane of many edges is that of least squared distance to what was measured on them, by
  // length: what the constraint will minimise (7.19). Directions (2.6.2) say less: short edges have
  // poor ones.
  std::optional<Plane> FitTo(std::span<const std::uint32_t> support) const {
    Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
    for (const std::uint32_t i : support) moments += MomentsOfEdge(i);
    if (!(moments(3, 3) > 0.0)) return std::nullopt;
    const MomentsFit fit = FitMoments(moments);
    if (fit.eigenvalues(1) < kMinSpreadM * kMinSpreadM) return std::nullopt;
    return fit.plane;
  }

  Eigen::Matrix4d MomentsOfEdge(std::uint32_t i) const {
    const PosedEdge& edge = edges_[i];
    const double weight = edge.edge->length_m / static_cast<double>(edge.points.size());
    Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
    for (const Eigen::Vector3d& p : edge.points) {
      moments += MomentsOf(weight, p, Eigen::Matrix3d::Zero());
    }
    return moments;
  }

  bool InCorridor(const PosedEdge& edge, const Plane& plane) const {
    return std::all_of(edge.points.begin(), edge.points.end(), [&](const Eigen::Vector3d& p) {
      return Distance(p, plane) <= options_.corridor_m;
    });
  }

  static bool IsLevel(const Plane& plane) { return std::abs(plane.normal.z()) >= kLevel; }

  // A border is seen up to a beam's spacing inside of where it is: from above a deck's rim seems to
  // be higher, from below lower, and one plane through both pulled storeys together by 0.04 m.
  // Beams are close beside each other: edges in upright planes are where they seem to be.
  bool MayShare(std::uint32_t a, std::uint32_t b, const Plane& plane) const {
    if (!IsLevel(plane)) return true;
    return SignedDistance(edges_[a].sensor, plane) * SignedDistance(edges_[b].sensor, plane) >= 0.0;
  }

  Candidate SupportOf(const Plane& plane, std::uint32_t around) const {
    Candidate candidate{.plane = plane, .support = {}, .value_m = 0.0};
    for (std::uint32_t i = 0; i < edges_.size(); ++i) {
      if (Apart(i, around) > options_.max_extent_m || !InCorridor(edges_[i], plane) ||
          !MayShare(i, around, plane)) {
        continue;
      }
      candidate.support.push_back(i);
      candidate.value_m += edges_[i].edge->length_m;
    }
    return candidate;
  }

  double NewLength(const Candidate& candidate, const std::vector<bool>& used) const {
    double length = 0.0;
    for (const std::uint32_t i : candidate.support) {
      if (!used[i]) length += edges_[i].edge->length_m;
    }
    return length;
  }

  // Edges leave that the plane of the other scans' edges, or without them the plane of all, does
  // not hold in its corridor.
  void DropWhatDoesNotFit(Candidate& candidate) const {
    std::map<std::size_t, std::vector<std::uint32_t>> of_scan;
    for (const std::uint32_t i : candidate.support) of_scan[edges_[i].scan].push_back(i);
    std::vector<std::uint32_t> kept;
    for (const auto& [scan, own] : of_scan) {
      std::vector<std::uint32_t> others;
      std::set_difference(candidate.support.begin(),
                          candidate.support.end(),
                          own.begin(),
                          own.end(),
                          std::back_inserter(others));
      const Plane plane = FitTo(others).value_or(candidate.plane);
      std::copy_if(own.begin(), own.end(), std::back_inserter(kept), [&](std::uint32_t i) {
        return InCorridor(edges_[i], plane);
      });
    }
    std::sort(kept.begin(), kept.end());
    candidate.plane = FitTo(kept).value_or(candidate.plane);
    std::erase_if(kept, [&](std::uint32_t i) { return !InCorridor(edges_[i], candidate.plane); });
    candidate.support = std::move(kept);
    candidate.value_m = 0.0;
    for (const std::uint32_t i : candidate.support) candidate.value_m += edges_[i].edge->length_m;
  }

  double RmsOf(const PosedEdge& edge, const Plane& plane) const {
    double sum = 0.0;
    for (const Eigen::Vector3d& p : edge.points) sum += std::pow(Distance(p, plane), 2);
    return std::sqrt(sum / static_cast<double>(edge.points.size()));
  }

  // Enough length, two scans, three lines, and much less in the corridors beside.
  bool Stands(const Candidate& candidate) const {
    if (candidate.value_m < options_.min_edge_support_m) return false;
    const std::size_t scan = edges_[candidate.support.front()].scan;
    if (std::all_of(candidate.support.begin(), candidate.support.end(), [&](std::uint32_t i) {
          return edges_[i].scan == scan;
        })) {
      return false;
    }
    if (LineCount(candidate.support) < kMinLines) return false;
    if (IsLevel(candidate.plane) && ShareAcross(candidate.support) < kMinAcross) return false;
    double beside = 0.0;
    for (const int k : {-4, -3, -2, 2, 3, 4}) {
      const Plane shifted = {.normal = candidate.plane.normal,
                             .distance = candidate.plane.distance + 2 * k * options_.corridor_m};
      beside += SupportOf(shifted, candidate.support.front()).value_m / 6;
    }
    return candidate.value_m >= kMinContrast * beside;
  }

  // Parallel borders lie in one plane by chance: the rims of a deck's openings and a kerb below.
  double ShareAcross(std::span<const std::uint32_t> support) const {
    Eigen::Matrix3d directions = Eigen::Matrix3d::Zero();
    for (const std::uint32_t i : support) {
      const Eigen::Vector3d& d = edges_[i].line.direction;
      directions += edges_[i].edge->length_m * d * d.transpose();
    }
    const Eigen::Vector3d shares =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(directions, Eigen::EigenvaluesOnly)
            .eigenvalues() /
        directions.trace();
    return 1.0 - shares(2);
  }

  // Different lines among the edges; the same border seen from many scans is one.
  std::size_t LineCount(std::span<const std::uint32_t> support) const {
    std::vector<Line> lines;
    for (const std::uint32_t i : support) {
      const PosedEdge& edge = edges_[i];
      const bool known = std::any_of(lines.begin(), lines.end(), [&](const Line& line) {
        return Distance(edge.points.front(), line) <= 4 * options_.corridor_m &&
               Distance(edge.points.back(), line) <= 4 * options_.corridor_m;
      });
      if (!known) lines.push_back(edge.line);
    }
    return lines.size();
  }

  SharedPlane PlaneOf(const Candidate& candidate) const {
    const Plane& plane = candidate.plane;
    const bool faces = SignedDistance(edges_[candidate.support.front()].sensor, plane) >= 0.0;
    SharedPlane shared{.plane = faces ? plane : Plane{-plane.normal, -plane.distance},
                       .from_edges = true,
                       .views = {},
                       .support_value = candidate.value_m};
    double disagreement = 0.0;
    for (const std::uint32_t i : candidate.support) {
      disagreement += edges_[i].edge->length_m / candidate.value_m *
                      std::pow(RmsOf(edges_[i], candidate.plane), 2);
    }
    std::map<std::size_t, SharedPlane::View> views;
    for (const std::uint32_t i : candidate.support) {
      const EdgeFeature& edge = *edges_[i].edge;
      SharedPlane::View& view =
          views
              .try_emplace(
                  edges_[i].scan,
                  SharedPlane::View{.scan = edges_[i].scan, .moments = Eigen::Matrix4d::Zero()})
              .first->second;
      view.moments += InformationOf(edge, disagreement);
      view.weight += edge.length_m;
      view.rms_m += edge.length_m * std::pow(RmsOf(edges_[i], candidate.plane), 2);
    }
    for (auto& [scan, view] : views) {
      view.rms_m = std::sqrt(view.rms_m / view.weight);
      shared.views.push_back(view);
    }
    return shared;
  }

  Eigen::Matrix4d InformationOf(const EdgeFeature& edge, double disagreement) const {
    const double variance =
        std::pow(std::max(edge.rms_m, options_.sigma_floor_m), 2) + disagreement;
    const double measurements =
        std::clamp(edge.length_m / options_.independent_length_m, 1.0, options_.max_measurements);
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    for (const Eigen::Vector3d& p : edge.points) {
      information += MomentsOf(measurements / variance / static_cast<double>(edge.points.size()),
                               p,
                               Eigen::Matrix3d::Zero());
    }
    return information;
  }

  std::span<const PosedEdge> edges_;
  const SharedPlaneOptions& options_;
  SplitMix64 random_;
  std::vector<double> cumulated_m_;
};

}  // namespace

std::vector<SharedPlane> FindEdgePlanes(std::span<const PosedPlanes> scans,
                                        const SharedPlaneOptions& options) {
  const std::vector<PosedEdge> edges = EdgesInMap(scans);
  return EdgePlaneFinder(edges, options).Run();
}

}  // namespace strata
