#!/usr/bin/env bash
# Writes tests/reference/footprint.csv: what each scene of configs/ takes of a CPU device (PoCL), shrunk as tests/unit/footprint.cpp does.
# kernels: in the programs that are built; launched: of these; bytes: at the peak; launches: of a whole member. Run it when a scene needs more, and say why in the commit.
# usage: tests/reference/make_footprint.sh [build folder, build unless given]
set -euo pipefail
cd "$(dirname "$0")/../.."
table=tests/reference/footprint.csv
rows=$("${1:-build}/tests/footprint" 2> /dev/null | sed -n 's/^row //p' || true)
[ -n "$rows" ] || { echo "no rows: is build/tests/footprint there?" >&2; exit 1; }
{
  echo "scene,kernels,launched,programs,launches_per_step,bytes,launches"
  echo "$rows"
} > "$table"
wc -l "$table"
