#!/usr/bin/env bash
# SLAM over one dataset, into out/demo/.
#   scripts/demo.sh [DATASET]
# DATASET defaults to data/euroc_mh01_excerpt in $DEEPUAV_SHARED (../shared by default).
set -euo pipefail
readonly shared=${DEEPUAV_SHARED:-$(dirname "${BASH_SOURCE[0]}")/../../shared}
dataset=$(realpath -m "${1:-$shared/data/euroc_mh01_excerpt}")
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if [[ ! -e $dataset ]]; then
  echo "demo.sh: no dataset at $dataset: give one, as in: scripts/demo.sh PATH/TO/MH_01_easy" >&2
  exit 1
fi
scripts/setup.sh --target deepuav
mkdir -p out
build/deepuav run "$dataset" --out out/demo
for truth in "$dataset"/groundtruth_cam0.csv "$dataset"/groundtruth.txt \
  "$dataset"/mav0/state_groundtruth_estimate0/data.csv; do
  if [[ -f $truth ]]; then
    build/deepuav eval "$truth" out/demo/trajectory.txt
    break
  fi
done
echo "The result lies in out/demo/"
