# Debian packages: `cpack -G DEB` in the build folder makes one each of server, client, library and Python client, and of strata-ros2
# where Cyclone DDS was there when it was built.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME strata)
set(CPACK_PACKAGE_VENDOR "Strata")
set(CPACK_PACKAGE_CONTACT "The founders of Strata <strata@localhost>")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_COMPONENTS_ALL server client dev python)
if(TARGET strata_ros2_program)
  list(APPEND CPACK_COMPONENTS_ALL ros2)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_SET_DESTDIR ON) # /etc and /lib/systemd are not below the prefix
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)

set(CPACK_DEBIAN_SERVER_PACKAGE_NAME stratad)
set(CPACK_COMPONENT_SERVER_DESCRIPTION "map database server for robots in three dimensions
 Robots upload laser scans over gRPC; stratad aligns them into one multi-level
 map, keeps it consistent, and answers where things are and how to get there.")
set(CPACK_DEBIAN_SERVER_PACKAGE_DEPENDS "adduser")
set(CPACK_DEBIAN_SERVER_PACKAGE_RECOMMENDS "strata") # the nightly copies of maps (strata-backup.timer)
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA
    ${CMAKE_CURRENT_SOURCE_DIR}/debian/conffiles;${CMAKE_CURRENT_SOURCE_DIR}/debian/postinst;${CMAKE_CURRENT_SOURCE_DIR}/debian/prerm;${CMAKE_CURRENT_SOURCE_DIR}/debian/postrm
)
set(CPACK_DEBIAN_CLIENT_PACKAGE_NAME strata)
set(CPACK_COMPONENT_CLIENT_DESCRIPTION "command line client of the map database Strata
 Creates and imports maps, plans paths, draws pictures; works with a server or
 on a folder of maps.")
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libstrata-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEV_DESCRIPTION "headers and libraries of the map database Strata
 For find_package(strata): the database in a program, or its client.")
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
    "libabsl-dev, libassimp-dev, libboost-dev, libbz2-dev, libceres-dev, libeigen3-dev, libexpat1-dev, libfcl-dev, libgeographiclib-dev, libgoogle-glog-dev, libgrpc++-dev, liblz4-dev, liblzf-dev, libmeshoptimizer-dev, libnanoflann-dev, libopenblas-serial-dev, libpcap-dev, libpcl-dev, libpq-dev, libprotobuf-dev, libqhull-dev, libsqlite3-dev, libtiff-dev, liburdfdom-dev, libxxhash-dev, libyaml-cpp-dev, libzstd-dev, zlib1g-dev"
)
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-strata)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3-grpcio, python3-numpy, python3-protobuf, python3-xxhash, python3-zstandard")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "strata") # strata.register
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "Python client of the map database Strata
 Arrays of points in, arrays of surfaces and paths out.")
set(CPACK_DEBIAN_ROS2_PACKAGE_NAME strata-ros2)
set(CPACK_DEBIAN_ROS2_PACKAGE_SUGGESTS "strata")
set(CPACK_COMPONENT_ROS2_DESCRIPTION "robots of ROS 2 in maps of Strata
 Takes clouds and poses of a robot over DDS into a map, by way of a spool on the
 robot's disk, and gives it the map of its floor, surfaces, paths and its place
 in the map. ROS is not needed.")
include(CPack)

# Only in packages: an installation under a prefix must not write to /etc.
install(
  FILES stratad.conf
  DESTINATION /etc/strata
  COMPONENT server EXCLUDE_FROM_ALL
)
install(
  FILES systemd/stratad.service systemd/strata-backup.service systemd/strata-backup.timer
  DESTINATION /lib/systemd/system
  COMPONENT server EXCLUDE_FROM_ALL
)
install(
  PROGRAMS backup/backup-maps
  DESTINATION /usr/lib/strata
  COMPONENT server EXCLUDE_FROM_ALL
)
install(
  FILES README.md
  DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/stratad
  COMPONENT server EXCLUDE_FROM_ALL
)
