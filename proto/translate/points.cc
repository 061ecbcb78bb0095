#include "proto/translate/points.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/api/scans.h"
#include "core/common/status.h"

namespace strata::translate {
namespace {

static_assert(std::endian::native == std::endian::little, "columns are copied as they lie");
static_assert(sizeof(Eigen::Vector3f) == 12 && sizeof(Colour) == 3);

template <typename T>
std::string Pack(std::span<const T> column) {
  std::string bytes(column.size() * sizeof(T), '\0');
  if (!column.empty())
    std::memcpy(bytes.data(), static_cast<const void*>(column.data()), bytes.size());
  return bytes;
}

// REQUIRES: bytes.size() is a multiple of sizeof(T).
template <typename T>
std::vector<T> Unpack(const std::string& bytes) {
  std::vector<T> column(bytes.size() / sizeof(T));
  if (!column.empty()) std::memcpy(static_cast<void*>(column.data()), bytes.data(), bytes.size());
  return column;
}

absl::Status CheckPointCount(std::size_t points) {
  if (points >= 1 && points <= api::kMaxPointsPerChunk) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("chunk has ", points, " points: send 1 to ", api::kMaxPointsPerChunk));
}

absl::Status CheckBytes(const char* name, std::size_t bytes, std::size_t per_point, std::size_t n) {
  if (bytes == 0 || bytes == per_point * n) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "chunk: ", name, " has ", bytes, " bytes, not ", per_point, " for each of ", n, " points"));
}

}  // namespace

v1::PointChunk ToProto(const PointCloud& cloud) {
  v1::PointChunk chunk;
  chunk.set_xyz(Pack(std::span(cloud.points)));
  chunk.set_intensity(Pack(std::span(cloud.intensity)));
  chunk.set_rgb(Pack(std::span(cloud.colour)));
  chunk.set_label(Pack(std::span(cloud.label)));
  return chunk;
}

absl::StatusOr<PointCloud> FromProto(const v1::PointChunk& chunk) {
  if (chunk.xyz().size() % sizeof(Eigen::Vector3f) != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("chunk: xyz has ", chunk.xyz().size(), " bytes, not 12 a point"));
  }
  const std::size_t n = chunk.xyz().size() / sizeof(Eigen::Vector3f);
  STRATA_RETURN_IF_ERROR(CheckPointCount(n));
  STRATA_RETURN_IF_ERROR(CheckBytes("intensity", chunk.intensity().size(), sizeof(float), n));
  STRATA_RETURN_IF_ERROR(CheckBytes("rgb", chunk.rgb().size(), sizeof(Colour), n));
  STRATA_RETURN_IF_ERROR(CheckBytes("label", chunk.label().size(), sizeof(std::uint16_t), n));
  PointCloud cloud;
  cloud.points = Unpack<Eigen::Vector3f>(chunk.xyz());
  cloud.intensity = Unpack<float>(chunk.intensity());
  cloud.colour = Unpack<Colour>(chunk.rgb());
  cloud.label = Unpack<std::uint16_t>(chunk.label());
  return cloud;
}

absl::Status CheckGrid(std::uint32_t rows, std::uint32_t columns, std::uint64_t point_count) {
  const std::uint64_t grid = std::uint64_t{rows} * columns;
  if ((rows == 0 && columns == 0) || grid == point_count) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("a grid of ", rows, " × ", columns, " does not hold ", point_count, " points"));
}

void DropFirst(std::size_t points, v1::PointChunk& chunk) {
  const auto drop = [points](std::size_t per_point, std::string& column) {
    if (!column.empty()) column.erase(0, points * per_point);
  };
  drop(sizeof(Eigen::Vector3f), *chunk.mutable_xyz());
  drop(sizeof(float), *chunk.mutable_intensity());
  drop(sizeof(Colour), *chunk.mutable_rgb());
  drop(sizeof(std::uint16_t), *chunk.mutable_label());
}

std::string PackLabels(std::span<const std::uint16_t> labels) { return Pack(labels); }

absl::StatusOr<std::vector<std::uint16_t>> UnpackLabels(const std::string& bytes) {
  if (bytes.size() % sizeof(std::uint16_t) == 0) return Unpack<std::uint16_t>(bytes);
  return absl::InvalidArgumentError(
      absl::StrCat("labels: ", bytes.size(), " bytes, not 2 a label"));
}

}  // namespace strata::translate
