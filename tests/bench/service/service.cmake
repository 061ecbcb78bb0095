find_package(CLI11 REQUIRED)
strata_executable(
  durable_upload_benchmark durable_upload_benchmark
  SOURCES service/durable_upload_benchmark.cc
  DEPS strata::codec_samples strata::engine strata::sdk strata::server strata::test_support PkgConfig::glog
       PkgConfig::sqlite3
)
strata_executable(
  tile_read_benchmark tile_read_benchmark
  SOURCES service/tile_read_benchmark.cc
  DEPS strata::engine strata::proto strata::server strata::test_support gRPC::grpc++ PkgConfig::glog
)
strata_executable(
  ingest_benchmark ingest_benchmark
  SOURCES service/ingest_benchmark.cc
  DEPS strata::engine strata::test_recordings strata::test_support PkgConfig::glog CLI11::CLI11
)
strata_smoke(durable_upload_benchmark 16 1 smoke)
strata_smoke(tile_read_benchmark 0.1 1 smoke)
strata_smoke(ingest_benchmark --scans 16 --repeats 1)
