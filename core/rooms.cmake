# How the time of the compiler is saved. Most of what a small file costs is reading the same headers.

# sim_rooms(simkernel core): compiles the files of each room below core/ as one unit. Kernels, which
# compile themselves for every instruction set (core/simd/foreach_target.h), stay on their own. Without SIM_UNITY the files share a
# precompiled header of the standard library instead.
function(sim_rooms target folder)
  if(NOT SIM_UNITY)
    target_precompile_headers(${target} PRIVATE <algorithm> <cmath> <filesystem> <functional> <map>
      <memory> <span> <sstream> <string> <variant> <vector>)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources EXCLUDE REGEX "^\\$<")  # objects of other targets
  foreach(source ${sources})
    file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR}/${folder} ${source})
    string(REGEX REPLACE "/.*" "" room ${path})
    if(source MATCHES "_kernel\\.cpp$")
      set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    else()
      # Small rooms that read the same headers share a unit.
      string(REGEX REPLACE "^(terminal|view)$" "run" room ${room})
      string(REGEX REPLACE "^engine$" "output" room ${room})
      string(REGEX REPLACE "^(fields|simd|math|geometry)$" "base" room ${room})
      set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${room})
    endif()
  endforeach()
endfunction()

# Plugins share the precompiled header of the first one.
function(sim_plugin_headers target)
  get_property(first GLOBAL PROPERTY sim_first_plugin)
  if(first)
    target_precompile_headers(${target} REUSE_FROM ${first})
  else()
    target_precompile_headers(${target} PRIVATE
      ${PROJECT_SOURCE_DIR}/core/plugin/plugin.h
      ${PROJECT_SOURCE_DIR}/core/plugin/explicit_plugin.h
      ${PROJECT_SOURCE_DIR}/core/plugin/embedded_plugin.h)
    set_property(GLOBAL PROPERTY sim_first_plugin ${target})
  endif()
endfunction()
