// Where in their cells the points of upright surfaces lie.
#ifndef STRATA_CORE_REGISTRATION_UPRIGHT_OFFSETS_H_
#define STRATA_CORE_REGISTRATION_UPRIGHT_OFFSETS_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/mls/mls_map.h"
#include "core/mls/patch.h"
#include "core/mls/tile_key.h"

namespace strata {

// A local map says of a wall in which cells it is; its points say where in them, ten times closer.
// A wall along the cells, as robots see them that drive along walls and through doors, is otherwise
// off to one side by up to half a cell everywhere. One thread at a time.
class UprightOffsets {
 public:
  // `local_map` must outlive it. `samples_per_metre` and `R_map_scan`: as in ScanFeatureOptions.
  UprightOffsets(const MlsMap& local_map,
                 double samples_per_metre,
                 const Eigen::Matrix3d& R_map_scan = Eigen::Matrix3d::Identity());

  // Some of the points that the map was made of, in the scan's frame.
  void Add(std::span<const Eigen::Vector3f> points);

  // From the middle of `cell` to where sample `i`, from below, of its vertical patch `patch` lies,
  // the `place`th patch of the map in its order [m]: the mean of the sample's points, moved onto
  // the face that they and those at its height in the four cells around lie on. A face seldom keeps
  // to one cell: of the few points beyond the border neither the mean nor the cell's middle is on
  // it. Zero where there is no face: what is seen of a hedge goes with where it was seen from.
  Eigen::Vector2f Of(CellIndex cell, const Patch& patch, std::size_t place, int i) const;

 private:
  struct Moments {
    Eigen::Vector2f sum = Eigen::Vector2f::Zero();
    float xx = 0.0F, xy = 0.0F, yy = 0.0F;
    std::uint32_t n = 0;

    void Add(const Eigen::Vector2f& p);
    // The points of others, each moved.
    void Add(const Moments& others, const Eigen::Vector2f& moved);
  };
  struct Face {
    Eigen::Vector2f mean;
    Eigen::Vector2f normal;
  };

  static std::optional<Face> FaceOf(const Moments& moments);
  // All patches of a cell with a vertical one, else none. `tile`: the last one, or nullptr.
  std::span<const Patch> UprightIn(CellIndex cell, const MlsTile*& tile) const;
  // The sample of a cell's vertical patch at a height; kNone if there is none.
  std::uint32_t SampleAt(CellIndex cell, std::int32_t z_ticks, const MlsTile*& tile) const;

  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  const MlsMap& map_;
  const Eigen::Matrix3f R_map_scan_;
  std::vector<std::size_t> tile_first_;  // place of each tile's first patch
  std::vector<std::uint32_t> first_;     // of each patch's samples; one more
  std::vector<Moments> samples_;
};

// Into how many samples a vertical patch of a map is divided, evenly from its bottom to its top.
int SamplesOf(const Patch& patch, double samples_per_metre);

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_UPRIGHT_OFFSETS_H_
