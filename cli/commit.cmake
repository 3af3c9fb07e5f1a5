# Writes OUTPUT, a header that defines SIM_COMMIT: the commit SOURCE is at, "+" behind it when the
# tree was changed since, or "unknown" without git.
set(commit "unknown")
if(GIT)
  execute_process(COMMAND ${GIT} -C ${SOURCE} describe --always --dirty=+ --abbrev=12
    OUTPUT_VARIABLE answer RESULT_VARIABLE failed ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT failed AND NOT "${answer}" STREQUAL "")
    set(commit "${answer}")
  endif()
endif()
set(text "#pragma once\n#define SIM_COMMIT \"${commit}\"\n")
set(before "")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} before)
endif()
if(NOT "${text}" STREQUAL "${before}")
  file(WRITE ${OUTPUT} "${text}")
endif()
