#include "core/codec/surface_tile_codec.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/codec/columns.h"
#include "core/codec/occupancy.h"
#include "core/codec/tile_header.h"
#include "core/common/status.h"

namespace strata {
namespace {

constexpr float kStepsPerMetre = 512.0F;
constexpr std::int64_t kMaxHeightCode = (1 << 24) - 1;  // exact in a float
constexpr float kSigmaCodesPerOctave = 7.5F;            // steps of 9.7 %
constexpr float kMinSigmaOctave = -24.0F;
constexpr float kCostCodesPerOctave = 8.0F;  // steps of 9.1 %
constexpr std::int64_t kInfiniteCost = 255;
constexpr int kMaxTraversability = static_cast<int>(Traversability::kNonTraversable);

// A surface in whole numbers, as it is stored.
struct Codes {
  std::uint16_t cell = 0;
  std::uint8_t traversability = 0;
  std::uint8_t class_id = 0;
  std::int64_t height = 0;
  std::int64_t depth = 0;  // > 0: vertical
  std::int64_t sigma = 0;
  std::int64_t cost = 0;
};

std::int64_t LengthCode(float metres) {
  if (!(std::abs(metres) <= kMaxHeightCode / kStepsPerMetre)) {
    return std::isnan(metres) ? 0 : std::signbit(metres) ? -kMaxHeightCode : kMaxHeightCode;
  }
  return std::lround(metres * kStepsPerMetre);
}

std::int64_t ByteCode(float value) { return std::lround(std::clamp(value, 0.0F, 255.0F)); }

std::int64_t SigmaCodeOf(float sigma_m) {
  if (!(sigma_m > 0.0F)) return 0;
  return ByteCode((std::log2(sigma_m) - kMinSigmaOctave) * kSigmaCodesPerOctave);
}

std::int64_t CostCodeOf(float cost) {
  if (!(cost > 0.0F)) return 0;
  if (std::isinf(cost)) return kInfiniteCost;
  return std::min(ByteCode(std::log2(1.0F + cost) * kCostCodesPerOctave), kInfiniteCost - 1);
}

Codes Quantised(const Surface& surface) {
  Codes codes{.cell = surface.cell,
              .traversability = static_cast<std::uint8_t>(surface.traversability),
              .class_id = surface.class_id,
              .height = LengthCode(surface.z_m),
              .sigma = SigmaCodeOf(surface.sigma_m),
              .cost = CostCodeOf(surface.cost)};
  if (surface.vertical()) codes.depth = std::max<std::int64_t>(1, LengthCode(surface.depth_m));
  return codes;
}

Surface Restored(const Codes& codes) {
  Surface surface{.cell = codes.cell,
                  .traversability = static_cast<Traversability>(codes.traversability),
                  .class_id = codes.class_id,
                  .z_m = static_cast<float>(codes.height) / kStepsPerMetre,
                  .depth_m = static_cast<float>(codes.depth) / kStepsPerMetre};
  surface.sigma_m =
      std::exp2(static_cast<float>(codes.sigma) / kSigmaCodesPerOctave + kMinSigmaOctave);
  surface.cost = codes.cost == kInfiniteCost
                     ? std::numeric_limits<float>::infinity()
                     : std::exp2(static_cast<float>(codes.cost) / kCostCodesPerOctave) - 1.0F;
  return surface;
}

// Columns. Heights and the like go to one of several columns by what is known of their
// surroundings, because a zstd frame has one table of frequencies.
enum Column : std::uint8_t {
  kKind,  // traversability and vertical: context-free, spatially coherent
  kClass,
  kHeight,  // + HeightContext
  kHeightLast = kHeight + 3,
  kDepth,  // + 1 where the prediction comes from a vertical neighbour
  kDepthLast = kDepth + 1,
  kSigma,  // + vertical
  kSigmaLast = kSigma + 1,
  kCost,  // + traversability
  kCostLast = kCost + 3,
  kColumnCount
};

std::int64_t FloorDivide(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0 ? 1 : 0); }

// Known surfaces beside one that is being coded.
class Surroundings {
 public:
  Surroundings(std::span<const Codes> surfaces, const Neighbours& n, bool vertical) {
    for (const std::uint32_t index : {n.left, n.up, n.up_right, n.up_left}) {
      if (index == Neighbours::kNone) continue;
      const Codes& beside = surfaces[index];
      if (nearest_ == nullptr) nearest_ = &beside;
      if ((beside.depth > 0) != vertical) continue;
      alike_[alike_count_++] = &beside;
    }
  }

  int alike_count() const { return alike_count_; }

  // Rounded mean of those alike; without any, the nearest; without surroundings, 0.
  std::int64_t Mean(std::int64_t Codes::*field) const {
    if (alike_count_ == 0) return nearest_ == nullptr ? 0 : nearest_->*field;
    std::int64_t sum = 0;
    for (int i = 0; i < alike_count_; ++i) sum += alike_[i]->*field;
    return FloorDivide(2 * sum + alike_count_, 2 * alike_count_);
  }

 private:
  const Codes* nearest_ = nullptr;
  const Codes* alike_[4] = {};
  int alike_count_ = 0;
};

int HeightColumn(const Surroundings& around, bool vertical) {
  if (around.alike_count() == 0) return kHeight;
  if (vertical) return kHeight + 1;
  return around.alike_count() == 1 ? kHeight + 2 : kHeight + 3;
}

// One surface, in either direction.
template <typename Coder>
Codes CodeSurface(Coder& coder,
                  const Neighbours& neighbours,
                  std::span<const Codes> surfaces,
                  Codes codes) {
  const auto kind = coder.CodeByte(
      kKind, static_cast<std::uint8_t>(codes.traversability << 1 | (codes.depth > 0)));
  codes.traversability = kind >> 1;
  const bool vertical = (kind & 1) != 0;
  const Surroundings around(surfaces, neighbours, vertical);
  const bool known = around.alike_count() > 0;

  codes.class_id = coder.CodeByte(kClass, codes.class_id);
  codes.height =
      coder.CodeRelative(HeightColumn(around, vertical), codes.height, around.Mean(&Codes::height));
  if (vertical) {
    // Undersides continue better than lengths.
    const std::int64_t expected =
        known ? WrappingAdd(codes.height, around.Mean(&Codes::depth) - around.Mean(&Codes::height))
              : 0;
    codes.depth = coder.CodeRelative(kDepth + known, codes.depth, expected);
  }
  codes.sigma = coder.CodeRelative(kSigma + vertical, codes.sigma, around.Mean(&Codes::sigma));
  codes.cost = coder.CodeRelative(
      kCost + std::min<int>(codes.traversability, 3), codes.cost, around.Mean(&Codes::cost));
  return codes;
}

bool InRange(const Codes& codes) {
  return codes.traversability <= kMaxTraversability && std::abs(codes.height) <= kMaxHeightCode &&
         codes.depth >= 0 && codes.depth <= kMaxHeightCode && codes.sigma >= 0 &&
         codes.sigma <= 255 && codes.cost >= 0 && codes.cost <= kInfiniteCost;
}

}  // namespace

std::string EncodeSurfaceTile(const SurfaceTile& tile) {
  std::vector<Codes> surfaces(tile.surfaces.size());
  std::vector<std::uint16_t> cells(tile.surfaces.size());
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    surfaces[i] = Quantised(tile.surfaces[i]);
    cells[i] = surfaces[i].cell;
  }
  const std::vector<Neighbours> neighbours = FindNeighbours(cells);
  ColumnEncoder encoder(kColumnCount);
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    CodeSurface(encoder, neighbours[i], surfaces, surfaces[i]);
  }
  std::string body;
  PutTileHeader(body, tile.key);
  PutFixed(body, tile.version);
  PutCells(body, cells);
  encoder.Finish(body);
  return SealBlob(BlobKind::kSurfaceTile, kSurfaceTileVersion, body);
}

absl::StatusOr<SurfaceTile> DecodeSurfaceTile(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kSurfaceTile, kSurfaceTileVersion, bytes));
  ByteReader reader(body);
  SurfaceTile tile;
  STRATA_RETURN_IF_ERROR(TakeTileHeader(reader, tile.key));
  tile.version = reader.Fixed<std::uint64_t>();
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> cells, TakeCells(reader));
  STRATA_ASSIGN_OR_RETURN(ColumnDecoder decoder,
                          ColumnDecoder::Open(reader, kColumnCount, cells.size()));
  if (reader.remaining() != 0) return absl::DataLossError("surface tile: bytes left over");
  const std::vector<Neighbours> neighbours = FindNeighbours(cells);
  std::vector<Codes> surfaces(cells.size());
  tile.surfaces.reserve(cells.size());
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    surfaces[i].cell = cells[i];
    surfaces[i] = CodeSurface(decoder, neighbours[i], surfaces, surfaces[i]);
    if (!InRange(surfaces[i])) return absl::DataLossError("surface tile: value out of range");
    tile.surfaces.push_back(Restored(surfaces[i]));
  }
  STRATA_RETURN_IF_ERROR(decoder.Finish());
  tile.IndexRows();
  return tile;
}

}  // namespace strata
