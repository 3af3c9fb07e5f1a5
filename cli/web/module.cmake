# The module of WebAssembly: all of `sim` with the plugins linked in, and what a page calls.
add_executable(sim_web sim.cpp web/charconv.cpp web/platform.cpp web/exports.cpp)
target_link_libraries(sim_web PRIVATE simverbs)
set(scripts ${PROJECT_SOURCE_DIR}/scripts)
target_link_options(sim_web PRIVATE
  -O0 -sERROR_ON_UNDEFINED_SYMBOLS=1
  -sMODULARIZE=1 -sEXPORT_NAME=makeSim -sINVOKE_RUN=0 -sEXIT_RUNTIME=0
  -sALLOW_MEMORY_GROWTH=1 -sINITIAL_MEMORY=33554432 -sMAXIMUM_MEMORY=2147483648
  -sTOTAL_STACK=4194304 -sENVIRONMENT=web,worker,node -sFORCE_FILESYSTEM=1 -lnodefs.js
  -sEXPORTED_RUNTIME_METHODS=callMain,ccall,FS,ENV,NODEFS
  -sEXPORTED_FUNCTIONS=_main,_malloc,_free,_sim_fma_doubles,_sim_fma_floats
  "SHELL:--embed-file ${scripts}@/sim/share/sim")
set_target_properties(sim_web PROPERTIES OUTPUT_NAME kernel SUFFIX .js
  RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})

# Beside it: where its fused multiply-adds are, what node starts, and the page.
set(web ${CMAKE_CURRENT_LIST_DIR})
find_program(NODE node REQUIRED NO_CMAKE_FIND_ROOT_PATH)
add_custom_command(TARGET sim_web POST_BUILD
  COMMAND ${NODE} ${web}/sites.mjs ${PROJECT_BINARY_DIR}/kernel.wasm ${PROJECT_BINARY_DIR}/kernel.sites
  COMMAND ${CMAKE_COMMAND} -E copy ${web}/sim.mjs ${web}/load.mjs ${PROJECT_BINARY_DIR}
  COMMAND ${NODE} ${web}/bundle.mjs ${web} ${PROJECT_BINARY_DIR} VERBATIM)
set(beside sites.mjs sim.mjs load.mjs bundle.mjs worker.js page.js page.css page.html)
list(TRANSFORM beside PREPEND ${web}/)
set_target_properties(sim_web PROPERTIES LINK_DEPENDS "${beside}")
