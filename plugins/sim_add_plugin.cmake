# sim_add_plugin(NAME FILE...): a plugin library NAME.so from C++ files, or from those of a folder; the
# same inside the tree and behind find_package(sim).
set(SIM_SEAL ${CMAKE_CURRENT_LIST_DIR}/seal.cmake)

function(sim_add_plugin name)
  sim_plugin_sources(files ${ARGN})
  add_library(${name} MODULE ${files})
  # It needs the laboratory only if it uses it: forces and methods run in programs without one.
  target_link_libraries(${name} PRIVATE -Wl,--as-needed sim::simlab sim::simkernel)
  sim_plugin_options(${name})
  # Installing must not change the file. The kernel is in the process already when it is opened.
  set_target_properties(${name} PROPERTIES PREFIX "" BUILD_WITH_INSTALL_RPATH ON)
  add_custom_command(TARGET ${name} POST_BUILD
    COMMAND ${CMAKE_COMMAND} -DLIBRARY=$<TARGET_FILE:${name}> -P ${SIM_SEAL} VERBATIM)
endfunction()

# sim_link_plugin(TARGET NAME FILE...): the same plugin inside the program or library TARGET, where
# sim::linked_plugins() of core/plugin/linked_plugins.h lists all of them for a Registry. NAME, an
# identifier, is the target of its objects.
function(sim_link_plugin target name)
  sim_plugin_sources(files ${ARGN})
  add_library(${name} OBJECT ${files})
  target_compile_definitions(${name} PRIVATE SIM_PLUGIN_NAME=${name})
  target_link_libraries(${name} PRIVATE sim::simlab sim::simkernel)
  sim_plugin_options(${name})
  target_link_libraries(${target} PRIVATE ${name})
  sim_list_plugins(${target} ${name})
endfunction()

# sim_list_plugins(TARGET NAME...): puts names on the list of a target, which is written at the end of
# its folder. A target without plugins has an empty one.
function(sim_list_plugins target)
  get_property(listed TARGET ${target} PROPERTY SIM_LISTS_PLUGINS)
  set_property(TARGET ${target} PROPERTY SIM_LISTS_PLUGINS ON)
  set_property(TARGET ${target} APPEND PROPERTY SIM_LINKED_PLUGINS ${ARGN})
  if(NOT listed)
    cmake_language(EVAL CODE "cmake_language(DEFER CALL sim_write_plugin_list ${target})")
  endif()
endfunction()

function(sim_write_plugin_list target)
  get_property(names TARGET ${target} PROPERTY SIM_LINKED_PLUGINS)
  set(declarations)
  set(entries)
  foreach(name ${names})
    string(APPEND declarations "extern \"C\" const sim::PluginCard sim_plugin_card_${name};\n"
      "extern \"C\" void sim_plugin_register_${name}(sim::Registrar&);\n")
    string(APPEND entries "      {&sim_plugin_card_${name}, sim_plugin_register_${name}},\n")
  endforeach()
  set(file ${CMAKE_CURRENT_BINARY_DIR}/${target}_linked_plugins.cpp)
  file(CONFIGURE OUTPUT ${file} @ONLY CONTENT [[
#include "core/plugin/linked_plugins.h"

#include <initializer_list>

@declarations@
std::span<const sim::LinkedPlugin> sim::linked_plugins() {
  static const std::initializer_list<LinkedPlugin> kPlugins = {
@entries@  };
  return {kPlugins.begin(), kPlugins.size()};
}
]])
  target_sources(${target} PRIVATE ${file})
endfunction()

# The C++ files of a plugin, those of a folder in place of its name.
function(sim_plugin_sources out)
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
  set(${out} ${files} PARENT_SCOPE)
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
