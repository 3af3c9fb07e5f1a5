#!/usr/bin/env bash
# Counts the instructions of a spring evaluation with valgrind: the 32 x 32 cloth under rk4 on AVX2,
# 200 steps less 0 steps. Fails above the bound, exits with 77 where the count cannot be taken.
# usage: instructions.sh PATH/TO/sim
set -euo pipefail

# Instructions a spring evaluation: 31.1 measured with g++ 12 -O3, and 15 % more.
readonly bound=36.0
readonly steps=200 springs=5826 evaluations=4

sim=$1
skip() { echo "skipped: $1"; exit 77; }
command -v valgrind >/dev/null || skip 'no valgrind'
grep -qw avx2 /proc/cpuinfo || skip 'no AVX2'

# Instructions of a whole run of $1 steps.
count() {
  local words
  words=$(SIM_SIMD=avx2 valgrind --tool=callgrind --callgrind-out-file=/dev/null \
    "$sim" scenes/cloth.lua rk4 0.001 -s n=32 -n "$1" -q 2>&1 >/dev/null) ||
    { printf '%s\nerror: %s failed under valgrind\n' "$words" "$sim" >&2; exit 1; }
  sed -n 's/^==[0-9]*== Collected *: *\([0-9]*\).*/\1/p' <<<"$words"
}

with=$(count "$steps")
without=$(count 0)
awk -v total="$((with - without))" -v work="$((steps * springs * evaluations))" -v bound="$bound" '
  BEGIN {
    each = total / work
    printf "%.2f instructions a spring evaluation, bound %.2f\n", each, bound
    exit !(each > 0 && each <= bound)
  }'
