# sim_add_plugin(NAME FILE...): a plugin library NAME.so from C++ files, or from those of a folder; the
# same inside the tree and behind find_package(sim).
set(SIM_SEAL ${CMAKE_CURRENT_LIST_DIR}/seal.cmake)

function(sim_add_plugin name)
  set(files)
  foreach(source ${ARGN})
    get_filename_component(source ${source} ABSOLUTE)
    if(IS_DIRECTORY ${source})
      file(GLOB_RECURSE own CONFIGURE_DEPENDS ${source}/*.cpp)
      list(APPEND files ${own})
    else()
      list(APPEND files ${source})
    endif()
  endforeach()
  add_library(${name} MODULE ${files})
  # It needs the laboratory only if it uses it: forces and methods run in programs without one.
  target_link_libraries(${name} PRIVATE -Wl,--as-needed sim::simlab sim::simkernel)
  sim_plugin_options(${name})
  # Installing must not change the file. The kernel is in the process already when it is opened.
  set_target_properties(${name} PROPERTIES PREFIX "" BUILD_WITH_INSTALL_RPATH ON)
  add_custom_command(TARGET ${name} POST_BUILD
    COMMAND ${CMAKE_COMMAND} -DLIBRARY=$<TARGET_FILE:${name}> -P ${SIM_SEAL} VERBATIM)
endfunction()

# How the code of a plugin is compiled.
function(sim_plugin_options target)
  # A precompiled header that plugins share must not see the name of one of them: no DEFINE_SYMBOL.
  set_target_properties(${target} PROPERTIES DEFINE_SYMBOL "" CXX_EXTENSIONS OFF
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_compile_options(${target} PRIVATE $<$<CONFIG:>:-O2>)
  # Kernels, which read themselves for every instruction set, are found by their names.
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "_kernel\\.cpp$")
  foreach(source ${sources})
    get_filename_component(folder ${source} DIRECTORY)
    target_include_directories(${target} PRIVATE ${folder})
    set_source_files_properties(${source} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  endforeach()
endfunction()
