#include "core/engine/scan_hash.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

#include "core/cloud/point_cloud.h"
#include "core/common/checksum.h"
#include "core/storage/value_codec.h"
#include "core/world/scan.h"

namespace strata {
namespace {

// The columns hold plain little-endian numbers without padding.
static_assert(sizeof(Eigen::Vector3f) == 12 && sizeof(Colour) == 3);

template <typename T>
absl::string_view BytesOf(const std::vector<T>& column) {
  return {reinterpret_cast<const char*>(column.data()), column.size() * sizeof(T)};
}

// Translation and unit quaternion (x, y, z, w) in steps of 1e-9, as little-endian 64-bit numbers;
// of the two quaternions of a rotation the one whose last component that is not 0 is positive.
std::string RoundedPose(const Pose& pose) {
  constexpr double kSteps = 1e9;
  const Eigen::Quaterniond q = Eigen::Quaterniond(pose.linear()).normalized();
  std::array<std::int64_t, 7> steps{};
  for (Eigen::Index i = 0; i < 3; ++i) {
    steps[static_cast<std::size_t>(i)] = std::llround(pose.translation()[i] * kSteps);
  }
  for (Eigen::Index i = 0; i < 4; ++i) {
    steps[static_cast<std::size_t>(3 + i)] = std::llround(q.coeffs()[i] * kSteps);
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

std::string ScanHasher::Digest(const ScanHeader& header) const {
  ContentHasher all;
  all.Add(header.id.ToString());
  all.Add(RoundedPose(header.T_map_scan));
  ScanHeader rest = header;
  rest.T_map_scan = Pose::Identity();
  all.Add(EncodeScanHeader(rest));
  for (const ContentHasher* column : {&points_, &intensity_, &colour_, &label_}) {
    all.Add(column->HexDigest());
  }
  return all.HexDigest();
}

}  // namespace strata
