# sim_add_lua(FOLDER): Lua from the sources in FOLDER, compiled as C++ so that its errors are exceptions;
# its interface has the names of C. Sets SIM_LUA and LUA_INCLUDE_DIRS.
function(sim_add_lua folder)
  file(GLOB sources ${folder}/*.c)
  list(FILTER sources EXCLUDE REGEX "/(lua|luac|onelua)\\.c$")
  if(NOT sources)
    message(FATAL_ERROR "no sources of Lua in ${folder}")
  endif()
  set_source_files_properties(${sources} PROPERTIES LANGUAGE CXX)
  add_library(sim_lua STATIC ${sources})
  target_compile_options(sim_lua PRIVATE -w -ffp-contract=off "SHELL:-x c++ -include lua.hpp")
  # Elsewhere as Debian has it.
  target_compile_definitions(sim_lua PRIVATE LUA_CORE LUA_LIB
    $<$<NOT:$<BOOL:${EMSCRIPTEN}>>:LUA_COMPAT_5_3;LUA_USE_LINUX>)
  # Debian's luaconf.h asks for the name of its architecture.
  set(headers ${PROJECT_BINARY_DIR}/headers)
  file(WRITE ${headers}/lua5.4-deb-multiarch.h "#define DEB_HOST_MULTIARCH \"none\"\n")
  target_include_directories(sim_lua SYSTEM PUBLIC ${folder} ${headers})
  set(SIM_LUA sim_lua PARENT_SCOPE)
  set(LUA_INCLUDE_DIRS ${folder} ${headers} PARENT_SCOPE)
endfunction()
