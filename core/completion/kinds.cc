#include "core/completion/kinds.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include <Eigen/Core>

#include "core/common/option_checks.h"
#include "core/common/status.h"
#include "core/completion/kind_codec.h"
#include "core/completion/kind_model.h"
#include "core/completion/thing_points.h"
#include "core/completion/upright_box.h"

namespace strata {
namespace {

constexpr std::size_t kMostModelPoints = 2'000;
constexpr std::size_t kMostModels = 2'000;  // of a class
constexpr std::size_t kMostAlike = 4;       // kinds that an entity is compared with
constexpr std::size_t kMostWhole = 8;       // that it may be a part of, by voxels
constexpr std::size_t kMostRegistered = 3;
// Others that a reference may have and be a part of another kind all the same, with them.
constexpr std::size_t kMostLikeParts = 1;
// Of a thing that is of a kind so much lies on it; another kind has to be so much less bad.
constexpr double kSurelyOn = 0.98;
constexpr double kClearlyBetter = 0.1;
constexpr double kMostFeatureDistance = 3.0;  // of kinds that are alike, in standard deviations
// Standard deviations are not taken for smaller, or noise would part what is alike.
const Eigen::Array3d kLeastDeviation(0.3, 0.08, 0.1);
constexpr double kSizeSlack = 0.05;  // share of an edge
// What lies flat is as high as it is rough: borders of ground that scan lines leave have no shape.
constexpr double kLeastHeightM = 0.1;
constexpr std::size_t kNoEntity = std::numeric_limits<std::size_t>::max();

Eigen::Array3d ArrayOf(const KindFeatures& f) { return {f.log_volume, f.ratio, f.log_radius}; }

// An entity, or what is known of a kind.
struct Candidate {
  std::size_t entity = kNoEntity;
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  Eigen::Array3d features = Eigen::Array3d::Zero();
  std::size_t support = 0;  // voxels
};

Candidate CandidateOf(const FoundEntity& entity, std::size_t index) {
  return {index,
          entity.box.size,
          ArrayOf(KindFeaturesOf(entity.box.size, entity.radius_m)),
          entity.voxels.size()};
}

Candidate CandidateOf(const KindShape& shape) {
  std::vector<Eigen::Vector3d> points;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& p : shape.points) {
    points.push_back(p.cast<double>());
    mean += points.back() / static_cast<double>(shape.points.size());
  }
  double radius = 0.0;
  for (const Eigen::Vector3d& p : points) radius = std::max(radius, (p - mean).norm());
  const Eigen::Vector3d size = UprightBoxOf(points).size;
  return {kNoEntity, size, ArrayOf(KindFeaturesOf(size, radius)), kNoEntity};
}

// A kind of the library, or an entity that may become the reference of one.
struct Reference {
  Candidate of;
  std::uint64_t id = 0;  // of the library; 0: not known yet
  std::unique_ptr<KindModel> model;
  Pose T_map_model = Pose::Identity();  // of the entity
  std::vector<std::size_t> members;     // other entities that are of it
  bool dropped = false;                 // it is a part of another
};

struct Match {
  std::size_t reference = 0;
  KindFit fit;
};

// Where a thing of a kind is.
struct Placed {
  std::size_t reference = 0;
  Pose T_map_kind = Pose::Identity();
};

// The kinds of one class.
class ClassSorter {
 public:
  ClassSorter(std::span<const FoundEntity> entities,
              const KindOptions& options,
              const Stop& stop,
              absl::FunctionRef<absl::Status(std::size_t)> done)
      : entities_(entities), options_(options), stop_(stop), done_(done) {}

  void AddKnown(const ThingKind& kind) {
    Reference reference;
    reference.of = CandidateOf(kind.shape);
    reference.id = kind.info.id;
    std::vector<Eigen::Vector3d> points;
    for (const Eigen::Vector3f& p : kind.shape.points) points.push_back(p.cast<double>());
    reference.model = std::make_unique<KindModel>(
        ThinnedInFrame(points, Pose::Identity(), kMostModelPoints), options_.tolerance_m);
    references_.push_back(std::move(reference));
  }

  // `indexes`: of the entities of the class, the largest first.
  absl::Status Sort(const std::vector<std::size_t>& indexes) {
    for (const std::size_t i : indexes) things_.push_back(CandidateOf(entities_[i], i));
    MeasureDeviation();
    for (const Candidate& thing : things_) {
      STRATA_RETURN_IF_ERROR(stop_.status());
      SortAlike(thing);
      STRATA_RETURN_IF_ERROR(done_(1));
    }
    for (const Candidate& thing : things_) {
      STRATA_RETURN_IF_ERROR(stop_.status());
      SortPart(thing);
      STRATA_RETURN_IF_ERROR(done_(1));
    }
    return JoinPieces();
  }

  // Of entities by index.
  const std::map<std::size_t, Match>& matches() const { return matches_; }
  const std::vector<Reference>& references() const { return references_; }

 private:
  void MeasureDeviation();
  std::unique_ptr<ThingPoints> PointsOf(const Candidate& thing, Pose& T_map_thing) const;
  bool IsAlike(const Candidate& thing, const Reference& reference) const;
  bool MayBePartOf(const Candidate& thing, const Reference& reference) const;
  double DistanceOf(const Candidate& thing, const Reference& reference) const {
    return ((thing.features - reference.of.features) / deviation_).matrix().norm();
  }
  // The nearest by features that `takes`.
  template <typename Takes>
  std::vector<std::size_t> NearestOf(const Candidate& thing, std::size_t most, Takes takes) const;
  std::optional<Match> BestOf(const ThingPoints& points,
                              const std::vector<std::size_t>& nearest,
                              KindStarts starts,
                              double min_cover) const;
  bool Accepts(const Reference& reference, const KindFit& fit, double min_cover) const;
  void SortAlike(const Candidate& thing);
  void SortPart(const Candidate& thing);
  // One that is as large as what it was taken for, and sticks out: is it rather a part of a larger
  // kind?
  void SortAnew(const Candidate& thing);
  // The kind that a reference, and the one that is like it, are parts of.
  std::optional<Match> WholeOf(const Reference& reference, std::optional<Match>& other) const;
  // Of a thing that something hides the middle of, there are several entities; what of them is
  // small looks like a part of many kinds. It is where the larger ones say that the thing is.
  absl::Status JoinPieces();
  std::optional<Match> PieceOf(const Candidate& thing, const std::vector<Placed>& placed) const;
  void Assign(std::size_t entity, const Match& match);

  std::span<const FoundEntity> entities_;
  const KindOptions& options_;
  const Stop& stop_;
  const absl::FunctionRef<absl::Status(std::size_t)> done_;
  std::vector<Candidate> things_;
  std::vector<Reference> references_;
  std::map<std::size_t, std::size_t> own_;  // reference that an entity is itself
  std::map<std::size_t, Match> matches_;
  Eigen::Array3d deviation_ = kLeastDeviation;
};

void ClassSorter::MeasureDeviation() {
  Eigen::Array3d mean = Eigen::Array3d::Zero(), squares = Eigen::Array3d::Zero();
  for (const Candidate& thing : things_) mean += thing.features;
  mean /= static_cast<double>(things_.size());
  for (const Candidate& thing : things_) squares += (thing.features - mean).square();
  deviation_ = (squares / static_cast<double>(things_.size())).sqrt().max(kLeastDeviation);
}

std::unique_ptr<ThingPoints> ClassSorter::PointsOf(const Candidate& thing,
                                                   Pose& T_map_thing) const {
  const FoundEntity& entity = entities_[thing.entity];
  T_map_thing = BaseFrameOf(entity.box);
  std::vector<Eigen::Vector3f> points =
      ThinnedInFrame(entity.voxels, T_map_thing, kMostModelPoints);
  if (points.size() < kMinKindPoints) return nullptr;
  return std::make_unique<ThingPoints>(std::move(points));
}

bool ClassSorter::IsAlike(const Candidate& thing, const Reference& reference) const {
  const Eigen::Array3d slack =
      2.0 * reference.model->tolerance_m() + kSizeSlack * reference.of.size.array();
  return ((thing.size - reference.of.size).array().abs() <= slack).all() &&
         DistanceOf(thing, reference) <= kMostFeatureDistance;
}

bool ClassSorter::MayBePartOf(const Candidate& thing, const Reference& reference) const {
  const double slack = 2.0 * reference.model->tolerance_m();
  const bool larger = reference.of.support == kNoEntity || reference.of.support >= thing.support;
  return larger && reference.of.entity != thing.entity && !reference.dropped &&
         thing.size.z() <= reference.of.size.z() + slack &&
         thing.size.x() <= reference.of.size.head<2>().norm() + slack;
}

template <typename Takes>
std::vector<std::size_t> ClassSorter::NearestOf(const Candidate& thing,
                                                std::size_t most,
                                                Takes takes) const {
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t i = 0; i < references_.size(); ++i) {
    if (takes(references_[i])) near.emplace_back(DistanceOf(thing, references_[i]), i);
  }
  const auto end = near.begin() + static_cast<std::ptrdiff_t>(std::min(most, near.size()));
  std::partial_sort(near.begin(), end, near.end());
  std::vector<std::size_t> indexes;
  for (auto i = near.begin(); i != end; ++i) indexes.push_back(i->second);
  return indexes;
}

bool ClassSorter::Accepts(const Reference& reference, const KindFit& fit, double min_cover) const {
  return fit.overlap >= options_.min_overlap && fit.cover >= min_cover &&
         fit.residual_m <= options_.max_residual * reference.model->tolerance_m();
}

std::optional<Match> ClassSorter::BestOf(const ThingPoints& points,
                                         const std::vector<std::size_t>& nearest,
                                         KindStarts starts,
                                         double min_cover) const {
  struct Tried {
    std::size_t reference = 0;
    std::vector<KindModel::Start> starts;
  };
  std::vector<Tried> tried;
  for (const std::size_t i : nearest) {
    Tried one{i, references_[i].model->StartsOf(points, starts)};
    if (!one.starts.empty()) tried.push_back(std::move(one));
  }
  std::stable_sort(tried.begin(), tried.end(), [](const Tried& a, const Tried& b) {
    return a.starts.front().distance_m < b.starts.front().distance_m;
  });
  if (tried.size() > kMostRegistered) tried.resize(kMostRegistered);
  std::optional<Match> best;
  for (const Tried& one : tried) {
    const Reference& reference = references_[one.reference];
    const std::optional<KindFit> fit = reference.model->Register(points, one.starts);
    if (!fit.has_value() || !Accepts(reference, *fit, min_cover)) continue;
    // What the library has goes before what is found.
    const auto badness = [&](const Match& match) {
      const Reference& of = references_[match.reference];
      const double tolerance_m = of.model->tolerance_m();
      return std::make_pair(of.id == 0,
                            starts == KindStarts::kCentred ? match.fit.Badness(tolerance_m)
                                                           : match.fit.BadnessOfPart(tolerance_m));
    };
    const Match match{one.reference, *fit};
    if (!best.has_value() || badness(match) < badness(*best)) best = match;
  }
  return best;
}

void ClassSorter::Assign(std::size_t entity, const Match& match) {
  references_[match.reference].members.push_back(entity);
  matches_[entity] = match;
}

void ClassSorter::SortAlike(const Candidate& thing) {
  Pose T_map_thing = Pose::Identity();
  std::unique_ptr<ThingPoints> points = PointsOf(thing, T_map_thing);
  if (points == nullptr) return;
  const bool flat = thing.size.z() < kLeastHeightM;
  const auto nearest = NearestOf(thing, kMostAlike, [&](const Reference& reference) {
    return (!flat || reference.id != 0) && IsAlike(thing, reference);
  });
  const std::optional<Match> match =
      BestOf(*points, nearest, KindStarts::kCentred, options_.min_cover);
  if (match.has_value()) return Assign(thing.entity, *match);
  if (flat || own_.size() == kMostModels) return;
  Reference reference;
  reference.of = thing;
  reference.model = std::make_unique<KindModel>(points->points(), options_.tolerance_m);
  reference.T_map_model = T_map_thing;
  own_[thing.entity] = references_.size();
  references_.push_back(std::move(reference));
}

std::optional<Match> ClassSorter::WholeOf(const Reference& reference,
                                          std::optional<Match>& other) const {
  const bool pair = !reference.members.empty();
  const auto nearest = NearestOf(reference.of, kMostWhole, [&](const Reference& whole) {
    // Two that were seen from the same side are like each other before anything else.
    const bool more = whole.id != 0 || whole.members.size() > reference.members.size();
    return (!pair || more) && MayBePartOf(reference.of, whole);
  });
  const std::optional<Match> match =
      BestOf(reference.model->thing(), nearest, KindStarts::kSideOnSide, options_.min_part_cover);
  if (!match.has_value() || !pair) return match;
  Pose T_map_other = Pose::Identity();
  const auto points =
      PointsOf(CandidateOf(entities_[reference.members[0]], reference.members[0]), T_map_other);
  // It is the smaller of both.
  other =
      BestOf(*points, {match->reference}, KindStarts::kSideOnSide, 0.5 * options_.min_part_cover);
  return other.has_value() ? match : std::nullopt;
}

void ClassSorter::SortAnew(const Candidate& thing) {
  const auto match = matches_.find(thing.entity);
  if (match == matches_.end() || match->second.fit.overlap >= kSurelyOn) return;
  Reference& taken = references_[match->second.reference];
  if (taken.id != 0) return;
  Pose T_map_thing = Pose::Identity();
  const std::unique_ptr<ThingPoints> points = PointsOf(thing, T_map_thing);
  const auto nearest = NearestOf(thing, kMostWhole, [&](const Reference& whole) {
    return &whole != &taken && !whole.members.empty() && MayBePartOf(thing, whole);
  });
  const std::optional<Match> part =
      BestOf(*points, nearest, KindStarts::kSideOnSide, options_.min_part_cover);
  if (!part.has_value()) return;
  const double tolerance_m = taken.model->tolerance_m();
  if (part->fit.BadnessOfPart(tolerance_m) + kClearlyBetter >=
      match->second.fit.BadnessOfPart(tolerance_m)) {
    return;
  }
  std::erase(taken.members, thing.entity);
  Assign(thing.entity, *part);
}

void ClassSorter::SortPart(const Candidate& thing) {
  const auto own = own_.find(thing.entity);
  if (own == own_.end()) return SortAnew(thing);
  Reference& reference = references_[own->second];
  if (reference.members.size() > kMostLikeParts) return;
  std::optional<Match> other;
  const std::optional<Match> match = WholeOf(reference, other);
  if (!match.has_value()) return;
  reference.dropped = true;
  Assign(thing.entity, *match);
  if (other.has_value()) Assign(reference.members[0], *other);
}

std::optional<Match> ClassSorter::PieceOf(const Candidate& thing,
                                          const std::vector<Placed>& placed) const {
  std::optional<Match> best;
  std::unique_ptr<ThingPoints> points;
  Pose T_map_thing = Pose::Identity();
  for (const Placed& whole : placed) {
    const KindModel& model = *references_[whole.reference].model;
    const Eigen::Vector3d middle = whole.T_map_kind.inverse() * entities_[thing.entity].box.centre;
    if (!model.thing().bounds().contains(middle.cast<float>())) continue;
    if (points == nullptr) points = PointsOf(thing, T_map_thing);
    if (points == nullptr) return std::nullopt;
    const Pose T_kind_thing = whole.T_map_kind.inverse() * T_map_thing;
    const std::optional<KindFit> fit = model.Register(*points, {{T_kind_thing}});
    if (!fit.has_value() || fit->overlap < options_.min_overlap ||
        fit->residual_m > options_.max_residual * model.tolerance_m()) {
      continue;
    }
    const Pose moved = T_kind_thing.inverse() * fit->T_kind_thing;
    if (moved.translation().norm() > 2.0 * model.tolerance_m()) continue;
    const double badness = fit->BadnessOfPart(model.tolerance_m());
    if (best.has_value() && badness >= best->fit.BadnessOfPart(model.tolerance_m())) continue;
    best = {whole.reference, *fit};
  }
  return best;
}

absl::Status ClassSorter::JoinPieces() {
  std::vector<Placed> placed;
  for (const Candidate& thing : things_) {
    STRATA_RETURN_IF_ERROR(stop_.status());
    const auto own = own_.find(thing.entity);
    if (own != own_.end() && !references_[own->second].members.empty() &&
        !references_[own->second].dropped) {
      placed.push_back({own->second, references_[own->second].T_map_model});
      continue;
    }
    const std::optional<Match> whole = PieceOf(thing, placed);
    auto match = matches_.find(thing.entity);
    if (whole.has_value()) {
      if (match != matches_.end())
        std::erase(references_[match->second.reference].members, thing.entity);
      Assign(thing.entity, *whole);
      match = matches_.find(thing.entity);
    }
    if (match == matches_.end()) continue;
    placed.push_back(
        {match->second.reference,
         BaseFrameOf(entities_[thing.entity].box) * match->second.fit.T_kind_thing.inverse()});
  }
  return absl::OkStatus();
}

// Gathers the kinds of all classes.
class KindGatherer {
 public:
  KindGatherer(std::span<const FoundEntity> entities, SortedKinds& sorted)
      : entities_(entities), sorted_(sorted) {}

  void Add(const ClassSorter& sorter) {
    std::vector<std::optional<EntityKind>> own(sorter.references().size());
    for (std::size_t i = 0; i < sorter.references().size(); ++i) {
      const Reference& reference = sorter.references()[i];
      if (reference.dropped || (reference.id == 0 && reference.members.empty())) continue;
      if (reference.id != 0) {
        own[i].emplace().id = reference.id;
      } else if (sorted_.found.size() < kMaxFoundKinds) {
        own[i] = Found(reference);
        sorted_.of_entity[reference.of.entity] = own[i];
      } else {
        ++sorted_.left_out;
      }
    }
    for (const auto& [entity, match] : sorter.matches()) {
      std::optional<EntityKind> kind = own[match.reference];
      if (!kind.has_value()) continue;
      kind->T_map_kind = BaseFrameOf(entities_[entity].box) * match.fit.T_kind_thing.inverse();
      kind->residual_m = match.fit.residual_m;
      kind->overlap = match.fit.overlap;
      sorted_.of_entity[entity] = kind;
    }
  }

 private:
  // The reference's own place.
  EntityKind Found(const Reference& reference) {
    const FoundEntity& entity = entities_[reference.of.entity];
    ThingKind kind;
    kind.shape.points = ThinnedInFrame(entity.voxels, reference.T_map_model, kMaxKindPoints);
    kind.info.id = KindIdOf(kind.shape);
    kind.info.class_id = entity.class_id;
    kind.info.size = entity.box.size;
    kind.info.points = kind.shape.points.size();
    EntityKind own;
    own.id = kind.info.id;
    own.T_map_kind = reference.T_map_model;
    own.overlap = 1.0;
    sorted_.found.push_back(std::move(kind));
    return own;
  }

  std::span<const FoundEntity> entities_;
  SortedKinds& sorted_;
};

// Indexes of the entities of each class, the largest first.
std::map<std::uint16_t, std::vector<std::size_t>> LargestFirst(
    std::span<const FoundEntity> entities) {
  std::map<std::uint16_t, std::vector<std::size_t>> by_class;
  for (std::size_t i = 0; i < entities.size(); ++i) by_class[entities[i].class_id].push_back(i);
  for (auto& [class_id, indexes] : by_class) {
    std::stable_sort(indexes.begin(), indexes.end(), [&](std::size_t a, std::size_t b) {
      return entities[a].voxels.size() > entities[b].voxels.size();
    });
  }
  return by_class;
}

}  // namespace

absl::Status KindOptions::Validate() const {
  OptionChecks checks("kinds");
  checks.InRange("tolerance_m", tolerance_m, 0.005, 1.0);
  checks.InRange("min_overlap", min_overlap, 1e-6, 1.0);
  checks.InRange("min_cover", min_cover, 1e-6, 1.0);
  checks.InRange("min_part_cover", min_part_cover, 1e-6, 1.0);
  checks.InRange("max_residual", max_residual, 1e-6, 1.0);
  return checks.status();
}

absl::StatusOr<SortedKinds> SortIntoKinds(std::span<const FoundEntity> entities,
                                          std::span<const ThingKind> library,
                                          const KindOptions& options,
                                          const Stop& stop,
                                          absl::FunctionRef<absl::Status(double)> progress) {
  SortedKinds sorted;
  sorted.of_entity.resize(entities.size());
  KindGatherer gatherer(entities, sorted);
  std::size_t done = 0;
  const auto count = [&](std::size_t more) {
    done += more;
    return progress(
        std::min(1.0, 0.5 * static_cast<double>(done) / static_cast<double>(entities.size())));
  };
  for (auto& [class_id, indexes] : LargestFirst(entities)) {
    if (indexes.size() > kMostSortedEntities) {
      sorted.left_out += indexes.size() - kMostSortedEntities;
      indexes.resize(kMostSortedEntities);
    }
    ClassSorter sorter(entities, options, stop, count);
    for (const ThingKind& kind : library) {
      if (kind.info.class_id == class_id) sorter.AddKnown(kind);
    }
    STRATA_RETURN_IF_ERROR(sorter.Sort(indexes));
    gatherer.Add(sorter);
  }
  return sorted;
}

}  // namespace strata
