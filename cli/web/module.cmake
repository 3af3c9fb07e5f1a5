# The modules of WebAssembly: all of `sim` for node, and what a page calls, which is smaller.
set(web ${CMAKE_CURRENT_LIST_DIR})
find_program(NODE node REQUIRED NO_CMAKE_FIND_ROOT_PATH)
find_program(WASM_OPT wasm-opt REQUIRED NO_CMAKE_FIND_ROOT_PATH)

# NAME.js and NAME.wasm, and where its fused multiply-adds are (load.mjs): NAME.sites. Made smaller
# where SMALL is true; emscripten's own way would rename what is exported.
function(sim_web_module name small)
  add_executable(web_${name} ${ARGN} web/charconv.cpp web/platform.cpp)
  target_link_libraries(web_${name} PRIVATE simverbs)
  target_link_options(web_${name} PRIVATE -O0 -sMODULARIZE=1 -sEXPORT_NAME=makeSim -sINVOKE_RUN=0
    -sALLOW_MEMORY_GROWTH=1 -sINITIAL_MEMORY=33554432 -sMAXIMUM_MEMORY=2147483648
    -sTOTAL_STACK=4194304 -sFORCE_FILESYSTEM=1
    "SHELL:--embed-file ${PROJECT_SOURCE_DIR}/scripts@/sim/share/sim")
  set_target_properties(web_${name} PROPERTIES OUTPUT_NAME ${name} SUFFIX .js
    RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR} LINK_DEPENDS ${web}/sites.mjs)
  set(file ${PROJECT_BINARY_DIR}/${name})
  if(small)
    add_custom_command(TARGET web_${name} POST_BUILD COMMAND ${WASM_OPT} -Oz --enable-simd
      --enable-exception-handling --enable-bulk-memory --enable-sign-ext
      --enable-nontrapping-float-to-int --enable-mutable-globals ${file}.wasm -o ${file}.wasm VERBATIM)
  endif()
  add_custom_command(TARGET web_${name} POST_BUILD
    COMMAND ${NODE} ${web}/sites.mjs ${file}.wasm ${file}.sites VERBATIM)
endfunction()
set(exports _malloc,_free,_sim_fma_doubles,_sim_fma_floats)

sim_web_module(kernel FALSE sim.cpp)
target_link_options(web_kernel PRIVATE -sENVIRONMENT=node -lnodefs.js
  -sEXPORTED_RUNTIME_METHODS=callMain,FS,ENV,NODEFS -sEXPORTED_FUNCTIONS=_main,${exports})

sim_web_module(page TRUE web/exports.cpp)
target_link_options(web_page PRIVATE --no-entry -sENVIRONMENT=worker
  -sEXPORTED_RUNTIME_METHODS=ccall,FS -sEXPORTED_FUNCTIONS=${exports})
# Nothing on a page writes files or starts studies that are plugins. The linker takes this list before
# that of all plugins, and leaves out what no plugin on it needs.
get_target_property(page_plugins simplugins SIM_LINKED_PLUGINS)
list(FILTER page_plugins EXCLUDE REGEX "^(writers|studies)_")
sim_list_plugins(web_page ${page_plugins})

# The module that a page unpacks its kernel with.
add_executable(web_unpack web/unpack.cpp)
target_compile_options(web_unpack PRIVATE -fno-exceptions -fno-rtti)
target_link_options(web_unpack PRIVATE -O2 --no-entry -sSTANDALONE_WASM -sALLOW_MEMORY_GROWTH=1
  -sTOTAL_STACK=65536 -sEXPORTED_FUNCTIONS=_unpack_room,_unpack_begin,_unpack_more)
set_target_properties(web_unpack PROPERTIES OUTPUT_NAME unpack SUFFIX .wasm
  RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})

# The script that node starts, and the page without a scene.
set(beside sim.mjs load.mjs bundle.mjs worker.js page.js page.css page.html
  address.js)
list(TRANSFORM beside PREPEND ${web}/)
add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/page.html
  COMMAND ${CMAKE_COMMAND} -E copy ${web}/sim.mjs ${web}/load.mjs ${PROJECT_BINARY_DIR}
  COMMAND ${NODE} ${web}/bundle.mjs ${web} ${PROJECT_BINARY_DIR}
  DEPENDS web_page web_kernel web_unpack ${beside} VERBATIM)
add_custom_target(sim_web ALL DEPENDS ${PROJECT_BINARY_DIR}/page.html)
