#!/usr/bin/env bash
# Sets everything up, then: without an argument, simulates a flight, runs SLAM on it, evaluates it and writes a report
# (out/demo/report.html); with one, runs SLAM over that dataset.
#   scripts/demo.sh [DATASET]
set -euo pipefail
dataset=${1:+$(realpath -m "$1")}
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if [[ -n $dataset && ! -e $dataset ]]; then
  echo "demo.sh: no dataset at $dataset" >&2
  exit 1
fi
scripts/setup.sh --target deepuav
mkdir -p out
if [[ -z $dataset ]]; then
  # A flight of an earlier program may be of other options.
  if [[ out/demo/flight/simulation.yaml -ot build/deepuav ]]; then rm -rf out/demo/flight; fi
  exec build/deepuav demo --out out/demo
fi
build/deepuav run "$dataset" --out out/demo
build/deepuav report out/demo
echo "The result lies in out/demo/"
