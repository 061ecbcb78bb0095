// Files of a client's spool: of any bytes, and with any head behind a right checksum and any points
// in right envelopes.
#include <cstddef>
#include <cstdint>
#include <string>

#include <fuzzer/FuzzedDataProvider.h>

#include "client/sdk/spool_file.h"
#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/codec/point_codec.h"
#include "core/common/checksum.h"
#include "core/common/status.h"
#include "core/world/scan_hash.h"
#include "core/world/value_codec.h"
#include "tests/fuzz/input_file.h"
#include "tests/fuzz/require.h"

namespace strata::fuzz {
namespace {

PointCloud AnyPiece(FuzzedDataProvider& input, const ScanHeader& header) {
  PointCloud cloud;
  const int count = input.ConsumeIntegralInRange(1, 20);
  for (int i = 0; i < count; ++i) {
    const auto x = input.ConsumeFloatingPoint<float>();
    cloud.points.emplace_back(x, 1.0F, 2.0F);
    if (header.has_intensity) cloud.intensity.push_back(x);
    if (header.has_label) cloud.label.push_back(input.ConsumeIntegral<std::uint16_t>());
  }
  return cloud;
}

ScanHeader AnyHeader(FuzzedDataProvider& input) {
  ScanHeader header;
  header.id = {input.ConsumeRandomLengthString(8), input.ConsumeIntegral<std::uint64_t>()};
  header.point_count = input.ConsumeIntegralInRange<std::uint64_t>(0, 50);
  header.has_intensity = input.ConsumeBool();
  header.has_label = input.ConsumeBool();
  if (input.ConsumeBool()) header.content_hash = ContentHashOf(header, {});
  return header;
}

// As client/sdk/spool_file.h describes it.
std::string AnyFile(FuzzedDataProvider& input) {
  const ScanHeader header = AnyHeader(input);
  std::string head;
  const auto put_text = [&head](const std::string& text) {
    PutFixed(head, static_cast<std::uint16_t>(text.size()));
    head += text;
  };
  put_text(input.ConsumeRandomLengthString(8));
  put_text(header.id.trajectory);
  put_text(header.content_hash);
  PutFixed(head, header.id.sequence);
  head += EncodeScanHeader(header);
  if (input.ConsumeBool())
    head.resize(input.ConsumeIntegralInRange<std::size_t>(0, 2 * head.size()));
  std::string bytes = "STRSPOOL";
  PutFixed(bytes, input.ConsumeIntegralInRange<std::uint32_t>(1, 2));
  PutFixed(bytes, static_cast<std::uint32_t>(head.size()));
  bytes += head;
  PutFixed(bytes, Checksum64(bytes));
  while (input.remaining_bytes() > 0) {
    const std::string piece =
        input.ConsumeBool() ? EncodePoints(AnyPiece(input, header)).value_or("")
                            : SealBlob(BlobKind::kPoints, 1, input.ConsumeRandomLengthString());
    PutFixed(bytes, static_cast<std::uint32_t>(piece.size()));
    bytes += piece;
  }
  return bytes;
}

absl::Status ReadAll(const std::string& path) {
  STRATA_ASSIGN_OR_RETURN(sdk::SpoolFileReader reader, sdk::SpoolFileReader::Open(path));
  std::uint64_t points = 0;
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const std::optional<PointCloud> piece, reader.Next());
    if (!piece.has_value()) break;
    points += piece->size();
  }
  Require(points == reader.scan().header.point_count, "a scan that was read is whole");
  return absl::OkStatus();
}

}  // namespace
}  // namespace strata::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace strata::fuzz;
  FuzzedDataProvider input(data, size);
  const bool raw = input.ConsumeBool();
  const InputFile file(raw ? input.ConsumeRemainingBytesAsString() : AnyFile(input));
  RequireGoodRefusal(ReadAll(file.path()));
  return 0;
}
