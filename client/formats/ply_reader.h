// Polygon (Stanford) files, version 1.0: ascii, binary_little_endian and binary_big_endian.
#ifndef STRATA_CLIENT_FORMATS_PLY_READER_H_
#define STRATA_CLIENT_FORMATS_PLY_READER_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/cloud/point_cloud.h"

namespace strata {

// The element `vertex` of a file, with properties of any type in any order; lists and other
// elements are skipped. INVALID_ARGUMENT with the line or byte and what was expected; announced
// sizes are checked against the file's before anything is allocated.
absl::StatusOr<PointCloud> ReadPly(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PLY_READER_H_
