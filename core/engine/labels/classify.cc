#include "core/engine/labels/classify.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/engine/labels/classifier_store.h"
#include "core/engine/labels/labelled_scans.h"
#include "core/engine/scans/damaged_scans.h"

namespace strata {
namespace {

class ScanClassifier {
 public:
  ScanClassifier(MapCore& core, Worker& worker, StoredClassifier stored, JobContext& context)
      : core_(core), worker_(worker), stored_(std::move(stored)), context_(context) {}

  absl::Status Run() {
    ScanNumber after = 0;
    while (true) {
      STRATA_ASSIGN_OR_RETURN(const std::vector<PosedScan> page, NextPage(after));
      if (page.empty()) break;
      for (const PosedScan& posed : page) STRATA_RETURN_IF_ERROR(Take(posed.scan));
      after = page.back().scan.number;
    }
    Report();
    return absl::OkStatus();
  }

 private:
  absl::StatusOr<std::vector<PosedScan>> NextPage(ScanNumber after) {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    STRATA_ASSIGN_OR_RETURN(const ScanTotals totals, reader->GetScanTotals());
    total_ = totals.scans;
    ScanQuery query;
    query.after = after;
    query.limit = 64;
    query.skip_damaged = true;  // verify names it
    return reader->ListScans(query, core_.snapshots().current().epoch);
  }

  absl::Status Take(const ScanRecord& scan) {
    STRATA_RETURN_IF_ERROR(context_.Progress(
        static_cast<double>(seen_) / static_cast<double>(std::max(total_, seen_ + 1)),
        "labelling scans"));
    ++seen_;
    if (scan.label_model == stored_.info.id) {
      ++before_;
      return absl::OkStatus();
    }
    if (!scan.has_points) {
      ++without_points_;
      return absl::OkStatus();
    }
    absl::Status done = Label(scan);
    if (absl::IsNotFound(done)) return absl::OkStatus();  // deleted meanwhile
    if (absl::IsFailedPrecondition(done)) {               // integrated, and its points dropped
      ++without_points_;
      return absl::OkStatus();
    }
    if (absl::IsDataLoss(done)) {
      STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
      damaged_.LeaveOut(*reader, scan.number, scan.header.id.ToString(), done);
      return absl::OkStatus();
    }
    if (done.ok()) ++labelled_;
    return done;
  }

  absl::Status Label(const ScanRecord& scan) {
    std::vector<std::uint16_t> labels;
    STRATA_RETURN_IF_ERROR(
        ForEachUprightPart(core_, scan, [&](const PointCloud& part) -> absl::Status {
          STRATA_ASSIGN_OR_RETURN(const ClassifiedCloud given,
                                  Classify(stored_.classifier, part, context_.stop()));
          for (std::size_t i = 0; i < part.size(); ++i) {
            const ClassName& name = stored_.classifier.classes[given.labels[i]];
            labels.push_back(part.points[i].allFinite() ? name.id : std::uint16_t{0});
          }
          return context_.Progress(
              static_cast<double>(seen_) / static_cast<double>(std::max(total_, seen_)),
              "labelling scans");
        }));
    return worker_.Execute(context_.stop(), [&](Integrator& integrator) {
      return integrator.SetModelLabels(scan.number, stored_.info.id, std::move(labels));
    });
  }

  void Report() {
    context_.SetMetric("scans_labelled", static_cast<double>(labelled_));
    context_.SetMetric("scans_labelled_before", static_cast<double>(before_));
    context_.SetMetric("scans_without_points", static_cast<double>(without_points_));
    damaged_.SetMetrics(context_);
    context_.SetMessage(absl::StrCat("classifier ",
                                     stored_.info.name,
                                     " labelled ",
                                     labelled_,
                                     " scans; ",
                                     before_,
                                     " it had labelled before",
                                     damaged_.Message()));
  }

  MapCore& core_;
  Worker& worker_;
  const StoredClassifier stored_;
  JobContext& context_;
  DamagedScans damaged_;
  std::uint64_t total_ = 0;
  std::uint64_t seen_ = 0;
  std::uint64_t labelled_ = 0;
  std::uint64_t before_ = 0;
  std::uint64_t without_points_ = 0;
};

}  // namespace

absl::Status RunClassifyJob(MapCore& core,
                            Worker& worker,
                            absl::string_view model,
                            JobContext& context) {
  STRATA_ASSIGN_OR_RETURN(StoredClassifier stored, LoadClassifier(core, model));
  return ScanClassifier(core, worker, std::move(stored), context).Run();
}

}  // namespace strata
