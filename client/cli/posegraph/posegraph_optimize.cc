// strata posegraph optimize
#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "client/cli/posegraph/posegraph_files.h"
#include "client/formats/file_bytes.h"
#include "client/formats/graph_file.h"
#include "core/common/status.h"
#include "core/posegraph/planar_pose_graph.h"
#include "core/posegraph/pose_graph.h"
#include "core/posegraph/solver/initial_poses.h"
#include "core/posegraph/solver/optimize_planar_pose_graph.h"
#include "core/posegraph/solver/optimize_pose_graph.h"

namespace strata::cli {
namespace {

struct OptimizeOptions {
  std::string in;
  std::string out;
  std::string start = "best";
  bool robust = false;
  int max_iterations = ConvergenceOptions().max_iterations;
};

// What is said of both kinds of graphs.
struct Report {
  std::string start;
  double cost_before = 0.0;  // of the poses of the file, or of the start
  double cost_start = 0.0;
  double cost_after = 0.0;
  int iterations = 0;
  PoseGraphTermination termination = PoseGraphTermination::kConverged;
  std::vector<std::size_t> rejected;
};

std::vector<Pose>& PosesOf(PoseGraphProblem& graph) { return graph.T_map_scan; }
std::vector<PlanarPose>& PosesOf(PlanarPoseGraph& graph) { return graph.poses; }

// Closures join vertices that do not follow each other.
template <typename Graph>
void LetClosuresBeFalse(Graph& graph) {
  for (auto& term : graph.relative) {
    term.may_be_false = term.i + 1 != term.j && term.j + 1 != term.i;
  }
}

// Sets the poses to those of the start asked for; "best" is that of the lowest cost, and without
// false closures in mind the chordal one is always tried.
template <typename Graph>
void ChooseStart(const OptimizeOptions& options, bool has_poses, Graph& graph, Report& report) {
  auto best = PosesOf(graph);
  bool first = true;
  const auto consider = [&](const std::string& name, auto poses) {
    if (options.start != "best" && options.start != name) return;
    PosesOf(graph) = std::move(poses);
    const double cost = Chi2(graph);
    if (!first && !(cost < report.cost_start)) return;
    first = false;
    best = PosesOf(graph);
    report.cost_start = cost;
    report.start = name;
  };
  const auto from_file = PosesOf(graph);
  report.cost_before = Chi2(graph);
  if (has_poses) consider("file", from_file);
  PosesOf(graph) = from_file;
  consider("odometry", OdometryPoses(graph));
  PosesOf(graph) = from_file;
  if (!options.robust || options.start == "chordal") consider("chordal", ChordalPoses(graph));
  PosesOf(graph) = std::move(best);
  if (!has_poses) report.cost_before = report.cost_start;
}

absl::Status Solve(PoseGraphProblem& graph,
                   const OptimizeOptions& options,
                   const Stop& stop,
                   Report& report) {
  PoseGraphOptions solver;
  solver.convergence.max_iterations = options.max_iterations;
  STRATA_ASSIGN_OR_RETURN(PoseGraphSolution solution, OptimizePoseGraph(graph, solver, stop));
  graph.T_map_scan = std::move(solution.T_map_scan);
  report.cost_after = solution.summary.after.total();
  report.iterations = solution.summary.iterations;
  report.termination = solution.summary.termination;
  for (const RejectedTerm& term : solution.summary.rejected_relative) {
    report.rejected.push_back(term.term);
  }
  return absl::OkStatus();
}

absl::Status Solve(PlanarPoseGraph& graph,
                   const OptimizeOptions& options,
                   const Stop& stop,
                   Report& report) {
  PlanarOptions solver;
  solver.convergence.max_iterations = options.max_iterations;
  STRATA_ASSIGN_OR_RETURN(PlanarSolution solution, OptimizePlanarPoseGraph(graph, solver, stop));
  graph.poses = std::move(solution.poses);
  report.cost_after = solution.chi2_after;
  report.iterations = solution.iterations;
  report.termination = solution.termination;
  report.rejected = std::move(solution.rejected);
  return absl::OkStatus();
}

template <typename Graph>
Json RejectedEdges(const GraphFile& file, const Graph& graph, const Report& report) {
  Json edges = Json::array();
  for (const std::size_t term : report.rejected) {
    const auto& edge = graph.relative[term];
    edges.push_back(Json::array({file.ids[edge.i], file.ids[edge.j]}));
  }
  return edges;
}

absl::Status Run(FileContext& context, const OptimizeOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  STRATA_ASSIGN_OR_RETURN(GraphFile file, ReadGraph(options.in));
  if (const std::string warning = ClippedWarning(file); !warning.empty()) {
    context.output.Talk("warning: " + warning);
  }
  if (options.start == "file" && !file.has_poses) {
    return absl::InvalidArgumentError(absl::StrCat(
        options.in, " has edges only; --start odometry or chordal makes poses out of them"));
  }
  Report report;
  const auto optimize = [&](auto& graph) -> absl::Status {
    if (options.robust) LetClosuresBeFalse(graph);
    ChooseStart(options, file.has_poses, graph, report);
    return Solve(graph, options, context.stop, report);
  };
  STRATA_RETURN_IF_ERROR(std::visit(optimize, file.graph));
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - begin;
  STRATA_RETURN_IF_ERROR(WriteFileBytes(options.out, G2oText(file)));

  Json json;
  json["cost_before"] = report.cost_before;
  json["cost_after"] = report.cost_after;
  json["iterations"] = report.iterations;
  json["elapsed_ms"] = elapsed.count();
  json["vertices"] = file.ids.size();
  json["edges"] = std::visit([](const auto& graph) { return graph.relative.size(); }, file.graph);
  json["start"] = report.start;
  json["cost_start"] = report.cost_start;
  json["stopped"] = std::string(ToString(report.termination));
  json["rejected"] =
      std::visit([&](const auto& graph) { return RejectedEdges(file, graph, report); }, file.graph);
  json["clipped"] = file.clipped;
  json["dropped"] = file.dropped;
  json["out"] = options.out;
  context.output.Object(json);
  return absl::OkStatus();
}

}  // namespace

void AddPosegraphOptimize(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<OptimizeOptions>();
  CLI::App* verb = commands.FileVerb(
      noun,
      "optimize",
      "The poses of least cost of a graph in a file of g2o or TORO, in space or in the plane.\n"
      "cost is the sum of eT Omega e over all edges with g2o's error; elapsed_ms runs from reading "
      "the file to the optimum",
      "strata posegraph optimize sphere2500.g2o --out solved.g2o --output json",
      [options](FileContext& context) { return Run(context, *options); });
  verb->add_option("IN", options->in, "The graph; vertices may be left out")
      ->type_name("FILE.(g2o|graph)")
      ->required();
  verb->add_option("--out", options->out, "Write vertices and edges as g2o")
      ->type_name("FILE.g2o")
      ->required();
  verb->add_option("--start",
                   options->start,
                   "Poses to start from: those of the file, composed along the edges between "
                   "neighbours, the chordal relaxation, or which of them costs least")
      ->check(CLI::IsMember({"best", "file", "odometry", "chordal"}))
      ->capture_default_str();
  verb->add_flag("--robust",
                 options->robust,
                 "Reject edges between vertices that do not follow each other where they "
                 "contradict the rest");
  verb->add_option("--max-iterations", options->max_iterations, "Linear systems to solve at most")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
}

}  // namespace strata::cli
