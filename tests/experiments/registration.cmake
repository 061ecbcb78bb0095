strata_executable(
  ingest_chain ingest_chain
  SOURCES ingest_chain.cc
  DEPS strata::registration strata::mls strata::test_support strata::test_recordings
)
