#!/usr/bin/env bash
# The benchmark of Niederer et al. 2011 on grids of 0.5, 0.2 and 0.1 mm, or those named: table and plot in tests/results/.
# 0.05 mm (3.4 million cells) is for GPUs. Spacings that are not named keep the results they have.
# usage: jobs/niederer.sh [SPACING]...    COHORT names a program that is built already, DEVICE is cpu or gpu, PYTHON has h5py
set -euo pipefail
cd "$(dirname "$0")/.."
if [ -z "${COHORT:-}" ]; then
  ./jobs/setup.sh
  ./jobs/build.sh release -DCOHORT_TESTS=OFF
fi
[ $# -gt 0 ] || set -- 0.5 0.2 0.1
"${PYTHON:-/usr/bin/python3}" -m analysis.niederer "$@" --cohort "${COHORT:-build/cohort}" ${DEVICE:+--device "$DEVICE"}
