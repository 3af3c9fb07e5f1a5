#!/usr/bin/env bash
# The library exports the listed symbols and no other, under its soname, and programs compiled
# against the last release still run, by abidiff (Debian: abigail-tools). `abi.sh LIBRARY [--write]`;
# the latter writes the file of a release.
set -euo pipefail
library=$1
here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P)
release=$here/sim-1.0.abi

objdump -p "$library" | grep -q 'SONAME *libsim.so.1$' || { echo 'the soname is another'; exit 1; }
listed=$(grep -o 'sim_[a-z_]*' "$here/../../core/c/sim.map" | sort)
declared=$(sed -n 's/^[a-z].*[ *]\(sim_[a-z_]*\)(.*/\1/p' "$here/../../core/c/sim.h" | sort)
exported=$(nm -D --defined-only "$library" | awk '$2 != "A" { sub("@.*", "", $3); print $3 }' | sort)
diff <(echo "$listed") <(echo "$exported") || { echo 'exported are others than listed'; exit 1; }
diff <(echo "$listed") <(echo "$declared") || { echo 'declared are others than listed'; exit 1; }
echo "$(wc -l <<<"$exported") symbols are exported, as listed and declared"

if ! command -v abidiff >/dev/null; then
  echo 'skipped: needs abidiff (Debian: abigail-tools)'
  exit 77
fi
facts=$(mktemp)
trap 'rm -f "$facts"' EXIT
# Structures are checked by tests/c/interface.c: a release build has no debug information.
abidw --no-corpus-path --no-comp-dir-path --no-architecture --out-file "$facts" "$library" 2>/dev/null
if [[ ${2:-} == --write ]]; then
  cp "$facts" "$release"
  exit
fi
abidiff --no-added-syms "$release" "$facts" || { echo 'programs of 1.0 may not run'; exit 1; }
echo 'as the last release'
