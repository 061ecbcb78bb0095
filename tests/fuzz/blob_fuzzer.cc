// Everything else that is stored or sent as bytes: bodies behind a right checksum, and raw bytes.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include <fuzzer/FuzzedDataProvider.h>

#include "core/classification/classifier_codec.h"
#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/codec/label_codec.h"
#include "core/codec/local_map_codec.h"
#include "core/codec/mls_tile_codec.h"
#include "core/codec/point_codec.h"
#include "core/codec/surface_tile_codec.h"
#include "core/common/checksum.h"
#include "core/completion/entity_codec.h"
#include "core/completion/inferred_codec.h"
#include "core/completion/kind_codec.h"
#include "core/mls/mls_map.h"
#include "core/planes/models/plane_model_codec.h"
#include "core/planes/scan_planes_codec.h"
#include "core/registration/place_descriptor.h"
#include "core/world/value_codec.h"
#include "tests/fuzz/require.h"

namespace strata::fuzz {
namespace {

// What is accepted is written and accepted again. (Not compared: a NaN is not itself.)
template <typename Decode, typename Encode>
void TryBytes(const std::string& bytes, const Decode& decode, const Encode& encode) {
  const auto value = decode(bytes);
  RequireGoodRefusal(value.status());
  if (value.ok()) Require(decode(encode(*value)).ok(), "what is read can be written");
}

// Values of core/storage end with the checksum of all before.
std::string WithChecksum(std::string bytes) {
  PutFixed(bytes, Checksum64(bytes));
  return bytes;
}

void TryKind(int kind, const std::string& body, std::uint16_t version) {
  const auto sealed = [&](BlobKind blob) { return SealBlob(blob, version, body); };
  switch (kind) {
    case 0:
      return TryBytes(sealed(BlobKind::kPoints), DecodePoints, [](const auto& points) {
        return EncodePoints(points).value();
      });
    case 1:
      return TryBytes(sealed(BlobKind::kLabels), DecodeLabels, [](const auto& labels) {
        return EncodeLabels(labels);
      });
    case 2:
      return TryBytes(sealed(BlobKind::kScanPlanes), DecodeScanPlanes, EncodeScanPlanes);
    case 10:
      return TryBytes(sealed(BlobKind::kPlaneModel), DecodePlaneModelInfo, EncodePlaneModelInfo);
    case 11:
      return TryBytes(sealed(BlobKind::kModelPlane), DecodeModelPlane, EncodeModelPlane);
    case 12:
      return TryBytes(sealed(BlobKind::kEntities), DecodeEntitiesInfo, EncodeEntitiesInfo);
    case 13:
      return TryBytes(sealed(BlobKind::kEntity), DecodeEntity, EncodeEntity);
    case 15:
      return TryBytes(sealed(BlobKind::kKindInfo), DecodeKindInfo, EncodeKindInfo);
    case 16:
      return TryBytes(sealed(BlobKind::kKindShape), DecodeKindShape, EncodeKindShape);
    case 17:
      return TryBytes(sealed(BlobKind::kKindFile), DecodeKindFile, EncodeKindFile);
    case 18:
      return TryBytes(sealed(BlobKind::kInferredHead), DecodeInferredInfo, EncodeInferredInfo);
    case 19:
      return TryBytes(sealed(BlobKind::kInferred), DecodeInferredPart, EncodeInferredPart);
    case 3:
      return TryBytes(sealed(BlobKind::kClassifier), DecodeClassifier, EncodeClassifier);
    case 4:
      return TryBytes(sealed(BlobKind::kSurfaceTile), DecodeSurfaceTile, [](const auto& tile) {
        return EncodeSurfaceTile(tile).value();
      });
    case 5:
      return TryBytes(sealed(BlobKind::kMlsTile), DecodeMlsTile, [](const auto& tile) {
        return EncodeMlsTile(tile).value();
      });
    case 6:
      return TryBytes(body, DecodePlace, EncodePlace);
    case 7:
      return TryBytes(WithChecksum(body), DecodePose, EncodePose);
    case 8:
      return TryBytes(WithChecksum(body), DecodeMatrix6, EncodeMatrix6);
    case 9: {
      const auto decode = [](const std::string& bytes) {
        return DecodeScanHeader({"t", 1}, bytes);
      };
      return TryBytes(WithChecksum(body), decode, EncodeScanHeader);
    }
    default: {
      const auto decode = [](const std::string& bytes) { return DecodeLocalMap(bytes, {}); };
      const auto encode = [](const MlsMap& map) { return EncodeLocalMap(map).value(); };
      return TryBytes(body, decode, encode);
    }
  }
}

}  // namespace
}  // namespace strata::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata;
  FuzzedDataProvider input(data, size);
  const int kind = input.ConsumeIntegralInRange(0, 19);
  const auto version = input.ConsumeIntegralInRange<std::uint16_t>(0, 3);
  const std::string bytes = input.ConsumeRemainingBytesAsString();
  fuzz::TryKind(kind, bytes, version);
  constexpr std::array kKinds = {BlobKind::kPoints, BlobKind::kClassifier};
  for (const BlobKind blob : kKinds) {
    fuzz::RequireGoodRefusal(OpenBlob(blob, version, bytes).status());
  }
  return 0;
}
