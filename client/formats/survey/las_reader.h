// LAS and LAZ: what airborne and mobile surveys are handed over as (ASPRS LAS specification 1.0 to
// 1.4; LAZ is LASzip's compressed LAS).
#ifndef STRATA_CLIENT_FORMATS_SURVEY_LAS_READER_H_
#define STRATA_CLIENT_FORMATS_SURVEY_LAS_READER_H_

#include <filesystem>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/cloud/point_cloud.h"

namespace strata {

// The points of a file of any point record format, 0 to 10, in metres: x east, y north, z up in the
// file's projection, as doubles until PointCloud::origin is taken out. Feet, as the file's
// projection says (LasUnitsOf), become metres; without a projection they are metres.
//
// Compressed: as any LASzip writes it, and COPC, which is that: all its points, in the order of its
// chunks.
//
// Intensity, colour, time (of GPS, seconds) and label are there if one of them is not zero in the
// file. The label is the classification, and 0 for its 1, "unclassified". Points that are withheld,
// which means deleted, are left out; waveforms are not looked at.
//
// INVALID_ARGUMENT with byte and what was expected: no LAS, fewer points than the header says,
// compressed otherwise than above, coordinates in degrees.
absl::StatusOr<PointCloud> ReadLas(absl::string_view bytes);

// The same of a file, of which no more is held than the points and one compressed chunk, of
// LASzip before 2.0 all of them. Errors
// name no file. UNAVAILABLE if it cannot be read.
absl::StatusOr<PointCloud> ReadLasFile(const std::filesystem::path& path);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SURVEY_LAS_READER_H_
