// What strata egomotion says of its run.
#ifndef STRATA_CLIENT_CLI_EGOMOTION_EGOMOTION_REPORT_H_
#define STRATA_CLIENT_CLI_EGOMOTION_EGOMOTION_REPORT_H_

#include "client/cli/terminal/output.h"
#include "core/egomotion/egomotion.h"

namespace strata::cli {

// Angles in degrees; times in seconds since 1970.
Json ToJson(const Egomotion& egomotion);

// Warns of a run whose poses are in part not where the robot was.
void WarnOf(const EgomotionReport& report, Output& output);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_EGOMOTION_EGOMOTION_REPORT_H_
