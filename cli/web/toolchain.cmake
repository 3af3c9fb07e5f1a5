# Libraries that the compiler to WebAssembly has in the place of the system's: ./dev web names the
# sources, in SIM_WEB_SOURCES, that Debian has of Lua and zlib. Included where EMSCRIPTEN is set.
set(SIM_WEB_SOURCES "" CACHE PATH "Folder with the sources of Lua and zlib as lua/ and zlib/")
set(SIM_WEB_LIBCXX /usr/lib/llvm-16/include/c++/v1 CACHE PATH "Headers of libc++ with ranges")

# The exceptions of WebAssembly; vectors of 128 bits. No threads: they need headers of the server
# that hosts of files do not send.
add_compile_options(-fwasm-exceptions -msimd128)
add_link_options(-fwasm-exceptions)
add_compile_definitions(EIGEN_DONT_VECTORIZE)
add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-nostdinc++>
  "SHELL:$<$<COMPILE_LANGUAGE:CXX>:-isystem ${CMAKE_CURRENT_LIST_DIR}/libcxx -isystem ${SIM_WEB_LIBCXX}>")
# In emscripten 3.1.6 joining straight code to vectors (SLP) moves a read behind a write to the same
# place: scenes/wall.lua had other bits.
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -DNDEBUG -fno-slp-vectorize")
set(CMAKE_POSITION_INDEPENDENT_CODE OFF)
set(SIM_LINK_PLUGINS ON)

add_library(Threads::Threads INTERFACE IMPORTED)
add_library(Eigen3::Eigen INTERFACE IMPORTED)
target_include_directories(Eigen3::Eigen SYSTEM INTERFACE /usr/include/eigen3)
# /usr/include itself must not be seen.
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/headers)
file(CREATE_LINK /usr/include/CLI ${PROJECT_BINARY_DIR}/headers/CLI SYMBOLIC)
add_library(CLI11::CLI11 INTERFACE IMPORTED)
target_include_directories(CLI11::CLI11 SYSTEM INTERFACE ${PROJECT_BINARY_DIR}/headers)

include(core/lua/lua_source.cmake)
sim_add_lua(${SIM_WEB_SOURCES}/lua/src)

enable_language(C)
file(GLOB zlib_sources ${SIM_WEB_SOURCES}/zlib/*.c)
list(FILTER zlib_sources EXCLUDE REGEX "/gz[a-z]+\\.c$")
add_library(sim_web_zlib STATIC ${zlib_sources})
target_compile_options(sim_web_zlib PRIVATE -w)
target_include_directories(sim_web_zlib SYSTEM PUBLIC ${SIM_WEB_SOURCES}/zlib)
add_library(ZLIB::ZLIB ALIAS sim_web_zlib)
