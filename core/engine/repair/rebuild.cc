#include "core/engine/repair/rebuild.h"

#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/engine/map/steady_view.h"
#include "core/engine/models/plane_models.h"
#include "core/engine/objects/completion.h"
#include "core/engine/objects/entities.h"
#include "core/engine/objects/kind_library.h"
#include "core/engine/repair/derived_pass.h"
#include "core/engine/repair/truth_check.h"
#include "core/engine/tiles/staged_tiles.h"
#include "core/engine/tiles/tile_check.h"

namespace strata {
namespace {

// Counts mismatches and names them, up to as many as a person would read.
class Findings final : public DerivedSink {
 public:
  absl::Status Differs(const DerivedDifferences& differences) override {
    for (const auto& [key, tile] : differences.tiles) {
      Add(absl::StrCat("tile ", key.ToString(), " (statistics)"));
    }
    for (const SurfaceTileRow& row : differences.surfaces) {
      Add(absl::StrCat("tile ", row.key.ToString(), " (served)"));
    }
    for (const ScanNumber number : differences.scans) {
      Add(absl::StrCat("indexes of scan number ", number));
    }
    return absl::OkStatus();
  }
  void Add(const std::string& what) {
    ++count_;
    if (count_ <= kNamed) absl::StrAppend(&named_, named_.empty() ? "" : ", ", what);
  }
  void AddTruth(const std::string& what) {
    truth_damaged_ = true;
    Add(what);
  }
  std::uint64_t count() const { return count_; }
  absl::Status Verdict() const {
    if (count_ == 0) return absl::OkStatus();
    const std::string more =
        count_ > kNamed ? absl::StrCat(", and ", count_ - kNamed, " more") : "";
    return absl::DataLossError(absl::StrCat(
        count_,
        count_ == 1 ? " mismatch: " : " mismatches: ",
        named_,
        more,
        truth_damaged_
            ? "; no rebuild makes scans again: put back a copy of the map's file, or delete the "
              "scan and upload it again"
            : "; a rebuild mends tiles"));
  }

 private:
  static constexpr std::uint64_t kNamed = 1000;
  std::uint64_t count_ = 0;
  bool truth_damaged_ = false;
  std::string named_;
};

// Stores differences until they are published.
class Repairs final : public DerivedSink {
 public:
  explicit Repairs(StagedTiles& staged) : staged_(staged) {}
  absl::Status Differs(const DerivedDifferences& differences) override {
    return staged_.Put(differences.tiles, differences.surfaces);
  }

 private:
  StagedTiles& staged_;
};

absl::Status PutIndexes(StorageWriter& writer, const ScanIndexes& indexes) {
  STRATA_RETURN_IF_ERROR(writer.DeleteOrphanIndexes());
  for (const auto& [number, index] : indexes) {
    STRATA_RETURN_IF_ERROR(writer.SetTilesOfScan(number, index.tiles));
    STRATA_RETURN_IF_ERROR(writer.SetFootprint(number, index.footprint));
  }
  return absl::OkStatus();
}

absl::Status Verify(MapCore& core, const SteadyView& view, int threads, JobContext& context) {
  Findings findings;
  TruthCheck truth(core, view, context);
  STRATA_RETURN_IF_ERROR(truth.Run([&](const std::string& what) { findings.AddTruth(what); }));
  std::uint64_t tiles = 0;
  if (findings.count() == 0) {
    STRATA_ASSIGN_OR_RETURN(const MapInfo info, view.readers.front()->GetMapInfo());
    MlsTileStore store(core);
    DerivedPass pass(core,
                     store,
                     {.epoch = view.clock.epoch,
                      .version = view.clock.tile_version,
                      .profile = info.parameters.default_profile,
                      .threads = threads,
                      .view = &view},
                     context);
    STRATA_RETURN_IF_ERROR(pass.Run(findings));
    tiles = pass.tiles();
  } else {
    // Without sound points nothing can be said about what should follow from them.
    STRATA_ASSIGN_OR_RETURN(tiles, CheckTilesAlone(view, context, [&](const std::string& what) {
                              findings.Add(what);
                            }));
  }
  if (const absl::Status kept = CheckKeptTiles(core, view, context); absl::IsDataLoss(kept)) {
    findings.Add(absl::StrCat("prepared tiles: ", kept.message()));
  } else {
    STRATA_RETURN_IF_ERROR(kept);
  }
  const absl::Status planes = ReadPlaneModel(MapState(core), context.stop(), [](const ModelPlane&) {
                                return absl::OkStatus();
                              }).status();
  if (absl::IsDataLoss(planes)) findings.Add(std::string(planes.message()));
  const absl::Status entities = ReadEntities(MapState(core), {}, context.stop(), [](const Entity&) {
                                  return absl::OkStatus();
                                }).status();
  if (absl::IsDataLoss(entities)) findings.Add(std::string(entities.message()));
  const absl::Status inferred =
      ReadInferred(MapState(core), {}, context.stop(), [](const InferredPart&) {
        return absl::OkStatus();
      }).status();
  if (absl::IsDataLoss(inferred)) findings.Add(std::string(inferred.message()));
  const absl::Status kinds = CheckKinds(core, context.stop());
  if (absl::IsDataLoss(kinds)) findings.Add(std::string(kinds.message()));
  context.SetMetric("tiles_checked", static_cast<double>(tiles));
  context.SetMetric("scans_checked", static_cast<double>(truth.scans()));
  context.SetMetric("pieces_checked", static_cast<double>(truth.pieces()));
  context.SetMetric("mismatches", static_cast<double>(findings.count()));
  context.SetMessage(absl::StrCat(truth.scans(), " scans and all tiles are as they should be"));
  return findings.Verdict();
}

}  // namespace

absl::Status RunRebuildJob(Integrator& integrator, int threads, JobContext& context) {
  integrator.store().Clear();
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t version, integrator.NextVersion());
  StagedTiles staged(integrator.core(), version);
  Repairs repairs(staged);
  DerivedPass pass(integrator.core(),
                   integrator.store(),
                   {.epoch = integrator.core().snapshots().current().epoch,
                    .version = version,
                    .profile = integrator.core().info().parameters.default_profile,
                    .threads = threads},
                   context);
  STRATA_RETURN_IF_ERROR(pass.Run(repairs));
  const absl::Status published = staged.Publish({}, [&](StorageWriter& writer) -> absl::Status {
    STRATA_RETURN_IF_ERROR(writer.DeletePlaneModel());  // made when a person asks for it
    STRATA_RETURN_IF_ERROR(integrator.core().NoteInferredIfAny(writer.reader()));
    STRATA_RETURN_IF_ERROR(writer.DeleteEntities());  // as well, with their kinds
    return PutIndexes(writer, pass.indexes());
  });
  integrator.store().Clear();
  STRATA_RETURN_IF_ERROR(published);
  context.SetMetric("scans", static_cast<double>(pass.scans()));
  context.SetMetric("tiles", static_cast<double>(pass.tiles()));
  context.SetMetric("tiles_changed", static_cast<double>(staged.changed()));
  context.SetMessage(absl::StrCat("rebuilt ",
                                  pass.tiles(),
                                  " tiles from ",
                                  pass.scans(),
                                  " scans, ",
                                  staged.changed(),
                                  " changed"));
  return absl::OkStatus();
}

absl::Status RunVerifyJob(MapCore& core, int threads, JobContext& context) {
  return WithSteadyView(core, threads, context.stop(), [&](const SteadyView& view) {
    return Verify(core, view, threads, context);
  });
}

absl::Status RecoverDerived(Integrator& integrator, const Stop& closing) {
  SilentContext context(closing);
  return RunRebuildJob(integrator, integrator.core().options().worker_threads, context);
}

}  // namespace strata
