// Symbols that Lua, whose archive is linked into this library, takes from here instead of from the
// C library (--wrap of the linker, see CMakeLists.txt).
#include <cstdio>

#include "core/math/elementary.h"

#define SIM_INSIDE __attribute__((visibility("hidden")))

extern "C" {

// The operator `^`, with the same bits on every machine.
SIM_INSIDE double __wrap_pow(double x, double y) { return sim::elementary::pow(x, y); }

#ifdef SIM_LUA_STREAMS
// The archive names the streams of C as programs may and libraries may not.
extern FILE *__real_stdin, *__real_stdout, *__real_stderr;
SIM_INSIDE FILE* __wrap_stdin = __real_stdin;
SIM_INSIDE FILE* __wrap_stdout = __real_stdout;
SIM_INSIDE FILE* __wrap_stderr = __real_stderr;
#endif
}
