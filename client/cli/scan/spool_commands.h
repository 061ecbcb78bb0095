// strata spool status|send, and scans that go into a spool.
#ifndef STRATA_CLIENT_CLI_SCAN_SPOOL_COMMANDS_H_
#define STRATA_CLIENT_CLI_SCAN_SPOOL_COMMANDS_H_

#include <string>
#include <vector>

#include "absl/status/status.h"

#include "client/cli/scan/scan_uploader.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"

namespace strata::cli {

// Puts the sources into the spool in `directory`, in their order, and sends what waits there as far
// as the server is there. `result` gets what became of them; scans that cannot be read or are
// refused at the door are its errors.
absl::Status ImportIntoSpool(FileContext& context,
                             const std::string& directory,
                             const std::string& map,
                             const std::vector<UploadSource>& sources,
                             Json& result);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_SCAN_SPOOL_COMMANDS_H_
