#include "core/codec/columns.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <zstd.h>

#include "core/common/status.h"

namespace strata {
namespace {

enum class Packing : std::uint8_t {  // stored
  kStored = 0,
  kRepeated = 1,
  kZstd = 2,
};

constexpr int kLevel = 3;

absl::Status Damaged(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("column: ", what));
}

// A thread's compressor: making one costs more than compressing a small column.
ZSTD_CCtx* Compressor() {
  thread_local const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context = [] {
    ZSTD_CCtx* made = ZSTD_createCCtx();
    ZSTD_CCtx_setParameter(made, ZSTD_c_compressionLevel, kLevel);
    ZSTD_CCtx_setParameter(made, ZSTD_c_contentSizeFlag, 0);  // the column has it already
    return std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)>(made, &ZSTD_freeCCtx);
  }();
  return context.get();
}

bool IsRepeated(absl::string_view bytes) {
  return bytes.size() > 1 && bytes.find_first_not_of(bytes[0]) == absl::string_view::npos;
}

void PutPacked(std::string& out, Packing packing, std::size_t size, absl::string_view packed) {
  out.push_back(static_cast<char>(packing));
  PutVarint(out, size);
  if (packing == Packing::kZstd) PutVarint(out, packed.size());
  out.append(packed.data(), packed.size());
}

}  // namespace

void PutColumn(std::string& out, absl::string_view bytes) {
  if (IsRepeated(bytes)) {
    PutPacked(out, Packing::kRepeated, bytes.size(), bytes.substr(0, 1));
    return;
  }
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size =
      ZSTD_compress2(Compressor(), packed.data(), packed.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(size) != 0 || size + 2 >= bytes.size()) {
    PutPacked(out, Packing::kStored, bytes.size(), bytes);
  } else {
    PutPacked(out, Packing::kZstd, bytes.size(), absl::string_view(packed.data(), size));
  }
}

absl::Status TakeColumn(ByteReader& reader, std::size_t max_size, std::string& bytes) {
  const auto packing = static_cast<Packing>(reader.Fixed<std::uint8_t>());
  const std::uint64_t size = reader.Varint();
  if (!reader.ok()) return Damaged("cut short");
  if (size > max_size) {
    return Damaged(absl::StrCat("announces ", size, " bytes, at most ", max_size, " can be"));
  }
  switch (packing) {
    case Packing::kStored: {
      const absl::string_view stored = reader.Take(size);
      if (!reader.ok()) return Damaged("cut short");
      bytes.assign(stored.data(), stored.size());
      return absl::OkStatus();
    }
    case Packing::kRepeated:
      bytes.assign(size, static_cast<char>(reader.Fixed<std::uint8_t>()));
      return reader.ok() ? absl::OkStatus() : Damaged("cut short");
    case Packing::kZstd: {
      const absl::string_view packed = reader.Take(reader.Varint());
      if (!reader.ok()) return Damaged("cut short");
      bytes.resize(size);
      const std::size_t got =
          ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size());
      return got == size ? absl::OkStatus() : Damaged("zstd frame does not decompress");
    }
  }
  return Damaged(absl::StrCat("unknown packing ", static_cast<int>(packing)));
}

void ColumnEncoder::PutBits(std::uint64_t value, int count) {
  while (count > 0) {
    const int taken = std::min(count, 32);
    pending_ |= (value & ((std::uint64_t{1} << taken) - 1)) << pending_count_;
    pending_count_ += taken;
    value >>= taken;
    count -= taken;
    for (; pending_count_ >= 8; pending_count_ -= 8, pending_ >>= 8) {
      raw_.push_back(static_cast<char>(pending_));
    }
  }
}

void ColumnEncoder::Finish(std::string& out) {
  for (const std::string& column : columns_) PutColumn(out, column);
  if (pending_count_ > 0) raw_.push_back(static_cast<char>(pending_));
  PutVarint(out, raw_.size());
  out += raw_;
}

absl::StatusOr<ColumnDecoder> ColumnDecoder::Open(ByteReader& reader,
                                                  int columns,
                                                  std::size_t max_tokens) {
  ColumnDecoder decoder;
  decoder.columns_.resize(columns);
  for (Column& column : decoder.columns_) {
    STRATA_RETURN_IF_ERROR(TakeColumn(reader, max_tokens, column.bytes));
  }
  const absl::string_view raw = reader.Take(reader.Varint());
  if (!reader.ok()) return Damaged("raw bits cut short");
  decoder.raw_.assign(raw.data(), raw.size());
  return decoder;
}

std::uint64_t ColumnDecoder::TakeBits(int count) {
  if (raw_position_ + count > 8 * raw_.size()) {
    ok_ = false;
    return 0;
  }
  std::uint64_t value = 0;
  for (int got = 0; got < count;) {
    const int offset = static_cast<int>(raw_position_ & 7);
    const int taken = std::min(8 - offset, count - got);
    const auto byte = static_cast<std::uint8_t>(raw_[raw_position_ >> 3]);
    value |= std::uint64_t{static_cast<std::uint8_t>(byte >> offset) & ((1U << taken) - 1)} << got;
    got += taken;
    raw_position_ += taken;
  }
  return value;
}

absl::Status ColumnDecoder::Finish() const {
  if (!ok_) return Damaged("fewer numbers than the tile needs");
  for (const Column& column : columns_) {
    if (column.position != column.bytes.size()) return Damaged("more numbers than the tile needs");
  }
  if ((raw_position_ + 7) / 8 != raw_.size()) return Damaged("more raw bits than the tile needs");
  return absl::OkStatus();
}

}  // namespace strata
