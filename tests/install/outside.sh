#!/usr/bin/env bash
# Installs a build into a folder, moves the folder, and makes a plugin against it outside the tree,
# and a program on the kernel alone: with find_package(sim), and with the flags of pkg-config. The
# plugins have to run in the installed program; plugins and programs have to give the same bits.
# usage: outside.sh BUILD SOURCE CMAKE CXX
set -euo pipefail

build=$1 source=$2 cmake=$3 cxx=$4
fail() { echo "outside: $1" >&2; exit 1; }
nm -D "$build/bin/sim" | grep -q __asan_init && { echo 'skipped: needs a build without sanitizers'; exit 77; }

place=$(mktemp -d)
trap 'rm -rf -- "$place"' EXIT
cd "$place"
unset SIM_PATH SIM_PLUGIN_PATH
"$cmake" --install "$build" --prefix "$place/first" >install.log || { cat install.log; exit 1; }
mv first prefix
sim=$place/prefix/bin/sim

# The program lives on what is beside it: its scenes, its plugins.
found=$("$sim" doctor) || fail 'sim doctor does not find its parts'
grep -q "$place/prefix/lib/sim/plugins" <<<"$found" || fail "other plugins: $found"
grep -q "$place/prefix/share/sim" <<<"$found" || fail "other scenes: $found"
! grep -q "$source" <<<"$found" || fail "it looks into the source tree: $found"

cp -r "$source/tests/install/attraction" .
cp "$source/tests/plugin/fixtures/attraction.cpp" attraction/
orbit() { "$sim" "$place/attraction/orbit.lua" --load "$1" --quiet --json | grep -o '"hash":"[^"]*"'; }

"$cmake" -S attraction -B by-cmake -DCMAKE_PREFIX_PATH="$place/prefix" -DCMAKE_CXX_COMPILER="$cxx" \
  >cmake.log || { cat cmake.log; exit 1; }
"$cmake" --build by-cmake >>cmake.log || { cat cmake.log; exit 1; }
by_cmake=$(orbit by-cmake/attraction.so) || fail 'the plugin of find_package(sim) does not run'

# Each physics is a folder: a copy of it outside the tree takes the place of the built-in one, keeps
# what its kind promises, and gives the same bits.
declare -A scenes=([expression]=double_well [fluid]=dam [wind]=flag [fem]=beam
  [surfaces]=folded [bodies]=stack [pair]=gas)
mkdir physics
cat >physics/CMakeLists.txt <<'END'
cmake_minimum_required(VERSION 3.25)
project(physics LANGUAGES CXX)
find_package(sim 0.2 REQUIRED)
file(GLOB folders LIST_DIRECTORIES true ${CMAKE_SOURCE_DIR}/*/)
foreach(folder ${folders})
  get_filename_component(name ${folder} NAME)
  if(IS_DIRECTORY ${folder})
    sim_add_plugin(${name} ${folder})
  endif()
endforeach()
END
for folder in "$source"/plugins/{forces,contact}/*/; do cp -r "$folder" physics/; done
"$cmake" -S physics -B by-folder -DCMAKE_PREFIX_PATH="$place/prefix" \
  -DCMAKE_CXX_COMPILER="$cxx" >folder.log || { cat folder.log; exit 1; }
"$cmake" --build by-folder >>folder.log || { cat folder.log; exit 1; }
hash_of() { "$sim" "$@" --steps 20 --quiet --json | grep -o '"hash":"[^"]*"'; }
for folder in physics/*/; do
  name=$(basename "$folder")
  [[ -n ${scenes[$name]-} ]] || fail "name a scene of the physics $name above"
  built_in=$(find prefix/lib/sim/plugins -name "$name.so")
  ours=$(hash_of "scenes/${scenes[$name]}.lua") || fail "${scenes[$name]}.lua does not run"
  mv "$built_in" "$name.built-in"
  "$sim" test "by-folder/$name.so" >test.log || { cat test.log; fail "sim test $name.so"; }
  copied=$(hash_of "scenes/${scenes[$name]}.lua" --load "by-folder/$name.so") ||
    fail "${scenes[$name]}.lua does not run with a copy of $folder"
  mv "$name.built-in" "$built_in"
  [[ $ours == "$copied" ]] || fail "two results of $name: $ours, $copied"
done

command -v pkg-config >/dev/null || { echo 'pkg-config is not here'; exit 0; }
export PKG_CONFIG_PATH=$place/prefix/lib/pkgconfig
# shellcheck disable=SC2046
"$cxx" -O2 -shared -fPIC attraction/attraction.cpp -o attraction.so $(pkg-config --cflags --libs sim)
by_hand=$(orbit attraction.so) || fail 'the plugin of pkg-config does not run'
[[ $by_cmake == "$by_hand" ]] || fail "two results: $by_cmake, $by_hand"

# The program of core/README.md: as scenes/cloth.lua, without the laboratory and without Lua.
"$cmake" -S "$source/tests/install/program" -B program -DCMAKE_PREFIX_PATH="$place/prefix" \
  -DCMAKE_CXX_COMPILER="$cxx" >cmake.log || { cat cmake.log; exit 1; }
"$cmake" --build program >>cmake.log || { cat cmake.log; exit 1; }
# shellcheck disable=SC2046
"$cxx" "$source/tests/install/program/cloth.cpp" -o cloth -Wl,-rpath,"$place/prefix/lib/sim" \
  $(pkg-config --cflags --libs sim)
wanted=$("$sim" scenes/cloth.lua --quiet --json | sed -n 's/.*"hash":"\([^"]*\)".*/\1/p')
for program in program/cloth ./cloth; do
  said=$("$program" "$place/prefix/lib/sim/plugins") || fail "$program does not run"
  [[ $said == *"hash $wanted" ]] || fail "$program says '$said', the scene has hash $wanted"
  LD_DEBUG=libs "$program" "$place/prefix/lib/sim/plugins" 2>libraries >/dev/null
  grep -q libsimkernel libraries || fail 'the libraries of the program are not known'
  ! grep -E 'find library=lib(simlab|lua)' libraries || fail "$program needs the laboratory"
done

# A program in C over libsim.
cat >cloth.c <<'END'
#include <inttypes.h>
#include <stdio.h>

#include <sim.h>

int main(void) {
  sim_error error;
  sim_scene* scene = sim_open("scenes/cloth.lua", 0, &error);
  if (!scene || sim_step(scene, 400, 0, &error) != SIM_OK) return puts(error.what), 1;
  printf("hash %016" PRIx64 "\n", sim_hash(scene, 0));
  sim_close(scene);
  return 0;
}
END
# shellcheck disable=SC2046
cc cloth.c -o cloth-c $(pkg-config --cflags --libs libsim) -Wl,-rpath,"$place/prefix/lib"
said=$(./cloth-c) || fail "the program in C does not run: $said"
[[ $said == "hash $wanted" ]] || fail "the program in C says '$said', the scene has hash $wanted"
[[ -s prefix/lib/sim/luacats/sim.lua ]] || fail 'the types for editors are not installed'

# Public headers are there with all that they include, and no others are.
# Headers of kernels are read in one alone.
grep -v '^core/simd/' "$source/core/public_headers.txt" | sed 's/.*/#include "&"/' >public.cpp
# shellcheck disable=SC2046
"$cxx" -std=c++20 -fsyntax-only public.cpp $(pkg-config --cflags sim) 2>public.log ||
  { cat public.log; fail 'public headers do not compile'; }
for header in $(cd prefix/include/sim && find core -name '*.h'); do
  grep -qx "$header" "$source/core/public_headers.txt" ||
    grep -rq "#include \"$header\"" prefix/include/sim || fail "$header is installed, but not public"
done
[[ ! -e prefix/include/sim/core/lua ]] || fail 'the scene language is installed'
