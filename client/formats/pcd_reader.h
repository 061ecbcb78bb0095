// Point Cloud Data files (PCL), versions 0.5 to 0.7: ascii, binary and binary_compressed.
#ifndef STRATA_CLIENT_FORMATS_PCD_READER_H_
#define STRATA_CLIENT_FORMATS_PCD_READER_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/cloud/point_cloud.h"

namespace strata {

// The cloud in the bytes of a file. HEIGHT > 1 makes it organised. A VIEWPOINT that is not zero is
// the sensor's place. INVALID_ARGUMENT with the line (header, ascii) or byte (binary) and what was
// expected; announced sizes are checked against the file's before anything is allocated.
//
// Not PCL's reader: that one prints to stdout, throws on hostile headers, makes zeros of UTM
// doubles, and is slower (docs/decisions/0083).
absl::StatusOr<PointCloud> ReadPcd(absl::string_view bytes);

// Whether the header that `beginning` of a file begins with says where the sensor stood.
bool HasPcdViewpoint(absl::string_view beginning);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PCD_READER_H_
