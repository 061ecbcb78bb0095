// To which side a feature of an upright surface was seen from: opposite faces of a wall are two
// things, however thin it is.
#ifndef STRATA_CORE_REGISTRATION_FACING_H_
#define STRATA_CORE_REGISTRATION_FACING_H_

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace strata {

// A horizontal direction: 0 for unknown, else 1 + its sector of kFacingSectors, counterclockwise
// from x.
using Facing = std::uint8_t;
inline constexpr int kFacingSectors = 32;
inline constexpr Facing kFacingUnknown = 0;

// Bit f is set where features that face f are in it.
using FacingSet = std::uint64_t;
inline constexpr FacingSet kAnyFacing = ~FacingSet{0};
// What can be of one surface with a feature that faces so: no more than a right angle apart. What
// is unknown may be of either side and is nobody's partner.
inline FacingSet CompatibleWith(Facing facing) {
  if (facing == kFacingUnknown) return FacingSet{0};
  constexpr int kQuarter = kFacingSectors / 4;
  constexpr FacingSet kSectors = (FacingSet{1} << kFacingSectors) - 1;
  constexpr FacingSet kHalf = (FacingSet{1} << (2 * kQuarter + 1)) - 1;  // around sector kQuarter
  const int by = (facing - 1 - kQuarter + kFacingSectors) % kFacingSectors;
  const FacingSet sectors = (kHalf << by | kHalf >> (kFacingSectors - by)) & kSectors;
  return sectors << 1;
}

// What may be averaged: compatible, or both unknown.
inline bool OfOneSide(Facing a, Facing b) { return a == b || (CompatibleWith(a) >> b & 1U) != 0; }

// Facings after a turn about z; of a rotation R by its YawOf(R).
class FacingTurn {
 public:
  explicit FacingTurn(double yaw_rad);
  Facing operator()(Facing facing) const { return turned_[facing]; }

 private:
  std::array<Facing, kFacingSectors + 1> turned_;
};
double YawOf(const Eigen::Matrix3d& R);

// Of each of the points of upright surfaces seen by a sensor at `sensor_origin`: the normal of the
// surface around it, towards the sensor. Where points span none it is the direction to the sensor,
// which is within a right angle of all that the sensor can see; unknown where a surface is seen
// along itself.
std::vector<Facing> FacingsOf(std::span<const Eigen::Vector3f> points,
                              const Eigen::Vector3f& sensor_origin);

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_FACING_H_
