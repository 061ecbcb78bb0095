// PTX: scans of terrestrial scanners as text, one after the other, each with its pose (Leica).
#ifndef STRATA_CLIENT_FORMATS_SURVEY_PTX_READER_H_
#define STRATA_CLIENT_FORMATS_SURVEY_PTX_READER_H_

#include <filesystem>
#include <vector>

#include "absl/status/statusor.h"

#include "client/formats/survey/station.h"

namespace strata {

// The scans of a file: two lines with the numbers of columns and rows, one with where the scanner
// stood, three with its axes, four with the matrix that takes its points, as rows, into the file's
// frame; then columns × rows lines "x y z intensity [red green blue]" in metres in the scanner's
// frame, where 0 0 0 stands for no return. The pose is the matrix. Looks at every line, but holds
// none: memory is that of one scan, while it is read. The grid is not kept: programs write points
// that never had one as a grid of any width.
//
// UNAVAILABLE if the file cannot be read; INVALID_ARGUMENT with the line and what was expected.
absl::StatusOr<std::vector<Station>> ListPtxStations(const std::filesystem::path& path);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SURVEY_PTX_READER_H_
