#include "core/planning/planner.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"

#include "core/common/cache_budget.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "core/planning/class_factors.h"
#include "core/planning/endpoint.h"
#include "core/planning/explain.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/move_cost.h"
#include "core/planning/path_check.h"
#include "core/planning/route.h"
#include "core/planning/search.h"
#include "core/planning/search_space.h"
#include "core/planning/search_workspace.h"
#include "core/planning/viewpoints.h"
#include "core/world/exploration.h"
#include "core/world/plan.h"

namespace strata {
namespace {

PlanResult NotOnSurface(PlanReason reason, absl::string_view end, const EndpointMatch& match) {
  PlanResult result;
  result.reason = reason;
  result.message = absl::StrCat(end, ": ", match.message);
  result.where = match.reason.where;
  result.obstruction = match.reason.kind;
  result.obstruction_value = match.reason.value;
  result.inferred = match.reason.inferred;
  result.nearest = match.nearest;
  return result;
}

absl::Status FillRefusal(SearchSpace& space,
                         const SearchWorkspace& workspace,
                         PatchId goal,
                         const Stop& stop,
                         PlanResult* result) {
  STRATA_ASSIGN_OR_RETURN(const Explanation why, WhyNoFurther(space, workspace, goal, stop));
  result->reason =
      why.kind == Obstruction::kUnknown ? PlanReason::kUnknownGround : PlanReason::kBlocked;
  result->message = absl::StrCat(
      result->reason == PlanReason::kBlocked ? "blocked by " : "no observed ground to go on: ",
      why.ToString());
  result->where = why.where;
  result->obstruction = why.kind;
  result->obstruction_value = why.value;
  result->inferred = why.inferred;
  return absl::OkStatus();
}

absl::StatusOr<PlanResult> Answer(SearchSpace& space,
                                  const PlanQuery& query,
                                  const std::shared_ptr<CacheBudget>& budget,
                                  const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(const EndpointMatch from, MatchEndpoint(space, query.from));
  if (from.patch == kNoPatchId) return NotOnSurface(PlanReason::kStartNotOnSurface, "start", from);
  STRATA_ASSIGN_OR_RETURN(const EndpointMatch to, MatchEndpoint(space, query.to));
  if (to.patch == kNoPatchId) return NotOnSurface(PlanReason::kGoalNotOnSurface, "goal", to);
  SearchWorkspace workspace(budget);
  STRATA_ASSIGN_OR_RETURN(
      const SearchOutcome outcome,
      FindPath(space, from.patch, to.patch, query.max_expanded, workspace, stop));
  PlanResult result;
  result.expanded = outcome.expanded;
  switch (outcome.end) {
    case SearchOutcome::End::kLimit:
      result.reason = PlanReason::kSearchLimit;
      result.message = absl::StrCat("no path within ", query.max_expanded, " expanded patches");
      break;
    case SearchOutcome::End::kFull:
      result.reason = PlanReason::kSearchLimit;
      result.message = absl::StrCat("no path within the memory that searches have, half of ",
                                    budget->max_bytes() >> 20,
                                    " MiB for all of them; plan in shorter legs");
      break;
    case SearchOutcome::End::kExhausted:
      STRATA_RETURN_IF_ERROR(FillRefusal(space, workspace, to.patch, stop, &result));
      break;
    case SearchOutcome::End::kFound: {
      Route route = MakeRoute(space, outcome.path);
      STRATA_RETURN_IF_ERROR(space.status());
      result.waypoints = std::move(route.waypoints);
      result.length_m = route.length_m;
      result.cost = route.cost_m;
      result.graph_cost = outcome.cost * space.checks().cell_size_m / kCostPerCell;
      result.gaps = std::move(route.gaps);
      result.tiles = std::move(route.tiles);
      result.message = "found";
      break;
    }
  }
  if (!from.message.empty()) absl::StrAppend(&result.message, "; start ", from.message);
  if (!to.message.empty()) absl::StrAppend(&result.message, "; goal ", to.message);
  return result;
}

}  // namespace

Planner::Planner(const PlannerOptions& options)
    : options_(options), cache_(options.budget, options.loop, options.preparations) {}

absl::StatusOr<PlanResult> Planner::Plan(TileSource& source,
                                         const PlanQuery& query,
                                         const Stop& stop) {
  const absl::Time begin = SteadyNow();
  STRATA_RETURN_IF_ERROR(stop.status());
  STRATA_RETURN_IF_ERROR(ValidateEndpoint("from", query.from, options_.cell_size_m));
  STRATA_RETURN_IF_ERROR(ValidateEndpoint("to", query.to, options_.cell_size_m));
  STRATA_RETURN_IF_ERROR(ValidateClassCosts(query.class_costs));
  STRATA_ASSIGN_OR_RETURN(const ProfileChecks checks,
                          MakeProfileChecks(query.profile, options_.cell_size_m));
  SearchSpace space(cache_, source, checks, ClassFactors(query.class_costs), stop);
  absl::StatusOr<PlanResult> result = Answer(space, query, options_.budget, stop);
  if (result.ok()) result->elapsed_ms = absl::ToDoubleMilliseconds(SteadyNow() - begin);
  return result;
}

absl::StatusOr<PathCheck> Planner::Check(TileSource& source,
                                         const PathQuery& query,
                                         const Stop& stop) {
  STRATA_RETURN_IF_ERROR(ValidateWaypoints(query.waypoints, options_.cell_size_m));
  STRATA_RETURN_IF_ERROR(ValidateClassCosts(query.class_costs));
  STRATA_ASSIGN_OR_RETURN(const ProfileChecks checks,
                          MakeProfileChecks(query.profile, options_.cell_size_m));
  SearchSpace space(cache_, source, checks, ClassFactors(query.class_costs), stop);
  return CheckPath(space, query.waypoints, stop);
}

absl::StatusOr<ExploreResult> Planner::Explore(TileSource& source,
                                               const ExploreQuery& query,
                                               SpaceOf space_of,
                                               const Stop& stop) {
  const absl::Time begin = SteadyNow();
  STRATA_RETURN_IF_ERROR(stop.status());
  STRATA_RETURN_IF_ERROR(ValidateExploreQuery(query));
  STRATA_ASSIGN_OR_RETURN(const ProfileChecks checks,
                          MakeProfileChecks(query.profile, options_.cell_size_m));
  SearchSpace space(cache_, source, checks, ClassFactors(query.class_costs), stop);
  absl::StatusOr<ExploreResult> result = ChooseViews(space, query, space_of, stop);
  if (result.ok()) result->elapsed_ms = absl::ToDoubleMilliseconds(SteadyNow() - begin);
  return result;
}

}  // namespace strata
