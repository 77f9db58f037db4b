#!/usr/bin/env bash
# The benchmark of Niederer et al. 2011 on grids of 0.5, 0.2 and 0.1 mm, or those named: table and plot in a folder.
# 0.05 mm (3.4 million cells) is for GPUs. Spacings that are not named keep the results the folder has.
# usage: jobs/niederer.sh [--results FOLDER] [SPACING]...    FOLDER is ./niederer-results unless given
#        COHORT names a program that is built already, DEVICE is cpu or gpu, PYTHON has h5py
set -euo pipefail
results=niederer-results
if [ "${1:-}" = --results ]; then
  results=${2:?--results needs a folder}
  shift 2
fi
results=$(realpath -m "$results")
cohort=$(realpath -m "${COHORT:-$(dirname "$0")/../build/cohort}")
cd "$(dirname "$0")/.."
if [ -z "${COHORT:-}" ]; then
  ./jobs/setup.sh
  ./jobs/build.sh release -DCOHORT_TESTS=OFF
fi
[ $# -gt 0 ] || set -- 0.5 0.2 0.1
"${PYTHON:-/usr/bin/python3}" -m analysis.niederer "$@" --results "$(realpath --relative-base=. "$results")" --cohort "$cohort" ${DEVICE:+--device "$DEVICE"}
