// Recordings of a Velodyne VLP-16 or HDL-32E: files of packets (.pcap).
#ifndef STRATA_CLIENT_FORMATS_PACKETS_VELODYNE_READER_H_
#define STRATA_CLIENT_FORMATS_PACKETS_VELODYNE_READER_H_

#include <filesystem>
#include <vector>

#include "absl/status/statusor.h"

#include "client/formats/survey/station.h"

namespace strata {

// A cloud of each whole revolution, from azimuth 0 on, clockwise; what is before the first and
// behind the last is left out. Points are in the sensor's frame: x to where the azimuth is 0, y to
// the left of it, z up [m]; with reflectivity and the time since the revolution began [s]. The
// azimuth is that at the time of each shot. Stations have the time at which the packet was captured
// in which they begin, and no pose. Memory is that of one revolution, while it is read.
//
// INVALID_ARGUMENT, with what to do: no file of packets, of another sensor or of several, an
// Ouster's, or no whole revolution.
absl::StatusOr<std::vector<Station>> ListVelodyneStations(const std::filesystem::path& path);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PACKETS_VELODYNE_READER_H_
