#!/usr/bin/env bash
# Makes the Debian package of a build, unpacks it into a folder, and runs it from there.
# usage: package.sh BUILD SOURCE
set -euo pipefail

build=$1 source=$2
fail() { echo "package: $1" >&2; exit 1; }
command -v dpkg-shlibdeps >/dev/null || { echo 'skipped: needs dpkg-shlibdeps (Debian: dpkg-dev)'; exit 77; }
nm -D "$build/bin/sim" | grep -q __asan_init && { echo 'skipped: needs a build without sanitizers'; exit 77; }

place=$(mktemp -d)
trap 'rm -rf -- "$place"' EXIT
cd "$place"
cpack --config "$build/CPackConfig.cmake" -G DEB >cpack.log 2>&1 || { cat cpack.log; exit 1; }
dpkg-deb -x sim_*.deb root
for library in libc6 libstdc++6 zlib1g; do
  dpkg-deb -f sim_*.deb Depends | grep -qF "$library " || fail "it does not depend on $library"
done

found=$(env -i HOME="$place" root/usr/bin/sim doctor) || fail 'sim doctor does not find its parts'
grep -q "$place/root/usr/lib/sim/plugins" <<<"$found" || fail "other plugins: $found"
! grep -q "$source" <<<"$found" || fail "it looks into the source tree: $found"
hash() { env -i HOME="$place" "$1" --steps 10 --json --quiet | grep -o '"hash":"[^"]*"'; }
[[ $(hash root/usr/bin/sim) == "$(hash "$build/bin/sim")" ]] || fail 'it gives other bits'
