#include "core/codec/label_codec.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/codec/blob.h"
#include "core/codec/bytes.h"
#include "core/codec/columns.h"
#include "core/common/status.h"

namespace strata {

std::string EncodeLabels(std::span<const std::uint16_t> labels) {
  std::string low(labels.size(), '\0');
  std::string high(labels.size(), '\0');
  for (std::size_t i = 0; i < labels.size(); ++i) {
    low[i] = static_cast<char>(labels[i] & 0xFF);
    high[i] = static_cast<char>(labels[i] >> 8);
  }
  std::string body;
  PutVarint(body, labels.size());
  PutColumn(body, low);
  PutColumn(body, high);
  return SealBlob(BlobKind::kLabels, kLabelsVersion, body);
}

absl::StatusOr<std::vector<std::uint16_t>> DecodeLabels(absl::string_view bytes) {
  STRATA_ASSIGN_OR_RETURN(const absl::string_view body,
                          OpenBlob(BlobKind::kLabels, kLabelsVersion, bytes));
  ByteReader reader(body);
  const std::uint64_t n = reader.Varint();
  if (!reader.ok() || n > kMaxEncodedLabels) {
    return absl::DataLossError(absl::StrCat("labels: ", n, " of them"));
  }
  std::string low;
  std::string high;
  STRATA_RETURN_IF_ERROR(TakeColumn(reader, n, low));
  STRATA_RETURN_IF_ERROR(TakeColumn(reader, n, high));
  if (low.size() != n || high.size() != n || reader.remaining() != 0) {
    return absl::DataLossError(absl::StrCat("labels: columns do not fit ", n, " labels"));
  }
  std::vector<std::uint16_t> labels(n);
  for (std::size_t i = 0; i < n; ++i) {
    labels[i] = static_cast<std::uint16_t>(static_cast<std::uint8_t>(high[i]) << 8 |
                                           static_cast<std::uint8_t>(low[i]));
  }
  return labels;
}

}  // namespace strata
