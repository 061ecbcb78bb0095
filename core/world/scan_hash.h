// The identity of a scan's content: what makes "the same scan again" recognisable.
#ifndef STRATA_CORE_WORLD_SCAN_HASH_H_
#define STRATA_CORE_WORLD_SCAN_HASH_H_

#include <cstddef>
#include <string>

#include "absl/strings/string_view.h"

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
  // Whether `digest` is of this content. A pose whose last bits changed on the way, and which lies
  // where one step meets the next, has two digests; this knows both.
  bool Matches(const ScanHeader& header, absl::string_view digest) const;

 private:
  // With the components of the rotation in `other_way` rounded to the farther step.
  std::string Digest(const ScanHeader& header, unsigned other_way) const;

  ContentHasher points_;
  ContentHasher intensity_;
  ContentHasher colour_;
  ContentHasher label_;
};

// Makes every NaN from point `first` on the quiet one; a point with one in any coordinate has
// three.
void QuietNans(PointCloud& cloud, std::size_t first = 0);

// Digest of a whole scan, whatever its NaN: what a client announces as ScanHeader::content_hash.
// REQUIRES: columns empty or as long as the points.
std::string ContentHashOf(const ScanHeader& header, const PointCloud& cloud);

}  // namespace strata

#endif  // STRATA_CORE_WORLD_SCAN_HASH_H_
