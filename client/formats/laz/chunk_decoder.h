// The points of one chunk of a LAZ file, one after the other.
#ifndef STRATA_CLIENT_FORMATS_LAZ_CHUNK_DECODER_H_
#define STRATA_CLIENT_FORMATS_LAZ_CHUNK_DECODER_H_

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/layered_items.h"
#include "client/formats/laz/laz_format.h"
#include "client/formats/laz/pointwise_items.h"

namespace strata {

// Any bytes give points: whether they were right is asked at the end.
class ChunkDecoder {
 public:
  // `format` must outlive it.
  explicit ChunkDecoder(const LazFormat& format) : format_(format) {}

  // Begins with a chunk, whose bytes must outlive the reading of it. INVALID_ARGUMENT if they are
  // too few.
  absl::Status Start(absl::string_view chunk);
  // The records of the points that follow, as LAS has them; as many as there is room for.
  void Read(std::span<char> records);
  // INVALID_ARGUMENT if the bytes ended before the points that were read.
  absl::Status Finish() const;

 private:
  absl::Status StartLayers(absl::string_view chunk);
  void Next();

  const LazFormat& format_;
  bool at_first_ = true;
  std::string point_;  // the last one
  // One of the two kinds, as many as the format has.
  ArithmeticDecoder decoder_;
  std::vector<std::unique_ptr<PointwiseItem>> pointwise_;
  std::size_t channel_ = 0;
  std::vector<std::unique_ptr<LayeredItem>> layered_;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_CHUNK_DECODER_H_
