#include "client/formats/bags/unpack.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include "client/formats/bags/bag_file.h"
#include "core/common/status.h"

namespace strata {
namespace {

// What one step of a library did.
struct UnpackStep {
  std::size_t read = 0;
  std::size_t written = 0;
  bool ended = false;
};
// Unpacks from the first bytes into `room` bytes at `out`; an error names what is wrong.
using UnpackSome =
    absl::FunctionRef<absl::Status(absl::string_view in, char* out, std::size_t room, UnpackStep&)>;

absl::Status UnpackAll(absl::string_view packed,
                       std::size_t size,
                       UnpackSome some,
                       std::string& unpacked) {
  // Who has held a chunk before has the memory already; else it grows by doubling.
  std::size_t have = 0;
  unpacked.resize(std::min(size, std::max<std::size_t>(unpacked.size(), std::size_t{1} << 16)));
  absl::Status status;
  while (have < size) {
    if (have == unpacked.size()) unpacked.resize(std::min(size, 2 * have));
    UnpackStep step;
    status = some(packed, unpacked.data() + have, unpacked.size() - have, step);
    packed.remove_prefix(step.read);
    have += step.written;
    if (!status.ok() || step.ended) break;
    if (step.read == 0 && step.written == 0) break;  // more bytes are wanted than there are
  }
  unpacked.resize(have);
  if (!status.ok() || have == size) return status;
  return absl::DataLossError(absl::StrCat("unpacks to ", have, " bytes, announced are ", size));
}

absl::Status UnpackLz4(absl::string_view packed, std::size_t size, std::string& unpacked) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) {
    return absl::ResourceExhaustedError("no memory to unpack lz4");
  }
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> owner(
      context, &LZ4F_freeDecompressionContext);
  return UnpackAll(
      packed,
      size,
      [context](absl::string_view in, char* out, std::size_t room, UnpackStep& step) {
        step.read = in.size();
        step.written = room;
        const std::size_t wanted =
            LZ4F_decompress(context, out, &step.written, in.data(), &step.read, nullptr);
        if (LZ4F_isError(wanted) != 0) {
          step = {};
          return absl::DataLossError(absl::StrCat("lz4: ", LZ4F_getErrorName(wanted)));
        }
        step.ended = wanted == 0;
        return absl::OkStatus();
      },
      unpacked);
}

absl::Status UnpackZstd(absl::string_view packed, std::size_t size, std::string& unpacked) {
  const std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(),
                                                                        &ZSTD_freeDCtx);
  if (context == nullptr) return absl::ResourceExhaustedError("no memory to unpack zstd");
  return UnpackAll(
      packed,
      size,
      [&context](absl::string_view in, char* out, std::size_t room, UnpackStep& step) {
        ZSTD_inBuffer from = {in.data(), in.size(), 0};
        ZSTD_outBuffer to = {out, room, 0};
        const std::size_t wanted = ZSTD_decompressStream(context.get(), &to, &from);
        step.read = from.pos;
        step.written = to.pos;
        if (ZSTD_isError(wanted) != 0) {
          return absl::DataLossError(absl::StrCat("zstd: ", ZSTD_getErrorName(wanted)));
        }
        step.ended = wanted == 0 && from.pos == from.size;  // frames may follow each other
        return absl::OkStatus();
      },
      unpacked);
}

absl::Status UnpackBz2(absl::string_view packed, std::size_t size, std::string& unpacked) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) {
    return absl::ResourceExhaustedError("no memory to unpack bz2");
  }
  const std::unique_ptr<bz_stream, int (*)(bz_stream*)> owner(&stream, &BZ2_bzDecompressEnd);
  return UnpackAll(
      packed,
      size,
      [&stream](absl::string_view in, char* out, std::size_t room, UnpackStep& step) {
        // Both counts are of 32 bits, and pieces are smaller.
        stream.next_in = const_cast<char*>(in.data());
        stream.avail_in = static_cast<unsigned>(in.size());
        stream.next_out = out;
        stream.avail_out = static_cast<unsigned>(room);
        const int result = BZ2_bzDecompress(&stream);
        step.read = in.size() - stream.avail_in;
        step.written = room - stream.avail_out;
        step.ended = result == BZ_STREAM_END;
        if (result == BZ_OK || step.ended) return absl::OkStatus();
        return absl::DataLossError(absl::StrCat("bz2: error ", result));
      },
      unpacked);
}

}  // namespace

absl::Status Unpack(absl::string_view method,
                    absl::string_view packed,
                    std::uint64_t size,
                    std::string& unpacked) {
  if (size > kMaxBagPieceBytes) {
    unpacked.clear();
    return absl::InvalidArgumentError(absl::StrCat(
        "says that it unpacks to ", size, " bytes, at most ", kMaxBagPieceBytes, " are read"));
  }
  const auto bytes = static_cast<std::size_t>(size);
  if (method == "lz4") return UnpackLz4(packed, bytes, unpacked);
  if (method == "zstd") return UnpackZstd(packed, bytes, unpacked);
  if (method == "bz2") return UnpackBz2(packed, bytes, unpacked);
  unpacked.clear();
  return absl::InvalidArgumentError(
      absl::StrCat("is packed by '", method.substr(0, 20), "'; lz4, zstd and bz2 are read"));
}

absl::StatusOr<absl::string_view> UnpackedMessage(absl::string_view bytes, std::string& unpacked) {
  constexpr absl::string_view kZstdMagic = "\x28\xB5\x2F\xFD";
  if (!absl::StartsWith(bytes, kZstdMagic)) return bytes;
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR) {
    return absl::DataLossError("a message is packed by zstd and does not say its size");
  }
  STRATA_RETURN_IF_ERROR(Unpack("zstd", bytes, size, unpacked));
  return unpacked;
}

}  // namespace strata
