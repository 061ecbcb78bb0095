#include "core/engine/objects/entities.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"

#include "core/common/hash_map.h"
#include "core/common/status.h"
#include "core/completion/entities.h"
#include "core/completion/entity_codec.h"
#include "core/completion/kind_codec.h"
#include "core/completion/kinds.h"
#include "core/engine/models/square_points.h"
#include "core/engine/objects/kind_library.h"
#include "core/storage/storage.h"
#include "core/world/map_class.h"

namespace strata {
namespace {

EntityOptions EntityOptionsOf(const JobArguments& arguments) {
  EntityOptions options;
  options.distance_m = arguments.Real("distance_m");
  options.voxel_m = arguments.Real("voxel_m");
  options.min_points = static_cast<std::uint64_t>(arguments.Whole("min_points"));
  return options;
}

// 0: every class.
absl::StatusOr<std::uint16_t> ClassAskedFor(StorageReader& reader, const JobArguments& arguments) {
  if (!arguments.Has("class")) return std::uint16_t{0};
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes, reader.ListClasses());
  return ClassIdOf(classes, arguments.Text("class"));
}

// The points of a map, square by square, to the finder in its two rounds.
class EntitySearch {
 public:
  EntitySearch(SquarePoints& points,
               const EntityOptions& options,
               std::uint16_t class_id,
               JobContext& context)
      : points_(points), finder_(options), class_id_(class_id), context_(context) {}

  absl::StatusOr<std::vector<FoundEntity>> Run() {
    const std::size_t squares = points_.squares().size();
    for (std::size_t i = 0; i < squares; ++i) {
      STRATA_RETURN_IF_ERROR(Progress(0.0, i, "measuring how near points are"));
      SquareVoxels voxels = finder_.ForSpacing(points_.squares()[i]);
      STRATA_RETURN_IF_ERROR(Fill(i, voxels));
      for (const SquareVoxels::Voxel& voxel : voxels.voxels()) {
        if (voxel.own) labelled_ += voxel.points;
      }
      STRATA_RETURN_IF_ERROR(finder_.Measure(voxels, context_.stop()));
    }
    finder_.Reaches();
    for (std::size_t i = 0; i < squares; ++i) {
      STRATA_RETURN_IF_ERROR(Progress(0.45, i, "finding entities"));
      SquareVoxels voxels = finder_.ForGrowing(points_.squares()[i]);
      STRATA_RETURN_IF_ERROR(Fill(i, voxels));
      STRATA_RETURN_IF_ERROR(finder_.Grow(voxels, context_.stop()));
    }
    STRATA_RETURN_IF_ERROR(context_.Progress(0.9, "drawing boxes"));
    return finder_.Finish(context_.stop());
  }

  // Points of the classes that were asked for, and of any class.
  std::uint64_t labelled() const { return labelled_; }
  std::uint64_t of_any_class() const { return of_any_class_; }
  std::vector<ClassReach> Reaches() {
    std::vector<ClassReach> reaches;
    for (const auto& [class_id, reach] : finder_.Reaches()) reaches.push_back({class_id, reach});
    return reaches;
  }
  ScanNumber NumberOf(std::uint32_t scan) const { return numbers_[scan]; }

 private:
  absl::Status Progress(double from, std::size_t square, absl::string_view what) {
    const auto count = static_cast<double>(points_.squares().size());
    return context_.Progress(from + 0.45 * static_cast<double>(square) / count, what);
  }

  absl::Status Fill(std::size_t square, SquareVoxels& voxels) {
    const auto take = [&](ScanNumber number,
                          std::span<const LabelledPoint> points) -> absl::Status {
      STRATA_RETURN_IF_ERROR(context_.stop().status());
      of_any_class_ += points.size();
      const auto [found, added] =
          indexes_.try_emplace(number, static_cast<std::uint32_t>(numbers_.size()));
      if (added) numbers_.push_back(number);
      if (class_id_ == 0) {
        voxels.Add(points, found->second);
        return absl::OkStatus();
      }
      std::vector<LabelledPoint> wanted;
      std::copy_if(points.begin(), points.end(), std::back_inserter(wanted), [&](const auto& p) {
        return p.label == class_id_;
      });
      voxels.Add(wanted, found->second);
      return absl::OkStatus();
    };
    return points_.ForEachLabelled(square, kSquareMarginM, context_.stop(), take);
  }

  SquarePoints& points_;
  EntityFinder finder_;
  const std::uint16_t class_id_;
  JobContext& context_;
  HashMap<ScanNumber, std::uint32_t> indexes_;
  std::vector<ScanNumber> numbers_;
  std::uint64_t labelled_ = 0;
  std::uint64_t of_any_class_ = 0;
};

// A library that changes more often while entities are sorted is left as it was.
constexpr int kMostSortings = 3;

StoredEntity StoredFormOf(const FoundEntity& found,
                          std::uint64_t id,
                          const std::optional<EntityKind>& kind,
                          const EntitySearch& search) {
  StoredEntity stored;
  stored.entity.kind = kind;
  stored.entity.id = id;
  stored.entity.class_id = found.class_id;
  stored.entity.box = found.box;
  stored.entity.radius_m = found.radius_m;
  stored.entity.points = found.points;
  for (const FoundEntity::Seen& seen : found.scans) {
    stored.scans.push_back({search.NumberOf(seen.scan), seen.points});
  }
  std::sort(stored.scans.begin(), stored.scans.end(), [](const auto& a, const auto& b) {
    return a.scan < b.scan;
  });
  return stored;
}

absl::Status PutFoundKinds(StorageWriter& writer,
                           const std::vector<ThingKind>& found,
                           const EntitiesInfo& info) {
  for (const ThingKind& kind : found) {
    KindInfo head = kind.info;
    head.made = info.made;
    STRATA_RETURN_IF_ERROR(writer.PutFoundKind({head.id, "", false, EncodeKindInfo(head)},
                                               EncodeKindShape(kind.shape)));
  }
  return absl::OkStatus();
}

// False, and nothing is kept, where a person has changed the library meanwhile.
absl::StatusOr<bool> KeepEntities(MapCore& core,
                                  const EntitiesInfo& info,
                                  const std::vector<StoredEntity>& entities,
                                  const SortedKinds& kinds,
                                  const std::vector<ThingKind>* library,
                                  const Stop& stop) {
  bool same = true;
  const auto keep = [&](StorageWriter& writer) -> absl::Status {
    STRATA_RETURN_IF_ERROR(stop.status());
    if (library != nullptr) {
      STRATA_ASSIGN_OR_RETURN(same, IsLibrary(writer.reader(), *library));
      if (!same) return absl::OkStatus();
    }
    STRATA_RETURN_IF_ERROR(core.NoteInferredIfAny(writer.reader()));
    STRATA_RETURN_IF_ERROR(writer.DeleteEntities());
    STRATA_RETURN_IF_ERROR(PutFoundKinds(writer, kinds.found, info));
    STRATA_RETURN_IF_ERROR(writer.PutEntityPart(info.job, {0, EncodeEntitiesInfo(info)}, {}));
    for (const StoredEntity& stored : entities) {
      std::vector<ScanNumber> scans;
      for (const StoredEntity::Seen& seen : stored.scans) scans.push_back(seen.scan);
      STRATA_RETURN_IF_ERROR(
          writer.PutEntityPart(info.job, {stored.entity.id, EncodeEntity(stored)}, scans));
    }
    return absl::OkStatus();
  };
  STRATA_RETURN_IF_ERROR(core.Publish({}, {}, true, keep));
  return same;
}

// Sorts entities into kinds by the library as it is, and keeps both.
absl::StatusOr<SortedKinds> SortAndKeep(MapCore& core,
                                        const std::vector<FoundEntity>& found,
                                        const EntitySearch& search,
                                        EntitiesInfo& info,
                                        JobContext& context) {
  for (int sorting = 1;; ++sorting) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<ThingKind> library,
                            LoadLibrary(core, context.stop()));
    const auto progress = [&](double share) {
      return context.Progress(0.92 + 0.07 * share, "sorting entities into kinds");
    };
    STRATA_ASSIGN_OR_RETURN(SortedKinds kinds,
                            SortIntoKinds(found, library, {}, context.stop(), progress));
    std::vector<StoredEntity> entities;
    for (std::size_t i = 0; i < found.size(); ++i) {
      entities.push_back(StoredFormOf(found[i], i + 1, kinds.of_entity[i], search));
    }
    info.made = absl::FromUnixMicros(absl::ToUnixMicros(absl::Now()));
    const std::vector<ThingKind>* const expected = sorting < kMostSortings ? &library : nullptr;
    STRATA_ASSIGN_OR_RETURN(const bool kept,
                            KeepEntities(core, info, entities, kinds, expected, context.stop()));
    if (kept) return kinds;
  }
}

// How many entities are of one, and which are of none for want of room.
void ReportKinds(const SortedKinds& kinds, JobContext& context, std::string& message) {
  std::size_t sorted = 0;
  std::set<std::uint64_t> ids;
  for (const std::optional<EntityKind>& kind : kinds.of_entity) {
    if (!kind.has_value()) continue;
    ++sorted;
    ids.insert(kind->id);
  }
  context.SetMetric("kinds", static_cast<double>(ids.size()));
  context.SetMetric("kinds_found", static_cast<double>(kinds.found.size()));
  context.SetMetric("entities_of_a_kind", static_cast<double>(sorted));
  absl::StrAppend(&message, ", ", sorted, " of ", ids.size(), " kinds");
  if (kinds.left_out > 0)
    absl::StrAppend(&message, " (", kinds.left_out, " were too many to sort)");
}

// Why there is no entity, where that is so; empty otherwise.
std::string WhyNone(const EntitiesInfo& info,
                    const EntitySearch& search,
                    const JobArguments& arguments) {
  if (info.entities > 0) return "";
  const std::string where = arguments.Has("region") ? " in the region" : "";
  if (search.labelled() == 0 && arguments.Has("class")) {
    return absl::StrCat("; no point", where, " is of class ", arguments.Text("class"));
  }
  if (search.labelled() == 0) return absl::StrCat("; no point", where, " has a class");
  return absl::StrCat("; ",
                      search.labelled(),
                      " points have a class, but no ",
                      arguments.Whole("min_points"),
                      " of them lie together: try a larger distance_m or a smaller min_points");
}

void ReportEntities(const EntitiesInfo& info,
                    const SquarePoints& points,
                    const EntitySearch& search,
                    const JobArguments& arguments,
                    const SortedKinds& kinds,
                    JobContext& context) {
  std::string of_kinds;
  ReportKinds(kinds, context, of_kinds);
  context.SetMetric("entities", static_cast<double>(info.entities));
  context.SetMetric("scans", static_cast<double>(info.scans));
  context.SetMetric("points", static_cast<double>(info.points));
  context.SetMetric("scans_without_points", static_cast<double>(points.without_points()));
  for (const ClassReach& reach : info.reaches) {
    context.SetMetric(absl::StrCat("distance_m.", reach.class_id), reach.distance_m);
  }
  points.damaged().SetMetrics(context);
  context.SetMessage(absl::StrCat(info.entities,
                                  " entities of ",
                                  info.reaches.size(),
                                  " classes from ",
                                  info.scans,
                                  " scans",
                                  info.entities > 0 ? of_kinds : "",
                                  WhyNone(info, search, arguments),
                                  points.damaged().Message()));
}

// Whether any point has a class, where that is not known from those of a region.
absl::Status CheckLabels(const SquarePoints& points,
                         const EntitySearch& search,
                         const JobArguments& arguments) {
  if (search.of_any_class() > 0 || arguments.Has("region") || points.scans() == 0) {
    return absl::OkStatus();
  }
  return absl::FailedPreconditionError(
      absl::StrCat("no point of ",
                   points.scans(),
                   " scans has a class; run a classifier (classifier train, job start MAP classify "
                   "model=NAME) or upload labels (scan label) first"));
}

absl::StatusOr<std::vector<KindInfo>> KindsOf(const MapState& state) {
  STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
  return KindsIn(*reader);
}

absl::StatusOr<std::uint64_t> JobOfKept(const MapState& state) {
  STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
  return reader->JobOfEntities();
}

// Reads what is kept of one job's entities, part by part.
class EntityReader {
 public:
  EntityReader(const MapState& state, std::uint64_t job, const std::vector<KindInfo>& kinds)
      : state_(state), job_(job), epoch_(state.view().epoch) {
    for (const KindInfo& kind : kinds) kind_names_[kind.id] = kind.name;
  }

  // nullopt: that was all.
  absl::StatusOr<std::optional<EntityPart>> Next() {
    STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state_.Reader());
    STRATA_ASSIGN_OR_RETURN(std::optional<EntityPart> part, reader->FindEntityPart(job_, last_));
    if (part.has_value()) {
      last_ = part->part;
      return part;
    }
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t now, reader->JobOfEntities());
    if (now != job_) return absl::AbortedError("other entities took their place; try again");
    return part;
  }

  absl::StatusOr<Entity> Decode(const EntityPart& part) {
    STRATA_ASSIGN_OR_RETURN(StoredEntity stored, DecodeEntity(part.bytes));
    Entity entity = std::move(stored.entity);
    for (const StoredEntity::Seen& seen : stored.scans) {
      STRATA_ASSIGN_OR_RETURN(const std::optional<ScanId> id, IdOf(seen.scan));
      if (id.has_value()) {
        entity.scans.push_back({*id, seen.points});
      } else {
        entity.points -= seen.points;
      }
    }
    NameKind(entity.kind);
    return entity;
  }

 private:
  // Kinds that were deleted since are none.
  void NameKind(std::optional<EntityKind>& kind) const {
    if (!kind.has_value()) return;
    const auto found = kind_names_.find(kind->id);
    if (found == kind_names_.end()) {
      kind.reset();
    } else {
      kind->name = found->second;
    }
  }

  // nullopt: it was deleted.
  absl::StatusOr<std::optional<ScanId>> IdOf(ScanNumber number) {
    const auto [found, added] = ids_.try_emplace(number, std::nullopt);
    if (!added) return found->second;
    STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state_.Reader());
    const absl::StatusOr<PosedScan> scan = reader->GetScan(number, epoch_);
    if (scan.ok()) {
      found->second = scan->scan.header.id;
    } else if (!absl::IsNotFound(scan.status())) {
      return scan.status();
    }
    return found->second;
  }

  const MapState& state_;
  const std::uint64_t job_;
  const std::uint64_t epoch_;
  HashMap<std::uint64_t, std::string> kind_names_;
  std::optional<std::uint64_t> last_;
  HashMap<ScanNumber, std::optional<ScanId>> ids_;
};

}  // namespace

absl::Status CheckObjectsJob(StorageReader& reader, const JobArguments& arguments) {
  return ClassAskedFor(reader, arguments).status();
}

absl::Status RunObjectsJob(MapCore& core,
                           const JobInfo& job,
                           const JobArguments& arguments,
                           JobContext& context) {
  const EntityOptions options = EntityOptionsOf(arguments);
  STRATA_RETURN_IF_ERROR(options.Validate());
  std::uint16_t class_id = 0;
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
    STRATA_ASSIGN_OR_RETURN(class_id, ClassAskedFor(*reader, arguments));
  }
  EntitiesInfo info;
  info.job = job.id;
  info.epoch = core.snapshots().current().epoch;
  PointChoice choice;
  choice.labels = true;
  if (arguments.Has("region")) choice.region = arguments.Box("region");
  SquarePoints points(core, choice);
  STRATA_RETURN_IF_ERROR(points.ListScans(info.epoch, context.stop()));
  EntitySearch search(points, options, class_id, context);
  STRATA_ASSIGN_OR_RETURN(const std::vector<FoundEntity> found, search.Run());
  STRATA_RETURN_IF_ERROR(CheckLabels(points, search, arguments));
  info.scans = points.scans();
  info.points = search.labelled();
  info.entities = found.size();
  info.reaches = search.Reaches();
  STRATA_ASSIGN_OR_RETURN(const SortedKinds kinds, SortAndKeep(core, found, search, info, context));
  ReportEntities(info, points, search, arguments, kinds, context);
  return absl::OkStatus();
}

absl::StatusOr<EntitiesInfo> ReadEntities(const MapState& state,
                                          const EntityQuery& query,
                                          const Stop& stop,
                                          absl::FunctionRef<absl::Status(const Entity&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t job, JobOfKept(state));
  if (job == 0) return absl::NotFoundError("no entities; objects find (job objects) finds them");
  STRATA_ASSIGN_OR_RETURN(const std::vector<KindInfo> kinds, KindsOf(state));
  std::uint64_t kind = 0;
  if (!query.kind.empty()) {
    STRATA_ASSIGN_OR_RETURN(const KindInfo asked, KindCalled(kinds, query.kind));
    kind = asked.id;
  }
  EntityReader reader(state, job, kinds);
  EntitiesInfo info;
  while (true) {
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_ASSIGN_OR_RETURN(const std::optional<EntityPart> part, reader.Next());
    if (!part.has_value()) break;
    if (part->part == 0) {
      STRATA_ASSIGN_OR_RETURN(info, DecodeEntitiesInfo(part->bytes));
      continue;
    }
    const absl::StatusOr<Entity> entity = reader.Decode(*part);
    if (absl::IsDataLoss(entity.status())) {
      return absl::DataLossError(absl::StrCat("entity ",
                                              part->part,
                                              ": ",
                                              entity.status().message(),
                                              "; objects find finds them anew"));
    }
    STRATA_RETURN_IF_ERROR(entity.status());
    if (kind != 0 && (!entity->kind.has_value() || entity->kind->id != kind)) continue;
    if (query.Takes(*entity)) STRATA_RETURN_IF_ERROR(sink(*entity));
  }
  if (info.job != job) return absl::DataLossError("entities: their head is not there");
  return info;
}

absl::StatusOr<std::vector<KindInfo>> CountKinds(const MapState& state, const Stop& stop) {
  HashMap<std::uint64_t, std::uint64_t> counts;
  const absl::Status read = ReadEntities(state, {}, stop, [&](const Entity& entity) {
                              if (entity.kind.has_value()) ++counts[entity.kind->id];
                              return absl::OkStatus();
                            }).status();
  if (!absl::IsNotFound(read) && !absl::IsDataLoss(read)) STRATA_RETURN_IF_ERROR(read);
  STRATA_ASSIGN_OR_RETURN(std::vector<KindInfo> kinds, KindsOf(state));
  for (KindInfo& kind : kinds) {
    const auto found = counts.find(kind.id);
    if (found != counts.end()) kind.entities = found->second;
  }
  return kinds;
}

}  // namespace strata
