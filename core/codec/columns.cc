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
#define ZSTD_STATIC_LINKING_ONLY  // for ZSTD_c_literalCompressionMode
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
constexpr int kQuickLevel = 1;
constexpr std::size_t kSampleBytes = 1024;

absl::Status Damaged(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("column: ", what));
}

using Compressor = std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)>;

Compressor MakeCompressor(int level) {
  Compressor made(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(made.get(), ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setParameter(made.get(), ZSTD_c_contentSizeFlag, 0);  // the column has it already
  return made;
}

// Hardly ever finds a repetition, and codes by frequency nevertheless. A zstd without that
// parameter, which is not of its stable interface, stores the bytes; any zstd reads both.
Compressor MakeFrequencyCoder() {
  Compressor made = MakeCompressor(ZSTD_minCLevel());
  ZSTD_CCtx_setParameter(made.get(), ZSTD_c_literalCompressionMode, ZSTD_lcm_huffman);
  return made;
}

// A thread's compressors: making one costs more than compressing a small column.
struct Compressors {
  Compressor thorough = MakeCompressor(kLevel);
  Compressor quick = MakeCompressor(kQuickLevel);
  Compressor frequencies = MakeFrequencyCoder();
};

Compressors& OfThisThread() {
  thread_local Compressors compressors;
  return compressors;
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

// Bytes after compression, at most as many as before.
std::size_t PackedSize(ZSTD_CCtx* compressor, absl::string_view bytes, std::string& packed) {
  packed.resize(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress2(compressor, packed.data(), packed.size(), bytes.data(), bytes.size());
  return ZSTD_isError(size) != 0 ? bytes.size() : std::min(size, bytes.size());
}

void PutWith(ZSTD_CCtx* compressor, std::string& out, absl::string_view bytes) {
  if (IsRepeated(bytes)) {
    PutPacked(out, Packing::kRepeated, bytes.size(), bytes.substr(0, 1));
    return;
  }
  std::string packed;
  const std::size_t size = PackedSize(compressor, bytes, packed);
  if (size + 2 >= bytes.size()) {
    PutPacked(out, Packing::kStored, bytes.size(), bytes);
  } else {
    PutPacked(out, Packing::kZstd, bytes.size(), absl::string_view(packed.data(), size));
  }
}

// Whether looking for repetitions saves a twentieth of a sample from the middle.
bool HasRepetitions(absl::string_view bytes) {
  const std::size_t size = std::min(bytes.size(), kSampleBytes);
  const absl::string_view sample = bytes.substr((bytes.size() - size) / 2, size);
  Compressors& compressors = OfThisThread();
  std::string packed;
  const std::size_t without = PackedSize(compressors.frequencies.get(), sample, packed);
  if (without == size) return false;
  return 20 * PackedSize(compressors.quick.get(), sample, packed) < 19 * without;
}

}  // namespace

void PutColumn(std::string& out, absl::string_view bytes) {
  PutWith(OfThisThread().thorough.get(), out, bytes);
}

void PutNoisyColumn(std::string& out, absl::string_view bytes) {
  Compressors& compressors = OfThisThread();
  PutWith((HasRepetitions(bytes) ? compressors.quick : compressors.frequencies).get(), out, bytes);
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
                                                  std::size_t max_tokens,
                                                  std::size_t max_bytes) {
  ColumnDecoder decoder;
  decoder.columns_.resize(columns);
  for (Column& column : decoder.columns_) {
    STRATA_RETURN_IF_ERROR(TakeColumn(reader, std::min(max_tokens, max_bytes), column.bytes));
    max_bytes -= column.bytes.size();
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
