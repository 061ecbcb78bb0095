#include "core/world/scan_hash.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

#include "core/cloud/cloud_slice.h"
#include "core/cloud/point_cloud.h"
#include "core/common/checksum.h"
#include "core/world/scan.h"
#include "core/world/value_codec.h"

namespace strata {
namespace {

// The columns hold plain little-endian numbers without padding.
static_assert(sizeof(Eigen::Vector3f) == 12 && sizeof(Colour) == 3);

template <typename T>
absl::string_view BytesOf(const std::vector<T>& column) {
  return {reinterpret_cast<const char*>(column.data()), column.size() * sizeof(T)};
}

constexpr double kSteps = 1e9;

// Components (bit i: number i of x, y, z, w) that lie so near to the middle between two steps that
// a way over a wire, which costs some 1e-16, may take them to the other one.
unsigned BetweenSteps(const Pose& pose) {
  constexpr double kNear = 1e-5;
  const Eigen::Quaterniond q = Eigen::Quaterniond(pose.linear()).normalized();
  unsigned between = 0;
  for (Eigen::Index i = 0; i < 4; ++i) {
    const double steps = std::abs(q.coeffs()[i]) * kSteps;
    if (std::abs(steps - std::floor(steps) - 0.5) < kNear) between |= 1U << i;
  }
  return between;
}

// Translation and unit quaternion (x, y, z, w) in steps of 1e-9, as little-endian 64-bit numbers;
// of the two quaternions of a rotation the one whose last component that is not 0 is positive.
std::string RoundedPose(const Pose& pose, unsigned other_way) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(pose.linear()).normalized();
  std::array<std::int64_t, 7> steps{};
  for (Eigen::Index i = 0; i < 3; ++i) {
    steps[static_cast<std::size_t>(i)] = std::llround(pose.translation()[i] * kSteps);
  }
  for (Eigen::Index i = 0; i < 4; ++i) {
    const double exact = q.coeffs()[i] * kSteps;
    std::int64_t& step = steps[static_cast<std::size_t>(3 + i)];
    step = std::llround(exact);
    if ((other_way >> i & 1U) != 0) step += exact > static_cast<double>(step) ? 1 : -1;
  }
  const auto last = std::find_if(steps.rbegin(), steps.rbegin() + 4, [](auto s) { return s != 0; });
  if (*last < 0) {
    for (std::size_t i = 3; i < 7; ++i) steps[i] = -steps[i];
  }
  std::string bytes;
  for (const std::int64_t step : steps) {
    for (int shift = 0; shift < 64; shift += 8) {
      bytes.push_back(static_cast<char>(static_cast<std::uint64_t>(step) >> shift & 0xFF));
    }
  }
  return bytes;
}

}  // namespace

void ScanHasher::Add(const PointCloud& piece) {
  points_.Add(BytesOf(piece.points));
  intensity_.Add(BytesOf(piece.intensity));
  colour_.Add(BytesOf(piece.colour));
  label_.Add(BytesOf(piece.label));
}

std::string ScanHasher::Digest(const ScanHeader& header) const { return Digest(header, 0); }

bool ScanHasher::Matches(const ScanHeader& header, absl::string_view digest) const {
  const unsigned between = BetweenSteps(header.T_map_scan);
  for (unsigned other_way = 0; other_way < 16; ++other_way) {
    if ((other_way & ~between) == 0 && Digest(header, other_way) == digest) return true;
  }
  return false;
}

std::string ScanHasher::Digest(const ScanHeader& header, unsigned other_way) const {
  ContentHasher all;
  all.Add(header.id.ToString());
  all.Add(RoundedPose(header.T_map_scan, other_way));
  ScanHeader rest = header;
  rest.T_map_scan = Pose::Identity();
  all.Add(EncodeScanHeader(rest));
  for (const ContentHasher* column : {&points_, &intensity_, &colour_, &label_}) {
    all.Add(column->HexDigest());
  }
  return all.HexDigest();
}

void QuietNans(PointCloud& cloud, std::size_t first) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = first; i < cloud.points.size(); ++i) {
    Eigen::Vector3f& point = cloud.points[i];
    if (point.array().isNaN().any()) point.setConstant(kNan);
  }
  for (std::size_t i = first; i < cloud.intensity.size(); ++i) {
    if (std::isnan(cloud.intensity[i])) cloud.intensity[i] = kNan;
  }
}

std::string ContentHashOf(const ScanHeader& header, const PointCloud& cloud) {
  constexpr std::size_t kPiece = 40'000;
  ScanHasher hasher;
  for (std::size_t begin = 0; begin < cloud.size(); begin += kPiece) {
    PointCloud piece = SliceOf(cloud, begin, std::min(cloud.size(), begin + kPiece));
    QuietNans(piece);
    hasher.Add(piece);
  }
  return hasher.Digest(header);
}

}  // namespace strata
