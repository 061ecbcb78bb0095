#include "core/codec/surface_tile_codec.h"

#include <algorithm>
#include <array>
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
constexpr std::int32_t kMaxHeightCode = (1 << 24) - 1;  // exact in a float
constexpr float kSigmaCodesPerOctave = 7.5F;            // steps of 9.7 %
constexpr float kMinSigmaOctave = -24.0F;
constexpr float kCostCodesPerOctave = 6.0F;        // steps of 12 %, where a robot can drive
constexpr float kCoarseCostCodesPerOctave = 2.0F;  // steps of 41 %, elsewhere
constexpr std::int32_t kInfiniteCost = 255;
constexpr std::uint8_t kMaxConfidence = 100;
constexpr std::int32_t kMaxShade = 63;
constexpr int kMaxTraversability = static_cast<int>(Traversability::kUnderside);
constexpr auto kUnderside = static_cast<std::uint8_t>(Traversability::kUnderside);

// A surface in whole numbers, as it is stored.
struct Codes {
  std::uint16_t cell = 0;
  std::uint8_t traversability = 0;
  std::uint8_t class_id = 0;
  std::uint8_t confidence = 0;
  bool coloured = false;
  std::int32_t red = 0, green = 0, blue = 0;  // of 64
  std::int32_t height = 0;
  std::int32_t depth = 0;  // > 0: vertical
  std::int32_t sigma = 0;
  std::int32_t cost = 0;
};

// Rounds to nearest; |value| < 2^30.
std::int32_t Rounded(double value) {
  // Makes it positive, so that truncating rounds down; and a half, so that it rounds to nearest.
  constexpr double kShift = (1 << 30) + 0.5;
  return static_cast<std::int32_t>(static_cast<std::int64_t>(value + kShift) - (1 << 30));
}

std::int32_t LengthCode(float metres) {
  if (std::isnan(metres)) return 0;
  constexpr double kMax = kMaxHeightCode;
  return Rounded(std::clamp(double{metres} * kStepsPerMetre, -kMax, kMax));
}

std::int32_t SigmaCodeOf(float sigma_m) {
  if (!(sigma_m > 0.0F)) return 0;
  const float code = (std::log2(sigma_m) - kMinSigmaOctave) * kSigmaCodesPerOctave;
  return Rounded(std::clamp(code, 0.0F, 255.0F));
}

float CostCodesPerOctave(std::uint8_t traversability) {
  return traversability == static_cast<std::uint8_t>(Traversability::kTraversable)
             ? kCostCodesPerOctave
             : kCoarseCostCodesPerOctave;
}

std::int32_t CostCodeOf(float cost, std::uint8_t traversability) {
  if (!(cost > 0.0F)) return 0;
  if (std::isinf(cost)) return kInfiniteCost;
  const float code = std::log2(1.0F + cost) * CostCodesPerOctave(traversability);
  return Rounded(std::min(code, kInfiniteCost - 1.0F));
}

std::int32_t ShadeCode(std::uint8_t shade) { return (shade * kMaxShade + 127) / 255; }
std::uint8_t Shade(std::int32_t code) {
  return static_cast<std::uint8_t>((code * 255 + kMaxShade / 2) / kMaxShade);
}

Codes Quantised(const Surface& surface) {
  Codes codes{.cell = surface.cell,
              .traversability = static_cast<std::uint8_t>(surface.traversability),
              .class_id = surface.class_id,
              .height = LengthCode(surface.z_m),
              .sigma = SigmaCodeOf(surface.sigma_m)};
  if (codes.traversability != kUnderside) {
    codes.cost = CostCodeOf(surface.cost, codes.traversability);
  }
  if (codes.class_id != 0) codes.confidence = std::min(surface.confidence, kMaxConfidence);
  if (surface.coloured()) {
    codes.coloured = true;
    codes.red = ShadeCode(surface.colour.r);
    codes.green = ShadeCode(surface.colour.g);
    codes.blue = ShadeCode(surface.colour.b);
  }
  if (surface.vertical()) codes.depth = std::max(1, LengthCode(surface.depth_m));
  return codes;
}

// What the 256 codes of sigma, and those of cost of each traversability, stand for [m; factor].
struct CodeTables {
  std::array<float, 256> sigma_m;
  std::array<std::array<float, 256>, kMaxTraversability + 1> cost;

  CodeTables() {
    for (int code = 0; code < 256; ++code) {
      const auto value = static_cast<float>(code);
      sigma_m[code] = std::exp2(value / kSigmaCodesPerOctave + kMinSigmaOctave);
      for (int kind = 0; kind <= kMaxTraversability; ++kind) {
        const float octaves = value / CostCodesPerOctave(static_cast<std::uint8_t>(kind));
        cost[kind][code] = code == kInfiniteCost ? std::numeric_limits<float>::infinity()
                                                 : std::exp2(octaves) - 1.0F;
      }
    }
  }
};

Colour RestoredColour(const Codes& codes) {
  if (!codes.coloured) return {};
  return Known({.r = Shade(codes.red), .g = Shade(codes.green), .b = Shade(codes.blue)});
}

Surface Restored(const Codes& codes, const CodeTables& tables) {
  return {.cell = codes.cell,
          .traversability = static_cast<Traversability>(codes.traversability),
          .class_id = codes.class_id,
          .confidence = codes.confidence,
          .colour = RestoredColour(codes),
          .z_m = static_cast<float>(codes.height) / kStepsPerMetre,
          .sigma_m = tables.sigma_m[codes.sigma],
          .depth_m = static_cast<float>(codes.depth) / kStepsPerMetre,
          .cost = tables.cost[codes.traversability][codes.cost]};
}

// Columns. Heights and the like go to one of several columns by what is known of their
// surroundings, because a zstd frame has one table of frequencies.
enum Column : std::uint8_t {
  kSameKind,  // bits, + KindContext
  kSameKindLast = kSameKind + 3,
  kKind,  // where not the same
  kClass,
  kHeight,  // + HeightContext
  kHeightLast = kHeight + 3,
  kDepth,  // + 1 where the prediction comes from a vertical neighbour
  kDepthLast = kDepth + 1,
  kSigma,  // + vertical
  kSigmaLast = kSigma + 1,
  kCost,  // + traversability; not of undersides
  kCostLast = kCost + 2,
  kConfidence,  // where there is a class
  kColoured,    // bits
  kGreen,       // and what follows, where coloured
  kRed,
  kBlue,
  kColumnCount
};

// Rounded sum / count for a count of 1 to 4; each division is by a constant.
std::int32_t MeanOf(std::int32_t sum, int count) {
  constexpr std::int32_t kShift = 3 << 27;  // makes it positive; a multiple of 3
  switch (count) {
    case 2:
      return (sum + 1) >> 1;
    case 3:
      return (sum + 1 + kShift) / 3 - kShift / 3;
    case 4:
      return (sum + 2) >> 2;
    default:
      return sum;
  }
}

// What is known beside a surface that is being coded: the mean of the surfaces around that are
// vertical or not as it is; without any, the first one around; without that, zeros.
struct Surroundings {
  int alike = 0;  // how many
  std::int32_t height = 0, depth = 0, sigma = 0;

  Surroundings(std::span<const Codes> surfaces, const SurfacesBeside& n, bool vertical) {
    for (const std::uint32_t index : {n.left, n.up, n.up_right, n.up_left}) {
      if (index == SurfacesBeside::kNone || (surfaces[index].depth > 0) != vertical) continue;
      Add(surfaces[index]);
      ++alike;
    }
    if (alike == 0 && (n.left & n.up) != SurfacesBeside::kNone) {
      Add(surfaces[n.left != SurfacesBeside::kNone ? n.left : n.up]);
    }
    height = MeanOf(height, alike);
    depth = MeanOf(depth, alike);
    sigma = MeanOf(sigma, alike);
  }

 private:
  void Add(const Codes& codes) {
    height += codes.height;
    depth += codes.depth;
    sigma += codes.sigma;
  }
};

int HeightColumn(const Surroundings& around, bool vertical) {
  if (around.alike == 0) return kHeight;
  if (vertical) return kHeight + 1;
  return around.alike == 1 ? kHeight + 2 : kHeight + 3;
}

// Reads or writes a number; false if what was read is not within [low, high].
template <typename Coder>
bool CodeWithin(Coder& coder,
                int column,
                std::int32_t expected,
                std::int32_t low,
                std::int32_t high,
                std::int32_t& value) {
  const std::int64_t coded = coder.CodeRelative(column, value, expected);
  if (coded < low || coded > high) return false;
  value = static_cast<std::int32_t>(coded);
  return true;
}

// What a surface is: all its yes and no in one number.
std::uint8_t KindOf(const Codes& codes) {
  return static_cast<std::uint8_t>(codes.traversability << 1 | (codes.depth > 0 ? 1 : 0));
}

// The mean cost of the surfaces around that are as traversable; 0 without any.
std::int32_t ExpectedCost(std::span<const Codes> surfaces,
                          const SurfacesBeside& n,
                          std::uint8_t traversability) {
  std::int32_t sum = 0;
  int count = 0;
  for (const std::uint32_t index : {n.left, n.up, n.up_right, n.up_left}) {
    if (index == SurfacesBeside::kNone || surfaces[index].traversability != traversability)
      continue;
    sum += surfaces[index].cost;
    ++count;
  }
  return MeanOf(sum, count);
}

// The kind of the surface to the left or else above, and how many of those around share it.
struct ExpectedKind {
  std::uint8_t kind = 0;
  int others = 0;

  ExpectedKind(std::span<const Codes> surfaces, const SurfacesBeside& n) {
    const std::uint32_t first = n.left != SurfacesBeside::kNone ? n.left : n.up;
    if (first == SurfacesBeside::kNone) return;
    kind = KindOf(surfaces[first]);
    for (const std::uint32_t index : {n.up, n.up_left, n.up_right}) {
      if (index != SurfacesBeside::kNone && KindOf(surfaces[index]) == kind) ++others;
    }
  }
};

// Tiles with colours are of the latest version; of the others those with undersides of version 3,
// those with classes of version 2, and those without of version 1, without the column of classes'
// confidences.
constexpr std::uint16_t kVersionWithConfidence = 2;
constexpr std::uint16_t kVersionWithUndersides = 3;
constexpr std::uint16_t kVersionWithColours = kSurfaceTileVersion;

std::uint16_t VersionOf(const std::vector<Codes>& surfaces) {
  std::uint16_t version = 1;
  for (const Codes& codes : surfaces) {
    if (codes.coloured) return kVersionWithColours;
    if (codes.traversability == kUnderside) {
      version = kVersionWithUndersides;
    } else if (codes.confidence != 0) {
      version = std::max(version, kVersionWithConfidence);
    }
  }
  return version;
}

int ColumnsOf(std::uint16_t version) {
  if (version >= kVersionWithColours) return kColumnCount;
  return version >= kVersionWithConfidence ? kColoured : kConfidence;
}

// The mean colour of the surfaces around that have one; 0 without any.
struct ExpectedColour {
  std::int32_t red = 0, green = 0, blue = 0;

  ExpectedColour(std::span<const Codes> surfaces, const SurfacesBeside& n) {
    int count = 0;
    for (const std::uint32_t index : {n.left, n.up, n.up_right, n.up_left}) {
      if (index == SurfacesBeside::kNone || !surfaces[index].coloured) continue;
      red += surfaces[index].red;
      green += surfaces[index].green;
      blue += surfaces[index].blue;
      ++count;
    }
    red = MeanOf(red, count);
    green = MeanOf(green, count);
    blue = MeanOf(blue, count);
  }
};

// A shade as its difference to what is expected, modulo 64.
template <typename Coder>
bool CodeShade(Coder& coder, int column, std::int32_t expected, std::int32_t& shade) {
  const std::uint8_t difference =
      coder.CodeByte(column, static_cast<std::uint8_t>((shade - expected) & kMaxShade));
  if (difference > kMaxShade) return false;
  shade = (expected + difference) & kMaxShade;
  return true;
}

// In either direction, as CodeSurface(). Red and blue mostly change as green does.
template <typename Coder>
bool CodeColour(Coder& coder,
                const SurfacesBeside& neighbours,
                std::span<const Codes> surfaces,
                Codes& codes) {
  codes.coloured = coder.CodeBit(kColoured, codes.coloured);
  if (!codes.coloured) return true;
  const ExpectedColour expected(surfaces, neighbours);
  if (!CodeShade(coder, kGreen, expected.green, codes.green)) return false;
  const std::int32_t change = codes.green - expected.green;
  const auto changed = [change](std::int32_t shade) {
    return std::clamp(shade + change, 0, kMaxShade);
  };
  return CodeShade(coder, kRed, changed(expected.red), codes.red) &&
         CodeShade(coder, kBlue, changed(expected.blue), codes.blue);
}

// One surface, in either direction; false if what was read is none. `codes.cell` is known.
template <typename Coder>
bool CodeSurface(Coder& coder,
                 const SurfacesBeside& neighbours,
                 std::span<const Codes> surfaces,
                 std::uint16_t version,
                 Codes& codes) {
  const ExpectedKind expected_kind(surfaces, neighbours);
  std::uint8_t kind = expected_kind.kind;
  if (!coder.CodeBit(kSameKind + expected_kind.others, KindOf(codes) == kind)) {
    kind = coder.CodeByte(kKind, KindOf(codes));
  }
  codes.traversability = kind >> 1;
  if (codes.traversability > kMaxTraversability) return false;
  codes.class_id = coder.CodeByte(kClass, codes.class_id);
  if (version >= kVersionWithConfidence && codes.class_id != 0) {
    codes.confidence = coder.CodeByte(kConfidence, codes.confidence);
    if (codes.confidence > kMaxConfidence) return false;
  }
  if (version >= kVersionWithColours && !CodeColour(coder, neighbours, surfaces, codes)) {
    return false;
  }
  const bool vertical = (kind & 1) != 0;
  const Surroundings around(surfaces, neighbours, vertical);
  if (!CodeWithin(coder,
                  HeightColumn(around, vertical),
                  around.height,
                  -kMaxHeightCode,
                  kMaxHeightCode,
                  codes.height)) {
    return false;
  }
  if (vertical) {
    // Undersides continue better than lengths.
    const bool known = around.alike > 0;
    const std::int32_t expected = known ? around.depth + codes.height - around.height : 0;
    if (!CodeWithin(coder, kDepth + known, expected, 1, kMaxHeightCode, codes.depth)) return false;
  }
  if (!CodeWithin(coder, kSigma + vertical, around.sigma, 0, 255, codes.sigma)) return false;
  return codes.traversability == kUnderside ||
         CodeWithin(coder,
                    kCost + codes.traversability,
                    ExpectedCost(surfaces, neighbours, codes.traversability),
                    0,
                    kInfiniteCost,
                    codes.cost);
}

}  // namespace

absl::StatusOr<std::string> EncodeSurfaceTile(const SurfaceTile& tile) {
  if (tile.surfaces.size() > kMaxTilePatches) {
    return absl::ResourceExhaustedError(absl::StrCat("tile ",
                                                     tile.key.ToString(),
                                                     " of ",
                                                     tile.surfaces.size(),
                                                     " surfaces; at most ",
                                                     kMaxTilePatches,
                                                     " can be kept of one"));
  }
  std::vector<Codes> surfaces(tile.surfaces.size());
  std::vector<std::uint16_t> cells(tile.surfaces.size());
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    surfaces[i] = Quantised(tile.surfaces[i]);
    cells[i] = surfaces[i].cell;
  }
  const std::vector<SurfacesBeside> neighbours = FindNeighbours(cells);
  const std::uint16_t version = VersionOf(surfaces);
  ColumnEncoder encoder(ColumnsOf(version));
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    CodeSurface(encoder, neighbours[i], surfaces, version, surfaces[i]);
  }
  std::string body;
  PutTileHeader(body, tile.key);
  PutFixed(body, tile.version);
  PutCells(body, cells);
  encoder.Finish(body);
  return SealBlob(BlobKind::kSurfaceTile, version, body);
}

absl::StatusOr<SurfaceTile> DecodeSurfaceTile(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kSurfaceTile, kSurfaceTileVersion, bytes));
  const std::uint16_t version = VersionOfBlob(bytes);
  ByteReader reader(body);
  SurfaceTile tile;
  STRATA_RETURN_IF_ERROR(TakeTileHeader(reader, tile.key));
  tile.version = reader.Fixed<std::uint64_t>();
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> cells, TakeCells(reader));
  STRATA_ASSIGN_OR_RETURN(ColumnDecoder decoder,
                          ColumnDecoder::Open(reader, ColumnsOf(version), cells.size()));
  if (reader.remaining() != 0) return absl::DataLossError("surface tile: bytes left over");
  static const CodeTables tables;
  const std::vector<SurfacesBeside> neighbours = FindNeighbours(cells);
  std::vector<Codes> surfaces(cells.size());
  tile.surfaces.reserve(cells.size());
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    surfaces[i].cell = cells[i];
    if (!CodeSurface(decoder, neighbours[i], surfaces, version, surfaces[i])) {
      return absl::DataLossError(absl::StrCat("surface tile: surface ", i, " is out of range"));
    }
    tile.surfaces.push_back(Restored(surfaces[i], tables));
  }
  STRATA_RETURN_IF_ERROR(decoder.Finish());
  if (version != VersionOf(surfaces)) {
    return absl::DataLossError("surface tile: of another version than what it holds");
  }
  tile.IndexRows();
  return tile;
}

}  // namespace strata
