#include "client/formats/survey/las_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "client/formats/parsing/byte_cursor.h"
#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/parsing/scalar.h"
#include "client/formats/survey/las_units.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::size_t kHeaderBytes = 227;       // of versions 1.0 to 1.2
constexpr std::size_t kHeader14Bytes = 375;     // of version 1.4
constexpr std::uint8_t kCompressedBits = 0xC0;  // of the format, as LAZ marks it
constexpr std::uint16_t kTextBit = 1 << 4;      // of the encoding: the projection is a text
constexpr std::uint32_t kMostRecords = 10'000;

// Where the fields of a point record format are; 0: nowhere.
struct LasFormat {
  std::size_t bytes, time, colour;
  bool extended;  // as version 1.4 has it
};
constexpr LasFormat kLasFormats[] = {
    {20, 0, 0, false},
    {28, 20, 0, false},
    {26, 0, 20, false},
    {34, 20, 28, false},
    {57, 20, 0, false},
    {63, 20, 28, false},
    {30, 22, 0, true},
    {36, 22, 30, true},
    {38, 22, 30, true},
    {59, 22, 0, true},
    {67, 22, 30, true},
};
constexpr std::size_t kIntensityAt = 12;

struct LasHeader {
  std::uint8_t minor = 0;
  std::uint16_t encoding = 0;
  std::size_t header_bytes = 0;
  std::size_t records = 0;  // of variable length
  std::size_t points_at = 0;
  LasFormat format = {};
  std::size_t point_bytes = 0;
  std::uint64_t points = 0;
  Eigen::Vector3d scale = Eigen::Vector3d::Zero();
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
};

// The number at a place that is there; else 0.
template <typename T>
T NumberAt(absl::string_view bytes, std::size_t at) {
  return at <= bytes.size() ? ByteCursor(bytes.substr(at)).Get<T>() : T{};
}

absl::Status LasFault(std::size_t at, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("byte ", at, ": ", what));
}

absl::Status CheckLasStart(absl::string_view bytes) {
  if (!absl::StartsWith(bytes, "LASF")) return LasFault(0, "expected 'LASF', as LAS files begin");
  if (bytes.size() < kHeaderBytes) {
    return LasFault(bytes.size(), absl::StrCat("expected a header of ", kHeaderBytes, " bytes"));
  }
  const int major = bytes[24];
  const int minor = bytes[25];
  if (major != 1 || minor < 0 || minor > 4) {
    return LasFault(24, absl::StrCat("version ", major, ".", minor, "; 1.0 to 1.4 are read"));
  }
  const auto format = NumberAt<std::uint8_t>(bytes, 104);
  if ((format & kCompressedBits) != 0) {
    return absl::InvalidArgumentError(
        "the points are compressed (LAZ, COPC), which is not read; 'laszip -i IN.laz -o OUT.las' "
        "or 'pdal translate IN.laz OUT.las' makes LAS of it");
  }
  if (format >= std::size(kLasFormats)) {
    return LasFault(104, absl::StrCat("point record format ", format, "; 0 to 10 are read"));
  }
  return absl::OkStatus();
}

absl::Status CheckLasHeader(absl::string_view bytes, const LasHeader& header) {
  if (header.point_bytes < header.format.bytes) {
    return LasFault(105,
                    absl::StrCat("points of ",
                                 header.point_bytes,
                                 " bytes; those of format ",
                                 NumberAt<std::uint8_t>(bytes, 104),
                                 " need ",
                                 header.format.bytes));
  }
  const std::size_t there = header.points_at <= bytes.size() ? bytes.size() - header.points_at : 0;
  if (header.points > there / header.point_bytes) {
    return LasFault(header.points_at,
                    absl::StrCat("expected ",
                                 header.points,
                                 " points of ",
                                 header.point_bytes,
                                 " bytes, there are ",
                                 there,
                                 " bytes: the file is cut short"));
  }
  if (!header.scale.allFinite() || !header.offset.allFinite() ||
      (header.scale.array() == 0).any()) {
    return LasFault(131, "expected finite scales and offsets, and no scale of 0");
  }
  return absl::OkStatus();
}

absl::StatusOr<LasHeader> ReadLasHeader(absl::string_view bytes) {
  STRATA_RETURN_IF_ERROR(CheckLasStart(bytes));
  LasHeader header;
  header.minor = NumberAt<std::uint8_t>(bytes, 25);
  header.encoding = NumberAt<std::uint16_t>(bytes, 6);
  header.header_bytes = NumberAt<std::uint16_t>(bytes, 94);
  header.points_at = NumberAt<std::uint32_t>(bytes, 96);
  header.records = NumberAt<std::uint32_t>(bytes, 100);
  header.format = kLasFormats[NumberAt<std::uint8_t>(bytes, 104)];
  header.point_bytes = NumberAt<std::uint16_t>(bytes, 105);
  header.points = NumberAt<std::uint32_t>(bytes, 107);
  if (header.minor >= 4 && header.header_bytes >= kHeader14Bytes &&
      bytes.size() >= kHeader14Bytes) {
    header.points = NumberAt<std::uint64_t>(bytes, 247);
  }
  for (int k = 0; k < 3; ++k) {
    const std::size_t at = sizeof(double) * static_cast<std::size_t>(k);
    header.scale[k] = NumberAt<double>(bytes, 131 + at);
    header.offset[k] = NumberAt<double>(bytes, 155 + at);
  }
  STRATA_RETURN_IF_ERROR(CheckLasHeader(bytes, header));
  return header;
}

// Records that follow each other from a place on, as far as they are whole.
void AddLasRecords(absl::string_view bytes,
                   std::uint64_t at,
                   std::uint64_t count,
                   bool extended,
                   std::vector<LasRecord>& records) {
  if (at > bytes.size()) return;
  ByteCursor cursor(bytes.substr(static_cast<std::size_t>(at)));
  for (std::uint64_t i = 0; i < count && records.size() < kMostRecords; ++i) {
    cursor.Take(2);
    const absl::string_view user = cursor.Take(16);
    LasRecord record{.user = std::string(user.substr(0, user.find('\0'))), .bytes = {}};
    record.id = cursor.Get<std::uint16_t>();
    const std::uint64_t length =
        extended ? cursor.Get<std::uint64_t>() : cursor.Get<std::uint16_t>();
    cursor.Take(32);  // what it is, in words
    record.bytes = cursor.Take(length);
    if (!cursor.ok()) return;
    records.push_back(std::move(record));
  }
}

std::vector<LasRecord> RecordsOf(absl::string_view bytes, const LasHeader& header) {
  std::vector<LasRecord> records;
  AddLasRecords(bytes, header.header_bytes, header.records, false, records);
  if (header.minor >= 4 && header.header_bytes >= kHeader14Bytes) {
    const auto at = NumberAt<std::uint64_t>(bytes, 235);
    AddLasRecords(bytes, at, NumberAt<std::uint32_t>(bytes, 243), true, records);
  }
  return records;
}

// One field of the points.
struct LasField {
  Meaning meaning;
  ScalarType type;
  std::size_t at;
};

std::uint8_t ClassOf(const LasFormat& format, std::uint8_t byte) {
  const std::uint8_t code = format.extended ? byte : byte & 31;
  return code == 1 ? 0 : code;
}

// The points of a file, field by field.
class LasPoints {
 public:
  LasPoints(absl::string_view bytes, const LasHeader& header, const LasUnits& units)
      : header_(header),
        first_(bytes.data() + header.points_at),
        unit_m_(units.horizontal_m, units.horizontal_m, units.vertical_m) {
    const LasFormat& format = header.format;
    AddField({Meaning::kIntensity, ScalarType::kUint16, kIntensityAt}, 2);
    if (HasClasses()) fields_.push_back({Meaning::kLabel, ScalarType::kUint8, class_at()});
    if (format.time > 0) AddField({Meaning::kTime, ScalarType::kFloat64, format.time}, 8);
    if (format.colour == 0 || !AnySet(format.colour, 6)) return;
    constexpr std::array kChannels = {Meaning::kRed, Meaning::kGreen, Meaning::kBlue};
    for (std::size_t k = 0; k < kChannels.size(); ++k) {
      fields_.push_back({kChannels[k], ScalarType::kUint16, format.colour + 2 * k});
    }
  }

  absl::StatusOr<PointCloud> Read() const {
    std::vector<Meaning> meanings = {Meaning::kX, Meaning::kY, Meaning::kZ};
    for (const LasField& field : fields_) meanings.push_back(field.meaning);
    STRATA_ASSIGN_OR_RETURN(CloudBuilder builder, CloudBuilder::Create(meanings));
    const auto count = static_cast<std::size_t>(header_.points);
    builder.Reserve(count);
    for (std::size_t begin = 0; begin < count; begin += kBlockPoints) {
      AddBlock(begin, std::min(kBlockPoints, count - begin), builder);
    }
    return std::move(builder).Build();
  }

 private:
  static constexpr std::size_t kBlockPoints = 1024;
  using Columns = std::array<std::array<double, kBlockPoints>, kMeanings>;

  std::size_t class_at() const { return header_.format.extended ? 16 : 15; }
  const char* PointAt(std::size_t index) const { return first_ + index * header_.point_bytes; }

  void AddField(const LasField& field, std::size_t bytes) {
    if (AnySet(field.at, bytes)) fields_.push_back(field);
  }

  // Whether a field says anything: what a sensor does not have is zero throughout.
  bool AnySet(std::size_t at, std::size_t bytes) const {
    for (std::size_t i = 0; i < header_.points; ++i) {
      const char* const field = PointAt(i) + at;
      if (std::any_of(field, field + bytes, [](char byte) { return byte != 0; })) return true;
    }
    return false;
  }

  bool HasClasses() const {
    for (std::size_t i = 0; i < header_.points; ++i) {
      const auto byte = static_cast<std::uint8_t>(PointAt(i)[class_at()]);
      if (ClassOf(header_.format, byte) != 0) return true;
    }
    return false;
  }

  bool IsWithheld(const char* point) const {
    if (header_.format.extended) return (point[15] & 4) != 0;
    return header_.minor >= 1 && (point[15] & 128) != 0;
  }

  void ReadCoordinates(std::size_t begin, std::size_t count, Columns& columns) const {
    for (int k = 0; k < 3; ++k) {
      const std::span<double> values(columns[static_cast<std::size_t>(k)].data(), count);
      ReadScalars(PointAt(begin) + 4 * k, header_.point_bytes, ScalarType::kInt32, false, values);
      for (double& value : values) {
        value = (value * header_.scale[k] + header_.offset[k]) * unit_m_[k];
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (IsWithheld(PointAt(begin + i))) columns[0][i] = std::numeric_limits<double>::quiet_NaN();
    }
  }

  void AddBlock(std::size_t begin, std::size_t count, CloudBuilder& builder) const {
    Columns columns;
    PointBlock block{.count = count, .columns = {}};
    for (std::size_t k = 0; k < 3; ++k) block.columns[k] = columns[k].data();
    ReadCoordinates(begin, count, columns);
    for (const LasField& field : fields_) {
      const auto m = static_cast<std::size_t>(field.meaning);
      block.columns[m] = columns[m].data();
      ReadScalars(PointAt(begin) + field.at,
                  header_.point_bytes,
                  field.type,
                  false,
                  block.of(field.meaning));
      if (field.meaning != Meaning::kLabel) continue;
      for (double& label : block.of(Meaning::kLabel)) {
        label = ClassOf(header_.format, static_cast<std::uint8_t>(label));
      }
    }
    builder.AddBlock(block);
  }

  const LasHeader& header_;
  const char* const first_;
  const Eigen::Vector3d unit_m_;
  std::vector<LasField> fields_;
};

}  // namespace

absl::StatusOr<PointCloud> ReadLas(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const LasHeader header, ReadLasHeader(bytes));
  STRATA_ASSIGN_OR_RETURN(const LasUnits units,
                          LasUnitsOf(RecordsOf(bytes, header), (header.encoding & kTextBit) != 0));
  return LasPoints(bytes, header, units).Read();
}

}  // namespace strata
