#ifndef STRATA_TESTS_SUPPORT_TINY_MAP_H_
#define STRATA_TESTS_SUPPORT_TINY_MAP_H_
#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "core/cloud/point_cloud.h"
#include "core/mls/mls_map.h"

namespace strata::testing {
inline MlsMap TinyMap(const PointCloud& cloud, const MlsParameters& parameters, double sigma0 = 0.01, double sigma1 = 0.0005) {
  struct M { TileKey key; std::uint16_t cell; std::int32_t z; std::uint8_t s; };
  std::vector<M> ms;
  for (const auto& p : cloud.points) {
    CellIndex c{(int)std::floor(p.x() / parameters.cell_size_m), (int)std::floor(p.y() / parameters.cell_size_m)};
    ms.push_back({TileOfCell(c), CellInTile(c), (std::int32_t)std::lround(p.z() * kTicksPerMetre), SigmaCode(sigma0 + sigma1 * p.norm())});
  }
  std::sort(ms.begin(), ms.end(), [](const M& a, const M& b) { return std::tie(a.key, a.cell, a.z) < std::tie(b.key, b.cell, b.z); });
  MlsMap map; map.parameters = parameters;
  for (const M& m : ms) {
    if (map.tiles.empty() || map.tiles.back().key != m.key) { map.tiles.emplace_back(); map.tiles.back().key = m.key; }
    auto& ps = map.tiles.back().patches;
    Patch p = PatchOfMeasurement(m.cell, m.z, m.s);
    if (!ps.empty() && ps.back().cell == p.cell && Touching(ps.back(), p, parameters)) ps.back() = Join(ps.back(), p, parameters);
    else ps.push_back(p);
  }
  for (auto& t : map.tiles) t.IndexRows();
  return map;
}
}  // namespace strata::testing
#endif
