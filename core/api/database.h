// The database as its users see it: one interface a noun. The engine implements it in the process,
// the SDK over gRPC; programs and tests are written once for both.
#ifndef STRATA_CORE_API_DATABASE_H_
#define STRATA_CORE_API_DATABASE_H_

#include "core/api/classifiers.h"
#include "core/api/jobs.h"
#include "core/api/maps.h"
#include "core/api/models.h"
#include "core/api/objects.h"
#include "core/api/planning.h"
#include "core/api/posegraph.h"
#include "core/api/scans.h"
#include "core/api/tiles.h"

namespace strata::api {

// Thread-safe; the references live as long as the database.
class Database {
 public:
  virtual ~Database() = default;

  virtual Maps& maps() = 0;
  virtual Scans& scans() = 0;
  virtual Tiles& tiles() = 0;
  virtual Planning& planning() = 0;
  virtual Jobs& jobs() = 0;
  virtual PoseGraph& posegraph() = 0;
  virtual Classifiers& classifiers() = 0;
  virtual Models& models() = 0;
  virtual Objects& objects() = 0;
};

}  // namespace strata::api

#endif  // STRATA_CORE_API_DATABASE_H_
