// Logs of a robot's motion as others record them.
#ifndef STRATA_CLIENT_FORMATS_MOTION_RECORDED_LOG_H_
#define STRATA_CLIENT_FORMATS_MOTION_RECORDED_LOG_H_

#include <filesystem>
#include <string>

#include "absl/status/statusor.h"

#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"

namespace strata {

struct RecordedLog {
  std::string layout;  // for people
  MotionLog log;
  Rig rig;  // what the layout says of the sensors; the rest are defaults
};

// Knows two layouts, in the folder or in the one folder below it that has one:
//
// ROS messages as CSV, times in seconds: imu.csv (stamp wx wy wz ax ay az; rad/s, m/s²), gps.csv
// (stamp lat lon alt var_e var_n var_u; degrees, m, m²; rows of status < 0 are no fix) and, if
// there are wheels, odom.csv (stamp vx wz; m/s, rad/s). Other columns may be there.
//
// The logger of Paul Balzer's car, one file with the columns millis ax ay az rollrate pitchrate
// yawrate speed latitude longitude altitude hdop vdop epe (ms, m/s² with the sign of gravity,
// degrees/s, km/h, degrees, m); a fix is a row whose place is another than the one before, its σ is
// epe, of the altitude epe · vdop / hdop.
//
// NOT_FOUND naming what was looked for; INVALID_ARGUMENT naming file and line.
absl::StatusOr<RecordedLog> ReadRecordedLog(const std::filesystem::path& folder);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_MOTION_RECORDED_LOG_H_
