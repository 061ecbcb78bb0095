// The two faces of a thin wall: which of them a scan is held to.
// Internal to core/registration, not installed.
#ifndef STRATA_CORE_REGISTRATION_FACES_H_
#define STRATA_CORE_REGISTRATION_FACES_H_

#include <cstdint>

#include <Eigen/Core>

#include "core/registration/registration_target.h"
#include "core/registration/scan_features.h"

namespace strata {

enum class Face : std::uint8_t {
  kWhole,  // nothing tells two faces apart
  kOne,    // both were seen: this is the one that the scan sees
  kOther,  // only the other one was seen, of a wall or of stairs: not what the scan sees
};

// Looks at the neighbours of the upright feature `index` of a target with upright_sides(). A scan
// whose sensor is at `sensor` sees a surface with this unit normal there, sign arbitrary. For kOne
// `element` becomes that of the face alone; otherwise it stays.
Face FaceTowards(const RegistrationTarget& target,
                 std::uint32_t index,
                 const Eigen::Vector3f& sensor,
                 const Eigen::Vector3f& normal,
                 int neighbours,
                 float radius_m,
                 SurfaceElement& element);

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_FACES_H_
