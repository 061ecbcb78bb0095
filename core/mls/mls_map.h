// The multi-level surface map: flat arrays of patches in tiles (thesis 6.5).
#ifndef STRATA_CORE_MLS_MLS_MAP_H_
#define STRATA_CORE_MLS_MLS_MAP_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mls/mls_parameters.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {

// Sums of colours over the measurements of a patch that had one (thesis 6.5.5, 12.2.1).
struct ColourSum {
  std::uint64_t r = 0, g = 0, b = 0;
  std::uint64_t count = 0;
  friend bool operator==(const ColourSum&, const ColourSum&) = default;
};

// How many measurements of patch `patch` (index into MlsTile::patches) voted for a class (6.5.5).
struct ClassVotes {
  std::uint32_t patch = 0;
  std::uint16_t class_id = 0;
  std::uint32_t count = 0;
  friend bool operator==(const ClassVotes&, const ClassVotes&) = default;
};

// The patches of one tile, sorted by (cell, z_min), two patches of a cell at least γ apart.
// Annotation layers lie beside the patches: `colour` is empty or has one entry a patch; `votes` is
// sorted by (patch, class_id) and sparse.
struct MlsTile {
  TileKey key;
  std::vector<Patch> patches;
  std::vector<ColourSum> colour;
  std::vector<ClassVotes> votes;
  // Index of the first patch of each row of cells; row_begin[kTileCells] == patches.size().
  std::array<std::uint32_t, kTileCells + 1> row_begin{};

  // Recomputes row_begin from patches.
  void IndexRows();
  // The patches of a cell, lowest first; empty when nothing was measured there.
  std::span<const Patch> Cell(std::uint16_t cell_in_tile) const;

  friend bool operator==(const MlsTile&, const MlsTile&) = default;
};

// A map: its parameters and its non-empty tiles, sorted by key. A local map has the same shape in
// the frame of its scan. Plain value; concurrent const use is safe.
struct MlsMap {
  MlsParameters parameters;
  std::vector<MlsTile> tiles;

  // nullptr when the map has nothing there.
  const MlsTile* Find(const TileKey& key) const;
  std::span<const Patch> Cell(CellIndex cell) const;
  std::size_t patch_count() const;
  std::size_t occupied_cell_count() const;
  // Bytes held, index and layers included.
  std::size_t memory_bytes() const;

  friend bool operator==(const MlsMap&, const MlsMap&) = default;
};

}  // namespace strata

#endif  // STRATA_CORE_MLS_MLS_MAP_H_
