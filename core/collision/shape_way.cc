#include "core/collision/shape_way.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/collision/shape_body.h"
#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/geometry/pose.h"

namespace strata {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

// Half of what a level surface is thick at least [m], and how many σ.
constexpr double kHalfThicknessM = 0.02;
constexpr double kSigmas = 3.0;
// Held at once: a way may be as long as a map.
constexpr std::size_t kMostTiles = 256;
// Ground is looked for this far below and above the plane that the shape stands on [m].
constexpr double kGroundReachM = 1.0;

struct Look {
  double depth_m = -1.0;  // < 0: nothing is touched
  Vector3d where = Vector3d::Zero();
  int class_id = 0;
  bool unknown = false;
  bool inferred = false;
};

// Something in a cell that the shape may touch [m].
struct Thing {
  double bottom = 0.0;
  double top = 0.0;
  int class_id = 0;
  bool unknown = false;
  bool inferred = false;
};

// Poses of a way, and how far along it they are.
class Way {
 public:
  Way(std::vector<Pose> poses, double reach_m, double step_m) : poses_(std::move(poses)) {
    for (std::size_t i = 0; i + 1 < poses_.size(); ++i) {
      const Eigen::AngleAxisd turn(poses_[i].linear().transpose() * poses_[i + 1].linear());
      const double length = (poses_[i + 1].translation() - poses_[i].translation()).norm();
      const double moved = length + reach_m * std::abs(turn.angle());
      steps_.push_back(std::max(1.0, std::ceil(moved / step_m)));
      lengths_.push_back(length);
      looks_ += steps_.back();
      length_m_ += length;
    }
  }

  double looks() const { return looks_ + 1.0; }
  double length_m() const { return length_m_; }

  // visit(pose, along), until it is not OK.
  template <typename Visit>
  absl::Status ForEach(const Visit& visit) const {
    double along = 0.0;
    for (std::size_t i = 0; i + 1 < poses_.size(); ++i) {
      const Eigen::Quaterniond from(poses_[i].linear());
      const Eigen::Quaterniond to(poses_[i + 1].linear());
      for (double step = 0.0; step < steps_[i]; ++step) {
        const double share = step / steps_[i];
        const Vector3d at = poses_[i].translation() +
                            share * (poses_[i + 1].translation() - poses_[i].translation());
        STRATA_RETURN_IF_ERROR(
            visit(MakePose(from.slerp(share, to), at), along + share * lengths_[i]));
      }
      along += lengths_[i];
    }
    return visit(poses_.back(), along);
  }

 private:
  std::vector<Pose> poses_;
  std::vector<double> steps_, lengths_;
  double looks_ = 0.0;
  double length_m_ = 0.0;
};

class Surroundings {
 public:
  Surroundings(TileOf tile_of,
               InferredOf inferred_of,
               double cell_size_m,
               const ShapeQuery& query,
               const Stop& stop)
      : tile_of_(tile_of),
        inferred_of_(inferred_of),
        cell_m_(cell_size_m),
        query_(query),
        stop_(stop),
        body_(query.shape) {}

  const ShapeBody& body() const { return body_; }

  absl::StatusOr<Look> At(const Pose& T) {
    AlignedBox3d around;
    for (int i = 0; i < 8; ++i) {
      around.extend(T * body_.bounds().corner(static_cast<AlignedBox3d::CornerType>(i)));
    }
    const double margin = query_.clearance_m;
    const auto index = [&](double at) {
      return static_cast<std::int32_t>(std::floor(at / cell_m_));
    };
    Look look;
    for (std::int32_t y = index(around.min().y() - margin); y <= index(around.max().y() + margin);
         ++y) {
      STRATA_RETURN_IF_ERROR(stop_.status());  // a shape may be as wide as a map
      for (std::int32_t x = index(around.min().x() - margin); x <= index(around.max().x() + margin);
           ++x) {
        STRATA_RETURN_IF_ERROR(LookAtCell(T, around, {x, y}, look));
      }
    }
    return look;
  }

 private:
  struct Held {
    std::shared_ptr<const SurfaceTile> measured;   // nullptr: none
    std::shared_ptr<const InferredTile> inferred;  // nullptr: nothing
  };

  absl::StatusOr<const Held*> TilesAt(CellIndex cell) {
    const TileKey key = TileOfCell(cell);
    if (last_ == nullptr || last_key_ != key) {
      auto found = tiles_.find(key);
      if (found == tiles_.end()) {
        if (tiles_.size() >= kMostTiles) tiles_.clear();
        STRATA_ASSIGN_OR_RETURN(std::shared_ptr<const SurfaceTile> tile, tile_of_(key));
        found = tiles_.emplace(key, Held{std::move(tile), inferred_of_(key)}).first;
      }
      last_key_ = key;
      last_ = &found->second;
    }
    return last_;
  }

  absl::Status LookAtCell(const Pose& T, const AlignedBox3d& around, CellIndex cell, Look& look) {
    STRATA_ASSIGN_OR_RETURN(const Held* const held, TilesAt(cell));
    std::span<const Surface> surfaces;
    if (held->measured != nullptr) surfaces = held->measured->Cell(CellInTile(cell));
    const Eigen::Vector2d low(cell.x * cell_m_, cell.y * cell_m_);
    const Eigen::Vector2d high(low.x() + cell_m_, low.y() + cell_m_);
    const Eigen::Vector2d middle = (low + high) / 2.0;
    const double ground = GroundAt(T, middle);
    bool seen = false;
    for (const Surface& surface : surfaces) {
      seen = seen || std::abs(surface.z_m - ground) <= kGroundReachM ||
             (surface.bottom_m() <= ground && surface.z_m >= ground);
      if (surface.z_m - ground <= query_.ground_m) continue;
      const double half =
          surface.vertical() ? 0.0 : std::max(kSigmas * surface.sigma_m, kHalfThicknessM);
      const double bottom = surface.bottom_m() - half - query_.clearance_m;
      const double top = surface.z_m + half + query_.clearance_m;
      if (bottom > around.max().z() || top < around.min().z()) continue;
      Touch(T, low, high, {.bottom = bottom, .top = top, .class_id = surface.class_id}, look);
    }
    if (held->inferred != nullptr) LookAtInferred(T, around, cell, *held->inferred, look);
    if (!query_.unknown_blocks || seen) return absl::OkStatus();
    const double top = std::max(ground, around.max().z()) + 1e-3;
    Touch(T, low, high, {.bottom = ground, .top = top, .unknown = true}, look);
    return absl::OkStatus();
  }

  void LookAtInferred(const Pose& T,
                      const AlignedBox3d& around,
                      CellIndex cell,
                      const InferredTile& inferred,
                      Look& look) const {
    const Eigen::Vector2d low(cell.x * cell_m_, cell.y * cell_m_);
    const Eigen::Vector2d high(low.x() + cell_m_, low.y() + cell_m_);
    const double ground = GroundAt(T, (low + high) / 2.0);
    const std::uint32_t in_tile = CellInTile(cell);
    for (const InferredSpan& span : inferred.Cells(in_tile, in_tile + 1)) {
      if (span.high_m - ground <= query_.ground_m) continue;
      const double bottom = span.low_m - kHalfThicknessM - query_.clearance_m;
      const double top = span.high_m + kHalfThicknessM + query_.clearance_m;
      if (bottom > around.max().z() || top < around.min().z()) continue;
      Touch(T, low, high, {.bottom = bottom, .top = top, .inferred = true}, look);
    }
  }

  // Height of the plane that the shape stands on.
  static double GroundAt(const Pose& T, const Eigen::Vector2d& at) {
    const Vector3d up = T.linear().col(2);
    const Vector3d& origin = T.translation();
    if (up.z() < 0.1) return origin.z();
    return origin.z() - up.head<2>().dot(at - origin.head<2>()) / up.z();
  }

  void Touch(const Pose& T,
             const Eigen::Vector2d& low,
             const Eigen::Vector2d& high,
             const Thing& thing,
             Look& look) const {
    const double margin = thing.unknown ? 0.0 : query_.clearance_m;
    const AlignedBox3d box(Vector3d(low.x() - margin, low.y() - margin, thing.bottom),
                           Vector3d(high.x() + margin, high.y() + margin, thing.top));
    const std::optional<ShapeTouch> touch = body_.Touches(T, box);
    if (!touch.has_value()) return;
    const double depth = thing.unknown ? 0.0 : touch->depth_m;
    // Of what is as deep, what was measured is told.
    const bool measured = !thing.unknown && !thing.inferred;
    if (depth < look.depth_m || (depth == look.depth_m && !measured)) return;
    look.depth_m = depth;
    look.where = thing.unknown
                     ? Vector3d((low.x() + high.x()) / 2, (low.y() + high.y()) / 2, thing.bottom)
                     : touch->where;
    look.class_id = thing.class_id;
    look.unknown = thing.unknown;
    look.inferred = thing.inferred;
  }

  TileOf tile_of_;
  InferredOf inferred_of_;
  const double cell_m_;
  const ShapeQuery& query_;
  const Stop& stop_;
  const ShapeBody body_;
  HashMap<TileKey, Held> tiles_;
  TileKey last_key_;
  const Held* last_ = nullptr;
};

std::string MessageOf(const ShapeCheck& check) {
  if (check.free) return absl::StrFormat("free along %.2f m", check.length_m);
  const ShapeContact& first = check.contacts.front();
  const std::string what = first.unknown
                               ? "is over unknown ground"
                               : absl::StrFormat("touches something%s, %.3f m deep,",
                                                 first.inferred ? " that was only inferred" : "",
                                                 first.depth_m);
  return absl::StrFormat(
      "%s at (%.2f, %.2f, %.2f), %.2f m along the way of %.2f m; %d such stretches",
      what,
      first.where.x(),
      first.where.y(),
      first.where.z(),
      first.from_m,
      check.length_m,
      check.contacts.size());
}

// Takes a look into the stretch that the one before was in, or begins one.
void Note(const Look& look, double along_m, bool goes_on, ShapeCheck& check) {
  if (!goes_on) {
    if (check.contacts.size() >= kMaxShapeContacts) return;
    check.contacts.push_back({.from_m = along_m, .to_m = along_m, .depth_m = -1.0});
  }
  ShapeContact& contact = check.contacts.back();
  contact.to_m = along_m;
  if (look.depth_m <= contact.depth_m) return;
  contact.depth_m = look.depth_m;
  contact.where = look.where;
  contact.class_id = look.class_id;
  contact.unknown = look.unknown;
  contact.inferred = look.inferred;
}

}  // namespace

absl::StatusOr<ShapeCheck> CheckShapeAlong(TileOf tile_of,
                                           double cell_size_m,
                                           const ShapeQuery& query,
                                           const Stop& stop,
                                           InferredOf inferred_of) {
  STRATA_RETURN_IF_ERROR(ValidateShapeQuery(query));
  Surroundings around(tile_of, inferred_of, cell_size_m, query, stop);
  double reach_m = 0.0;
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner = around.body().bounds().corner(static_cast<AlignedBox3d::CornerType>(i));
    reach_m = std::max(reach_m, corner.norm());
  }
  const Way way(
      query.poses.empty() ? PosesAlong(query.waypoints) : query.poses, reach_m, cell_size_m / 4.0);
  if (way.looks() > static_cast<double>(kMaxShapeLooks)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "shape: %.1f m with steps of %g m are %.0f looks, more than %d; check the way in parts",
        way.length_m(),
        cell_size_m / 4.0,
        way.looks(),
        kMaxShapeLooks));
  }
  ShapeCheck check;
  check.length_m = way.length_m();
  bool touched = false;
  const auto look_at = [&](const Pose& T, double along_m) -> absl::Status {
    ++check.looks;
    STRATA_ASSIGN_OR_RETURN(const Look look, around.At(T));
    if (look.depth_m >= 0.0) Note(look, along_m, touched, check);
    touched = look.depth_m >= 0.0;
    return absl::OkStatus();
  };
  STRATA_RETURN_IF_ERROR(way.ForEach(look_at));
  check.free = check.contacts.empty();
  check.free_m = check.free ? check.length_m : check.contacts.front().from_m;
  check.message = MessageOf(check);
  return check;
}

}  // namespace strata
