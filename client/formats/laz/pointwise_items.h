// The parts of a point that LAZ codes one behind the other, point by point: POINT10, GPSTIME11,
// RGB12 and BYTE, here of version 2 (M. Isenburg, "LASzip: lossless compression of LiDAR data",
// 2013).
#ifndef STRATA_CLIENT_FORMATS_LAZ_POINTWISE_ITEMS_H_
#define STRATA_CLIENT_FORMATS_LAZ_POINTWISE_ITEMS_H_

#include <memory>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/laz_format.h"

namespace strata {

class PointwiseItem {
 public:
  virtual ~PointwiseItem() = default;
  // Makes of the bytes of the point before those of the next one.
  virtual void Next(ArithmeticDecoder& decoder, char* item) = 0;
};

// Of a chunk whose first point has these bytes. REQUIRES: ReadLazFormat() gave the item, of a file
// that is not layered.
std::unique_ptr<PointwiseItem> MakePointwiseItem(const LazItem& item, const char* first);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_POINTWISE_ITEMS_H_
