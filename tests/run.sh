#!/usr/bin/env bash
# Set-up, build, tests. usage: tests/run.sh [--all]     --all: also those labelled slow
set -euo pipefail
cd "$(dirname "$0")/.."
selection=(--label-exclude slow)
case "${1:-}" in
  "") ;;
  --all) selection=() ;;
  *) echo "usage: tests/run.sh [--all]" >&2; exit 1 ;;
esac
./jobs/setup.sh
./jobs/build.sh release -DCOHORT_TESTS=ON
ctest --test-dir build --parallel 2 --output-on-failure --no-tests=error "${selection[@]}"
