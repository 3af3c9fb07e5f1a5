// The texts that `sim --help` prints before and after its options.
#pragma once

namespace sim::cli {

inline constexpr const char* kExamples =
    "Examples:\n"
    "  sim                                        a cloth falls, as its scene says\n"
    "  sim scenes/sample.lua r 0.005              three systems, RK4, steps of 5 ms\n"
    "  sim scenes/cloth.lua -s n=32 --dump=c.csv  another size, to a file\n\n"
    "Steps a scene and says how far the result can be trusted.";

inline constexpr const char* kFooter =
    "Tables\n"
    "  --dump    step,t,particle,x,y,z,vx,vy,vz; first order without v; flat states\n"
    "            step,t,component,value. A world has a first column system; where it\n"
    "            mixes orders, cells that a system lacks stay empty; a flat state has\n"
    "            its components under particle and their values under x.\n"
    "  --energy  step,t,kinetic,potential,total,work,drift in J; second order only\n"
    "  --observe step,t,NAME,..: observe = { NAME = function(s) .. end } of the scene\n"
    "  --tension step,t,constraint,a,b,tension,fx,fy,fz in N: constraints, on a; of\n"
    "            rods between a and b; then --dump has cx,cy,cz, the force on each\n"
    "  FILE ends in .csv or .jsonl; it is replaced only when the run has ended.\n"
    "Verdict\n"
    "  the last line, on standard error; in the report too where that goes elsewhere\n"
    "Environment\n"
    "  SIM_PATH         folders with scenes/, before the installed ones\n"
    "  SIM_PLUGIN_PATH  folders of plugins, after --plugin-path; then those in\n"
    "                   ~/.local/share/sim/plugins\n"
    "  SIM_LUA_BUDGET   as --lua-budget, for what that does not say\n"
    "  SIM_SIMD         sse2, fma, avx2 or avx512: not more; the same bits\n"
    "Exit codes\n"
    "  0 ok, 1 internal, 2 usage, 3 scene, 4 diverged, 5 file or environment,\n"
    "  6 checkpoint, 7 plugin, 8 a --check failed, 9 a case of a sweep failed,\n"
    "  129, 130, 143 or 152 a signal, 141 the reader of a pipe has gone\n";

}  // namespace sim::cli
