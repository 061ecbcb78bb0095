strata_executable(
  store_commit_benchmark store_commit_benchmark
  SOURCES service/store_commit_benchmark.cc
  DEPS strata::postgres_cluster strata::storage_postgresql strata::storage_sqlite strata::test_support
)
