#!/usr/bin/env bash
# Configures and builds one preset of CMakePresets.json; says how long it may take and how far it is. All that CMake and the
# compiler say stays in build.log of the preset's folder.
# usage: jobs/build.sh PRESET [-DOPTION=VALUE]...
set -euo pipefail
cd "$(dirname "$0")/.."
preset=$1
shift
folder=build
if [ "$preset" != release ]; then folder=build-$preset; fi
first=true
if [ -e "$folder/build.ninja" ]; then first=false; fi
mkdir -p "$folder"
log=$folder/build.log
seconds_a_step=3  # of one core, measured
report_s=30

echo "configuring $folder (preset $preset), log in $log"
cmake --preset "$preset" "$@" > "$log" 2>&1 || { tail -30 "$log" >&2; exit 1; }
if ! $first; then
  echo "building what has changed"
else
  steps=$(ninja -C "$folder" -t commands | wc -l)
  echo "building: $steps steps, about $(((steps * seconds_a_step / $(nproc) + 59) / 60)) min on $(nproc) idle cores"
fi
cmake --build --preset "$preset" --parallel "$(nproc)" >> "$log" 2>&1 &
build=$!
trap 'kill "$build" 2> /dev/null || true' EXIT
shown=$SECONDS
while kill -0 "$build" 2> /dev/null; do
  sleep 0.5
  if ((SECONDS - shown < report_s)); then continue; fi
  shown=$SECONDS
  echo "building: $(grep -o '^\[[0-9]*/[0-9]*\]' "$log" | tail -1 | tr -d '[]')"
done
wait "$build" || { grep -E -A5 'error|FAILED' "$log" | head -40 >&2; exit 1; }
