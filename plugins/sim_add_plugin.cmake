# sim_add_plugin(NAME FILE...): a plugin library NAME.so from C++ files; the same inside the tree and
# behind find_package(sim).
function(sim_add_plugin name)
  add_library(${name} MODULE ${ARGN})
  target_link_libraries(${name} PRIVATE sim::simkernel)
  # A precompiled header that plugins share must not see the name of one of them: no DEFINE_SYMBOL.
  set_target_properties(${name} PROPERTIES PREFIX "" DEFINE_SYMBOL "" CXX_EXTENSIONS OFF
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_compile_options(${name} PRIVATE $<$<CONFIG:>:-O2>)
endfunction()
