#include "core/engine/objects/entities.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
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
#include "core/engine/models/square_points.h"
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

absl::StatusOr<std::vector<MapClass>> ClassesOf(MapCore& core) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  return reader->ListClasses();
}

// 0: every class.
absl::StatusOr<std::uint16_t> ClassAskedFor(MapCore& core, const JobArguments& arguments) {
  if (!arguments.Has("class")) return std::uint16_t{0};
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes, ClassesOf(core));
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

StoredEntity StoredFormOf(const FoundEntity& found, std::uint64_t id, const EntitySearch& search) {
  StoredEntity stored;
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

absl::Status KeepEntities(MapCore& core,
                          const EntitiesInfo& info,
                          const std::vector<StoredEntity>& entities,
                          const Stop& stop) {
  return core.writer().Run(Durability::kFull, 0, stop, [&](StorageWriter& writer) -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer.DeleteEntities());
    STRATA_RETURN_IF_ERROR(writer.PutEntityPart(info.job, {0, EncodeEntitiesInfo(info)}, {}));
    for (const StoredEntity& stored : entities) {
      std::vector<ScanNumber> scans;
      for (const StoredEntity::Seen& seen : stored.scans) scans.push_back(seen.scan);
      STRATA_RETURN_IF_ERROR(
          writer.PutEntityPart(info.job, {stored.entity.id, EncodeEntity(stored)}, scans));
    }
    return absl::OkStatus();
  });
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
                    JobContext& context) {
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

absl::StatusOr<std::uint64_t> JobOfKept(MapCore& core) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  return reader->JobOfEntities();
}

// Reads what is kept of one job's entities, part by part.
class EntityReader {
 public:
  EntityReader(MapCore& core, std::uint64_t job)
      : core_(core), job_(job), epoch_(core.snapshots().current().epoch) {}

  // nullopt: that was all.
  absl::StatusOr<std::optional<EntityPart>> Next() {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
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
    return entity;
  }

 private:
  // nullopt: it was deleted.
  absl::StatusOr<std::optional<ScanId>> IdOf(ScanNumber number) {
    const auto [found, added] = ids_.try_emplace(number, std::nullopt);
    if (!added) return found->second;
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    const absl::StatusOr<PosedScan> scan = reader->GetScan(number, epoch_);
    if (scan.ok()) {
      found->second = scan->scan.header.id;
    } else if (!absl::IsNotFound(scan.status())) {
      return scan.status();
    }
    return found->second;
  }

  MapCore& core_;
  const std::uint64_t job_;
  const std::uint64_t epoch_;
  std::optional<std::uint64_t> last_;
  HashMap<ScanNumber, std::optional<ScanId>> ids_;
};

}  // namespace

absl::Status CheckObjectsJob(MapCore& core, const JobArguments& arguments) {
  return ClassAskedFor(core, arguments).status();
}

absl::Status RunObjectsJob(MapCore& core,
                           const JobInfo& job,
                           const JobArguments& arguments,
                           JobContext& context) {
  const EntityOptions options = EntityOptionsOf(arguments);
  STRATA_RETURN_IF_ERROR(options.Validate());
  STRATA_ASSIGN_OR_RETURN(const std::uint16_t class_id, ClassAskedFor(core, arguments));
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
  std::vector<StoredEntity> entities;
  for (const FoundEntity& entity : found) {
    entities.push_back(StoredFormOf(entity, entities.size() + 1, search));
  }
  info.made = absl::Now();
  info.scans = points.scans();
  info.points = search.labelled();
  info.entities = entities.size();
  info.reaches = search.Reaches();
  STRATA_RETURN_IF_ERROR(KeepEntities(core, info, entities, context.stop()));
  ReportEntities(info, points, search, arguments, context);
  return absl::OkStatus();
}

absl::StatusOr<EntitiesInfo> ReadEntities(MapCore& core,
                                          const EntityQuery& query,
                                          const Stop& stop,
                                          absl::FunctionRef<absl::Status(const Entity&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t job, JobOfKept(core));
  if (job == 0) return absl::NotFoundError("no entities; objects find (job objects) finds them");
  EntityReader reader(core, job);
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
    if (query.Takes(*entity)) STRATA_RETURN_IF_ERROR(sink(*entity));
  }
  if (info.job != job) return absl::DataLossError("entities: their head is not there");
  return info;
}

}  // namespace strata
