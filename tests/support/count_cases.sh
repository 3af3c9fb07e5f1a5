#!/usr/bin/env bash
# Counts the test cases in a log of ctest, names those that were skipped, and says what they need.
# usage: count_cases.sh LastTest.log
set -euo pipefail
[[ -f ${1:-} ]] || exit 0
# A test that tells no cases is one; so is the failure of a test that says none of its cases failed.
awk '
  /^[0-9]+\/[0-9]+ Test: / { test = $3; told = own_failed = 0; needs = "" }
  /^skipped: / {
    needs = substr($0, 10)
    print "skipped: " test ": " needs
    if (match(needs, /\(Debian: [^)]*\)$/)) {
      count = split(substr(needs, RSTART + 9, RLENGTH - 10), names, " ")
      for (i = 1; i <= count; ++i)
        if (!(names[i] in wanted)) { wanted[names[i]]; packages = packages " " names[i] }
    }
  }
  /^cases: [0-9]+ passed, [0-9]+ failed, [0-9]+ skipped$/ {
    passed += $2; failed += $4; skipped += $6
    told = 1; own_failed = $4
  }
  /^Test (Passed|Failed)\.$/ {
    if ($2 == "Failed." && !own_failed && !(needs != "" && !told)) own_failed = ++failed
    else if (!told) needs != "" ? ++skipped : ++passed
  }
  END {
    if (packages != "") print "for what was skipped: apt-get install --no-install-recommends" packages
    printf "%d passed, %d failed, %d skipped\n", passed, failed, skipped
  }
' "$1"
