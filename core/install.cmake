# What an installation holds: programs, kernel, plugins, scripts, headers, and how others find them.
include(CMakePackageConfigHelpers)

install(TARGETS simkernel sim_flags EXPORT sim LIBRARY DESTINATION lib)
install(DIRECTORY scripts/ DESTINATION share/sim)
install(DIRECTORY core/ DESTINATION include/sim/core
  FILES_MATCHING PATTERN "*.h")

# find_package(sim) gives sim::simkernel and sim_add_plugin(NAME FILE...).
set(package lib/cmake/sim)
install(EXPORT sim NAMESPACE sim:: FILE sim-targets.cmake DESTINATION ${package})
configure_package_config_file(core/sim-config.cmake.in ${PROJECT_BINARY_DIR}/sim-config.cmake
  INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/sim-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/sim-config.cmake ${PROJECT_BINARY_DIR}/sim-config-version.cmake
  plugins/sim_add_plugin.cmake plugins/seal.cmake DESTINATION ${package})

# pkg-config --cflags --libs sim
configure_file(core/sim.pc.in ${PROJECT_BINARY_DIR}/sim.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/sim.pc DESTINATION lib/pkgconfig)

# A package of Debian: `cpack` in the build folder, or ./dev deb.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)  # tests need not be built for it
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME sim)
set(CPACK_PACKAGE_CONTACT "The authors of sim <sim@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/lib)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "g++, cmake, pkg-config")
include(CPack)
