#include "core/codec/mls_tile_codec.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/codec/columns.h"
#include "core/codec/occupancy.h"
#include "core/codec/patch_statistics.h"
#include "core/codec/tile_header.h"
#include "core/common/status.h"

namespace strata {
namespace {

// Tiles in which no patch's side is known are of version 1.
constexpr std::uint16_t kVersionWithoutSides = 1;
constexpr std::uint8_t kShapes = 5;

enum Column : std::uint8_t {
  kShape,   // + 5 · sides
  kBottom,  // + whether vertical
  kBottomLast = kBottom + 1,
  kTop,  // of vertical patches, from neighbours; 1: alone
  kTopLast = kTop + 1,
  kHeight,  // of pairs, triples and sums
  kHeightLast = kHeight + 2,
  kTopSigma,  // + whether vertical
  kTopSigmaLast = kTopSigma + 1,
  kCount,  // + whether vertical
  kCountLast = kCount + 1,
  kLowestSigma,
  kMiddleSigma,
  kMiddleHeight,
  kSumW,
  kSumWz,
  kSumWzz,
  kColourCount,
  kColourChannel,
  kColourChannelLast = kColourChannel + 2,
  kVotePatch,
  kVoteClass,
  kVoteCount,
  kColumnCount
};

// Known patches beside one that is being coded: means over those equally vertical.
struct Surroundings {
  std::int64_t bottom = 0, top = 0, top_sigma = 0;
  bool alike = false;

  Surroundings(std::span<const Patch> patches, const SurfacesBeside& neighbours, bool vertical) {
    std::int64_t count = 0;
    for (const std::uint32_t index :
         {neighbours.left, neighbours.up, neighbours.up_right, neighbours.up_left}) {
      if (index == SurfacesBeside::kNone || patches[index].vertical() != vertical) continue;
      Add(patches[index]);
      ++count;
    }
    alike = count > 0;
    if (alike) {
      bottom /= count;
      top /= count;
      top_sigma /= count;
      return;
    }
    for (const std::uint32_t index : {neighbours.left, neighbours.up}) {
      if (index == SurfacesBeside::kNone) continue;
      Add(patches[index]);
      return;
    }
  }

 private:
  void Add(const Patch& patch) {
    bottom += patch.z_min;
    top += patch.z_max;
    top_sigma += patch.top_sigma_code;
  }
};

// A patch in numbers wide enough for whatever hostile bytes say.
struct Numbers {
  std::int64_t z_min, z_max, top_sigma, count, middle_ticks, lowest_code, middle_code;
};

bool InRange(const Numbers& n) {
  const auto is_code = [](std::int64_t code) { return code >= 0 && code <= 255; };
  return n.z_min >= -kMaxZTicks - 1 && n.z_min <= n.z_max && n.z_max <= kMaxZTicks &&
         is_code(n.top_sigma) && is_code(n.lowest_code) && is_code(n.middle_code) && n.count >= 0 &&
         n.count <= Patch::kMaxCount && n.middle_ticks >= 0 &&
         n.middle_ticks <= 2 * std::int64_t{kMaxZTicks};
}

// Heights, top and count of a patch; then what its shape needs of the other measurements.
template <typename Coder>
void CodeMeasurements(Coder& coder, PatchShape shape, const Surroundings& around, Numbers& n) {
  const bool vertical = shape == PatchShape::kVertical;
  n.z_min = coder.CodeRelative(kBottom + vertical, n.z_min, around.bottom);
  if (vertical) {
    n.z_max =
        coder.CodeRelative(kTop + !around.alike, n.z_max, around.alike ? around.top : n.z_min);
  } else if (shape == PatchShape::kSingle) {
    n.z_max = n.z_min;
  } else {
    n.z_max = coder.CodeRelative(
        kHeight + static_cast<int>(shape) - static_cast<int>(PatchShape::kPair), n.z_max, n.z_min);
  }
  n.top_sigma = coder.CodeRelative(kTopSigma + vertical, n.top_sigma, around.top_sigma);
  if (shape == PatchShape::kVertical || shape == PatchShape::kSums) {
    n.count = static_cast<std::int64_t>(
        coder.Code(kCount + vertical, static_cast<std::uint64_t>(n.count)));
  } else {
    n.count = shape == PatchShape::kSingle ? 1 : shape == PatchShape::kPair ? 2 : 3;
  }
  if (shape == PatchShape::kPair || shape == PatchShape::kTriple) {
    n.lowest_code = coder.CodeRelative(kLowestSigma, n.lowest_code, n.top_sigma);
  }
  if (shape == PatchShape::kTriple) {
    n.middle_code = coder.CodeRelative(kMiddleSigma, n.middle_code, n.top_sigma);
    n.middle_ticks = static_cast<std::int64_t>(
        coder.Code(kMiddleHeight, static_cast<std::uint64_t>(n.middle_ticks)));
  }
}

template <typename Coder>
std::uint64_t CodeSum(Coder& coder, int column, std::uint64_t sum, std::uint64_t expected) {
  return static_cast<std::uint64_t>(coder.CodeRelative(
      column, static_cast<std::int64_t>(sum), static_cast<std::int64_t>(expected)));
}

// The sums of a patch of many measurements. False if they do not fit their fields.
template <typename Coder>
bool CodeSums(Coder& coder, Patch& patch) {
  const std::uint64_t sum_w = CodeSum(coder, kSumW, patch.sum_w, ExpectedSumW(patch));
  if (sum_w >> 44 != 0) return false;
  patch.sum_w = sum_w;
  const std::uint64_t sum_wz = CodeSum(coder, kSumWz, patch.sum_wz, ExpectedSumWz(patch));
  if (sum_wz >> 54 != 0) return false;
  patch.sum_wz = sum_wz;
  patch.sum_wzz = CodeSum(coder, kSumWzz, patch.sum_wzz, ExpectedSumWzz(patch));
  return true;
}

// One patch in either direction; false if what was read is no patch. `patch.cell` is known.
template <typename Coder>
bool CodePatch(Coder& coder,
               const SurfacesBeside& neighbours,
               std::span<const Patch> patches,
               Patch& patch) {
  OtherMeasurements others;
  const std::uint8_t shape_and_sides =
      coder.CodeByte(kShape,
                     static_cast<std::uint8_t>(static_cast<int>(ShapeOf(patch, others)) +
                                               kShapes * static_cast<int>(patch.sides)));
  const auto shape = static_cast<PatchShape>(shape_and_sides % kShapes);
  patch.sides = shape_and_sides / kShapes & 3U;
  if (shape_and_sides >= 4 * kShapes) return false;
  const Surroundings around(patches, neighbours, shape == PatchShape::kVertical);
  Numbers n{.z_min = patch.z_min,
            .z_max = patch.z_max,
            .top_sigma = static_cast<std::int64_t>(patch.top_sigma_code),
            .count = static_cast<std::int64_t>(patch.count),
            .middle_ticks = others.middle_ticks,
            .lowest_code = others.lowest_code,
            .middle_code = others.middle_code};
  CodeMeasurements(coder, shape, around, n);
  if (!InRange(n)) return false;
  patch.z_min = n.z_min;
  patch.z_max = n.z_max;
  patch.top_sigma_code = static_cast<std::uint64_t>(n.top_sigma);
  patch.count = static_cast<std::uint64_t>(n.count);
  if (shape == PatchShape::kSums) return CodeSums(coder, patch);
  ImplySums(shape,
            {static_cast<std::uint8_t>(n.lowest_code),
             static_cast<std::uint8_t>(n.middle_code),
             static_cast<std::int32_t>(n.middle_ticks)},
            patch);
  return true;
}

// Colours change little from patch to patch: sums are told against the previous mean.
template <typename Coder>
void CodeColours(Coder& coder, std::span<const Patch> patches, std::span<ColourSum> colours) {
  ColourSum previous{.r = 128, .g = 128, .b = 128, .count = 1};
  for (std::size_t i = 0; i < colours.size(); ++i) {
    ColourSum& c = colours[i];
    c.count = CodeSum(coder, kColourCount, c.count, patches[i].count);
    std::uint64_t ColourSum::*const channels[] = {&ColourSum::r, &ColourSum::g, &ColourSum::b};
    for (int k = 0; k < 3; ++k) {
      c.*channels[k] = CodeSum(coder,
                               kColourChannel + k,
                               c.*channels[k],
                               previous.*channels[k] / previous.count * c.count);
    }
    if (c.count > 0) previous = c;
  }
}

// False if what was read breaks the order of the layer.
template <typename Coder>
bool CodeVotes(Coder& coder, std::size_t patch_count, std::span<ClassVotes> votes) {
  ClassVotes previous;
  for (std::size_t i = 0; i < votes.size(); ++i) {
    ClassVotes& vote = votes[i];
    const std::uint64_t skipped = coder.Code(kVotePatch, vote.patch - previous.patch);
    if (skipped >= patch_count || previous.patch + skipped >= patch_count) return false;
    const auto class_id = coder.Code(kVoteClass, vote.class_id);
    const auto count = coder.Code(kVoteCount, vote.count);
    if (class_id > 0xFFFF || count > 0xFFFFFFFF) return false;
    vote = {.patch = previous.patch + static_cast<std::uint32_t>(skipped),
            .class_id = static_cast<std::uint16_t>(class_id),
            .count = static_cast<std::uint32_t>(count)};
    if (i > 0 && skipped == 0 && vote.class_id <= previous.class_id) return false;
    previous = vote;
  }
  return true;
}

std::uint16_t VersionOf(const std::vector<Patch>& patches) {
  const bool sides = std::any_of(
      patches.begin(), patches.end(), [](const Patch& patch) { return patch.sides != 0; });
  return sides ? kMlsTileVersion : kVersionWithoutSides;
}

bool InOrder(const Patch& before, const Patch& after) {
  return before.cell != after.cell ? before.cell < after.cell : before.z_max < after.z_min;
}

// A patch, its cell and what lies beside it.
constexpr std::size_t kDecodedPatchBytes =
    sizeof(Patch) + sizeof(std::uint16_t) + sizeof(SurfacesBeside);

absl::Status Damaged(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("MLS tile: ", what));
}

absl::Status DecodePatches(ColumnDecoder& decoder,
                           std::span<const std::uint16_t> cells,
                           std::vector<Patch>& patches) {
  const std::vector<SurfacesBeside> neighbours = FindNeighbours(cells);
  patches.resize(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    patches[i].cell = cells[i];
    if (!CodePatch(decoder, neighbours[i], patches, patches[i]) ||
        (i > 0 && !InOrder(patches[i - 1], patches[i]))) {
      return Damaged(absl::StrCat("patch ", i, " is out of range or order"));
    }
  }
  return absl::OkStatus();
}

absl::Status NotATile(const TileKey& key, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("MLS tile ", key.ToString(), ": ", what));
}

absl::Status EncodePatches(ColumnEncoder& encoder,
                           const MlsTile& tile,
                           std::span<const std::uint16_t> cells) {
  const std::vector<Patch>& patches = tile.patches;
  const std::vector<SurfacesBeside> neighbours = FindNeighbours(cells);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    Patch patch = patches[i];
    if (!CodePatch(encoder, neighbours[i], patches, patch) ||
        (i > 0 && !InOrder(patches[i - 1], patches[i]))) {
      return NotATile(tile.key, absl::StrCat("patch ", i, " is out of range or order"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckTileSize(const MlsTile& tile) {
  const auto check = [&tile](std::size_t count, absl::string_view what, std::size_t most) {
    if (count <= most) return absl::OkStatus();
    return absl::ResourceExhaustedError(absl::StrCat("tile ",
                                                     tile.key.ToString(),
                                                     " of ",
                                                     count,
                                                     " ",
                                                     what,
                                                     "; at most ",
                                                     most,
                                                     " can be kept of one"));
  };
  STRATA_RETURN_IF_ERROR(check(tile.patches.size(), "patches", kMaxTilePatches));
  return check(tile.votes.size(), "votes", kMaxTileVotes);
}

absl::StatusOr<std::string> EncodeMlsTile(const MlsTile& tile) {
  STRATA_RETURN_IF_ERROR(CheckTileSize(tile));
  if (!tile.colour.empty() && tile.colour.size() != tile.patches.size()) {
    return NotATile(
        tile.key,
        absl::StrCat(tile.colour.size(), " colours for ", tile.patches.size(), " patches"));
  }
  std::vector<std::uint16_t> cells(tile.patches.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    cells[i] = static_cast<std::uint16_t>(tile.patches[i].cell);
  }
  ColumnEncoder encoder(kColumnCount);
  STRATA_RETURN_IF_ERROR(EncodePatches(encoder, tile, cells));
  std::vector<ColourSum> colours = tile.colour;
  CodeColours(encoder, tile.patches, colours);
  std::vector<ClassVotes> votes = tile.votes;
  if (!CodeVotes(encoder, tile.patches.size(), votes)) {
    return NotATile(tile.key, "votes out of range or order");
  }

  std::string body;
  PutTileHeader(body, tile.key);
  PutCells(body, cells);
  PutFixed(body, static_cast<std::uint8_t>(!tile.colour.empty()));
  PutVarint(body, votes.size());
  encoder.Finish(body);
  return SealBlob(BlobKind::kMlsTile, VersionOf(tile.patches), body);
}

absl::StatusOr<MlsTile> DecodeMlsTile(absl::string_view bytes) {
  return DecodeMlsTileWithin(std::numeric_limits<std::size_t>::max(), bytes);
}

absl::StatusOr<MlsTile> DecodeMlsTileWithin(std::size_t max_bytes, absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kMlsTile, kMlsTileVersion, bytes));
  ByteReader reader(body);
  MlsTile tile;
  STRATA_RETURN_IF_ERROR(TakeTileHeader(reader, tile.key));
  STRATA_ASSIGN_OR_RETURN(
      const std::vector<std::uint16_t> cells,
      TakeCells(reader, std::min(kMaxTilePatches, max_bytes / kDecodedPatchBytes)));
  const bool has_colour = reader.Fixed<std::uint8_t>() != 0;
  const std::uint64_t vote_count = reader.Varint();
  if (vote_count > kMaxTileVotes) return Damaged(absl::StrCat(vote_count, " votes"));
  const std::size_t decoded_bytes =
      cells.size() * (kDecodedPatchBytes + (has_colour ? sizeof(ColourSum) : 0)) +
      vote_count * sizeof(ClassVotes);
  if (decoded_bytes > max_bytes) {
    return absl::ResourceExhaustedError(absl::StrCat("MLS tile: ",
                                                     cells.size(),
                                                     " patches and ",
                                                     vote_count,
                                                     " votes take ",
                                                     decoded_bytes,
                                                     " bytes, at most ",
                                                     max_bytes,
                                                     " may be"));
  }
  STRATA_ASSIGN_OR_RETURN(ColumnDecoder decoder,
                          ColumnDecoder::Open(reader,
                                              kColumnCount,
                                              std::max<std::size_t>(cells.size(), vote_count),
                                              max_bytes - decoded_bytes));
  if (reader.remaining() != 0) return Damaged("bytes left over");

  STRATA_RETURN_IF_ERROR(DecodePatches(decoder, cells, tile.patches));
  if (VersionOf(tile.patches) != VersionOfBlob(bytes)) return Damaged("sides of another version");
  if (has_colour) tile.colour.resize(cells.size());
  CodeColours(decoder, tile.patches, tile.colour);
  tile.votes.resize(vote_count);
  if (!CodeVotes(decoder, cells.size(), tile.votes)) return Damaged("votes out of range or order");
  STRATA_RETURN_IF_ERROR(decoder.Finish());
  tile.IndexRows();
  return tile;
}

}  // namespace strata
