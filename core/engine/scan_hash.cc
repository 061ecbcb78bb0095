#include "core/engine/scan_hash.h"

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
  all.Add(EncodeScanHeader(header));
  for (const ContentHasher* column : {&points_, &intensity_, &colour_, &label_}) {
    all.Add(column->HexDigest());
  }
  return all.HexDigest();
}

}  // namespace strata
