// Any surfaces survive being encoded, and damaged bytes are refused or read as something that does.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <tuple>

#include <fuzzer/FuzzedDataProvider.h>

#include "core/codec/surface_tile_codec.h"
#include "tests/fuzz/require.h"
#include "tests/fuzz/tile_parts.h"

namespace strata::fuzz {
namespace {

Surface AnySurface(FuzzedDataProvider& input) {
  Surface surface;
  surface.cell = input.ConsumeIntegralInRange<std::uint16_t>(0, 600);
  surface.traversability = static_cast<Traversability>(input.ConsumeIntegralInRange(0, 2));
  surface.class_id = input.ConsumeIntegral<std::uint8_t>();
  surface.confidence = input.ConsumeIntegral<std::uint8_t>();
  surface.z_m = input.ConsumeFloatingPoint<float>();
  surface.sigma_m = input.ConsumeFloatingPoint<float>();
  surface.depth_m = input.ConsumeFloatingPoint<float>();
  surface.cost = input.ConsumeFloatingPoint<float>();
  return surface;
}

SurfaceTile AnyTile(FuzzedDataProvider& input) {
  SurfaceTile tile;
  tile.key.level = input.ConsumeIntegralInRange(0, 12);
  tile.version = input.ConsumeIntegral<std::uint64_t>();
  const int count = input.ConsumeIntegralInRange(0, 40);
  for (int i = 0; i < count; ++i) tile.surfaces.push_back(AnySurface(input));
  const auto order = [](const Surface& s) { return std::tuple(s.cell, s.z_m); };
  std::sort(tile.surfaces.begin(), tile.surfaces.end(), [&](const Surface& a, const Surface& b) {
    return order(a) < order(b);
  });
  return tile;
}

}  // namespace
}  // namespace strata::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  FuzzedDataProvider input(data, size);
  const std::string bytes = EncodeSurfaceTile(fuzz::AnyTile(input)).value();
  const auto decoded = DecodeSurfaceTile(bytes);
  fuzz::Require(decoded.ok(), "what was encoded can be decoded");
  fuzz::Require(EncodeSurfaceTile(*decoded).value() == bytes, "and has the same bytes again");

  fuzz::TileParts parts = fuzz::TakeApart(BlobKind::kSurfaceTile, bytes);
  const std::uint16_t version = input.ConsumeBool() ? 1 : VersionOfBlob(bytes);
  fuzz::Damage(input, parts);
  const auto damaged = DecodeSurfaceTile(fuzz::PutTogether(BlobKind::kSurfaceTile, version, parts));
  fuzz::RequireGoodRefusal(damaged.status());
  if (damaged.ok()) {
    fuzz::Require(DecodeSurfaceTile(EncodeSurfaceTile(*damaged).value()).value() == *damaged,
                  "what is read can be written");
  }
  return 0;
}
