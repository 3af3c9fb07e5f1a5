#!/usr/bin/env bash
# Runs scenes and methods with two programs, the second one for another kind of processor, and
# compares the hashes of the states. Fails where two differ.
# usage: same_bits.sh PATH/TO/sim PATH/TO/other/sim [EMULATOR]
set -euo pipefail

scenes=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../../scripts/scenes" && pwd)
wrong=0 runs=0

# The hashes of a run: of each system of a world.
hashes() { "$@" --no-verify 2>&1 | grep '^hash' || true; }

compare() {
  local here there
  here=$(hashes "$sim" "$@")
  there=$(hashes ${emulator:+"$emulator"} "$other" "$@")
  runs=$((runs + 1))
  [[ -n $here && $here == "$there" ]] && return
  echo "differs: $*: '$here', '$there'" >&2
  wrong=$((wrong + 1))
}

sim=$1 other=$2 emulator=${3:-}
for scene in "$scenes"/*.lua; do compare "$scene" -n 5; done
for method in euler trapezoid rk4 dopri5 symplectic_euler verlet pefrl implicit_euler \
  implicit_midpoint imex trbdf2 bdf2 projective_dynamics; do
  compare "$scenes/cloth.lua" "$method" 1e-4 -s n=17 -n 20
done
for method in rk4 verlet; do
  compare "$scenes/cloth.lua" -i "$method:precision=single" -d 0.001 -s n=17 -n 50
  compare "$scenes/cloth.lua" "$method" 0.0005 -s n=96 -n 5 -j 2
done
compare "$scenes/cloth.lua"
echo "$((runs - wrong)) of $runs runs have the same bits"
((wrong == 0))
