#include "core/engine/objects/completion.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/status.h"
#include "core/completion/inferred_codec.h"
#include "core/completion/prototype.h"
#include "core/completion/shape_view.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/objects/entities.h"
#include "core/engine/objects/kind_library.h"
#include "core/engine/objects/thing_views.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/storage/storage.h"
#include "core/world/things/kind.h"

namespace strata {
namespace {

// That a job infers at most, so that it can hold them until they are written.
constexpr std::uint64_t kMostPointsOfJob = 10'000'000;

// The entities of each kind, those with most points first.
using ThingsOfKinds = absl::btree_map<std::uint64_t, std::vector<Entity>>;

absl::StatusOr<ThingsOfKinds> ThingsWithKinds(MapCore& core,
                                              const EntityQuery& query,
                                              std::uint64_t epoch,
                                              const Stop& stop) {
  ThingsOfKinds things;
  STRATA_ASSIGN_OR_RETURN(const EntitiesInfo info,
                          ReadEntities(MapState(core), query, stop, [&](const Entity& entity) {
                            if (entity.kind.has_value()) things[entity.kind->id].push_back(entity);
                            return absl::OkStatus();
                          }));
  if (info.epoch != epoch) {
    return absl::FailedPreconditionError(
        absl::StrCat("the entities stand on the poses of epoch ",
                     info.epoch,
                     ", the map on those of epoch ",
                     epoch,
                     "; objects find (job objects) finds them anew"));
  }
  for (auto& [kind, of_kind] : things) {
    std::stable_sort(of_kind.begin(), of_kind.end(), [](const Entity& a, const Entity& b) {
      return a.points > b.points;
    });
  }
  return things;
}

// What a job inferred, until it is kept.
struct Inferred {
  InferredInfo info;
  absl::btree_map<std::uint64_t, InferredPart> parts;                 // by entity
  absl::btree_map<std::uint64_t, absl::btree_set<ScanNumber>> scans;  // that a kind was seen by
  std::uint64_t of_other_kind = 0;  // entities that rays contradict
  std::uint64_t too_little = 0;     // entities of which too little was seen
  std::uint64_t symmetric = 0;      // kinds
  std::uint64_t too_large = 0;      // kinds
  DamagedScans damaged;
};

// Every second of them, as often as it takes.
void ThinOut(std::vector<Eigen::Vector3d>& points) {
  while (points.size() > kMostInferredPoints) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points.size(); i += 2) points[kept++] = points[i];
    points.resize(kept);
  }
}

// Points of the shape that a library has of a kind; none if it has not.
std::vector<Eigen::Vector3d> KnownShape(const std::vector<ThingKind>& library, std::uint64_t kind) {
  std::vector<Eigen::Vector3d> points;
  for (const ThingKind& known : library) {
    if (known.info.id != kind) continue;
    for (const Eigen::Vector3f& p : known.shape.points) points.emplace_back(p.cast<double>());
  }
  return points;
}

// Completes the entities of one kind after the other.
class Completer {
 public:
  Completer(MapCore& core, std::uint64_t epoch, double voxel_m, JobContext& context, Inferred& out)
      : core_(core), epoch_(epoch), voxel_m_(voxel_m), context_(context), out_(out) {}

  // The prototype is of as many things as fit into memory, those that were seen best, and of
  // `known`, what the library has of the kind's shape.
  absl::Status Complete(std::span<const Entity> entities,
                        const std::vector<Eigen::Vector3d>& known) {
    const std::vector<WholeThing> things = WholeThingsOf(entities);
    Eigen::AlignedBox3d box = BoxOfKind(things);
    for (const Eigen::Vector3d& p : known) box.extend(p);
    const double voxel_m = ShapeVoxelM(box, voxel_m_);
    if (absl::IsInvalidArgument(ShapeView::Over(box, voxel_m).status())) {
      ++out_.too_large;
      return absl::OkStatus();
    }
    const std::size_t most = ThingsAtATime(box, voxel_m);
    std::optional<Prototype> prototype;
    for (std::size_t begin = 0; begin < things.size(); begin += most) {
      const std::span<const WholeThing> some =
          std::span(things).subspan(begin, std::min(most, things.size() - begin));
      STRATA_ASSIGN_OR_RETURN(
          ThingViews views,
          ReadThingViews(core_, epoch_, some, box, voxel_m, out_.damaged, context_.stop()));
      out_.scans[entities[0].kind->id].insert(views.scans.begin(), views.scans.end());
      if (!prototype.has_value()) {
        STRATA_ASSIGN_OR_RETURN(ShapeView view, ShapeView::Over(box, voxel_m));
        view.AddPoints(known);
        if (!known.empty()) views.views.push_back(std::move(view));
        STRATA_ASSIGN_OR_RETURN(prototype, BuildPrototype(views.views, context_.stop()));
        out_.symmetric += prototype->mirror.has_value() ? 1 : 0;
      }
      STRATA_RETURN_IF_ERROR(AddParts(*prototype, some, views.views));
    }
    ++out_.info.kinds;
    return absl::OkStatus();
  }

 private:
  absl::Status AddParts(const Prototype& prototype,
                        std::span<const WholeThing> things,
                        const std::vector<ShapeView>& views) {
    for (std::size_t i = 0; i < things.size(); ++i) {
      STRATA_RETURN_IF_ERROR(context_.stop().status());
      Inference inference = InferHidden(prototype, views[i]);
      ThinOut(inference.points);
      const Entity& entity = things[i].entity;
      InferredPart& part = out_.parts[entity.id];
      part.entity = entity.id;
      part.kind = entity.kind->id;
      part.agreeing = inference.agreeing;
      part.contradicting = inference.contradicting;
      for (const Eigen::Vector3d& p : inference.points) {
        part.points.emplace_back(entity.kind->T_map_kind * p);
      }
      out_.of_other_kind += inference.IsOfKind() ? 0 : 1;
      out_.too_little += inference.IsOfKind() && !inference.IsSeenEnough() ? 1 : 0;
      out_.info.points += part.points.size();
      ++out_.info.entities;
    }
    if (out_.info.points <= kMostPointsOfJob) return absl::OkStatus();
    return absl::ResourceExhaustedError(
        absl::StrCat("complete: more than ", kMostPointsOfJob, " points; take a larger voxel_m"));
  }

  MapCore& core_;
  const std::uint64_t epoch_;
  const double voxel_m_;
  JobContext& context_;
  Inferred& out_;
};

// Leaves out the kinds that a scan has seen which was deleted meanwhile. Inside the commit.
absl::Status ForgetDeleted(StorageReader& reader, Inferred& inferred) {
  for (const auto& [kind, scans] : inferred.scans) {
    for (const ScanNumber scan : scans) {
      STRATA_ASSIGN_OR_RETURN(const bool there, IsThere(reader, scan, inferred.info.epoch));
      if (there) continue;
      absl::erase_if(inferred.parts,
                     [k = kind](const auto& part) { return part.second.kind == k; });
      break;
    }
  }
  return absl::OkStatus();
}

absl::Status KeepInferred(MapCore& core, Inferred& inferred, const Stop& stop) {
  return core.Publish({}, {}, true, [&](StorageWriter& writer) -> absl::Status {
    STRATA_RETURN_IF_ERROR(stop.status());
    core.NoteInferred();
    const std::uint64_t job = inferred.info.job;
    STRATA_RETURN_IF_ERROR(ForgetDeleted(writer.reader(), inferred));
    STRATA_RETURN_IF_ERROR(writer.DeleteInferred());
    STRATA_RETURN_IF_ERROR(writer.PutInferredPart(job, 0, {0, EncodeInferredInfo(inferred.info)}));
    for (const auto& [entity, part] : inferred.parts) {
      STRATA_RETURN_IF_ERROR(
          writer.PutInferredPart(job, part.kind, {entity, EncodeInferredPart(part)}));
    }
    for (const auto& [kind, scans] : inferred.scans) {
      for (const ScanNumber scan : scans) {
        STRATA_RETURN_IF_ERROR(writer.PutInferredScan(kind, scan));
      }
    }
    return absl::OkStatus();
  });
}

void ReportInferred(const Inferred& inferred, JobContext& context) {
  const InferredInfo& info = inferred.info;
  context.SetMetric("kinds", static_cast<double>(info.kinds));
  context.SetMetric("entities", static_cast<double>(info.entities));
  context.SetMetric("points", static_cast<double>(info.points));
  context.SetMetric("contradicted", static_cast<double>(inferred.of_other_kind));
  context.SetMetric("too_little_seen", static_cast<double>(inferred.too_little));
  context.SetMetric("symmetric", static_cast<double>(inferred.symmetric));
  context.SetMetric("too_large", static_cast<double>(inferred.too_large));
  inferred.damaged.SetMetrics(context);
  std::string message = absl::StrCat(
      info.points, " points inferred of ", info.entities, " entities of ", info.kinds, " kinds");
  if (inferred.of_other_kind > 0) {
    absl::StrAppend(
        &message, "; ", inferred.of_other_kind, " look different and were left as they are");
  }
  if (inferred.too_little > 0) {
    absl::StrAppend(&message, "; of ", inferred.too_little, " too little was seen");
  }
  if (inferred.too_large > 0) {
    absl::StrAppend(&message, "; ", inferred.too_large, " kinds are too large");
  }
  context.SetMessage(message + inferred.damaged.Message());
}

// Reads what is kept of one job, part by part.
class InferredReader {
 public:
  InferredReader(const MapState& state, std::uint64_t job) : state_(state), job_(job) {}

  // nullopt: that was all.
  absl::StatusOr<std::optional<EntityPart>> Next() {
    STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state_.Reader());
    STRATA_ASSIGN_OR_RETURN(std::optional<EntityPart> part, reader->FindInferredPart(job_, last_));
    if (part.has_value()) {
      last_ = part->part;
      return part;
    }
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t now, reader->JobOfInferred());
    if (now != job_) return absl::AbortedError("what was inferred has changed; try again");
    return part;
  }

 private:
  const MapState& state_;
  const std::uint64_t job_;
  std::optional<std::uint64_t> last_;
};

absl::StatusOr<std::uint64_t> JobOfKeptInferred(const MapState& state) {
  STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t job, reader->JobOfInferred());
  if (job != 0) return job;
  return absl::NotFoundError(
      "nothing is inferred; objects complete (job complete) does so after objects find");
}

// Which entities a query takes, wherever they are: what nobody saw of one may be outside of its
// box.
absl::StatusOr<absl::btree_set<std::uint64_t>> EntitiesAskedFor(const MapState& state,
                                                                EntityQuery query,
                                                                const Stop& stop) {
  query.region.reset();
  absl::btree_set<std::uint64_t> asked;
  STRATA_RETURN_IF_ERROR(ReadEntities(state, query, stop, [&](const Entity& entity) {
                           asked.insert(entity.id);
                           return absl::OkStatus();
                         }).status());
  return asked;
}

bool ReachesInto(const std::optional<Eigen::AlignedBox3d>& region, const InferredPart& part) {
  return !region.has_value() ||
         std::any_of(part.points.begin(), part.points.end(), [&](const Eigen::Vector3d& p) {
           return region->contains(p);
         });
}

}  // namespace

absl::Status RunCompleteJob(MapCore& core,
                            const JobInfo& job,
                            const JobArguments& arguments,
                            JobContext& context) {
  Inferred inferred;
  inferred.info.job = job.id;
  inferred.info.epoch = core.snapshots().current().epoch;
  EntityQuery query;
  if (arguments.Has("kind")) query.kind = arguments.Text("kind");
  STRATA_ASSIGN_OR_RETURN(const ThingsOfKinds things,
                          ThingsWithKinds(core, query, inferred.info.epoch, context.stop()));
  if (things.empty()) {
    return absl::FailedPreconditionError(
        "no entity has a kind; objects find gives one to things of a shape that a map has twice, "
        "or that kind import brought");
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<ThingKind> library, LoadLibrary(core, context.stop()));
  Completer completer(core, inferred.info.epoch, arguments.Real("voxel_m"), context, inferred);
  std::size_t done = 0;
  for (const auto& [kind, of_kind] : things) {
    STRATA_RETURN_IF_ERROR(
        context.Progress(0.95 * static_cast<double>(done++) / static_cast<double>(things.size()),
                         "completing kinds"));
    STRATA_RETURN_IF_ERROR(completer.Complete(of_kind, KnownShape(library, kind)));
  }
  inferred.info.made = absl::Now();
  STRATA_RETURN_IF_ERROR(KeepInferred(core, inferred, context.stop()));
  ReportInferred(inferred, context);
  return absl::OkStatus();
}

absl::StatusOr<InferredInfo> ReadInferred(
    const MapState& state,
    const EntityQuery& query,
    const Stop& stop,
    absl::FunctionRef<absl::Status(const InferredPart&)> sink) {
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t job, JobOfKeptInferred(state));
  STRATA_ASSIGN_OR_RETURN(const absl::btree_set<std::uint64_t> asked,
                          EntitiesAskedFor(state, query, stop));
  InferredReader reader(state, job);
  InferredInfo info;
  while (true) {
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_ASSIGN_OR_RETURN(const std::optional<EntityPart> stored, reader.Next());
    if (!stored.has_value()) break;
    if (stored->part == 0) {
      STRATA_ASSIGN_OR_RETURN(info, DecodeInferredInfo(stored->bytes));
      continue;
    }
    if (!asked.contains(stored->part)) continue;
    const absl::StatusOr<InferredPart> part = DecodeInferredPart(stored->bytes);
    if (absl::IsDataLoss(part.status())) {
      return absl::DataLossError(absl::StrCat("entity ",
                                              stored->part,
                                              ": ",
                                              part.status().message(),
                                              "; objects complete infers it anew"));
    }
    STRATA_RETURN_IF_ERROR(part.status());
    if (ReachesInto(query.region, *part)) STRATA_RETURN_IF_ERROR(sink(*part));
  }
  if (info.job != job) return absl::DataLossError("inferred parts: their head is not there");
  return info;
}

}  // namespace strata
