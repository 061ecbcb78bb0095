// Prepared tiles as a map's file keeps them, changed behind zstd and their checksum: they are
// refused, or searches over them end.
#include <bit>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"
#include <fuzzer/FuzzedDataProvider.h>
#include <zstd.h>

#include "core/codec/bytes.h"
#include "core/common/checksum.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/packed_tile.h"
#include "core/planning/planner.h"
#include "core/planning/tile_cache.h"
#include "core/world/plan.h"
#include "tests/core/planning/memory_tiles.h"
#include "tests/fuzz/require.h"
#include "tests/support/drawing.h"

namespace strata::fuzz {
namespace {

constexpr double kCell = 0.1;
// Format, size of the columns, size of cells, packed size of the least dangers.
constexpr std::size_t kHeaderBytes = 20;
constexpr std::size_t kChecksumBytes = 8;

// Two tiles of ground with holes and posts, in places under a second storey.
testing::DrawnMap Ground() {
  testing::DrawnMap map;
  for (int y = 0; y < 24; ++y) {
    for (int x = 240; x < 272; ++x) {
      if (x % 7 == 3 && y % 5 == 2) continue;
      map[{x, y}] = {{0.01 * y, x % 11 == 5 && y % 6 == 1 ? 0.9 : 0.0}};
      if (x > 250 && y < 12) map[{x, y}].push_back({2.5, 0.1});
    }
  }
  return map;
}

// A source that has everything prepared, by other bytes for the tile `key` than were packed.
class KeptTiles : public testing::MemoryTiles {
 public:
  KeptTiles() : MemoryTiles(Ground().Tiles()) {
    const ProfileChecks checks = MakeProfileChecks({}, kCell).value();
    for (const TileKey& key : Keys()) {
      packed_[key] = PackTile(*PrepareFrom(*this, key, checks).value(), kCell);
    }
  }
  absl::StatusOr<std::optional<std::string>> LoadPrepared(const TileKey& key,
                                                          const TileVersions& /*versions*/,
                                                          const RobotProfile& /*p*/) override {
    if (changed_.has_value() && changed_->first == key) return changed_->second;
    return packed_.at(key);
  }
  const std::map<TileKey, std::string>& packed() const { return packed_; }
  void Change(const TileKey& key, std::string packed) { changed_ = {key, std::move(packed)}; }

 private:
  std::map<TileKey, std::string> packed_;
  std::optional<std::pair<TileKey, std::string>> changed_;
};

// Of the least dangers, as they are packed.
std::size_t FirstBytes(const std::string& packed) {
  return ByteReader(absl::string_view(packed).substr(16)).Fixed<std::uint32_t>();
}

std::string ColumnsOf(const std::string& packed) {
  const std::size_t begin = kHeaderBytes + FirstBytes(packed);
  std::string columns(1 << 20, '\0');
  const std::size_t used = ZSTD_decompress(columns.data(),
                                           columns.size(),
                                           packed.data() + begin,
                                           packed.size() - begin - kChecksumBytes);
  Require(ZSTD_isError(used) == 0U, "what was packed can be decompressed");
  columns.resize(used);
  return columns;
}

// With the least dangers of `whole`.
std::string Packed(const std::string& columns, const std::string& whole) {
  const std::size_t begin = kHeaderBytes + FirstBytes(whole);
  std::string packed;
  PutFixed(packed, std::uint32_t{2});
  PutFixed(packed, static_cast<std::uint32_t>(columns.size()));
  PutFixed(packed, std::bit_cast<std::uint64_t>(kCell));
  packed += whole.substr(packed.size(), begin - packed.size());
  packed.resize(begin + ZSTD_compressBound(columns.size()));
  packed.resize(
      begin + ZSTD_compress(
                  packed.data() + begin, packed.size() - begin, columns.data(), columns.size(), 1));
  PutFixed(packed, Checksum64(packed));
  return packed;
}

// Other bytes at some places, most of them behind the sheets, which are nearly all of the columns.
void Damage(FuzzedDataProvider& input, std::string& columns) {
  const int changes = input.ConsumeIntegralInRange(1, 12);
  for (int i = 0; i < changes; ++i) {
    const std::size_t first = input.ConsumeBool() ? 0 : columns.size() - columns.size() / 4;
    const std::size_t at = input.ConsumeIntegralInRange<std::size_t>(first, columns.size() - 1);
    columns[at] = input.ConsumeIntegral<char>();
  }
  if (input.ConsumeIntegralInRange(0, 15) == 0) {
    columns.resize(input.ConsumeIntegralInRange<std::size_t>(0, columns.size()));
  }
}

void Search(KeptTiles& source, FuzzedDataProvider& input) {
  const auto end = [&input]() {
    return PlanEndpoint{.x_m = input.ConsumeIntegralInRange(240, 271) * kCell + 0.05,
                        .y_m = input.ConsumeIntegralInRange(0, 23) * kCell + 0.05,
                        .z_m = input.ConsumeBool() ? 2.5 : 0.1};
  };
  Planner planner({.cell_size_m = kCell});
  PlanQuery query{.from = end(), .to = end(), .max_expanded = 100'000};
  if (input.ConsumeBool()) query.class_costs[input.ConsumeIntegralInRange(0, 5)] = 2.0;
  const auto found = planner.Plan(source, query, Stop());
  RequireGoodRefusal(found.status());
  if (!found.ok() || found->reason != PlanReason::kFound) return;
  RequireGoodRefusal(planner.Check(source, {.waypoints = found->waypoints}, Stop()).status());
}

}  // namespace
}  // namespace strata::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  static fuzz::KeptTiles source;
  FuzzedDataProvider input(data, size);
  const auto& packed = source.packed();
  auto tile = packed.begin();
  if (input.ConsumeBool()) ++tile;
  std::string columns = fuzz::ColumnsOf(tile->second);
  fuzz::Require(fuzz::Packed(columns, tile->second) == tile->second,
                "the format is what this fuzzer writes");
  fuzz::Damage(input, columns);
  const std::string changed = fuzz::Packed(columns, tile->second);
  const auto unpacked = UnpackTile(changed, fuzz::kCell);
  fuzz::RequireGoodRefusal(unpacked.status());
  if (!unpacked.ok()) return 0;  // it would be prepared anew
  const auto again = UnpackTile(PackTile(*unpacked, fuzz::kCell), fuzz::kCell);
  fuzz::Require(again.ok() && *again == *unpacked, "what is read can be written");
  source.Change(tile->first, changed);
  fuzz::Search(source, input);
  return 0;
}
