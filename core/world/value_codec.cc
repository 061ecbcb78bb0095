#include "core/world/value_codec.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/checksum.h"
#include "core/common/status.h"
#include "core/geometry/pose.h"
#include "core/world/scan.h"

namespace strata {
namespace {

constexpr std::uint8_t kVersion = 1;
enum class Kind : std::uint8_t { kPose = 1, kMatrix6 = 2, kScanHeader = 3 };

class ByteWriter {
 public:
  explicit ByteWriter(Kind kind) {
    Put(static_cast<std::uint8_t>(kind));
    Put(kVersion);
  }
  template <typename T>
  requires std::is_integral_v<T>
  void Put(T value) {
    const auto bits = static_cast<std::make_unsigned_t<T>>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes_.push_back(static_cast<char>((std::uint64_t{bits} >> (8 * i)) & 0xFF));
    }
  }
  void Put(double value) { Put(std::bit_cast<std::uint64_t>(value)); }
  void Put(float value) { Put(std::bit_cast<std::uint32_t>(value)); }
  std::string Finish() && {
    Put(Checksum64(bytes_));
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
};

// Reads what ByteWriter wrote. Open() has checked the size, so that no read can run over.
class ByteReader {
 public:
  static absl::StatusOr<ByteReader> Open(absl::string_view what,
                                         Kind kind,
                                         std::size_t payload_bytes,
                                         absl::string_view bytes) {
    constexpr std::size_t kFrameBytes = 10;
    if (bytes.size() != payload_bytes + kFrameBytes) {
      return absl::DataLossError(absl::StrCat(
          what, ": ", bytes.size(), " bytes instead of ", payload_bytes + kFrameBytes));
    }
    ByteReader reader(bytes.substr(bytes.size() - 8));
    if (reader.Get<std::uint64_t>() != Checksum64(bytes.substr(0, bytes.size() - 8))) {
      return absl::DataLossError(absl::StrCat(what, ": checksum mismatch"));
    }
    reader.rest_ = bytes;
    if (reader.Get<std::uint8_t>() != static_cast<std::uint8_t>(kind) ||
        reader.Get<std::uint8_t>() != kVersion) {
      return absl::DataLossError(absl::StrCat(what, ": unknown kind or version"));
    }
    return reader;
  }
  template <typename T>
  T Get() {
    using Bits = std::conditional_t<std::is_same_v<T, double>,
                                    std::uint64_t,
                                    std::conditional_t<std::is_same_v<T, float>, std::uint32_t, T>>;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bits |= std::uint64_t{static_cast<std::uint8_t>(rest_[i])} << (8 * i);
    }
    rest_.remove_prefix(sizeof(T));
    return std::bit_cast<T>(static_cast<Bits>(bits));
  }

 private:
  explicit ByteReader(absl::string_view bytes) : rest_(bytes) {}
  absl::string_view rest_;
};

constexpr std::size_t kPoseBytes = 12 * sizeof(double);
constexpr std::size_t kHeaderBytes =
    8 + kPoseBytes + 12 + 1 + 4 * sizeof(double) + 1 + 8 + 4 + 4 + 1;

void PutPose(const Pose& pose, ByteWriter& writer) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) writer.Put(pose.matrix()(row, column));
  }
}

Pose GetPose(ByteReader& reader) {
  Pose pose = Pose::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) pose.matrix()(row, column) = reader.Get<double>();
  }
  return pose;
}

enum Flags : std::uint8_t { kIntensity = 1, kColour = 2, kLabel = 4 };

}  // namespace

std::string EncodePose(const Pose& pose) {
  ByteWriter writer(Kind::kPose);
  PutPose(pose, writer);
  return std::move(writer).Finish();
}

absl::StatusOr<Pose> DecodePose(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(ByteReader reader,
                          ByteReader::Open("pose", Kind::kPose, kPoseBytes, bytes));
  return GetPose(reader);
}

std::string EncodeMatrix6(const Matrix6d& matrix) {
  ByteWriter writer(Kind::kMatrix6);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) writer.Put(matrix(row, column));
  }
  return std::move(writer).Finish();
}

absl::StatusOr<Matrix6d> DecodeMatrix6(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(
      ByteReader reader,
      ByteReader::Open("information matrix", Kind::kMatrix6, 36 * sizeof(double), bytes));
  Matrix6d matrix;
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) matrix(row, column) = reader.Get<double>();
  }
  return matrix;
}

std::string EncodeScanHeader(const ScanHeader& header) {
  ByteWriter writer(Kind::kScanHeader);
  writer.Put(absl::ToUnixMicros(header.time));
  PutPose(header.T_map_scan, writer);
  for (int axis = 0; axis < 3; ++axis) writer.Put(header.sensor_origin[axis]);
  const SensorModel sensor = header.sensor.value_or(SensorModel());
  writer.Put(static_cast<std::uint8_t>(header.sensor.has_value()));
  writer.Put(sensor.sigma_m);
  writer.Put(sensor.sigma_per_metre);
  writer.Put(sensor.min_range_m);
  writer.Put(sensor.max_range_m);
  writer.Put(static_cast<std::uint8_t>(header.alignment));
  writer.Put(header.point_count);
  writer.Put(header.rows);
  writer.Put(header.columns);
  writer.Put(static_cast<std::uint8_t>((header.has_intensity ? kIntensity : 0) |
                                       (header.has_colour ? kColour : 0) |
                                       (header.has_label ? kLabel : 0)));
  return std::move(writer).Finish();
}

absl::StatusOr<ScanHeader> DecodeScanHeader(const ScanId& id, absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(ByteReader reader,
                          ByteReader::Open("scan header", Kind::kScanHeader, kHeaderBytes, bytes));
  ScanHeader header;
  header.id = id;
  header.time = absl::FromUnixMicros(reader.Get<std::int64_t>());
  header.T_map_scan = GetPose(reader);
  for (int axis = 0; axis < 3; ++axis) header.sensor_origin[axis] = reader.Get<float>();
  const bool has_sensor = reader.Get<std::uint8_t>() != 0;
  SensorModel sensor;
  sensor.sigma_m = reader.Get<double>();
  sensor.sigma_per_metre = reader.Get<double>();
  sensor.min_range_m = reader.Get<double>();
  sensor.max_range_m = reader.Get<double>();
  if (has_sensor) header.sensor = sensor;
  header.alignment = static_cast<Alignment>(reader.Get<std::uint8_t>());
  header.point_count = reader.Get<std::uint64_t>();
  header.rows = reader.Get<std::uint32_t>();
  header.columns = reader.Get<std::uint32_t>();
  const std::uint8_t flags = reader.Get<std::uint8_t>();
  header.has_intensity = (flags & kIntensity) != 0;
  header.has_colour = (flags & kColour) != 0;
  header.has_label = (flags & kLabel) != 0;
  return header;
}

}  // namespace strata
