# A port of vcpkg, for an overlay: vcpkg install sim-laboratory --overlay-ports=packaging/vcpkg.
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../.." ABSOLUTE)

# Compiled as C++, as no package of Lua is.
vcpkg_download_distfile(LUA
  URLS https://www.lua.org/ftp/lua-5.4.4.tar.gz
  FILENAME lua-5.4.4.tar.gz
  SHA512 af0c35d5ba00fecbb2dd617bd7b825edf7418a16a73076e04f2a0df58cdbf098dc3ff4402e974afd789eb5d86d2e12ec6df9c84b99b23656ea694a85f83bcd21)
vcpkg_extract_source_archive(LUA_SOURCE ARCHIVE "${LUA}")

vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS -DSIM_TESTS=OFF "-DSIM_LUA_SOURCE=${LUA_SOURCE}/src"
    -DCMAKE_DISABLE_FIND_PACKAGE_HDF5=ON -DCMAKE_DISABLE_FIND_PACKAGE_PETSc=ON)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME sim CONFIG_PATH lib/cmake/sim)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
