// How well do the scans of a recording agree at given poses? Prints one line of JSON a pose file.
//
//   crispness SCANS POSES… [--cell 0.1] [--gap 0.1] [--thickness 0.3] [--band 0.5]
//
// All points become one multi-level surface map, with a small gap, so that a surface seen at two
// heights is either one thick patch or two levels:
//   spread_m      of the heights in a horizontal patch around their mean, from Σw, Σwz and Σwz²
//                 (w = 1/σ²): root of the mean square over all measurements, and the median patch
//   double_share  of the cells, those with two levels whose facing sides are less than BAND apart
// Smaller is crisper. Both have a floor that no poses change: rough ground, slopes, walls that
// were hit here and there. A surface that is doubled by more than the thickness leaves the spread
// and may enter the share: the two belong together.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "core/mls/build.h"
#include "core/mls/join.h"
#include "tests/support/pcd.h"

namespace strata {
namespace {

struct Crispness {
  std::size_t cells = 0;
  std::size_t doubled = 0;
  std::size_t horizontal = 0;  // patches of at least kMinCount measurements
  double sum_w = 0.0;
  double sum_w_spread2 = 0.0;
  std::vector<double> spreads;
};

constexpr std::uint64_t kMinCount = 5;

MlsMap MapAt(const std::filesystem::path& scans,
             const std::filesystem::path& poses_file,
             const MlsParameters& parameters) {
  const auto poses = testing::ReadIndexedPoses(poses_file).value();
  MlsScratch scratch;
  std::vector<MlsMap> contributions;
  for (const auto& [index, path] : testing::ListScans(scans)) {
    const PointCloud cloud = testing::ReadBinaryPcd(path).value();
    const Pose& T_map_scan = poses.at(index).T_world_scan;
    contributions.push_back(
        BuildMlsMap(cloud, T_map_scan, SensorModel(), parameters, scratch).value().map);
  }
  return JoinAll(contributions, parameters);
}

// Whether two levels of a cell face each other closer than `band_m`.
bool IsDoubled(const std::vector<Patch>& cell, double band_m) {
  for (std::size_t k = 1; k < cell.size(); ++k) {
    if (cell[k].bottom_m() - cell[k - 1].top_m() < band_m) return true;
  }
  return false;
}

void AddPatch(const Patch& patch, Crispness& total) {
  if (patch.vertical() || patch.count < kMinCount) return;
  const double spread = patch.spread_m();
  const auto weight = static_cast<double>(patch.sum_w);
  ++total.horizontal;
  total.sum_w += weight;
  total.sum_w_spread2 += weight * spread * spread;
  total.spreads.push_back(spread);
}

Crispness Measure(const MlsMap& map, double band_m) {
  Crispness total;
  std::vector<Patch> cell;
  const auto end_cell = [&] {
    if (cell.empty()) return;
    ++total.cells;
    total.doubled += IsDoubled(cell, band_m) ? 1 : 0;
    cell.clear();
  };
  for (const MlsTile& tile : map.tiles) {
    for (const Patch& patch : tile.patches) {
      if (!cell.empty() && cell.back().cell != patch.cell) end_cell();
      cell.push_back(patch);
      AddPatch(patch, total);
    }
    end_cell();
  }
  return total;
}

void Print(const std::filesystem::path& poses, Crispness total) {
  const std::size_t middle = total.spreads.size() / 2;
  double median = 0.0;
  if (!total.spreads.empty()) {
    std::nth_element(total.spreads.begin(),
                     total.spreads.begin() + static_cast<std::ptrdiff_t>(middle),
                     total.spreads.end());
    median = total.spreads[middle];
  }
  std::printf(
      "{\"poses\": \"%s\", \"cells\": %zu, \"double_share\": %.6f, \"horizontal\": %zu, "
      "\"spread_m\": %.6f, \"median_spread_m\": %.6f}\n",
      poses.stem().c_str(),
      total.cells,
      static_cast<double>(total.doubled) /
          static_cast<double>(std::max<std::size_t>(1, total.cells)),
      total.horizontal,
      total.sum_w > 0.0 ? std::sqrt(total.sum_w_spread2 / total.sum_w) : 0.0,
      median);
}

int Main(int argc, char** argv) {
  CLI::App app("how well scans agree at given poses");
  std::filesystem::path scans;
  std::vector<std::filesystem::path> poses;
  MlsParameters parameters{.cell_size_m = 0.1, .gap_size_m = 0.1, .thickness_m = 0.3};
  double band_m = 0.5;
  app.add_option("SCANS", scans, "folder of binary PCD files")->required();
  app.add_option("POSES", poses, "lines: index time x y z qx qy qz qw")->required();
  app.add_option("--cell", parameters.cell_size_m)->capture_default_str();
  app.add_option("--gap", parameters.gap_size_m)->capture_default_str();
  app.add_option("--thickness", parameters.thickness_m)->capture_default_str();
  app.add_option("--band", band_m)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  for (const std::filesystem::path& file : poses) {
    Print(file, Measure(MapAt(scans, file, parameters), band_m));
  }
  return 0;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
