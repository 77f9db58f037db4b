#!/usr/bin/env bash
# Configures and builds one preset of CMakePresets.json; prints nothing unless it fails.
# usage: jobs/build.sh PRESET [-DOPTION=VALUE]...
set -euo pipefail
cd "$(dirname "$0")/.."
preset=$1
shift
log=$(mktemp)
trap 'rm -f "$log"' EXIT
echo "building (preset $preset)"
cmake --preset "$preset" "$@" > "$log" 2>&1 || { tail -30 "$log" >&2; exit 1; }
cmake --build --preset "$preset" --parallel "$(nproc)" > "$log" 2>&1 || { grep -E -A5 'error|FAILED' "$log" | head -40 >&2; exit 1; }
