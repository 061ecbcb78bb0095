#include "core/mls/surface_mesh.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/mls/local_plane.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFF;

// Whether a link already bounds a face, on either side of it.
enum Side : std::uint8_t {
  kAbove = 1,  // of the link to the right
  kBelow = 2,
  kRight = 4,  // of the link up
  kLeft = 8,
};

class MeshMaker {
 public:
  MeshMaker(std::span<const SurfaceTile* const> tiles,
            double cell_size_m,
            const SurfaceMeshOptions& options)
      : tiles_(tiles), tan_slope_(std::tan(options.max_slope_rad)) {
    cell_m_ = tiles.empty() ? cell_size_m : std::ldexp(cell_size_m, tiles.front()->key.level);
    std::uint32_t count = 0;
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      tile_of_key_[tiles[t]->key] = t;
      mesh_.first_vertex.push_back(count);
      count += static_cast<std::uint32_t>(tiles[t]->surfaces.size());
    }
    right_.assign(count, kNone);
    up_.assign(count, kNone);
    left_.assign(count, kNone);
    down_.assign(count, kNone);
    used_.assign(count, 0);
  }

  SurfaceMesh Make() {
    for (std::size_t t = 0; t < tiles_.size(); ++t) AddVertices(t);
    for (std::size_t t = 0; t < tiles_.size(); ++t) LinkTile(t);
    for (std::uint32_t v = 0; v < vertex_count(); ++v) AddQuad(v);
    for (std::uint32_t v = 0; v < vertex_count(); ++v) AddTriangles(v);
    for (std::uint32_t v = 0; v < vertex_count(); ++v) AddLines(v);
    std::vector<bool> on_diagonal(vertex_count(), false);
    for (std::size_t t = 0; t < tiles_.size(); ++t) AddDiagonals(t, on_diagonal);
    for (std::uint32_t v = 0; v < vertex_count(); ++v) {
      const bool linked = right_[v] != kNone || up_[v] != kNone || left_[v] != kNone ||
                          down_[v] != kNone || on_diagonal[v];
      if (!linked) mesh_.points.push_back(v);
    }
    return std::move(mesh_);
  }

 private:
  // The surfaces of one cell and the vertex of the lowest.
  struct Column {
    std::span<const Surface> surfaces;
    std::uint32_t first_vertex = 0;
  };

  std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(used_.size()); }

  Column ColumnAt(const TileKey& key, std::uint16_t cell_in_tile) const {
    const auto it = tile_of_key_.find(key);
    if (it == tile_of_key_.end()) return {};
    const SurfaceTile& tile = *tiles_[it->second];
    const std::span<const Surface> surfaces = tile.Cell(cell_in_tile);
    const std::ptrdiff_t offset = surfaces.data() - tile.surfaces.data();
    return {surfaces, mesh_.first_vertex[it->second] + static_cast<std::uint32_t>(offset)};
  }

  // The column dx, dy cells from a cell of tile `t`.
  Column Beside(std::size_t t, std::uint16_t cell, int dx, int dy) const {
    TileKey key = tiles_[t]->key;
    const int x = (cell & (kTileCells - 1)) + dx;
    const int y = (cell >> kTileShift) + dy;
    key.x += x >> kTileShift;
    key.y += y >> kTileShift;
    return ColumnAt(key, CellInTile({x, y}));
  }

  static std::size_t Nearest(std::span<const Surface> surfaces, float z_m) {
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < surfaces.size(); ++i) {
      if (std::abs(surfaces[i].z_m - z_m) < std::abs(surfaces[nearest].z_m - z_m)) nearest = i;
    }
    return nearest;
  }

  bool Fit(const Surface& a, const Surface& b, double cells) const {
    const double noise = kNoiseGate * std::hypot(double{a.sigma_m}, double{b.sigma_m});
    return std::abs(double{a.z_m} - b.z_m) <= noise + cells * cell_m_ * tan_slope_;
  }

  // Calls link(vertex of a, vertex of b) for the surfaces of two adjacent cells that belong
  // together.
  template <typename Link>
  void Match(const Column& a, const Column& b, double cells, Link link) const {
    if (b.surfaces.empty()) return;
    for (std::size_t i = 0; i < a.surfaces.size(); ++i) {
      const std::size_t j = Nearest(b.surfaces, a.surfaces[i].z_m);
      if (Nearest(a.surfaces, b.surfaces[j].z_m) != i) continue;
      if (!Fit(a.surfaces[i], b.surfaces[j], cells)) continue;
      link(a.first_vertex + static_cast<std::uint32_t>(i),
           b.first_vertex + static_cast<std::uint32_t>(j));
    }
  }

  // Calls visit(cell, column) for every occupied cell of tile `t`.
  template <typename Visit>
  void ForEachCell(std::size_t t, Visit visit) const {
    const std::vector<Surface>& surfaces = tiles_[t]->surfaces;
    for (std::size_t begin = 0; begin < surfaces.size();) {
      std::size_t end = begin + 1;
      while (end < surfaces.size() && surfaces[end].cell == surfaces[begin].cell) ++end;
      visit(surfaces[begin].cell,
            Column{std::span(surfaces).subspan(begin, end - begin),
                   mesh_.first_vertex[t] + static_cast<std::uint32_t>(begin)});
      begin = end;
    }
  }

  void AddVertices(std::size_t t) {
    for (const Surface& surface : tiles_[t]->surfaces) {
      const CellIndex cell = CellOf(tiles_[t]->key, surface.cell);
      if (surface.vertical()) {
        mesh_.verticals.push_back({static_cast<std::uint32_t>(mesh_.vertices.size()),
                                   double{surface.z_m} - surface.depth_m});
      }
      mesh_.vertices.emplace_back((cell.x + 0.5) * cell_m_, (cell.y + 0.5) * cell_m_, surface.z_m);
    }
  }

  void LinkTile(std::size_t t) {
    ForEachCell(t, [this, t](std::uint16_t cell, const Column& column) {
      Match(column, Beside(t, cell, 1, 0), 1.0, [this](std::uint32_t a, std::uint32_t b) {
        right_[a] = b;
        left_[b] = a;
      });
      Match(column, Beside(t, cell, 0, 1), 1.0, [this](std::uint32_t a, std::uint32_t b) {
        up_[a] = b;
        down_[b] = a;
      });
    });
  }

  void AddQuad(std::uint32_t a) {
    const std::uint32_t b = right_[a];
    const std::uint32_t c = up_[a];
    if (b == kNone || c == kNone || up_[b] == kNone || up_[b] != right_[c]) return;
    mesh_.quads.push_back({a, b, up_[b], c});
    used_[a] |= kAbove | kRight;
    used_[c] |= kBelow;
    used_[b] |= kLeft;
  }

  // The triangle around corner v of a square, unless its links bound a face there already.
  // `horizontal` and `vertical` are the vertices that hold the links.
  void AddTriangle(const std::array<std::uint32_t, 3>& corners,
                   std::uint32_t horizontal,
                   Side horizontal_side,
                   std::uint32_t vertical,
                   Side vertical_side) {
    if ((used_[horizontal] & horizontal_side) != 0 || (used_[vertical] & vertical_side) != 0)
      return;
    used_[horizontal] |= horizontal_side;
    used_[vertical] |= vertical_side;
    mesh_.triangles.push_back(corners);
  }

  void AddTriangles(std::uint32_t v) {
    const std::uint32_t r = right_[v];
    const std::uint32_t u = up_[v];
    const std::uint32_t l = left_[v];
    const std::uint32_t d = down_[v];
    if (r != kNone && u != kNone) AddTriangle({v, r, u}, v, kAbove, v, kRight);
    if (l != kNone && u != kNone) AddTriangle({l, v, u}, l, kAbove, v, kLeft);
    if (r != kNone && d != kNone) AddTriangle({d, r, v}, v, kBelow, d, kRight);
    if (l != kNone && d != kNone) AddTriangle({d, v, l}, l, kBelow, d, kLeft);
  }

  void AddLines(std::uint32_t v) {
    if (right_[v] != kNone && (used_[v] & (kAbove | kBelow)) == 0) {
      mesh_.lines.push_back({v, right_[v]});
    }
    if (up_[v] != kNone && (used_[v] & (kRight | kLeft)) == 0) mesh_.lines.push_back({v, up_[v]});
  }

  void AddDiagonals(std::size_t t, std::vector<bool>& on_diagonal) {
    const auto add = [&](std::uint32_t a, std::uint32_t b) {
      mesh_.lines.push_back({a, b});
      on_diagonal[a] = true;
      on_diagonal[b] = true;
    };
    ForEachCell(t, [&](std::uint16_t cell, const Column& column) {
      Match(column, Beside(t, cell, 1, 1), std::numbers::sqrt2, [&](auto a, auto b) {
        const bool alone =
            right_[a] == kNone && up_[a] == kNone && left_[b] == kNone && down_[b] == kNone;
        if (alone) add(a, b);
      });
      Match(column, Beside(t, cell, -1, 1), std::numbers::sqrt2, [&](auto a, auto b) {
        const bool alone =
            left_[a] == kNone && up_[a] == kNone && right_[b] == kNone && down_[b] == kNone;
        if (alone) add(a, b);
      });
    });
  }

  std::span<const SurfaceTile* const> tiles_;
  double tan_slope_;
  double cell_m_ = 0.0;
  HashMap<TileKey, std::size_t> tile_of_key_;
  SurfaceMesh mesh_;
  std::vector<std::uint32_t> right_, up_, left_, down_;  // links by vertex; kNone
  std::vector<std::uint8_t> used_;                       // Side bits of a vertex' right and up link
};

}  // namespace

SurfaceMesh MakeSurfaceMesh(std::span<const SurfaceTile* const> tiles,
                            double cell_size_m,
                            const SurfaceMeshOptions& options) {
  return MeshMaker(tiles, cell_size_m, options).Make();
}

}  // namespace strata
