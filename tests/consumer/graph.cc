#include <cstdio>

#include "core/posegraph/solver/optimize_pose_graph.h"

int main() {
  strata::PoseGraphProblem graph;  // three metres, measured twice
  graph.T_map_scan.assign(2, strata::Pose::Identity());
  for (const double metres : {2.9, 3.1}) {
    strata::RelativePoseTerm term{.i = 0, .j = 1};
    term.T_i_j.translation().x() = metres;
    graph.relative.push_back(term);
  }
  const auto solution = strata::OptimizePoseGraph(graph);
  if (!solution.ok()) return 1;
  std::printf("%.2f m\n", solution->T_map_scan[1].translation().x());
}
