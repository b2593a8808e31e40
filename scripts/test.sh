#!/usr/bin/env bash
# Builds everything and runs every test.
#   scripts/test.sh [--with-training] [--sanitizer address|thread] [-- CTEST ARGUMENTS...]
# The tests of training/ need PyTorch, 7 GB: --with-training installs it; without, they are skipped where it is not there.
# Tests on real data look for it in $DEEPUAV_SHARED (../shared by default) and are skipped where it is absent.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# Into .venv/, so that tests find evo_ape and evo_rpe on the path.
install_python_packages() {
  local requirements=tests/requirements.txt stamp=.venv/.requirements.txt
  if cmp -s "$requirements" "$stamp"; then return; fi
  rm -rf .venv
  /usr/bin/python3 -m venv .venv
  if ! .venv/bin/python -m pip install --quiet --disable-pip-version-check --only-binary=:all: -r "$requirements"; then
    rm -rf .venv
    echo "test.sh: the comparison with evo is skipped: its packages could not be installed" >&2
    return
  fi
  cp "$requirements" "$stamp"
}

# What the tests of the pages open them with; without, they are skipped.
install_packages() {
  local missing=() package
  for package in chromium chromium-driver python3-selenium; do
    [[ $(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || missing+=("$package")
  done
  if ((${#missing[@]} == 0)); then return; fi
  local as_root=()
  if ((EUID != 0)); then
    if ! command -v sudo >/dev/null; then
      echo "test.sh: without root or sudo the tests of the pages are skipped: no ${missing[*]}" >&2
      return
    fi
    as_root=(sudo)
  fi
  if ! { "${as_root[@]}" apt-get update -q && "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
         apt-get install -y -q --no-install-recommends "${missing[@]}"; }; then
    echo "test.sh: the tests of the pages are skipped: could not install ${missing[*]}" >&2
  fi
}

# Into .venv-training/, as training/README.md says.
install_training_packages() {
  local requirements=training/requirements.txt stamp=.venv-training/.requirements.txt
  if cmp -s "$requirements" "$stamp"; then return; fi
  rm -rf .venv-training
  /usr/bin/python3 -m venv .venv-training
  if ! .venv-training/bin/python -m pip install --quiet --disable-pip-version-check --no-cache-dir -r "$requirements"; then
    rm -rf .venv-training
    echo "test.sh: the tests of training/ are skipped: its packages could not be installed" >&2
    return
  fi
  cp "$requirements" "$stamp"
}

wrong_use() {
  echo "test.sh: $1" >&2
  exit 2
}

with_training=false
preset=release
while (($# > 0)); do
  case $1 in
    --with-training) with_training=true ;;
    --sanitizer)
      case ${2:-} in
        address) preset=asan ;;
        thread) preset=tsan ;;
        *) wrong_use "sanitizer is '${2:-}': expected address or thread" ;;
      esac
      shift
      ;;
    --)
      shift
      break
      ;;
    *) wrong_use "unknown argument '$1': expected --with-training, --sanitizer NAME or -- and arguments for ctest" ;;
  esac
  shift
done

# As setup.sh does: tests compile, too.
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}
scripts/setup.sh --preset "$preset"
install_packages
install_python_packages
if "$with_training"; then install_training_packages; fi

if [[ -z ${DEEPUAV_SHARED:-} && -d ../shared ]]; then
  DEEPUAV_SHARED=$(realpath ../shared)
  export DEEPUAV_SHARED
fi
PATH=$PWD/.venv/bin:$PATH
# evo keeps its settings, and matplotlib its caches, in the user's folder unless told otherwise.
export EVO_HOME=$PWD/.venv/evo MPLCONFIGDIR=$PWD/.venv/matplotlib MPLBACKEND=Agg

launcher=()
# ThreadSanitizer's fixed memory layout does not fit address randomisation of newer kernels.
if [[ $preset == tsan ]] && setarch -R true 2>/dev/null; then launcher=(setarch -R); fi
status=0
"${launcher[@]}" ctest --preset "$preset" --output-on-failure -j2 "$@" || status=$?
folder=build
[[ $preset == release ]] || folder=build-$preset
# Again, and last: among the output of 1,300 tests they are hard to find.
if ((status != 0)); then python3 scripts/failed_tests.py "$folder"; fi
exit "$status"
