// Query times of the planner beside boost::astar_search on an explicit graph of the same patches
// and costs, in one run and one thread.
//
// World: a seeded campus of 120 m × 100 m at 10 cm: rolling noisy ground with single holes,
// buildings as hollow boxes, kerbs, trunks, and a bridge with ramps over a road.
// Usage: planning_benchmark [queries] [repetitions]
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <boost/graph/astar_search.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <boost/property_map/vector_property_map.hpp>

#include "core/planning/move_cost.h"
#include "core/planning/packed_tile.h"
#include "core/planning/planner.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/route.h"
#include "core/planning/search.h"
#include "core/planning/search_space.h"
#include "core/planning/search_workspace.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/support/drawing.h"

namespace strata {
namespace {

constexpr double kCell = 0.1;
constexpr double kSameCost = 1e-3;
constexpr int kCampusX = 1200;
constexpr int kCampusY = 1000;
constexpr std::uint64_t kSeed = 20261121;

// Processor time of this thread: what else runs on the machine does not count.
double NowMs() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

// ---- the world ----

class Campus {
 public:
  Campus() : columns_(static_cast<std::size_t>(kCampusX) * kCampusY) {}

  std::vector<SurfaceTile> Build() {
    Ground();
    for (int k = 0; k < 14; ++k) Building();
    for (int k = 0; k < 20; ++k) Kerb();
    for (int k = 0; k < 400; ++k) At(Pick(kCampusX), Pick(kCampusY)) = {{2.5, 2.5}};
    Bridge();
    for (int k = 0; k < kCampusX * kCampusY / 50; ++k) At(Pick(kCampusX), Pick(kCampusY)).clear();
    testing::DrawnMap map;
    for (int y = 0; y < kCampusY; ++y) {
      for (int x = 0; x < kCampusX; ++x) {
        if (At(x, y).empty()) continue;
        // Tiles have heights in whole steps.
        for (testing::DrawnSurface& s : At(x, y)) s.z_m = std::round(s.z_m * 512.0) / 512.0;
        map[{x - 600, y - 500}] = At(x, y);
      }
    }
    return map.Tiles();
  }

 private:
  std::vector<testing::DrawnSurface>& At(int x, int y) {
    return columns_[static_cast<std::size_t>(y) * kCampusX + x];
  }
  int Pick(int n) { return static_cast<int>(random_() % n); }
  double Terrain(int x, int y) const {
    return 0.8 * std::sin(x * kCell / 17.0) * std::cos(y * kCell / 23.0);
  }

  void Ground() {
    std::normal_distribution<double> noise(0.0, 0.008);
    for (int y = 0; y < kCampusY; ++y) {
      for (int x = 0; x < kCampusX; ++x) At(x, y) = {{Terrain(x, y) + noise(random_)}};
    }
  }
  void Building() {
    const int w = 100 + Pick(150);
    const int h = 80 + Pick(120);
    const int x0 = 20 + Pick(kCampusX - w - 40);
    const int y0 = 20 + Pick(kCampusY - h - 40);
    for (int y = y0; y < y0 + h; ++y) {
      for (int x = x0; x < x0 + w; ++x) {
        const bool wall = x < x0 + 2 || y < y0 + 2 || x >= x0 + w - 2 || y >= y0 + h - 2;
        if (wall) {
          At(x, y) = {{Terrain(x, y) + 5.0, 5.0}};
        } else {
          At(x, y).clear();
        }
      }
    }
  }
  // Raises a lawn by 8 to 25 cm: some can be stepped on, some not.
  void Kerb() {
    const double rise = 0.08 + 0.01 * Pick(18);
    const int x0 = Pick(kCampusX - 150);
    const int y0 = Pick(kCampusY - 150);
    for (int y = y0; y < y0 + 40 + Pick(2); ++y) {
      for (int x = x0; x < x0 + 140; ++x) {
        for (testing::DrawnSurface& s : At(x, y)) s.z_m += rise;
      }
    }
  }
  // West to east through the middle, over a road from south to north.
  void Bridge() {
    for (int y = 480; y < 520; ++y) {
      for (int x = 400; x < 800; ++x) {
        const int to_deck = std::max({0, 560 - x, x - 640});
        const double z = 3.2 - to_deck * 0.02;
        if (to_deck == 0) {
          At(x, y) = {{Terrain(x, y)}, {z, 0.4}};
        } else if (z > Terrain(x, y)) {
          At(x, y) = {{z, z - Terrain(x, y)}};
        }
      }
    }
  }

  std::mt19937_64 random_{kSeed};
  std::vector<std::vector<testing::DrawnSurface>> columns_;
};

// ---- boost::astar_search on an explicit graph ----

struct EdgeCost {
  std::uint32_t cost = 0;
};
using CsrGraph = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, EdgeCost>;

struct GoalReached {};

struct BoostGraph {
  std::unique_ptr<CsrGraph> graph;
  std::vector<std::uint32_t> vertex_of;  // patch → vertex
  std::vector<CellIndex> cells;          // per vertex
};

BoostGraph MakeBoostGraph(SearchSpace& space) {
  BoostGraph result;
  std::vector<PatchId> patches;
  result.vertex_of.assign(space.end(), 0);
  for (const SearchSpace::Slot& slot : space.slots()) {
    slot.tile->standing.ForEach([&](std::uint32_t place, std::uint32_t /*number*/) {
      result.vertex_of[slot.base + place] = static_cast<std::uint32_t>(patches.size());
      patches.push_back(slot.base + place);
    });
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  std::vector<EdgeCost> costs;
  for (const PatchId patch : patches) {
    result.cells.push_back(space.CellOfPatch(patch));
    for (int k = 0; k < 8; ++k) {
      EdgeCost cost;
      int cells = 0;
      const PatchId target = space.Follow(patch, k, &cost.cost, &cells);
      if (target == kNoPatchId) continue;
      edges.emplace_back(result.vertex_of[patch], result.vertex_of[target]);
      costs.push_back(cost);
    }
  }
  result.graph = std::make_unique<CsrGraph>(
      boost::edges_are_sorted, edges.begin(), edges.end(), costs.begin(), patches.size());
  return result;
}

class BoostSearch {
 public:
  explicit BoostSearch(const BoostGraph& graph)
      : graph_(graph),
        predecessor_(graph.cells.size()),
        distance_(graph.cells.size()),
        rank_(graph.cells.size()),
        colour_(graph.cells.size()) {}

  std::uint32_t Cost(std::uint32_t from, std::uint32_t to) {
    const auto index = boost::get(boost::vertex_index, *graph_.graph);
    try {
      boost::astar_search(
          *graph_.graph,
          from,
          Octile{{}, &graph_.cells, graph_.cells[to]},
          boost::visitor(StopAt{{}, to})
              .weight_map(boost::get(&EdgeCost::cost, *graph_.graph))
              .predecessor_map(boost::make_iterator_property_map(predecessor_.begin(), index))
              .distance_map(boost::make_iterator_property_map(distance_.begin(), index))
              .rank_map(boost::make_iterator_property_map(rank_.begin(), index))
              .color_map(boost::make_iterator_property_map(colour_.begin(), index)));
    } catch (const GoalReached&) {
      return distance_[to];
    }
    return UINT32_MAX;
  }

 private:
  struct Octile : boost::astar_heuristic<CsrGraph, std::uint32_t> {
    Octile(boost::astar_heuristic<CsrGraph, std::uint32_t> base,
           const std::vector<CellIndex>* c,
           CellIndex g)
        : boost::astar_heuristic<CsrGraph, std::uint32_t>(base), cells(c), goal(g) {}
    std::uint32_t operator()(std::uint32_t v) {
      const auto dx = static_cast<std::uint32_t>(std::abs((*cells)[v].x - goal.x));
      const auto dy = static_cast<std::uint32_t>(std::abs((*cells)[v].y - goal.y));
      return kCostPerCell * (std::max(dx, dy) - std::min(dx, dy)) +
             kCostPerDiagonal * std::min(dx, dy);
    }
    const std::vector<CellIndex>* cells;
    CellIndex goal;
  };
  struct StopAt : boost::default_astar_visitor {
    StopAt(boost::default_astar_visitor base, std::uint32_t g)
        : boost::default_astar_visitor(base), goal(g) {}
    void examine_vertex(std::uint32_t v, const CsrGraph& /*graph*/) const {
      if (v == goal) throw GoalReached();
    }
    std::uint32_t goal;
  };

  const BoostGraph& graph_;
  std::vector<std::uint32_t> predecessor_;
  std::vector<std::uint32_t> distance_;
  std::vector<std::uint32_t> rank_;
  std::vector<boost::default_color_type> colour_;
};

// ---- the comparison ----

std::vector<std::pair<PatchId, PatchId>> PickQueries(SearchSpace& space,
                                                     BoostSearch& peer,
                                                     const BoostGraph& graph,
                                                     std::size_t count) {
  std::mt19937_64 random(kSeed + 1);
  std::vector<PatchId> standable;
  for (const SearchSpace::Slot& slot : space.slots()) {
    slot.tile->standing.ForEach([&](std::uint32_t place, std::uint32_t /*number*/) {
      standable.push_back(slot.base + place);
    });
  }
  std::vector<std::pair<PatchId, PatchId>> queries;
  for (int attempt = 0; attempt < 1'000'000 && queries.size() < count; ++attempt) {
    const PatchId from = standable[random() % standable.size()];
    const PatchId to = standable[random() % standable.size()];
    const double distance = (space.Position(from) - space.Position(to)).norm();
    if (distance < 90.0 || distance > 110.0) continue;
    if (peer.Cost(graph.vertex_of[from], graph.vertex_of[to]) == UINT32_MAX) continue;
    queries.emplace_back(from, to);
  }
  return queries;
}

PlanEndpoint EndpointOf(SearchSpace& space, PatchId patch) {
  const Eigen::Vector3d p = space.Position(patch);
  return {.x_m = p.x(), .y_m = p.y(), .z_m = p.z()};
}

struct Column {
  const char* name;
  std::vector<double> ms = {};
  double expanded = 0.0;
};

// What is kept of prepared tiles on disk.
void ReportPacked(const SearchSpace& space, std::size_t patches) {
  std::vector<std::string> packed;
  std::size_t bytes = 0;
  double begin = NowMs();
  for (const SearchSpace::Slot& slot : space.slots()) {
    bytes += packed.emplace_back(PackTile(*slot.tile, kCell)).size();
  }
  const double pack_ms = NowMs() - begin;
  begin = NowMs();
  for (const std::string& tile : packed) {
    if (!UnpackTile(tile, kCell).ok()) std::abort();
  }
  std::printf("packed: %.2f bytes a patch, in %.0f ns; unpacked in %.0f ns\n",
              static_cast<double>(bytes) / patches,
              pack_ms * 1e6 / patches,
              (NowMs() - begin) * 1e6 / patches);
}

int Compare(testing::MemoryTiles& source, std::size_t query_count, int repetitions) {
  const RobotProfile profile;
  const auto checks = MakeProfileChecks(profile, kCell);
  TileCache cache(std::make_shared<CacheBudget>(std::size_t{4} << 30));
  SearchSpace space(cache, source, *checks);
  double begin = NowMs();
  for (const TileKey& key : source.Keys()) space.SlotOf(key);
  const double prepare_ms = NowMs() - begin;
  std::size_t patches = 0;
  std::size_t standable = 0;
  for (const SearchSpace::Slot& slot : space.slots()) {
    patches += slot.tile->standing.size() + slot.tile->other.size();
    standable += slot.tile->standing.size();
  }
  const BoostGraph graph = MakeBoostGraph(space);
  BoostSearch peer(graph);
  SearchWorkspace workspace;
  Planner planner({.cell_size_m = kCell});
  const auto queries = PickQueries(space, peer, graph, query_count);
  Column columns[] = {{"boost::astar_search"}, {"search"}, {"Plan, warm"}};
  double worst = 0.0;
  for (const auto& [from, to] : queries) {
    std::vector<double> ms[3];
    std::uint32_t peer_cost = 0;
    std::uint64_t expanded = 0;
    for (int r = -1; r < repetitions; ++r) {  // the first round warms up
      const auto timed = [&](int column, auto&& work) {
        const double start = NowMs();
        work();
        if (r >= 0) ms[column].push_back(NowMs() - start);
      };
      timed(0, [&] { peer_cost = peer.Cost(graph.vertex_of[from], graph.vertex_of[to]); });
      timed(1, [&] {
        const auto outcome = FindPath(space, from, to, UINT64_MAX, workspace, Stop());
        expanded = outcome->expanded;
        worst = std::max(worst, std::abs(outcome->cost / static_cast<double>(peer_cost) - 1.0));
      });
      timed(2, [&] {
        const PlanQuery query = {
            .from = EndpointOf(space, from), .to = EndpointOf(space, to), .profile = profile};
        if (!planner.Plan(source, query, Stop())->found()) std::abort();
      });
    }
    for (int c = 0; c < 3; ++c) columns[c].ms.push_back(Median(ms[c]));
    columns[1].expanded += static_cast<double>(expanded) / queries.size();
  }
  std::printf("%zu patches (%zu standable), %zu moves, %zu tiles, %zu queries of 90-110 m\n",
              patches,
              standable,
              boost::num_edges(*graph.graph),
              space.slots().size(),
              queries.size());
  std::printf("prepared for the profile: %.0f ms (%.0f ns a patch), %.1f bytes a patch\n",
              prepare_ms,
              prepare_ms * 1e6 / patches,
              static_cast<double>(cache.statistics().bytes) / patches);
  ReportPacked(space, patches);
  std::printf("largest difference of costs: %.5f %%\n", 100.0 * worst);
  std::printf("%-26s %10s %10s %14s\n", "", "median ms", "x faster", "expanded");
  const double reference = Median(columns[0].ms);
  for (const Column& column : columns) {
    std::printf("%-26s %10.2f %10.2f %14.0f\n",
                column.name,
                Median(column.ms),
                reference / Median(column.ms),
                column.expanded);
  }
  return worst <= kSameCost ? 0 : 1;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) {
  const std::size_t queries = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 60;
  const int repetitions = argc > 2 ? std::atoi(argv[2]) : 3;
  strata::testing::MemoryTiles source(strata::Campus().Build());
  return strata::Compare(source, queries, std::max(1, repetitions));
}
