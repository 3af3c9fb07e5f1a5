# sim_add_plugin(NAME FILE...): a plugin library NAME.so from C++ files; the same inside the tree and
# behind find_package(sim).
set(SIM_SEAL ${CMAKE_CURRENT_LIST_DIR}/seal.cmake)

function(sim_add_plugin name)
  add_library(${name} MODULE ${ARGN})
  # It needs the laboratory only if it uses it: forces and methods run in programs without one.
  target_link_libraries(${name} PRIVATE -Wl,--as-needed sim::simlab sim::simkernel)
  # A precompiled header that plugins share must not see the name of one of them: no DEFINE_SYMBOL.
  set_target_properties(${name} PROPERTIES PREFIX "" DEFINE_SYMBOL "" CXX_EXTENSIONS OFF
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_compile_options(${name} PRIVATE $<$<CONFIG:>:-O2>)
  # Installing must not change the file. The kernel is in the process already when it is opened.
  set_target_properties(${name} PROPERTIES BUILD_WITH_INSTALL_RPATH ON)
  add_custom_command(TARGET ${name} POST_BUILD
    COMMAND ${CMAKE_COMMAND} -DLIBRARY=$<TARGET_FILE:${name}> -P ${SIM_SEAL} VERBATIM)
endfunction()
