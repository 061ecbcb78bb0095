// Our use of Ceres beside a plain one with automatic differentiation, and how cost grows with the
// graph.
//
//   posegraph_benchmark [runs]
//
// Every ratio is of medians of runs that alternate in one process. The data are the recorded graphs
// sphere2500, parking-garage and smallGrid3D; the scale table is made of a patrol that goes round a
// block.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "client/formats/graph_file.h"
#include "core/posegraph/pose_graph.h"
#include "core/posegraph/solver/initial_poses.h"
#include "core/posegraph/solver/optimize_pose_graph.h"
#include "tests/bench/poses/posegraph_peer.h"
#include "tests/support/data_dir.h"

namespace strata::bench {
namespace {

// Processor time: others use the machine too.
double Milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double MedianOf(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

struct Medians {
  double ours_ms, peer_ms;
};
Medians Alternate(int runs, const std::function<void()>& ours, const std::function<void()>& peer) {
  std::vector<double> a;
  std::vector<double> b;
  for (int k = 0; k < runs; ++k) {
    const double begin = Milliseconds();
    ours();
    const double middle = Milliseconds();
    peer();
    a.push_back(middle - begin);
    b.push_back(Milliseconds() - middle);
  }
  return {MedianOf(a), MedianOf(b)};
}

constexpr double kSameOptimum = 1e-4;

PoseGraphProblem Read(const std::string& path) {
  auto file = ReadGraph(path);
  if (!file.ok()) {
    std::fprintf(stderr, "%s\n", std::string(file.status().message()).c_str());
    std::exit(1);
  }
  return std::get<PoseGraphProblem>(std::move(file->graph));
}

void CompareDerivatives(const std::string& name, const PoseGraphProblem& problem, int runs) {
  const EdgeCosts ours(problem, EdgeCosts::Kind::kOurs);
  const EdgeCosts automatic(problem, EdgeCosts::Kind::kAutomatic);
  volatile double sink = 0.0;
  const Medians ms = Alternate(
      10 * runs,
      [&] { sink = sink + ours.Evaluate(); },
      [&] { sink = sink + automatic.Evaluate(); });
  std::printf(
      "%-16s residuals and Jacobians of %zu edges: ours %.3f ms, Ceres AD %.3f ms: %.1f x\n",
      name.c_str(),
      problem.relative.size(),
      ms.ours_ms,
      ms.peer_ms,
      ms.peer_ms / ms.ours_ms);
}

// Whether our optimum is as good as the peer's.
bool CompareSolvers(const std::string& name, const std::string& path, int runs) {
  double ours_chi2 = 0.0;
  int ours_iterations = 0;
  PeerSolution peer;
  const Medians ms = Alternate(
      runs,
      [&] {
        const auto solution = OptimizePoseGraph(Read(path));
        ours_chi2 = solution->summary.after.total();
        ours_iterations = solution->summary.iterations;
      },
      [&] { peer = SolveWithCeres(Read(path)); });
  std::printf(
      "%-16s file to optimum from its own start: ours %.1f ms (%d iterations, %.8g), "
      "Ceres AD %.1f ms (%d, %.8g): ratio %.2f\n",
      name.c_str(),
      ms.ours_ms,
      ours_iterations,
      ours_chi2,
      ms.peer_ms,
      peer.iterations,
      peer.chi2,
      ms.ours_ms / ms.peer_ms);
  return ours_chi2 <= (1.0 + kSameOptimum) * peer.chi2;
}

// A robot that goes round a block of 125 m with a pose every 0.25 m; every 10th pose is matched
// with the lap before. The start is odometry.
PoseGraphProblem Patrol(std::size_t nodes) {
  constexpr std::size_t kLap = 500;
  std::mt19937_64 random(20'000);
  std::normal_distribution<double> normal;
  std::vector<Pose> truth;
  for (std::size_t n = 0; n < nodes; ++n) {
    const double angle = 2.0 * M_PI * static_cast<double>(n) / kLap;
    truth.push_back(MakePose(
        Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
        Eigen::Vector3d(20.0 * std::sin(angle), -20.0 * std::cos(angle), std::sin(3.0 * angle))));
  }
  PoseGraphProblem problem;
  const auto add = [&](std::size_t i, std::size_t j) {
    Vector6d step;
    for (int k = 0; k < 6; ++k) step[k] = (k < 3 ? 0.001 : 0.01) * normal(random);
    RelativePoseTerm term{.i = i, .j = j, .T_i_j = Retract(truth[i].inverse() * truth[j], step)};
    Vector6d information;
    information << 1e6, 1e6, 1e6, 1e4, 1e4, 1e4;
    term.information = information.asDiagonal();
    problem.relative.push_back(term);
  };
  problem.T_map_scan.assign(nodes, Pose::Identity());
  for (std::size_t n = 1; n < nodes; ++n) add(n - 1, n);
  for (std::size_t n = kLap; n < nodes; n += 10) add(n - kLap, n);
  problem.T_map_scan = OdometryPoses(problem);
  return problem;
}

struct Measured {
  double ms = 0.0;
  double megabytes = 0.0;  // peak
  int iterations = 0;
};

// In a process of its own, whose peak of memory is that of the work.
Measured InAChild(const std::function<Measured()>& work) {
  int ends[2];
  if (pipe(ends) != 0) std::exit(1);
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    const Measured measured = work();
    const bool written = write(ends[1], &measured, sizeof measured) == sizeof measured;
    _exit(written ? 0 : 1);
  }
  Measured measured;
  const bool got = read(ends[0], &measured, sizeof measured) == sizeof measured;
  rusage usage{};
  int status = 0;
  wait4(child, &status, 0, &usage);
  close(ends[0]);
  close(ends[1]);
  if (!got || status != 0) std::exit(1);
  measured.megabytes = static_cast<double>(usage.ru_maxrss) / 1024.0;
  return measured;
}

Measured SolvePatrol(std::size_t nodes) {
  const PoseGraphProblem problem = Patrol(nodes);
  const double begin = Milliseconds();
  const auto solution = OptimizePoseGraph(problem);
  Measured measured;
  measured.ms = Milliseconds() - begin;
  measured.iterations = solution->summary.iterations;
  return measured;
}

void ScaleTable(int runs) {
  const Measured empty = InAChild([] { return Measured(); });
  const std::size_t sizes[2] = {2'000, 20'000};
  std::vector<double> ms[2];
  Measured last[2];
  for (int run = 0; run < runs; ++run) {
    for (int k = 0; k < 2; ++k) {
      last[k] = InAChild([&] { return SolvePatrol(sizes[k]); });
      ms[k].push_back(last[k].ms);
    }
  }
  double megabytes[2];
  for (int k = 0; k < 2; ++k) {
    megabytes[k] = last[k].megabytes - empty.megabytes;
    std::printf("patrol of %6zu poses: %9.1f ms, %d iterations, %7.1f MB above an empty process\n",
                sizes[k],
                MedianOf(ms[k]),
                last[k].iterations,
                megabytes[k]);
  }
  std::printf("ten times the poses: %.1f x the time, %.1f x the memory\n",
              MedianOf(ms[1]) / MedianOf(ms[0]),
              megabytes[1] / megabytes[0]);
}

int Main(int runs) {
  ScaleTable(runs);  // first: children inherit what the process has grown to
  const auto folder = testing::FindData("posegraphs");
  if (!folder.has_value()) {
    std::printf("no recorded graphs: set STRATA_DATA to a folder that holds posegraphs\n");
    return 0;
  }
  bool same = true;
  for (const std::string name : {"sphere2500", "parking-garage", "smallGrid3D"}) {
    const std::string path = *folder / "g2o_3d" / (name + ".g2o");
    CompareDerivatives(name, Read(path), runs);
    same = CompareSolvers(name, path, runs) && same;
  }
  return same ? 0 : 1;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) {
  return strata::bench::Main(argc > 1 ? std::max(1, std::atoi(argv[1])) : 5);
}
