// E57: scans of terrestrial scanners with their poses (ASTM E2807-11).
#ifndef STRATA_CLIENT_FORMATS_SURVEY_E57_READER_H_
#define STRATA_CLIENT_FORMATS_SURVEY_E57_READER_H_

#include <filesystem>
#include <vector>

#include "absl/status/statusor.h"

#include "client/formats/survey/station.h"

namespace strata {

// The scans (data3D) of a file: cartesian or spherical, of integers, scaled integers or floats,
// with intensity, colour and time where there are; points whose place is said to be invalid are
// left out. A scan without a pose is in the file's frame; one that is described wrongly says so
// when it is read. Pictures and grids are not looked at. Memory is that of the XML, and of one scan
// while it is read; every page that is read is checked.
//
// UNAVAILABLE if the file cannot be read; INVALID_ARGUMENT saying what was expected, also of a file
// without scans.
absl::StatusOr<std::vector<Station>> ListE57Stations(const std::filesystem::path& path);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SURVEY_E57_READER_H_
