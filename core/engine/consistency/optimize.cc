#include "core/engine/consistency/optimize.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "core/common/status.h"
#include "core/engine/consistency/closure_search.h"
#include "core/engine/consistency/graph_world.h"
#include "core/engine/consistency/optimize_settings.h"
#include "core/engine/consistency/optimize_verdict.h"
#include "core/engine/consistency/proposal.h"
#include "core/engine/map/parallel.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/engine/scans/matching.h"
#include "core/engine/scans/scan_views.h"
#include "core/posegraph/alignment/alignment.h"
#include "core/posegraph/closures/closure_consistency.h"

namespace strata {
namespace {

// Shares of the whole job.
constexpr double kClosuresEnd = 0.3;
constexpr double kAlignmentEnd = 0.8;

// Progress of a part of the job, as the job's own.
class PartOfJob final : public JobContext {
 public:
  PartOfJob(JobContext& whole, double begin, double end)
      : whole_(whole), begin_(begin), end_(end) {}
  absl::Status Progress(double progress, absl::string_view phase) override {
    return whole_.Progress(begin_ + (end_ - begin_) * progress, phase);
  }
  const Stop& stop() const override { return whole_.stop(); }
  void SetMetric(const std::string& name, double value) override { whole_.SetMetric(name, value); }
  void SetMessage(std::string message) override { whole_.SetMessage(std::move(message)); }
  void SetProposed() override { whole_.SetProposed(); }
  void SetAccepted() override { whole_.SetAccepted(); }

 private:
  JobContext& whole_;
  const double begin_;
  const double end_;
};

struct Proposed {
  std::uint64_t base_epoch = 0;  // that the proposal is of
  std::string summary;           // for people
  bool is_sound = true;          // worth an epoch without a person's word
};

class Optimizer {
 public:
  Optimizer(MapCore& core,
            const OptimizeSettings& settings,
            int threads,
            const JobInfo& job,
            DamagedScans& damaged,
            JobContext& context)
      : core_(core),
        settings_(settings),
        threads_(threads),
        job_(job),
        damaged_(damaged),
        context_(context) {}

  // Leaves the proposal in the store.
  absl::StatusOr<Proposed> Propose() {
    STRATA_RETURN_IF_ERROR(context_.Progress(0.0, "reading the pose graph"));
    STRATA_ASSIGN_OR_RETURN(GraphWorld world, GraphWorld::Read(core_, &damaged_));
    ScanViews views(ScanAccess(core_), world.Scans(), &damaged_);
    std::vector<FoundClosure> closures;
    std::vector<Pose> start = world.Poses();
    if (settings_.closures) {
      PartOfJob part(context_, 0.0, kClosuresEnd);
      STRATA_ASSIGN_OR_RETURN(ClosureSearch search,
                              SearchClosures(world, views, 0, settings_, threads_, part));
      closures = std::move(search.closures);
      start = std::move(search.T_map_scan);
      context_.SetMetric("closures_tried", static_cast<double>(search.tried));
      context_.SetMetric("closures_matched", static_cast<double>(search.matched));
    }
    AlignmentProblem problem = world.Problem(settings_);
    problem.T_map_scan = std::move(start);
    for (const FoundClosure& closure : closures) {
      problem.pairs.push_back({closure.i, closure.j});
    }
    STRATA_ASSIGN_OR_RETURN(const AlignmentResult result, Align(problem, views));
    STRATA_RETURN_IF_ERROR(Store(world, result, KeptClosures(world, closures, result)));
    STRATA_ASSIGN_OR_RETURN(const OptimizeVerdict verdict,
                            VerdictOn(world, views, result, damaged_));
    context_.SetMetric("steps", static_cast<double>(verdict.steps));
    context_.SetMetric("steps_loose", static_cast<double>(verdict.loose_steps.size()));
    context_.SetMetric("steps_sliding", static_cast<double>(verdict.sliding_steps.size()));
    context_.SetMetric("parts_apart", static_cast<double>(verdict.apart.size()));
    context_.SetMetric("pairs_compared", static_cast<double>(verdict.compared));
    context_.SetMetric("pairs_contradicted",
                       static_cast<double>(verdict.contradicted_pairs.size()));
    return Proposed{
        world.epoch(), absl::StrCat(Report(world, result), " ", verdict.message), verdict.is_sound};
  }

 private:
  absl::StatusOr<AlignmentResult> Align(const AlignmentProblem& problem, ScanViews& views) {
    AlignmentOptions options;
    options.registration = EngineRegistrationOptions();
    options.planes = settings_.planes;
    options.directions = settings_.directions;
    options.max_rounds = settings_.rounds;
    options.pose_graph.weighting = settings_.weighting;
    options.pose_graph.local_weight = settings_.local_weight;
    return AlignScans(
        problem,
        views,
        options,
        [this](std::size_t count, absl::FunctionRef<absl::Status(std::size_t)> body) {
          return ParallelFor(threads_, count, [&](int, std::size_t k) { return body(k); });
        },
        [this](double progress) {
          return context_.Progress(kClosuresEnd + (kAlignmentEnd - kClosuresEnd) * progress,
                                   "aligning scans and planes");
        },
        context_.stop());
  }

  // The closures that the final poses agree with.
  std::vector<ConstraintRecord> KeptClosures(const GraphWorld& world,
                                             const std::vector<FoundClosure>& closures,
                                             const AlignmentResult& result) const {
    std::vector<ConstraintRecord> kept;
    for (const FoundClosure& closure : closures) {
      if (!ClosureHolds(
              closure.T_i_j, result.T_map_scan[closure.i], result.T_map_scan[closure.j])) {
        continue;
      }
      ConstraintRecord record;
      record.scan_i = world.number(closure.i);
      record.scan_j = world.number(closure.j);
      record.constraint.T_i_j = closure.T_i_j;
      record.constraint.information = closure.information;
      record.constraint.origin = ConstraintOrigin::kOptimize;
      record.constraint.note = closure.note;
      kept.push_back(std::move(record));
    }
    return kept;
  }

  absl::Status Store(const GraphWorld& world,
                     const AlignmentResult& result,
                     const std::vector<ConstraintRecord>& closures) {
    std::vector<PlaneRecord> planes = world.DisabledPlanes();
    for (const SharedPlane& plane : result.planes) planes.push_back(world.RecordOf(plane));
    context_.SetMetric("closures", static_cast<double>(closures.size()));
    const std::set<ScanNumber> damaged = damaged_.Scans();
    return core_.writer().Run(
        Durability::kFull, 0, context_.stop(), [&](StorageWriter& writer) -> absl::Status {
          STRATA_RETURN_IF_ERROR(writer.DiscardProposal(job_.id));
          for (std::size_t k = 0; k < result.T_map_scan.size(); ++k) {
            if (damaged.contains(world.number(k))) continue;  // its neighbours carry it
            STRATA_RETURN_IF_ERROR(
                writer.ProposePose(job_.id, {world.number(k), result.T_map_scan[k]}));
          }
          for (const ConstraintRecord& record : closures) {
            STRATA_RETURN_IF_ERROR(writer.ProposeConstraint(job_.id, record));
          }
          for (const PlaneRecord& record : planes) {
            STRATA_RETURN_IF_ERROR(writer.ProposePlane(job_.id, record));
          }
          return absl::OkStatus();
        });
  }

  std::string Report(const GraphWorld& world, const AlignmentResult& result) {
    for (std::size_t r = 0; r < result.rounds.size(); ++r) {
      const AlignmentRound& round = result.rounds[r];
      const std::string name = absl::StrCat("round.", r + 1, ".");
      context_.SetMetric(name + "matches", static_cast<double>(round.matches));
      context_.SetMetric(name + "registered", static_cast<double>(round.registered));
      context_.SetMetric(name + "planes", static_cast<double>(round.planes));
      context_.SetMetric(name + "directions", static_cast<double>(round.directions));
      context_.SetMetric(name + "cost_before", round.before.total());
      context_.SetMetric(name + "cost_after", round.after.total());
      context_.SetMetric(name + "max_shift_m", round.max_shift_m);
      context_.SetMetric(name + "max_turn_rad", round.max_turn_rad);
    }
    if (!result.rounds.empty()) {
      const PoseGraphCosts& costs = result.rounds.back().after;
      context_.SetMetric("cost.relative", costs.relative);
      context_.SetMetric("cost.planes", costs.planes);
      context_.SetMetric("cost.directions", costs.directions);
      context_.SetMetric("cost.priors", costs.priors);
    }
    for (const NodeResidual& worst : result.worst_nodes) {
      context_.SetMetric(absl::StrCat("worst.", world.id(worst.node).ToString()), worst.chi2);
    }
    context_.SetMetric("settled", result.termination == AlignmentTermination::kSettled ? 1.0 : 0.0);
    context_.SetMetric("scans", static_cast<double>(world.size()));
    context_.SetMetric("planes", static_cast<double>(result.planes.size()));
    ReportRejected(world, result);
    double squares = 0.0;
    double largest = 0.0;
    for (std::size_t k = 0; k < world.size(); ++k) {
      const double shift =
          (result.T_map_scan[k].translation() - world.Poses()[k].translation()).norm();
      squares += shift * shift;
      largest = std::max(largest, shift);
    }
    const double rms =
        std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, world.size())));
    context_.SetMetric("shift_rms_m", rms);
    context_.SetMetric("shift_max_m", largest);
    return absl::StrFormat(
        "%d scans, %d planes: moved by %.3f m rms, %.3f m at most; %s after %d %s.",
        world.size(),
        result.planes.size(),
        rms,
        largest,
        result.termination == AlignmentTermination::kSettled ? "settled" : "not settled",
        result.rounds.size(),
        result.rounds.size() == 1 ? "round" : "rounds");
  }

  // How many, and the worst by name.
  void ReportRejected(const GraphWorld& world, const AlignmentResult& result) {
    constexpr std::size_t kNamed = 20;
    std::vector<RejectedMatch> rejected = result.rejected;
    const auto given = std::count_if(
        rejected.begin(), rejected.end(), [](const RejectedMatch& match) { return match.given; });
    context_.SetMetric("constraints_rejected", static_cast<double>(given));
    context_.SetMetric("priors_rejected", static_cast<double>(result.rejected_priors));
    context_.SetMetric("matches_rejected",
                       static_cast<double>(rejected.size()) - static_cast<double>(given));
    // Constraints that a person can switch off come first.
    std::stable_sort(rejected.begin(), rejected.end(), [](const auto& a, const auto& b) {
      return a.given != b.given ? a.given : a.chi2 > b.chi2;
    });
    rejected.resize(std::min(rejected.size(), kNamed));
    for (const RejectedMatch& match : rejected) {
      context_.SetMetric(absl::StrCat("rejected.",
                                      world.id(match.term.i).ToString(),
                                      ".",
                                      world.id(match.term.j).ToString()),
                         match.chi2);
    }
  }

  MapCore& core_;
  const OptimizeSettings& settings_;
  const int threads_;
  const JobInfo& job_;
  DamagedScans& damaged_;
  JobContext& context_;
};

// Nobody waits for a proposal that nobody asked for; the next closure brings another.
absl::Status Drop(MapCore& core, const JobInfo& job, const Stop& stop) {
  return core.writer().Run(Durability::kFull, 0, stop, [&](StorageWriter& writer) {
    return writer.DiscardProposal(job.id);
  });
}

// Makes the proposal the next epoch.
absl::Status Apply(MapCore& core,
                   Worker& worker,
                   const JobInfo& job,
                   std::uint64_t base_epoch,
                   const MoveTolerance& tolerance,
                   int threads,
                   DamagedScans& damaged,
                   JobContext& context) {
  TilesAhead ahead(core);
  const bool made =
      MakeAhead(core, job, base_epoch, tolerance, threads, context.stop(), ahead).ok();
  const auto apply = [&](Integrator& integrator) {
    return ApplyProposal(
        integrator, job, base_epoch, tolerance, threads, damaged, made ? &ahead : nullptr, context);
  };
  return worker.Execute(context.stop(), apply, absl::StrCat("job ", job.id, " (", job.kind, ")"));
}

}  // namespace

absl::Status RunOptimizeJob(MapCore& core,
                            Worker* worker,
                            const JobInfo& job,
                            const JobArguments& arguments,
                            JobContext& context) {
  const bool accepted = job.parameters.contains(kAccepted);
  const OptimizeSettings settings(arguments);
  const int threads = ThreadsOf(arguments, core.options());
  DamagedScans damaged;
  Proposed proposed;
  if (accepted) {
    proposed = {static_cast<std::uint64_t>(job.metrics.at("epoch_before")), job.message};
  } else {
    Optimizer optimizer(core, settings, threads, job, damaged, context);
    STRATA_ASSIGN_OR_RETURN(proposed, optimizer.Propose());
  }
  context.SetMetric("epoch_before", static_cast<double>(proposed.base_epoch));
  const bool is_refused = !accepted && !proposed.is_sound;
  if (is_refused && arguments.Flag("automatic")) {
    STRATA_RETURN_IF_ERROR(Drop(core, job, context.stop()));
  } else if (!accepted && (settings.dry_run || is_refused)) {
    context.SetProposed();
  } else if (worker == nullptr) {
    context.SetAccepted();
  } else {
    PartOfJob part(context, accepted ? 0.0 : kAlignmentEnd, 1.0);
    STRATA_RETURN_IF_ERROR(
        Apply(core, *worker, job, proposed.base_epoch, settings.tolerance, threads, damaged, part));
  }
  const bool told = accepted && job.metrics.contains("left_out") &&
                    job.metrics.at("left_out") > 0.0;  // by the proposal
  if (!told) {
    damaged.SetMetrics(context);
    absl::StrAppend(&proposed.summary, damaged.Message());
  }
  context.SetMessage(std::move(proposed.summary));
  return absl::OkStatus();
}

}  // namespace strata
