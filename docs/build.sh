#!/usr/bin/env bash
# build.sh BIN FOLDER: the site in FOLDER/html, from docs/ and from what the programs say of
# themselves; its scenes run where ./dev web has built the kernel. A warning of Sphinx is an error.
set -euo pipefail
bin=$1 folder=$2
docs=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P)
root=$docs/..
pages=$folder/pages
rm -rf "$pages" "$folder/html"
mkdir -p "$pages/pictures" "$pages/_static" "$folder/html"
cp "$docs"/*.md "$docs"/*.svg "$docs/conf.py" "$pages"
cp "$docs/site.css" "$pages/_static"
cp "$root"/tests/pictures/*.{png,svg} "$pages/pictures"
cp "$root/plugins/README.md" "$pages/plugin-guide.md"
cp "$root/core/README.md" "$pages/kernel.md"
cp "$root/tests/bench/RESULTS.md" "$pages/results.md"
cp "$root/CHANGELOG.md" "$pages/changelog.md"
cp "$root/CONTRIBUTING.md" "$pages/contributing.md"
cp "$root/SECURITY.md" "$pages/security.md"

# Links between files of the tree become links between pages.
sed -i -E \
  -e 's#\]\((\.\./)*tests/pictures/#](pictures/#g' \
  -e 's#\]\((\.\./)*(tests/bench/)?RESULTS\.md#](results.md#g' \
  -e 's#\]\((\.\./)*plugins/README\.md#](plugin-guide.md#g' \
  -e 's#\]\((\.\./)*core/README\.md#](kernel.md#g' \
  -e 's~\]\(docs/~](~g' \
  -e 's#\]\((\.\./)*SECURITY\.md#](security.md#g' \
  -e 's#\]\((\.\./)*CONTRIBUTING\.md#](contributing.md#g' \
  -e 's#\[([^]]*)\]\((\.\./)*(CODE_OF_CONDUCT\.md|LICENSE)\)#`\3`#g' \
  "$pages"/*.md

# Pages that the programs write.
{
  printf '# Reference of the scene language\n\n'
  printf 'This page is made from what the program says of itself; `sim describe NAME` shows one entry in the\n'
  printf 'terminal. Units are SI, vectors are {x, y, z}, ids start at 0.\n\n'
  "$bin/sim" list --markdown
} >"$pages/reference.md"
{
  printf '# The command line\n\n## sim\n\n```text\n'
  "$bin/sim" --help
  printf '```\n\n'
  "$bin/sim" --completion fish | sed -nE 's/.*__fish_use_subcommand -a ([a-z]+) .*/\1/p' |
    while read -r verb; do
      printf '## sim %s\n\n```text\n' "$verb"
      "$bin/sim" help "$verb"
      printf '```\n\n'
    done
  printf '## simrepl\n\n```text\n'
  "$bin/simrepl" --help
  printf '```\n\n## Commands of the prompt\n\n```text\n'
  echo .help | "$bin/simrepl"
  printf '```\n'
} >"$pages/command-line.md"

# The gallery, and scenes that run.
python3 -B "$docs/live.py" "$bin/sim" "$root/scripts/scenes" "$pages" "$folder/html" \
  "$root/build/web/site"

SIM_VERSION=$("$bin/sim" --version | cut -d' ' -f2) PYTHONDONTWRITEBYTECODE=1 \
  sphinx-build -q -W --keep-going -b html -d "$folder/doctrees" "$pages" "$folder/html"

# Debian's furo lacks two steps of its build: its script imports another, which browsers refuse here,
# and its style asks the host for a file.
furo=$folder/html/_static
sed -i '/^import Gumshoe/{s/.*//;r '"$furo/scripts/gumshoe-patched.js"'
}' "$furo/scripts/furo.js"
sed -i -E 's#@import url\(/javascript/[^)]*\);##' "$furo/styles/furo.css"
