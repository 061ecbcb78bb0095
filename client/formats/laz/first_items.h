// The parts of a point as the first LASzip coded them (version 1): POINT10, GPSTIME11, RGB12, BYTE
// and, for good, WAVEPACKET13.
#ifndef STRATA_CLIENT_FORMATS_LAZ_FIRST_ITEMS_H_
#define STRATA_CLIENT_FORMATS_LAZ_FIRST_ITEMS_H_

#include <memory>

#include "client/formats/laz/laz_format.h"
#include "client/formats/laz/pointwise_items.h"

namespace strata {

// As MakePointwiseItem(). REQUIRES: version 1.
std::unique_ptr<PointwiseItem> MakeFirstItem(const LazItem& item);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_LAZ_FIRST_ITEMS_H_
