#!/usr/bin/env bash
# Formats the C++ sources in place; with --check, changes nothing and fails where a file would change.
#   scripts/format.sh [--check]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

mode=(-i)
if [[ ${1:-} == --check ]]; then mode=(--dry-run --Werror); fi
find src apps tests bench examples python \( -name '*.h' -o -name '*.cc' \) -print0 | xargs -0 -r clang-format "${mode[@]}"
