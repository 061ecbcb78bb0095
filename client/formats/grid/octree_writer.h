// Occupied and free space as an octree of OctoMap.
#ifndef STRATA_CLIENT_FORMATS_GRID_OCTREE_WRITER_H_
#define STRATA_CLIENT_FORMATS_GRID_OCTREE_WRITER_H_

#include <cstddef>
#include <string>

#include "core/occupancy/occupancy_voxels.h"

namespace strata {

struct OctreeFile {
  std::string bytes;
  std::size_t nodes = 0;  // as OctoMap counts; 0: of an empty grid
  double occupied_m3 = 0.0;
  double free_m3 = 0.0;
};

// A .bt file (OctoMap 1.6 and later): each node one of free, occupied and divided, those of eight
// alike put together; what nobody saw is not in it, and what is free only `with_free`.
OctreeFile BtFile(const OccupancyVoxels& grid, bool with_free = true);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_GRID_OCTREE_WRITER_H_
