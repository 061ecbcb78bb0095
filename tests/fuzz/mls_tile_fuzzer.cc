// The tiles of any points survive being encoded, and damaged bytes are refused or read as something
// that does.
#include <cstddef>
#include <cstdint>
#include <string>

#include <fuzzer/FuzzedDataProvider.h>

#include "core/codec/mls_tile_codec.h"
#include "core/mls/build.h"
#include "tests/fuzz/require.h"
#include "tests/fuzz/tile_parts.h"

namespace strata::fuzz {
namespace {

PointCloud AnyCloud(FuzzedDataProvider& input) {
  PointCloud cloud;
  const bool coloured = input.ConsumeBool();
  const bool labelled = input.ConsumeBool();
  const int count = input.ConsumeIntegralInRange(0, 60);
  for (int i = 0; i < count; ++i) {
    const auto x = input.ConsumeFloatingPointInRange(0.0F, 3.0F);
    const auto y = input.ConsumeFloatingPointInRange(0.0F, 1.0F);
    cloud.points.emplace_back(x, y, input.ConsumeFloatingPointInRange(-2047.0F, 2047.0F));
    if (coloured) cloud.colour.push_back({input.ConsumeIntegral<std::uint8_t>(), 7, 255});
    if (labelled) cloud.label.push_back(input.ConsumeIntegralInRange<std::uint16_t>(0, 300));
  }
  return cloud;
}

void TryDamaged(FuzzedDataProvider& input, const std::string& bytes) {
  TileParts parts = TakeApart(BlobKind::kMlsTile, bytes);
  Damage(input, parts);
  const auto damaged = DecodeMlsTile(PutTogether(BlobKind::kMlsTile, VersionOfBlob(bytes), parts));
  RequireGoodRefusal(damaged.status());
  if (!damaged.ok()) return;
  Require(DecodeMlsTile(EncodeMlsTile(*damaged).value()).value() == *damaged,
          "what is read can be written");
}

}  // namespace
}  // namespace strata::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  FuzzedDataProvider input(data, size);
  const SensorModel sensor{.max_range_m = 10'000.0};
  const auto built = BuildMlsMap(fuzz::AnyCloud(input), Pose::Identity(), sensor, {});
  fuzz::Require(built.ok(), "finite points make a map");
  for (const MlsTile& tile : built->map.tiles) {
    const std::string bytes = EncodeMlsTile(tile).value();
    const auto decoded = DecodeMlsTile(bytes);
    fuzz::Require(decoded.ok() && *decoded == tile, "a tile comes back as it was");
    fuzz::TryDamaged(input, bytes);
  }
  return 0;
}
