strata_executable(
  durable_upload_benchmark durable_upload_benchmark
  SOURCES durable_upload_benchmark.cc
  DEPS strata::codec_samples strata::engine strata::sdk strata::server strata::test_support PkgConfig::glog
       PkgConfig::sqlite3
)
