// Planes that are no surface of their own, but what another one's points are off it.
// Internal to core/planes, not installed.
//
// Errors of poses are shared by all points of a scan, so walls have more in their tails than a
// mixture of Gaussians expects, and EM gives it a plane of its own: across the wall, or a few
// centimetres off it. A surface hides what is behind it: where two are seen in the same place from
// the same side, and no farther apart than their points are off them, there is one.
#ifndef STRATA_CORE_PLANES_MODELS_DOUBLED_PLANES_H_
#define STRATA_CORE_PLANES_MODELS_DOUBLED_PLANES_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/planes/models/plane_colour.h"
#include "core/planes/models/plane_polygons.h"

namespace strata {

struct FacedPlane {
  SeenPlane seen;
  LabColour colour = LabColour::Zero();
  double band_m = 0.0;      // points so near are on it
  std::int64_t facing = 0;  // points seen from the normal's side less those from the other
  Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();  // of its surface
};

// Of each plane the one that it belongs to, a larger one or itself: one that lies within the
// other's band, faces where it does, and has half of its points where the other has as many or
// more. Colours that are not alike are two surfaces' (thesis 5.5). `planes`: by falling area.
std::vector<std::size_t> OwnersOf(std::span<const FacedPlane> planes);

// What was seen on `other` was seen on `plane`.
void AddSeen(const FacedPlane& other, FacedPlane& plane);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_DOUBLED_PLANES_H_
