#!/usr/bin/env bash
# AddressSanitizer, LeakSanitizer and UndefinedBehaviorSanitizer over the unit and robustness tests.
# usage: tests/sanitise.sh [further arguments of ctest]
set -euo pipefail
cd "$(dirname "$0")/.."
./jobs/setup.sh
./jobs/build.sh sanitise
export LSAN_OPTIONS="suppressions=$PWD/tests/leaks.supp:print_suppressions=0"
# Frame pointers end where a library has none; then a leak could not be told from one of ours.
export ASAN_OPTIONS=fast_unwind_on_malloc=0
export UBSAN_OPTIONS=print_stacktrace=1
ctest --test-dir build-sanitise --output-on-failure --no-tests=error --label-regex 'unit|robustness' --label-exclude slow "$@"
