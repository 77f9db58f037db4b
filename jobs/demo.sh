#!/usr/bin/env bash
# From a fresh clone to demo.h5, demo_ecg.png and demo_pv.png: packages, build, configs/demo.yaml on two ranks on the CPU.
# Run again, it resumes what is unfinished; a finished file is left as it is.
set -euo pipefail
cd "$(dirname "$0")/.."
./jobs/setup.sh
./jobs/build.sh release -DCOHORT_TESTS=OFF

# Containers forbid the copies between processes that Open MPI tries first, and it then fills the log with that.
export OMPI_MCA_btl_vader_single_copy_mechanism=none
launcher=(mpirun --oversubscribe --bind-to none -n 2)
if [ "$(id -u)" -eq 0 ]; then launcher+=(--allow-run-as-root); fi
code=0
"${launcher[@]}" build/cohort run configs/demo.yaml --device cpu || code=$?
if [ "$code" -ne 0 ] && [ "$code" -ne 2 ]; then exit "$code"; fi
/usr/bin/python3 -m analysis.ecg demo.h5 -o demo_ecg.png
/usr/bin/python3 -m analysis.pv demo.h5 -o demo_pv.png
build/cohort status demo.h5
if [ "$code" -eq 0 ]; then echo "demo.h5 is finished; its ECGs are in demo_ecg.png, its pressure-volume loops in demo_pv.png"; fi
exit "$code"
