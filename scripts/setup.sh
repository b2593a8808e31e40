#!/usr/bin/env bash
# Installs what the project needs on Debian 12 and builds it into build/. Safe to run again: what is there is kept.
#   scripts/setup.sh [--no-build] [--preset release|asan|tsan] [--target NAME]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly openvino_version=2026.4.1 pymavlink_version=2.4.50
readonly packages=(
  build-essential cmake ninja-build ccache pkg-config unzip ca-certificates python3 python3-dev python3-venv python3-pip
  libopencv-dev libeigen3-dev libceres-dev libyaml-cpp-dev libcli11-dev libspdlog-dev libfmt-dev
  nlohmann-json3-dev libpugixml-dev libjs-three libjs-chart.js libboost-dev libgeographiclib-dev libgdal-dev
  libavformat-dev libavcodec-dev libswscale-dev libexif-dev libjpeg62-turbo-dev libssl-dev libzstd-dev libgtest-dev libgmock-dev
  libbenchmark-dev libembree-dev clang-format clang-tidy
)

fail() {
  echo "setup.sh: $1" >&2
  exit "${2:-1}"
}

install_packages() {
  local missing=() package
  for package in "${packages[@]}"; do
    [[ $(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || missing+=("$package")
  done
  if ((${#missing[@]} == 0)); then return; fi
  local as_root=()
  if ((EUID != 0)); then
    command -v sudo >/dev/null || fail "needs root or sudo to install: ${missing[*]}"
    as_root=(sudo)
  fi
  echo "Installing ${missing[*]}"
  "${as_root[@]}" apt-get update -q
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
}

# The build is for x86-64-v3 there (DEEPUAV_ARCH); without AVX2 it would end in an illegal instruction.
check_cpu() {
  [[ $(uname -m) != x86_64 ]] || grep -qw avx2 /proc/cpuinfo || fail "this CPU has no AVX2: expected one of x86-64-v3"
}

# fetch_wheel NAME VERSION SHA256 PLATFORM FOLDER [FILE...]: makes .deps/NAME of a FOLDER of the wheel, unpacking these files alone
# where any are named, unless it is there already.
fetch_wheel() {
  local name=$1 version=$2 sha256=$3 platform=$4 part=$5
  local files=("${@:6}")
  local stamp=.deps/$name/.wheel wanted="$version $sha256"
  if [[ -f $stamp && $(<"$stamp") == "$wanted" ]]; then return; fi

  echo "Downloading $name $version"
  mkdir -p .deps
  rm -rf .deps/unpacking.*
  trap 'rm -rf .deps/unpacking.*' EXIT
  local folder
  folder=$(mktemp -d .deps/unpacking.XXXXXX)
  # Debian's own Python, because a Python of the user may lack pip.
  /usr/bin/python3 -m pip download --quiet --no-deps --only-binary=:all: --implementation cp --python-version 3.11 \
    --platform "$platform" --dest "$folder" "$name==$version"
  local wheel=("$folder/$name"-*.whl)
  echo "$sha256  ${wheel[0]}" | sha256sum --check --quiet || fail "the wheel of $name has another SHA-256 than $sha256"
  unzip -q "${wheel[0]}" "${files[@]}" -d "$folder/unpacked"
  echo "$wanted" >"$folder/unpacked/$part/.wheel"
  rm -rf ".deps/$name"
  mv "$folder/unpacked/$part" ".deps/$name"
}

# The wheel of OpenVINO carries its C++ headers, libraries and CMake files; its Python part is not used, so one wheel
# serves whichever Python is installed.
install_openvino() {
  local platform sha256
  case $(uname -m) in
    x86_64)
      platform=manylinux_2_28_x86_64
      sha256=2d22b1da03f7caf74df30e9f6417d0ab2f637e4a38e08e1dcd294d2c37407aaf
      ;;
    aarch64)
      platform=manylinux_2_35_aarch64
      sha256=bea1eb3733c34ef331adc945da0ccda5937865031139073663be84c517ffda22
      ;;
    *) fail "no OpenVINO for $(uname -m): expected x86_64 or aarch64" ;;
  esac
  fetch_wheel openvino "$openvino_version" "$sha256" "$platform" openvino
}

# Of the wheel only what is written in Python is used: MAVLink's messages and what makes C of them, to build, and a receiver
# for the tests. So one wheel serves all machines.
install_pymavlink() {
  local sha256=6c56a34ae4e6e9215f77cd4ad809b804611ad248290783d2d701904bb8db9772
  fetch_wheel pymavlink "$pymavlink_version" "$sha256" manylinux_2_28_x86_64 "" \
    pymavlink/__init__.py pymavlink/tools/mavgen.py 'pymavlink/generator/*.py' 'pymavlink/generator/C/*' \
    'pymavlink/dialects/*__init__.py' 'pymavlink/dialects/v20/common.*' 'pymavlink/dialects/v20/standard.*' \
    'pymavlink/dialects/v20/minimal.*' '*/licenses/*'
}

preset=release
build=true
target=all
while (($# > 0)); do
  case $1 in
    --no-build) build=false ;;
    --preset)
      (($# > 1)) || fail "--preset names none: expected release, asan or tsan" 2
      preset=$2
      shift
      ;;
    --target)
      (($# > 1)) || fail "--target names none: expected a target of the build, as deepuav" 2
      target=$2
      shift
      ;;
    *) fail "unknown argument '$1': expected --no-build, --preset NAME or --target NAME" 2 ;;
  esac
  shift
done
case $preset in
  release | asan | tsan) ;;
  *) fail "preset is '$preset': expected release, asan or tsan" 2 ;;
esac

check_cpu
install_packages
install_openvino
install_pymavlink
if $build; then
  # What one checkout has compiled, another one need not compile again.
  export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}
  cmake --preset "$preset"
  cmake --build --preset "$preset" --target "$target" --parallel "$(nproc)"
fi
