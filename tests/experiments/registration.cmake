strata_executable(
  ingest_chain ingest_chain
  SOURCES ingest_chain.cc
  DEPS strata::registration strata::mls strata::test_support strata::test_recordings
)
strata_executable(
  place_recognition place_recognition
  SOURCES place_recognition.cc
  DEPS strata::posegraph strata::registration strata::mls strata::simulator strata::test_support strata::test_recordings
)
strata_executable(
  icp_chain icp_chain
  SOURCES icp_chain.cc
  DEPS strata::registration_peers strata::test_recordings
)
strata_executable(
  crispness crispness
  SOURCES crispness.cc
  DEPS strata::mls strata::test_recordings
)
strata_executable(
  fleet fleet
  SOURCES fleet.cc
  DEPS strata::engine strata::simulator strata::test_support
)
strata_executable(
  path_uncertainty path_uncertainty
  SOURCES path_uncertainty.cc
  DEPS strata::engine strata::posegraph strata::simulator strata::test_support strata::test_recordings
)
