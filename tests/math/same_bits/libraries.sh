#!/usr/bin/env bash
# The elementary functions with other libraries of C and other processors have the bits that they have
# here. usage: libraries.sh PROGRAM SOURCE COMPILER, the digest as it was built, and what it is of
set -euo pipefail
program=$1 source=$2 compiler=$3
place=$(mktemp -d)
trap 'rm -rf -- "$place"' EXIT
known=bff16e99e7951a1c
files=("$source/tests/math/same_bits/digest.cpp" "$source/core/math/elementary.cpp")
flags=(-std=c++20 -O2 -ffp-contract=off -I"$source")
tried=0

compare() {
  local name=$1 found=$2
  [[ $found == "$known" ]] || { echo "$name: $found instead of $known"; exit 1; }
  echo "$name: $found"
}

compare 'as built' "$("$program")"

# musl has no C++ library of its own; what the objects ask for is C alone.
if command -v musl-gcc >/dev/null; then
  for file in "${files[@]}"; do
    "$compiler" "${flags[@]}" -U_FORTIFY_SOURCE -fno-exceptions -fno-stack-protector -c "$file" \
      -o "$place/$(basename "$file").o"
  done
  musl-gcc -static "$place"/*.o -o "$place/digest"
  compare musl "$("$place/digest")"
  ((++tried))
fi
if command -v em++ >/dev/null && command -v node >/dev/null &&
  em++ "${flags[@]}" -O1 "${files[@]}" -o "$place/digest.js" 2>"$place/log"; then
  compare 'WebAssembly (musl)' "$(node --no-experimental-fetch "$place/digest.js")"
  ((++tried))
fi
if command -v aarch64-linux-gnu-g++ >/dev/null && command -v qemu-aarch64 >/dev/null; then
  aarch64-linux-gnu-g++ "${flags[@]}" -static "${files[@]}" -o "$place/digest"
  compare ARM "$(qemu-aarch64 "$place/digest")"
  ((++tried))
fi
((tried > 0)) || { echo 'skipped: needs musl-gcc (Debian: musl-tools), emscripten or an ARM compiler'; exit 77; }
