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
place=$(mktemp -d)
trap 'rm -rf -- "$place"' EXIT
# The symbols of the library; and the layouts of its structures, from a program that uses all.
write_facts() {
  abidw --no-corpus-path --no-comp-dir-path --no-architecture --out-file "$2" "$1" 2>/dev/null
}
write_facts "$library" "$place/symbols.abi"
cc -std=c99 -g -fPIC -shared -ffile-prefix-map="$here=." -I"$here/../../core/c" "$here/layout.c" \
  -Wl,-soname,layout.so -o "$place/layout.so"
write_facts "$place/layout.so" "$place/layout.abi"
layouts=$here/sim-1.0-layout.abi
if [[ ${2:-} == --write ]]; then
  cp "$place/symbols.abi" "$release"
  cp "$place/layout.abi" "$layouts"
  exit
fi
# The options say their own size: members may be added at their end.
printf '[suppress_type]\nname = sim_options\nhas_data_member_inserted_at = end\n' >"$place/allowed"
abidiff --no-added-syms "$release" "$place/symbols.abi" || { echo 'programs of 1.0 may not run'; exit 1; }
abidiff --suppressions "$place/allowed" "$layouts" "$place/layout.abi" ||
  { echo 'structures of 1.0 have another layout'; exit 1; }
echo 'symbols and structures are as in the last release'
