// The identity of a scan's content: what makes "the same scan again" recognisable.
#ifndef STRATA_CORE_ENGINE_SCAN_HASH_H_
#define STRATA_CORE_ENGINE_SCAN_HASH_H_

#include <string>

#include "core/cloud/point_cloud.h"
#include "core/common/checksum.h"
#include "core/world/scan.h"

namespace strata {

// Hash over header and points in order; does not depend on how the points were split into pieces.
// NaN must be the quiet one (what core/codec writes). The pose counts in steps of 1e-9 (metres, and
// of its unit quaternion): on its way over a wire it becomes a quaternion and back, which changes
// its last bits.
class ScanHasher {
 public:
  void Add(const PointCloud& piece);
  std::string Digest(const ScanHeader& header) const;

 private:
  ContentHasher points_;
  ContentHasher intensity_;
  ContentHasher colour_;
  ContentHasher label_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_SCAN_HASH_H_
