// The live path of thesis 6.5.3: single measurements into a map as they come, without waiting for
// the rest of the scan. For whole scans use build.h, which is many times faster.
#ifndef STRATA_CORE_MLS_UPDATE_H_
#define STRATA_CORE_MLS_UPDATE_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/common/hash_map.h"
#include "core/mls/mls_map.h"
#include "core/mls/mls_parameters.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {

// Patches under update. Each measurement goes the way of 6.5.3:
//   1. fused with the patch of its cell whose mean is nearest, if the distance is within the gate
//      3 · √(σ_patch² + σ_measurement²), at least kMinGateM and less than γ. Fusing is eq. 6.1 and
//      6.2 in information form (Σ1/σ², Σz/σ²: the same estimate, without drift of rounding);
//   2. else disregarded if it lies inside a vertical patch, below its top;
//   3. else a new patch.
// The thesis' gate uses the patch's σ alone, which tends to 0 and would come to reject good
// measurements; the measurement's own σ and a floor keep it open.
//
// While under update two patches of a cell may be closer than γ (a kerb beside its ground). Map()
// closes the update with the rule of creation: intervals closer than γ are one. What it returns
// differs from BuildMlsMap of the same measurements in nothing but Patch::count of vertical
// patches: disregarded measurements are not counted. Colours and labels are not carried.
//
// Not safe for concurrent use. Memory: about 60 bytes a patch.
class MlsUpdater {
 public:
  static constexpr double kMinGateM = 0.02;

  enum class Outcome : std::uint8_t { kFused, kDisregarded, kNewPatch, kOutsideMap };

  // REQUIRES: ValidateMlsParameters(parameters).
  explicit MlsUpdater(const MlsParameters& parameters);
  // Goes on from a map; its layers are left behind.
  explicit MlsUpdater(const MlsMap& map);

  // `p_map` in metres, its standard deviation in height `sigma_m`. kOutsideMap when a coordinate is
  // not finite or beyond the map (kMaxZTicks, kMaxCellIndex); nothing changes then.
  Outcome Update(const Eigen::Vector3d& p_map, double sigma_m);
  // The same for a measurement already quantised.
  Outcome Update(CellIndex cell, std::int32_t z_ticks, std::uint8_t sigma_code);

  // The patches of a cell as they are now, in no order.
  std::vector<Patch> Cell(CellIndex cell) const;
  std::size_t patch_count() const { return nodes_.size(); }

  // The map of everything so far; the update may go on.
  MlsMap Map() const;

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;
  // Patches of one cell form a chain through one array.
  struct Node {
    Patch patch;
    std::uint32_t next = kNone;
  };

  void Insert(CellIndex cell, const Patch& patch);

  MlsParameters parameters_;
  std::vector<Node> nodes_;
  HashMap<std::uint64_t, std::uint32_t> first_;  // by cell: head of its chain
};

}  // namespace strata

#endif  // STRATA_CORE_MLS_UPDATE_H_
