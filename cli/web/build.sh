#!/usr/bin/env bash
# build.sh FOLDER SOURCES: the modules of WebAssembly and the page in FOLDER. SOURCES holds lua/ and
# zlib/ as Debian's source packages have them. Needs emscripten, node, xz and libc++-16-dev.
set -euo pipefail
folder=$1 sources=$(cd -- "$2" && pwd -P)
root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.." && pwd -P)
! command -v ccache >/dev/null || export EM_COMPILER_WRAPPER=ccache
export NODE_PATH=/usr/share/nodejs
# Flags of the system's own compiler are not for this one.
unset CFLAGS CXXFLAGS CPPFLAGS LDFLAGS
generator='Unix Makefiles'
! command -v ninja >/dev/null || generator=Ninja
cmake -S "$root" -B "$folder" -G "$generator" \
  -DCMAKE_TOOLCHAIN_FILE=/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake \
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DSIM_TESTS=OFF \
  -DSIM_WEB_SOURCES="$sources"
cmake --build "$folder" -j "$(nproc)" --target sim_web
