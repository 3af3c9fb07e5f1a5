# What an installation holds: programs, both libraries, plugins, scripts, public headers, and how
# others find them.
include(CMakePackageConfigHelpers)

install(TARGETS simkernel simlab sim_flags EXPORT sim LIBRARY DESTINATION ${SIM_LIBDIR})
install(DIRECTORY scripts/ DESTINATION share/sim)
# The page for `sim export --format page`, where ./dev web has made it.
install(FILES build/web/page.html DESTINATION share/sim/web OPTIONAL)
# The C interface, and the package of Python over it, which looks for the library beside itself.
install(TARGETS sim_c EXPORT sim LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(FILES core/c/sim.h DESTINATION include)
install(DIRECTORY python/sim DESTINATION lib/python3/dist-packages
  FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed" PATTERN "__pycache__" EXCLUDE)
# The public headers: what plugins and programs include. What these include in turn, the types of
# their interfaces, comes with them.
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
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/sim)
install(EXPORT sim NAMESPACE sim:: FILE sim-targets.cmake DESTINATION ${package})
configure_package_config_file(core/sim-config.cmake.in ${PROJECT_BINARY_DIR}/sim-config.cmake
  INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/sim-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/sim-config.cmake ${PROJECT_BINARY_DIR}/sim-config-version.cmake
  plugins/sim_add_plugin.cmake plugins/seal.cmake DESTINATION ${package})

set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)  # tests need not be built for an installation

# pkg-config --cflags --libs sim, the kernel; or simlab, with the laboratory; or libsim, the C interface
file(RELATIVE_PATH prefix_of_pc /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
foreach(package_file sim.pc simlab.pc libsim.pc)
  configure_file(core/${package_file}.in ${PROJECT_BINARY_DIR}/${package_file} @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${package_file} DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()

# The entry of `sim view` in menus.
file(STRINGS CITATION.cff released REGEX "^date-released: ")
string(REGEX REPLACE "^date-released: " "" SIM_RELEASED "${released}")
configure_file(packaging/sim.metainfo.xml.in ${PROJECT_BINARY_DIR}/sim.metainfo.xml @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/sim.metainfo.xml DESTINATION share/metainfo)
install(FILES packaging/sim.desktop DESTINATION share/applications)
install(FILES packaging/sim.svg DESTINATION share/icons/hicolor/scalable/apps)
