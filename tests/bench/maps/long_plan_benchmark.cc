// Long plans in little memory: time, memory and tiles prepared of a first query and of the same
// again, beside a planner that has memory enough.
//
// Worlds are made from a seed, or their tiles read from a file (a 32-bit length before each tile as
// it is served). Tiles are kept as bytes and decoded on demand, as in a map: only what the planner
// and the decoded tiles take counts.
// Usage: long_plan_benchmark street|yard|decks|FILE [cache MiB] [length m] [seed] [from x,y,z to
// x,y,z] [q: without the planner that has enough] [kept: tiles were prepared before, as a map at
// rest keeps them]
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include <malloc.h>

#include "core/codec/surface_tile_codec.h"
#include "core/common/cache_budget.h"
#include "core/common/hash_map.h"
#include "core/common/lru_cache.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/common/stop.h"
#include "core/engine/engine.h"
#include "core/engine/map/parallel.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/ground/rows.h"
#include "core/planning/packed_tile.h"
#include "core/planning/planner.h"
#include "core/planning/tile_cache.h"
#include "core/planning/tile_source.h"
#include "core/world/plan.h"
#include "core/world/robot_profile.h"

namespace strata {
namespace {

double ProcessorSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

// ---- tiles ----

using TileBytes = HashMap<TileKey, std::string>;

class DecodedTiles : public TileSource {
 public:
  DecodedTiles(const TileBytes& bytes, const std::shared_ptr<CacheBudget>& budget)
      : bytes_(bytes), decoded_(budget, budget->max_bytes() / 16) {}

  absl::StatusOr<std::shared_ptr<const SurfaceTile>> Load(const TileKey& key) override {
    const auto found = bytes_.find(key);
    if (found == bytes_.end()) return std::shared_ptr<const SurfaceTile>();
    if (std::shared_ptr<const SurfaceTile> held = decoded_.Find(key)) return held;
    ++decodings;
    absl::StatusOr<SurfaceTile> tile = DecodeSurfaceTile(found->second);
    if (!tile.ok()) return tile.status();
    auto made = std::make_shared<const SurfaceTile>(*std::move(tile));
    decoded_.Put(
        key, made, sizeof(SurfaceTile) + made->surfaces.capacity() * sizeof(made->surfaces[0]));
    return made;
  }
  std::uint64_t Version(const TileKey& key) override { return bytes_.contains(key) ? 1 : 0; }
  absl::StatusOr<std::optional<std::string>> LoadPrepared(
      const TileKey& key,
      const TileVersions& /*versions*/,
      const RobotProfile& /*profile*/) override {
    const auto found = kept_.find(key);
    return found == kept_.end() ? std::optional<std::string>() : found->second;
  }
  // What a map at rest would keep of all tiles; returns its bytes.
  absl::StatusOr<std::size_t> Keep(double cell_size_m) {
    std::size_t size = 0;
    STRATA_ASSIGN_OR_RETURN(const ProfileChecks checks, MakeProfileChecks({}, cell_size_m));
    for (const auto& [key, tile] : bytes_) {
      STRATA_ASSIGN_OR_RETURN(const auto made, PrepareFrom(*this, key, checks));
      if (made == nullptr) continue;
      kept_[key] = PackTile(*made, cell_size_m);
      size += kept_[key].size();
    }
    return size;
  }

  std::uint64_t decodings = 0;

 private:
  const TileBytes& bytes_;
  TileBytes kept_;
  LruCache<TileKey, const SurfaceTile> decoded_;
};

// ---- worlds ----

struct Drawn {
  float z_m = 0.0F;
  float depth_m = 0.0F;
};
struct World {
  double cell_size_m = 0.1;
  TileKey low;  // tiles [low, high]
  TileKey high;
  // Surfaces of a cell, lowest first.
  std::function<void(CellIndex, std::mt19937_64&, std::vector<Drawn>*)> column;
  PlanEndpoint from;
  PlanEndpoint to;
};

float Noise(std::mt19937_64& random, double sigma_m) {
  return static_cast<float>(std::normal_distribution<double>(0.0, sigma_m)(random));
}

// Bends to and fro: a carriageway of 9 m between kerbs, pavements with trunks, houses, and every
// 90 m a yard of 30 m.
World Street(double length_m) {
  World world;
  const auto middle = [](double x) { return 12.0 * std::sin(x / 71.0) + 9.0 * std::sin(x / 23.0); };
  world.low = {0, -1, -2};
  world.high = {0, static_cast<std::int32_t>(length_m / 25.6) + 1, 1};
  world.column = [=](CellIndex cell, std::mt19937_64& random, std::vector<Drawn>* column) {
    const double x = (cell.x + 0.5) * 0.1;
    const double off = std::abs((cell.y + 0.5) * 0.1 - middle(x));
    const double ground = 2.0 * std::sin(x / 190.0);
    const bool yard = std::fmod(x + 900.0, 90.0) < 25.0;
    if (off < 4.5) {
      column->push_back({static_cast<float>(ground) + Noise(random, 0.004)});
    } else if (off < 7.5 || (yard && off < 30.0)) {
      const bool trunk = (cell.x % 80) < 4 && (cell.y % 60) < 4;
      column->push_back(trunk ? Drawn{static_cast<float>(ground) + 3.0F, 3.0F}
                              : Drawn{static_cast<float>(ground) + 0.12F + Noise(random, 0.006)});
    } else if (off < 7.8) {
      column->push_back({static_cast<float>(ground) + 6.0F, 6.0F});
    } else if (off < 18.0 && random() % 3 != 0) {
      column->push_back({static_cast<float>(ground) + Noise(random, 0.6)});
    }
  };
  world.from = {.x_m = 1.05, .y_m = middle(1.05), .z_m = 0.0};
  world.to = {.x_m = length_m, .y_m = middle(length_m), .z_m = 2.0 * std::sin(length_m / 190.0)};
  return world;
}

// A square of level noisy ground in cells of 5 cm; planned from corner to corner.
World Yard(double length_m) {
  World world;
  world.cell_size_m = 0.05;
  const double half = length_m / std::sqrt(2.0) / 2.0 + 5.0;
  const int tiles = static_cast<int>(std::ceil(half / 12.8));
  world.low = {0, -tiles, -tiles};
  world.high = {0, tiles - 1, tiles - 1};
  world.column = [=](CellIndex cell, std::mt19937_64& random, std::vector<Drawn>* column) {
    if (std::abs(cell.x * 0.05) < half && std::abs(cell.y * 0.05) < half) {
      column->push_back({Noise(random, 0.002)});
    }
  };
  world.from = {.x_m = -half + 5.0, .y_m = -half + 5.0};
  world.to = {.x_m = half - 5.0, .y_m = half - 5.0};
  return world;
}

// A car park: three decks of `length_m`/3 by 60 m, one above the other, with walls that leave a
// gap at every other end, and ramps between the decks; from the lowest to the highest.
World Decks(double length_m) {
  World world;
  const int columns = static_cast<int>(length_m / 3.0 / 0.1);
  world.low = {0, 0, 0};
  world.high = {0, columns / kTileCells, 600 / kTileCells};
  world.column = [=](CellIndex cell, std::mt19937_64& random, std::vector<Drawn>* column) {
    if (cell.x < 0 || cell.y < 0 || cell.x >= columns || cell.y >= 600) return;
    const int wall = cell.x % 200;
    const bool gap = (cell.x / 200) % 2 == 0 ? cell.y < 60 : cell.y >= 540;
    for (int deck = 0; deck < 3; ++deck) {
      const double floor = 3.0 * deck;
      const int run = deck == 1 ? columns - 1 - cell.x : cell.x;  // from where a ramp ends
      if (deck > 0 && cell.y >= 250 && cell.y < 350 && run < 190) {
        // A solid ramp with a landing of 4 m at its upper end.
        const double rise = std::min(3.0, 0.02 * (190 - run));
        column->back() = {static_cast<float>(floor - 3.0 + rise), static_cast<float>(rise)};
        continue;
      }
      if (wall < 2 && !gap && run >= 200) {
        column->push_back({static_cast<float>(floor + 1.5), 1.5F});
      } else {
        column->push_back(
            {static_cast<float>(floor) + Noise(random, 0.004), deck > 0 ? 0.2F : 0.0F});
      }
    }
  };
  world.from = {.x_m = 2.05, .y_m = 2.05, .level = 0};
  world.to = {.x_m = columns * 0.1 - 2.0, .y_m = 58.0, .z_m = 6.0};
  return world;
}

TileBytes Draw(const World& world, std::uint64_t seed) {
  TileBytes bytes;
  std::vector<Drawn> column;
  for (std::int32_t ty = world.low.y; ty <= world.high.y; ++ty) {
    for (std::int32_t tx = world.low.x; tx <= world.high.x; ++tx) {
      std::mt19937_64 random(seed + (static_cast<std::uint64_t>(tx) << 32) + ty);
      SurfaceTile tile;
      tile.key = {0, tx, ty};
      tile.version = 1;
      for (int c = 0; c < kTileCells * kTileCells; ++c) {
        column.clear();
        world.column(CellOf(tile.key, static_cast<std::uint16_t>(c)), random, &column);
        for (const Drawn& drawn : column) {
          tile.surfaces.push_back({.cell = static_cast<std::uint16_t>(c),
                                   .z_m = drawn.z_m,
                                   .sigma_m = 0.01F,
                                   .depth_m = drawn.depth_m});
        }
      }
      if (tile.surfaces.empty()) continue;
      tile.IndexRows();
      bytes[tile.key] = EncodeSurfaceTile(tile).value();
    }
  }
  return bytes;
}

TileBytes ReadTiles(const char* path) {
  std::ifstream file(path, std::ios::binary);
  TileBytes bytes;
  std::uint32_t size = 0;
  while (file.read(reinterpret_cast<char*>(&size), sizeof(size))) {
    std::string tile(size, '\0');
    if (!file.read(tile.data(), size)) break;
    const absl::StatusOr<SurfaceTile> decoded = DecodeSurfaceTile(tile);
    if (decoded.ok() && decoded->key.level == 0) bytes[decoded->key] = std::move(tile);
  }
  return bytes;
}

// ---- the measurement ----

double PeakMb() {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    if (line.rfind("VmHWM:", 0) == 0) return std::atof(line.c_str() + 6) / 1024.0;
  }
  return 0.0;
}
void ForgetPeak() { std::ofstream("/proc/self/clear_refs") << "5"; }

struct Measured {
  PlanResult result;
  double seconds = 0.0;
};

// Plans `times` times with caches of `cache_mib` and tells of each.
double Measure(
    const TileBytes& bytes, const World& world, std::size_t cache_mib, int times, bool kept) {
  const auto budget = std::make_shared<CacheBudget>(cache_mib << 20);
  DecodedTiles source(bytes, budget);
  if (kept) {
    const double begin = ProcessorSeconds();
    const absl::StatusOr<std::size_t> size = source.Keep(world.cell_size_m);
    if (!size.ok()) std::printf("%s\n", size.status().ToString().c_str());
    std::printf("kept %zu bytes, made in %.1f s of processor\n",
                size.value_or(0),
                ProcessorSeconds() - begin);
    source.decodings = 0;
  }
  const ParallelLoop loop = [](std::size_t count,
                               absl::FunctionRef<absl::Status(std::size_t)> body) {
    return ParallelFor(EngineOptions().worker_threads, count, [&](int /*thread*/, std::size_t i) {
      return body(i);
    });
  };
  Planner planner({.cell_size_m = world.cell_size_m, .budget = budget, .loop = loop});
  double graph_cost = 0.0;
  for (int i = 0; i < times; ++i) {
    ForgetPeak();
    const double base = PeakMb();
    const std::uint64_t prepared = planner.cache_statistics().prepared;
    const std::uint64_t decoded = source.decodings;
    const double begin = ProcessorSeconds();
    const absl::Time asked = SteadyNow();
    const absl::StatusOr<PlanResult> result = planner.Plan(
        source,
        {.from = world.from, .to = world.to, .profile = {}, .max_expanded = 1000'000'000},
        Stop());
    const double seconds = ProcessorSeconds() - begin;
    const double waited = absl::ToDoubleSeconds(SteadyNow() - asked);
    if (!result.ok()) {
      std::printf("%s\n", result.status().ToString().c_str());
      return 0.0;
    }
    graph_cost = result->graph_cost;
    std::printf(
        "%5zu MiB  %-4s %7.2f s (%.2f s of processor)  expanded %9llu  prepared %5llu  "
        "decoded %6llu  "
        "peak %6.0f MB (+%.0f)"
        "  length %.2f  cost %.4f  graph cost %.4f  %zu waypoints  %s\n",
        cache_mib,
        i == 0 ? "cold" : "warm",
        waited,
        seconds,
        static_cast<unsigned long long>(result->expanded),
        static_cast<unsigned long long>(planner.cache_statistics().prepared - prepared),
        static_cast<unsigned long long>(source.decodings - decoded),
        PeakMb(),
        PeakMb() - base,
        result->length_m,
        result->cost,
        graph_cost,
        result->waypoints.size(),
        result->message.substr(0, 60).c_str());
    std::fflush(stdout);
  }
  return graph_cost;
}

PlanEndpoint EndpointOf(const char* text) {
  PlanEndpoint end;
  double z = 0.0;
  std::sscanf(text, "%lf,%lf,%lf", &end.x_m, &end.y_m, &z);
  end.z_m = z;
  return end;
}

int Run(int argc, char** argv) {
  mallopt(M_ARENA_MAX, 4);  // as stratad does, with what the process takes in mind
  mallopt(M_MMAP_THRESHOLD, 256 << 10);
  const std::string kind = argc > 1 ? argv[1] : "street";
  const std::size_t cache_mib = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 160;
  const double length_m = argc > 3 ? std::atof(argv[3]) : kind == "yard" ? 269.0 : 7000.0;
  const std::uint64_t seed = argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 1;
  World world;
  TileBytes bytes;
  if (kind == "street" || kind == "yard" || kind == "decks") {
    world = kind == "street" ? Street(length_m) : kind == "yard" ? Yard(length_m) : Decks(length_m);
    bytes = Draw(world, seed);
  } else {
    bytes = ReadTiles(kind.c_str());
  }
  if (argc > 6) {
    world.from = EndpointOf(argv[5]);
    world.to = EndpointOf(argv[6]);
  }
  std::size_t patches = 0;
  for (const auto& [key, tile] : bytes) patches += DecodeSurfaceTile(tile)->surfaces.size();
  std::printf("%s, seed %llu: %zu tiles, %zu patches\n",
              kind.c_str(),
              static_cast<unsigned long long>(seed),
              bytes.size(),
              patches);
  const bool kept = std::any_of(
      argv, argv + argc, [](const char* word) { return absl::string_view(word) == "kept"; });
  const double frugal = Measure(bytes, world, cache_mib, 3, kept);
  const double ample = argc > 7 ? frugal : Measure(bytes, world, 8192, 2, kept);
  std::printf("cost in %zu MiB beside the cheapest: %.6f\n", cache_mib, frugal / ample);
  return frugal <= 1.01 * ample ? 0 : 1;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Run(argc, argv); }
