#!/bin/bash
# Runs studies of configs/studies and keeps their files in a folder: jobs/studies.sh BUILD FOLDER NAME ...
#     jobs/studies.sh build study-results circulation cell splitting            # minutes of two CPU cores
#     jobs/studies.sh build study-results niederer ecg land heart               # for a GPU
# Further options of `cohort study` in STUDY_OPTIONS, say "--device gpu".
set -u
build=$1 folder=$2
shift 2
mkdir -p "$folder"
failed=0
for name in "$@"; do
  begin=$(date +%s)
  # shellcheck disable=SC2086
  "$build/cohort" study "configs/studies/$name.yaml" --store "$folder/study_$name.h5" ${STUDY_OPTIONS:-} \
    > "$folder/study_$name.txt" 2> "$folder/study_$name.log" || failed=1
  echo "$name: $(($(date +%s) - begin)) s"
  awk '/ error rms / {measure = $1 " " $2} /^the default / {print "  " measure ": " $0}' "$folder/study_$name.txt"
  grep -E "error|cohort:" "$folder/study_$name.log"
done
exit $failed
