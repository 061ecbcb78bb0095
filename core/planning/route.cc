#include "core/planning/route.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <Eigen/Core>

#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/move_cost.h"
#include "core/planning/search_space.h"
#include "core/world/plan.h"

namespace strata {
namespace {

// A place on the way: in the cell of a patch, at its height.
struct Sample {
  Eigen::Vector3d position;
  double danger = 0.0;
  double class_factor = 1.0;
  PatchId patch = 0;
};

Sample SampleAt(SearchSpace& space, PatchId patch, const Eigen::Vector3d& position) {
  return {position, space.Danger(patch), space.ClassFactor(patch), patch};
}

double CostBetween(const Sample& a, const Sample& b, double extra_danger) {
  return (b.position - a.position).norm() * (1.0 + 0.5 * (a.danger + b.danger) + extra_danger) *
         0.5 * (a.class_factor + b.class_factor);
}

int DirectionOf(int dx, int dy) {
  for (int k = 0; k < 8; ++k) {
    if (kStepX[k] == dx && kStepY[k] == dy) return k;
  }
  return -1;
}

// Walks the cells under the line between two cell centres, in units where a cell is 1 wide and t
// runs from 0 to 1.
class LineWalk {
 public:
  LineWalk(CellIndex from, CellIndex to)
      : dx_(to.x - from.x), dy_(to.y - from.y), ax_(std::abs(dx_)), ay_(std::abs(dy_)) {}

  bool done() const { return i_ == ax_ && j_ == ay_; }
  // Direction of the next cell.
  int Advance() {
    // The line leaves a cell through the side it meets first; through the corner if both at once.
    const std::int64_t to_x = i_ < ax_ ? (2 * i_ + 1) * ay_ : INT64_MAX;
    const std::int64_t to_y = j_ < ay_ ? (2 * j_ + 1) * ax_ : INT64_MAX;
    const bool x = to_x <= to_y;
    const bool y = to_y <= to_x;
    enter_ = exit();
    i_ += x ? 1 : 0;
    j_ += y ? 1 : 0;
    return DirectionOf(x ? Sign(dx_) : 0, y ? Sign(dy_) : 0);
  }
  double enter() const { return enter_; }
  double exit() const {
    const double x = i_ < ax_ ? (i_ + 0.5) / static_cast<double>(ax_) : 1.0;
    const double y = j_ < ay_ ? (j_ + 0.5) / static_cast<double>(ay_) : 1.0;
    return std::min(x, y);
  }
  double middle() const { return i_ + j_ == 0 ? 0.0 : done() ? 1.0 : 0.5 * (enter() + exit()); }
  // Distance from the centre of the present cell to the farthest of the line's points in it.
  double Offset() const { return std::max(OffsetAt(enter_), OffsetAt(exit())); }

 private:
  static int Sign(std::int64_t v) { return v > 0 ? 1 : v < 0 ? -1 : 0; }
  double OffsetAt(double t) const {
    return std::hypot(t * static_cast<double>(ax_) - static_cast<double>(i_),
                      t * static_cast<double>(ay_) - static_cast<double>(j_));
  }

  std::int64_t dx_, dy_, ax_, ay_;
  std::int64_t i_ = 0;
  std::int64_t j_ = 0;
  double enter_ = 0.0;
};

class RouteMaker {
 public:
  RouteMaker(SearchSpace& space, const std::vector<PatchId>& path) : space_(space), path_(path) {}

  Route Run() {
    for (const PatchId patch : path_) AddOriginal(patch);
    samples_.push_back(original_.front());
    std::size_t i = 0;
    std::size_t run_begin = 0;  // of the samples since the last gap
    while (i + 1 < path_.size()) {
      if (gap_danger_[i + 1] > 0.0) {
        CrossGap(i, run_begin);
        run_begin = samples_.size() - 1;
        ++i;
      } else {
        i = PullFrom(i);
      }
    }
    AddWaypoints(run_begin);
    Finish();
    return std::move(route_);
  }

 private:
  void AddOriginal(PatchId patch) {
    original_.push_back(SampleAt(space_, patch, space_.Position(patch)));
    double extra = 0.0;
    double cost = 0.0;
    if (original_.size() > 1) {
      const CellIndex a = space_.CellOfPatch(path_[original_.size() - 2]);
      const CellIndex b = space_.CellOfPatch(patch);
      const int cells = std::max(std::abs(b.x - a.x), std::abs(b.y - a.y));
      extra = kGapDanger * (cells - 1) / cells;
      cost =
          cost_to_.back() + CostBetween(original_[original_.size() - 2], original_.back(), extra);
    }
    gap_danger_.push_back(extra);
    cost_to_.push_back(cost);
  }

  void CrossGap(std::size_t i, std::size_t run_begin) {
    AddWaypoints(run_begin);
    const Eigen::Vector3d& from = original_[i].position;
    const Eigen::Vector3d& to = original_[i + 1].position;
    route_.gaps.push_back({from, to, (to - from).norm()});
    route_.cost_m += cost_to_[i + 1] - cost_to_[i];
    samples_.push_back(original_[i + 1]);
  }

  // Appends samples of a line or a single move from patch i on; returns the patch it leads to.
  std::size_t PullFrom(std::size_t i) {
    std::size_t end = i + 1;  // of the present run
    while (end + 1 < path_.size() && gap_danger_[end + 1] == 0.0) ++end;
    std::size_t good = i + 1;
    std::size_t bad = end + 1;
    std::vector<Sample> line;
    for (std::size_t stride = 2; good < end; stride *= 2) {
      const std::size_t j = std::min(i + stride, end);
      if (!Line(i, j, &line)) {
        bad = j;
        break;
      }
      Take(&line, &good, j);
    }
    while (bad - good > 1) {
      const std::size_t j = good + (bad - good) / 2;
      if (Line(i, j, &line)) {
        Take(&line, &good, j);
      } else {
        bad = j;
      }
    }
    if (good == i + 1) best_ = {original_[i + 1]};
    for (const Sample& sample : best_) {
      route_.cost_m += CostBetween(samples_.back(), sample, 0.0);
      samples_.push_back(sample);
    }
    return good;
  }

  void Take(std::vector<Sample>* line, std::size_t* good, std::size_t j) {
    std::swap(best_, *line);
    *good = j;
  }

  bool IsClear(PatchId patch, double offset_cells) const {
    const ProfileChecks& checks = space_.checks();
    return space_.EdgeDistance(patch) >=
           checks.profile.radius_m + offset_cells * checks.cell_size_m;
  }

  // Samples of the line from patch i to patch j, without its beginning.
  bool Line(std::size_t i, std::size_t j, std::vector<Sample>* line) {
    line->clear();
    LineWalk walk(space_.CellOfPatch(path_[i]), space_.CellOfPatch(path_[j]));
    const Eigen::Vector3d from = original_[i].position;
    const Eigen::Vector3d along = original_[j].position - from;
    const double allowed = cost_to_[j] - cost_to_[i];
    PatchId patch = path_[i];
    double cost = 0.0;
    const Sample* last = &original_[i];
    line->reserve(2 * (j - i) + 2);
    while (true) {
      if (!IsClear(patch, walk.Offset())) return false;
      if (walk.done()) break;
      std::uint32_t move_cost = 0;
      int cells = 0;
      patch = space_.Follow(patch, walk.Advance(), &move_cost, &cells);
      if (patch == kNoPatchId || cells != 1) return false;
      Eigen::Vector3d position = from + walk.middle() * along;
      position.z() = space_.Height(patch);
      line->push_back(SampleAt(space_, patch, position));
      cost += CostBetween(*last, line->back(), 0.0);
      if (cost > allowed) return false;
      last = &line->back();
    }
    return patch == path_[j];
  }

  // Appends the waypoints of the samples from `begin` on.
  void AddWaypoints(std::size_t begin) {
    if (route_.waypoints.empty() || begin > 0) route_.waypoints.push_back(samples_[begin].position);
    Simplify(begin, samples_.size() - 1);
  }

  // Douglas and Peucker, without recursion into what is straight.
  void Simplify(std::size_t first, std::size_t last) {
    if (first == last) return;
    const std::size_t worst = FarthestFromLine(first, last);
    if (worst == first) {
      route_.waypoints.push_back(samples_[last].position);
      return;
    }
    Simplify(first, worst);
    Simplify(worst, last);
  }

  std::size_t FarthestFromLine(std::size_t first, std::size_t last) const {
    const Eigen::Vector3d& a = samples_[first].position;
    const Eigen::Vector3d ab = samples_[last].position - a;
    const double run2 = ab.head<2>().squaredNorm();
    std::size_t worst = first;
    double worst_ratio = 1.0;
    for (std::size_t i = first + 1; i < last; ++i) {
      const Eigen::Vector3d ap = samples_[i].position - a;
      const double t = run2 > 0.0 ? ap.head<2>().dot(ab.head<2>()) / run2 : 0.0;
      const Eigen::Vector3d off = ap - t * ab;
      const double ratio =
          std::max(std::abs(off.z()) / kWaypointToleranceM, off.head<2>().norm() / 1e-6);
      if (ratio <= worst_ratio) continue;
      worst_ratio = ratio;
      worst = i;
    }
    return worst;
  }

  void Finish() {
    for (std::size_t i = 1; i < route_.waypoints.size(); ++i) {
      route_.length_m += (route_.waypoints[i] - route_.waypoints[i - 1]).norm();
    }
    for (const Sample& sample : samples_) {
      const TileKey& key = space_.slots()[space_.SlotOf(sample.patch)].key;
      if (route_.tiles.empty() || !(route_.tiles.back() == key)) route_.tiles.push_back(key);
    }
    std::sort(route_.tiles.begin(), route_.tiles.end());
    route_.tiles.erase(std::unique(route_.tiles.begin(), route_.tiles.end()), route_.tiles.end());
  }

  SearchSpace& space_;
  const std::vector<PatchId>& path_;
  Route route_;
  // The patches of the path: where they are, cost up to each, extra danger of the move to it.
  std::vector<Sample> original_;
  std::vector<double> cost_to_;
  std::vector<double> gap_danger_;
  std::vector<Sample> samples_;  // of the route so far
  std::vector<Sample> best_;     // longest line found by PullFrom
};

}  // namespace

Route MakeRoute(SearchSpace& space, const std::vector<PatchId>& path) {
  return RouteMaker(space, path).Run();
}

}  // namespace strata
