#include "client/formats/survey/e57_points.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/parsing/byte_cursor.h"
#include "client/formats/parsing/cloud_builder.h"
#include "client/formats/survey/e57_file.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr std::size_t kBlockPoints = 1024;
constexpr std::uint64_t kSectionHeaderBytes = 32;
constexpr std::uint8_t kVectorSection = 1;
// Packets.
constexpr std::uint8_t kIndexPacket = 0;
constexpr std::uint8_t kDataPacket = 1;
constexpr std::uint8_t kEmptyPacket = 2;
constexpr std::uint64_t kPacketHeaderBytes = 4;

int BitsOf(const E57Field& field) {
  switch (field.encoding) {
    case E57Encoding::kInteger:
    case E57Encoding::kScaledInteger:
      return std::bit_width(static_cast<std::uint64_t>(field.maximum) -
                            static_cast<std::uint64_t>(field.minimum));
    case E57Encoding::kSingle:
      return 32;
    case E57Encoding::kDouble:
      return 64;
    case E57Encoding::kOther:
      break;
  }
  return 0;
}

// The values of one field, bit after bit across all packets, the lowest first.
class E57Stream {
 public:
  explicit E57Stream(const E57Field& field) : field_(field), bits_(BitsOf(field)) {}

  int bits() const { return bits_; }
  void Append(absl::string_view bytes) {
    if (bit_ / 8 >= bytes_.size() / 2) {
      bytes_.erase(0, bit_ / 8);
      bit_ %= 8;
    }
    bytes_.append(bytes.data(), bytes.size());
  }
  std::uint64_t available() const {
    if (bits_ == 0) return std::numeric_limits<std::uint64_t>::max();
    return (8 * std::uint64_t{bytes_.size()} - bit_) / static_cast<std::uint64_t>(bits_);
  }
  // REQUIRES: as many are available.
  void Take(std::span<double> values) {
    for (double& value : values) value = ValueOf(TakeBits());
  }

 private:
  std::uint64_t TakeBits() {
    if (bits_ == 0) return 0;
    const std::size_t byte = bit_ / 8;
    const auto shift = static_cast<int>(bit_ % 8);
    std::array<unsigned char, 9> around{};
    std::memcpy(around.data(), bytes_.data() + byte, std::min(around.size(), bytes_.size() - byte));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 8; ++i) value |= std::uint64_t{around[i]} << (8 * i);
    value >>= shift;
    if (shift + bits_ > 64) value |= std::uint64_t{around[8]} << (64 - shift);
    bit_ += static_cast<std::size_t>(bits_);
    return bits_ == 64 ? value : value & ((std::uint64_t{1} << bits_) - 1);
  }

  double ValueOf(std::uint64_t bits) const {
    if (field_.encoding == E57Encoding::kDouble) return std::bit_cast<double>(bits);
    if (field_.encoding == E57Encoding::kSingle) {
      return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
    }
    const auto whole = static_cast<std::int64_t>(bits + static_cast<std::uint64_t>(field_.minimum));
    return static_cast<double>(whole) * field_.scale + field_.offset;
  }

  E57Field field_;
  int bits_;
  std::string bytes_;
  std::size_t bit_ = 0;  // of the bytes, where the next value begins
};

using RoleColumns = std::array<std::array<double, kBlockPoints>, kE57Roles>;

struct RoleMeaning {
  E57Role role;
  Meaning meaning;
};
constexpr RoleMeaning kRoleMeanings[] = {
    {E57Role::kX, Meaning::kX},
    {E57Role::kY, Meaning::kY},
    {E57Role::kZ, Meaning::kZ},
    {E57Role::kIntensity, Meaning::kIntensity},
    {E57Role::kRed, Meaning::kRed},
    {E57Role::kGreen, Meaning::kGreen},
    {E57Role::kBlue, Meaning::kBlue},
    {E57Role::kTime, Meaning::kTime},
    {E57Role::kLabel, Meaning::kLabel},
};

// Makes a cloud of the packets of a section.
class E57PointReader {
 public:
  E57PointReader(E57File file, const E57Points& points) : file_(std::move(file)), points_(points) {
    for (const E57Field& field : points.fields) streams_.emplace_back(field);
  }

  absl::StatusOr<PointCloud> Read() {
    STRATA_RETURN_IF_ERROR(FindPackets());
    STRATA_RETURN_IF_ERROR(CheckCount());
    STRATA_ASSIGN_OR_RETURN(CloudBuilder builder, CloudBuilder::Create(Meanings()));
    builder.Reserve(static_cast<std::size_t>(points_.count));
    while (read_ < points_.count) {
      if (at_ + kPacketHeaderBytes > end_) return TooFew();
      STRATA_RETURN_IF_ERROR(ReadPacket());
      Decode(builder);
    }
    return std::move(builder).Build();
  }

 private:
  bool Has(E57Role role) const {
    return std::any_of(points_.fields.begin(), points_.fields.end(), [role](const auto& field) {
      return field.role == role;
    });
  }

  std::vector<Meaning> Meanings() const {
    std::vector<Meaning> meanings;
    for (const auto& [role, meaning] : kRoleMeanings) {
      if (Has(role)) meanings.push_back(meaning);
    }
    return meanings;
  }

  absl::Status FindPackets() {
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t section, file_.PlaceOf(points_.at));
    std::string header;
    STRATA_RETURN_IF_ERROR(file_.Read(section, kSectionHeaderBytes, header));
    ByteCursor cursor(header);
    const auto id = cursor.Get<std::uint8_t>();
    cursor.Take(7);
    const auto bytes = cursor.Get<std::uint64_t>();
    STRATA_ASSIGN_OR_RETURN(at_, file_.PlaceOf(cursor.Get<std::uint64_t>()));
    if (id != kVectorSection || bytes > file_.size() - section || at_ < section) {
      return absl::InvalidArgumentError(absl::StrCat("expected a section of points at byte ",
                                                     points_.at,
                                                     ", found one of kind ",
                                                     id,
                                                     " of ",
                                                     bytes,
                                                     " bytes"));
    }
    end_ = section + bytes;
    return absl::OkStatus();
  }

  // The bits of all points must be there: then no number of them takes more memory than is due.
  absl::Status CheckCount() const {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < streams_.size(); ++i) {
      if (points_.fields[i].role) bits += static_cast<std::uint64_t>(streams_[i].bits());
    }
    const std::uint64_t there = 8 * (std::max(at_, end_) - at_);
    if (bits > 0 && points_.count <= there / bits) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat(
        points_.count, " points of ", bits, " bits do not fit into ", there / 8, " bytes"));
  }

  absl::Status TooFew() const {
    return absl::InvalidArgumentError(
        absl::StrCat("expected ", points_.count, " points, found ", read_));
  }

  absl::Status ReadPacket() {
    STRATA_RETURN_IF_ERROR(file_.Read(at_, kPacketHeaderBytes, packet_));
    ByteCursor cursor(packet_);
    const auto kind = cursor.Get<std::uint8_t>();
    cursor.Take(1);
    const std::uint64_t bytes = std::uint64_t{cursor.Get<std::uint16_t>()} + 1;
    if (kind > kEmptyPacket || bytes < kPacketHeaderBytes || bytes > end_ - at_) {
      return absl::InvalidArgumentError(absl::StrCat(
          "byte ", at_, " (without checksums): a packet of kind ", kind, " and ", bytes, " bytes"));
    }
    const std::uint64_t begin = std::exchange(at_, at_ + bytes);
    if (kind == kIndexPacket || kind == kEmptyPacket) return absl::OkStatus();
    STRATA_RETURN_IF_ERROR(file_.Read(begin, bytes, packet_));
    return TakeStreams(begin);
  }

  absl::Status TakeStreams(std::uint64_t begin) {
    ByteCursor lengths(packet_);
    lengths.Take(kPacketHeaderBytes);
    const auto count = lengths.Get<std::uint16_t>();
    ByteCursor cursor = lengths;
    cursor.Take(2 * std::uint64_t{count});
    for (std::size_t i = 0; i < streams_.size() && count == streams_.size(); ++i) {
      const absl::string_view bytes = cursor.Take(lengths.Get<std::uint16_t>());
      if (points_.fields[i].role) streams_[i].Append(bytes);
    }
    if (count == streams_.size() && cursor.ok()) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat("byte ",
                                                   begin,
                                                   " (without checksums): a packet of ",
                                                   count,
                                                   " fields; expected ",
                                                   streams_.size(),
                                                   " that fit into it"));
  }

  // Adds the points all of whose values are there.
  void Decode(CloudBuilder& builder) {
    std::uint64_t count = points_.count - read_;
    for (std::size_t i = 0; i < streams_.size(); ++i) {
      if (points_.fields[i].role) count = std::min(count, streams_[i].available());
    }
    read_ += count;
    for (std::uint64_t done = 0; done < count; done += kBlockPoints) {
      const auto block =
          static_cast<std::size_t>(std::min<std::uint64_t>(kBlockPoints, count - done));
      for (std::size_t i = 0; i < streams_.size(); ++i) {
        if (points_.fields[i].role) streams_[i].Take({Column(*points_.fields[i].role), block});
      }
      AddBlock(block, builder);
    }
  }

  double* Column(E57Role role) { return columns_[static_cast<std::size_t>(role)].data(); }

  void AddBlock(std::size_t count, CloudBuilder& builder) {
    if (points_.spherical) FromSpherical(count);
    if (Has(E57Role::kInvalid)) LeaveInvalidOut(count);
    if (points_.colour_low && points_.colour_high) ScaleColours(count);
    PointBlock block{.count = count, .columns = {}};
    for (const auto& [role, meaning] : kRoleMeanings) {
      if (Has(role)) block.columns[static_cast<std::size_t>(meaning)] = Column(role);
    }
    builder.AddBlock(block);
  }

  void FromSpherical(std::size_t count) {
    double* const x = Column(E57Role::kX);
    double* const y = Column(E57Role::kY);
    double* const z = Column(E57Role::kZ);
    for (std::size_t i = 0; i < count; ++i) {
      const double range = x[i];
      const double azimuth = y[i];
      const double elevation = z[i];
      x[i] = range * std::cos(elevation) * std::cos(azimuth);
      y[i] = range * std::cos(elevation) * std::sin(azimuth);
      z[i] = range * std::sin(elevation);
    }
  }

  void LeaveInvalidOut(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      if (Column(E57Role::kInvalid)[i] == 0.0) continue;
      Column(E57Role::kX)[i] = std::numeric_limits<double>::quiet_NaN();
    }
  }

  void ScaleColours(std::size_t count) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double low = (*points_.colour_low)[k];
      const double per_step = 255.0 / ((*points_.colour_high)[k] - low);
      double* const channel =
          Column(static_cast<E57Role>(static_cast<std::size_t>(E57Role::kRed) + k));
      for (std::size_t i = 0; i < count; ++i) {
        const double scaled = std::round((channel[i] - low) * per_step);
        channel[i] = scaled >= 0.0 ? std::min(scaled, 255.0) : 0.0;
      }
    }
  }

  E57File file_;
  const E57Points& points_;
  std::vector<E57Stream> streams_;
  std::uint64_t at_ = 0;   // the next packet
  std::uint64_t end_ = 0;  // of the section
  std::uint64_t read_ = 0;
  std::string packet_;
  RoleColumns columns_{};
};

}  // namespace

absl::StatusOr<PointCloud> ReadE57Points(const std::filesystem::path& path,
                                         const E57Points& points) {
  if (points.count == 0) return absl::InvalidArgumentError("a scan of 0 points");
  STRATA_ASSIGN_OR_RETURN(E57File file, E57File::Open(path));
  return E57PointReader(std::move(file), points).Read();
}

}  // namespace strata
