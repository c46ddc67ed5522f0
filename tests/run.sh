#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test. From any directory, as often as you like.
#
#   tests/run.sh [--full] [PRESET]     PRESET is release unless said otherwise
#
# --full adds what takes longer: the presets checked, asan and minimal, every public header compiled
# alone, and clang-format and clang-tidy on everything.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

full=no
preset=release
for argument in "$@"; do
    case "$argument" in
        --full) full=yes ;;
        -*)
            echo "usage: tests/run.sh [--full] [PRESET]" >&2
            exit 2
            ;;
        *) preset=$argument ;;
    esac
done
jobs=$(nproc)

# test_preset NAME: configures, builds and tests one preset of CMakePresets.json.
test_preset() {
    echo "== $1"
    cmake --preset "$1"
    cmake --build --preset "$1" --parallel "$jobs"
    ctest --preset "$1" --parallel "$jobs"
}

cmake/install-dependencies.sh build
test_preset "$preset"
if [[ $full == yes ]]; then
    for name in checked asan minimal; do
        [[ $name == "$preset" ]] || test_preset "$name"
    done
    echo "== headers"
    cmake --build --preset "$preset" --parallel "$jobs" --target all_verify_interface_header_sets
    echo "== lint"
    cmake/install-dependencies.sh lint
    cmake/lint.sh format
    cmake/lint.sh tidy
fi
