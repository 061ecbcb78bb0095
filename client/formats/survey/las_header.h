// What stands before and behind the points of a LAS file: its header and its records.
#ifndef STRATA_CLIENT_FORMATS_SURVEY_LAS_HEADER_H_
#define STRATA_CLIENT_FORMATS_SURVEY_LAS_HEADER_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "client/formats/parsing/byte_source.h"
#include "client/formats/survey/las_units.h"

namespace strata {

// Where the fields of a point record format are; 0: nowhere.
struct LasFormat {
  std::size_t bytes, time, colour;
  bool extended;  // as version 1.4 has it
};

struct LasHeader {
  std::uint8_t minor = 0;
  bool text_projection = false;  // the projection is a text
  bool compressed = false;       // LAZ
  int format_number = 0;         // 0 to 10
  LasFormat format = {};
  std::size_t header_bytes = 0;
  std::uint32_t records = 0;  // of variable length
  std::uint64_t points_at = 0;
  std::size_t point_bytes = 0;  // at least those of the format
  std::uint64_t points = 0;
  Eigen::Vector3d scale = Eigen::Vector3d::Zero();
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
};

// UNAVAILABLE; INVALID_ARGUMENT with byte and what was expected: no LAS, or fewer points than the
// header says where they are not compressed.
absl::StatusOr<LasHeader> ReadLasHeader(ByteSource& source);

// Those records that say something to us, of projections and of LAZ, before the points and, of
// version 1.4, behind them; as far as they are whole. UNAVAILABLE.
absl::StatusOr<std::vector<LasRecord>> ReadLasRecords(ByteSource& source, const LasHeader& header);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SURVEY_LAS_HEADER_H_
