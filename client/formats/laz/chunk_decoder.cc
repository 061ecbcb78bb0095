#include "client/formats/laz/chunk_decoder.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/layered_items.h"
#include "client/formats/laz/laz_format.h"
#include "client/formats/laz/pointwise_items.h"
#include "client/formats/parsing/byte_cursor.h"

namespace strata {

absl::Status ChunkDecoder::Start(absl::string_view chunk) {
  if (chunk.size() < format_.point_bytes) {
    return absl::InvalidArgumentError(absl::StrCat("a chunk of ",
                                                   chunk.size(),
                                                   " bytes; expected at least the ",
                                                   format_.point_bytes,
                                                   " of its first point"));
  }
  at_first_ = true;
  point_ = std::string(chunk.substr(0, format_.point_bytes));
  if (format_.layered) return StartLayers(chunk);
  decoder_ = ArithmeticDecoder(chunk.substr(format_.point_bytes));
  pointwise_.clear();
  std::size_t at = 0;
  for (const LazItem& item : format_.items) {
    pointwise_.push_back(MakePointwiseItem(item, point_.data() + at));
    at += item.bytes;
  }
  return absl::OkStatus();
}

// Behind the first point there is how many there are, which the chunk table says, too, and how many
// bytes each layer has; then the layers.
absl::Status ChunkDecoder::StartLayers(absl::string_view chunk) {
  ByteCursor cursor(chunk);
  cursor.Take(format_.point_bytes + sizeof(std::uint32_t));
  std::vector<std::vector<std::uint32_t>> sizes;
  for (const LazItem& item : format_.items) {
    std::vector<std::uint32_t>& of_item = sizes.emplace_back(LayersOf(item));
    for (std::uint32_t& size : of_item) size = cursor.Get<std::uint32_t>();
  }
  layered_.clear();
  std::size_t at = 0;
  for (std::size_t i = 0; i < format_.items.size(); ++i) {
    std::vector<ArithmeticDecoder> layers;
    for (const std::uint32_t size : sizes[i]) layers.emplace_back(cursor.Take(size));
    const LazItem& item = format_.items[i];
    layered_.push_back(MakeLayeredItem(item, std::move(layers), point_.data() + at, channel_));
    at += item.bytes;
  }
  if (cursor.ok()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("a chunk of ", chunk.size(), " bytes has layers of more: it is damaged"));
}

void ChunkDecoder::Read(std::span<char> records) {
  for (; !records.empty(); records = records.subspan(point_.size())) {
    if (!std::exchange(at_first_, false)) Next();
    std::copy(point_.begin(), point_.end(), records.begin());
  }
}

void ChunkDecoder::Next() {
  char* item = point_.data();
  for (std::size_t i = 0; i < format_.items.size(); ++i) {
    if (format_.layered) {
      layered_[i]->Next(channel_, item);
    } else {
      pointwise_[i]->Next(decoder_, item);
    }
    item += format_.items[i].bytes;
  }
}

absl::Status ChunkDecoder::Finish() const {
  const bool ok = format_.layered ? std::all_of(layered_.begin(),
                                                layered_.end(),
                                                [](const auto& item) { return item->ok(); })
                                  : decoder_.ok();
  if (ok) return absl::OkStatus();
  return absl::InvalidArgumentError("a chunk has fewer bytes than its points need: it is damaged");
}

}  // namespace strata
