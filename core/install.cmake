# What an installation holds: programs, both libraries, plugins, scripts, public headers, and how
# others find them.
include(CMakePackageConfigHelpers)

install(TARGETS simkernel simlab sim_flags EXPORT sim LIBRARY DESTINATION lib)
install(DIRECTORY scripts/ DESTINATION share/sim)
# The page for `sim export --format page`, where ./dev web has made it.
install(FILES build/web/page.html DESTINATION share/sim/web OPTIONAL)
# The C interface, and the package of Python over it, which looks for the library beside itself.
install(TARGETS sim_c EXPORT sim LIBRARY DESTINATION lib)
install(FILES core/c/sim.h DESTINATION include)
install(DIRECTORY python/sim DESTINATION lib/python3/dist-packages
  FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed" PATTERN "__pycache__" EXCLUDE)
# The public headers: what plugins and programs may include. What these include in turn comes with
# them, and may change at any time, as all others.
file(STRINGS core/public_headers.txt headers_left)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS core/public_headers.txt)
set(headers)
while(headers_left)
  list(POP_FRONT headers_left header)
  if(header IN_LIST headers)
    continue()
  endif()
  list(APPEND headers ${header})
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${header} DESTINATION include/sim/${folder})
  file(STRINGS ${header} includes REGEX "^[ \t]*#[ \t]*include[ \t]*\"core/")
  foreach(include ${includes})
    string(REGEX REPLACE "^[^\"]*\"([^\"]+)\".*" "\\1" include "${include}")
    list(APPEND headers_left ${include})
  endforeach()
endwhile()

# find_package(sim) gives sim::simkernel, sim::simlab and sim_add_plugin(NAME FILE...).
set(package lib/cmake/sim)
install(EXPORT sim NAMESPACE sim:: FILE sim-targets.cmake DESTINATION ${package})
configure_package_config_file(core/sim-config.cmake.in ${PROJECT_BINARY_DIR}/sim-config.cmake
  INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/sim-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/sim-config.cmake ${PROJECT_BINARY_DIR}/sim-config-version.cmake
  plugins/sim_add_plugin.cmake plugins/seal.cmake DESTINATION ${package})

# pkg-config --cflags --libs sim, the kernel; or simlab, with the laboratory; or libsim, the C interface
foreach(package_file sim.pc simlab.pc libsim.pc)
  configure_file(core/${package_file}.in ${PROJECT_BINARY_DIR}/${package_file} @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${package_file} DESTINATION lib/pkgconfig)
endforeach()

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
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "g++, cmake, pkg-config, python3-numpy")
include(CPack)
