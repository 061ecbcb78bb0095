// Legacy VTK files (ParaView, libpointmatcher), ascii and binary.
#ifndef STRATA_CLIENT_FORMATS_VTK_READER_H_
#define STRATA_CLIENT_FORMATS_VTK_READER_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/cloud/point_cloud.h"

namespace strata {

// The section POINTS of a file of any data set type; cells and attributes are not read.
// INVALID_ARGUMENT with the line or byte and what was expected.
absl::StatusOr<PointCloud> ReadVtk(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_VTK_READER_H_
