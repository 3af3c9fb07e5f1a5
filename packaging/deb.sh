#!/usr/bin/env bash
# deb.sh FOLDER [--once] [--no-web]: the packages of Debian in FOLDER/packages, made and checked in
# clean roots of this machine's release: built in two folders at two dates, which gives the same
# bytes; lintian; then installed into a fresh root, where debian/tests run.
#   --once    one build, nothing to compare with
#   --no-web  without sim-web: no emscripten, half the time
# Runs as root; needs debootstrap and a mirror. With --once, ccache in /var/cache/ccache is used; it
# leaves traces in debug information, and two builds are to be independent.
set -euo pipefail
folder=$1
shift
root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)
once='' profiles='' options=''
for word in "$@"; do
  case $word in
    --once) once=1 ;;
    --no-web) profiles=pkg.sim.noweb ;;
  esac
done
say() { printf 'deb: %s\n' "$*" >&2; }
fail() { say "error: $1" && exit "${2:-1}"; }

((EUID == 0)) || fail 'run it as root: it makes clean roots with debootstrap' 5
command -v debootstrap >/dev/null || fail 'debootstrap is missing; apt-get install debootstrap' 5
mkdir -p "$folder"
folder=$(cd -- "$folder" && pwd -P)
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
version=$(sed -nE 's/^project\(sim VERSION ([0-9.]+).*/\1/p' "$root/CMakeLists.txt")
full=$(sed -nE '1s/.*\((.*)\).*/\1/p' "$root/packaging/debian/changelog")
[[ ${full%-*} == "$version" ]] || fail "packaging/debian/changelog has $full, CMakeLists.txt $version"
export SOURCE_DATE_EPOCH
SOURCE_DATE_EPOCH=$(date +%s -d "$(sed -nE '0,/^ -- /s/^ -- .*>  //p' "$root/packaging/debian/changelog")")

# in_root ROOT COMMAND...: with /dev and /proc, which end with it, and nothing else of this machine.
in_root() {
  local place=$1
  shift
  unshare --mount --fork --pid --kill-child bash -c '
    place=$1
    shift
    mount --bind /dev "$place/dev" && mount -t proc proc "$place/proc" || exit
    if [[ -d /var/cache/ccache && -d $place/ccache ]]; then
      mount --bind /var/cache/ccache "$place/ccache" || exit
    fi
    exec chroot "$place" /usr/bin/env -i PATH=/usr/lib/ccache:/usr/sbin:/usr/bin:/sbin:/bin \
      HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive CC=gcc CXX=g++ \
      CCACHE_DIR=/ccache CCACHE_SLOPPINESS=pch_defines,time_macros "$@"
  ' _ "$place" "$@" </dev/null
}
apt=(apt-get -qq -y --no-install-recommends)

# logged NAME COMMAND...: the output is shown only where the command fails.
logged() {
  local log=$folder/$1.log
  shift
  "$@" >"$log" 2>&1 || { tail -n 40 "$log" | cut -c1-300 >&2 && fail "$log has all of it"; }
}

if [[ ! -f $folder/base/done ]]; then
  say "a root of $suite"
  rm -rf "$folder/base"
  logged base debootstrap --variant=minbase "$suite" "$folder/base"
  cp /etc/resolv.conf "$folder/base/etc"
  touch "$folder/base/done"
fi

say "the source archive, sim_$version.orig.tar.gz"
work=$folder/source
rm -rf "$work" && mkdir -p "$work"
# archive NAME FOLDER: from the names on standard input, the same bytes whenever it is made.
archive() {
  LC_ALL=C sort -z | tar -C "$2" --no-recursion --mtime="@$SOURCE_DATE_EPOCH" \
    --owner=0 --group=0 --numeric-owner --mode=go=rX,u+rw --format=ustar --transform="s#^#$3/#" \
    -c --null --files-from=- |
    gzip -9n >"$work/$1"
}
(
  cd "$root"
  if [[ -e .git ]]; then git ls-files -z; else find . -path ./build -prune -o -type f -printf '%P\0'; fi
) | grep -zv '^packaging/debian/' | archive "sim_$version.orig.tar.gz" "$root" "sim-$version"
if [[ -z $profiles ]]; then
  for component in lua zlib; do
    sources=$root/build/web/sources/$component
    [[ -d $sources ]] || fail "no $sources; run ./dev web first, or give --no-web" 5
    (cd "$sources" && find . -path ./debian -prune -o -path ./.pc -prune -o -type f -printf '%P\0') |
      archive "sim_$version.orig-$component.tar.gz" "$sources" "$component"
  done
fi

caching=CCACHE_DISABLE=1
[[ -z $once ]] || caching=CCACHE_DIR=/ccache
builder=$folder/builder
if [[ ! -f $builder/done || $root/packaging/debian/control -nt $builder/done || $profiles != "$(<"$builder/done")" ]]; then
  say 'a root with what the build needs'
  rm -rf "$builder"
  cp -a "$folder/base" "$builder"
  mkdir -p "$builder/ccache" "$builder/control/debian"
  cp "$root/packaging/debian/control" "$builder/control/debian"
  options=${profiles:+-P $profiles}
  # shellcheck disable=SC2086
  logged builder in_root "$builder" "${apt[@]}" $options build-dep /control
  logged tools in_root "$builder" "${apt[@]}" install build-essential ccache faketime lintian
  printf '%s\n' "$profiles" >"$builder/done"
fi

# build_in FOLDER COMMAND...: source and packages in this folder of the builder's root.
build_in() {
  local place=$1 tree=$1/sim-$version component
  shift
  rm -rf "${builder:?}$place" && mkdir -p "$builder$tree"
  cp "$work"/*.tar.gz "$builder$place"
  tar -xzf "$work/sim_$version.orig.tar.gz" -C "$builder$place"
  for component in lua zlib; do
    [[ ! -f $work/sim_$version.orig-$component.tar.gz ]] ||
      tar -xzf "$work/sim_$version.orig-$component.tar.gz" -C "$builder$tree"
  done
  cp -a "$root/packaging/debian" "$builder$tree"
  in_root "$builder" /usr/bin/env -C "$tree" "$caching" "$@" dpkg-buildpackage --no-sign \
    ${profiles:+"-P$profiles"}
}
say 'builds'
logged build build_in /build/first
packages=$folder/packages
rm -rf "$packages" && mkdir -p "$packages"
find "$builder/build/first" -maxdepth 1 -type f -exec cp -t "$packages" {} +
say 'lintian'
# The copyright of components that are not there is not wrong without sim-web.
in_root "$builder" /usr/bin/env -C /build/first lintian --allow-root --fail-on error,warning \
  --suppress-tags "${profiles:+superfluous-file-pattern}" \
  "sim_${full}_$(dpkg --print-architecture).changes" >&2 || fail 'lintian complains'

if [[ -z $once ]]; then
  say 'builds again, elsewhere and a year later'
  logged again build_in /somewhere/else/second faketime -f +365d
  for file in "$builder"/somewhere/else/second/*.deb; do
    cmp "$file" "$packages/$(basename "$file")" || fail "two builds differ: $(basename "$file")"
  done
fi

say 'installs into a fresh root, and runs debian/tests'
fresh=$folder/fresh
rm -rf "$fresh"
cp -a "$folder/base" "$fresh"
mkdir "$fresh/packages" "$fresh/source"
cp "$packages"/*.deb "$fresh/packages"
tar -xzf "$work/sim_$version.orig.tar.gz" -C "$fresh/source" --strip-components=1
cp -a "$root/packaging/debian" "$fresh/source"
logged install in_root "$fresh" sh -c 'apt-get -qq update; apt-get -qq -y --no-install-recommends install \
  $(ls /packages/*.deb | grep -v dbgsym) g++ cmake make pkg-config'
for name in $(sed -nE 's/^Tests: //p' "$root/packaging/debian/tests/control"); do
  [[ $name != page || -z $profiles ]] || continue
  logged "test-$name" in_root "$fresh" setpriv --reuid=65534 --clear-groups /usr/bin/env \
    -C /source HOME=/tmp sh -c "mkdir /tmp/$name && AUTOPKGTEST_TMP=/tmp/$name debian/tests/$name"
  say "debian/tests/$name passes"
done
say "$packages has them"
