#!/usr/bin/env bash
# Installs the Debian packages that Farfield needs, and only those that are missing.
#
#   cmake/install-dependencies.sh [build] [demo] [lint]
#
#   build  compiler, tools and libraries for every target and test (the default)
#   demo   ffmpeg, for the film that examples/demo.sh makes
#   lint   what .ci/run needs beyond a build: clang-format, clang-tidy, python3
#
# Where it cannot install (no apt, no rights) it names the packages and ends well: the libraries may
# have come another way, and CMake says which one it does not find.
set -euo pipefail

build=(
    g++ cmake ninja-build ccache pkg-config
    libglm-dev libexpected-dev
    libtinygltf-dev libpng-dev libmeshoptimizer-dev libopenmesh-dev libzstd-dev
    libepoxy-dev libegl-dev libgl-dev libopengl-dev libgl1-mesa-dri
    libembree-dev libtbb-dev
    nlohmann-json3-dev libcli11-dev
    catch2 libbenchmark-dev
)
demo=(ffmpeg)
lint=(clang clang-format clang-tidy libclang-rt-14-dev python3)

[[ $# -gt 0 ]] || set -- build
packages=()
for group in "$@"; do
    case "$group" in
        build) packages+=("${build[@]}") ;;
        demo) packages+=("${demo[@]}") ;;
        lint) packages+=("${lint[@]}") ;;
        *)
            echo "install-dependencies: no group '$group'; there are build, demo and lint" >&2
            exit 2
            ;;
    esac
done

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    echo "install-dependencies: no apt here; the build looks for what Debian calls: ${packages[*]}"
    exit 0
fi

missing=()
for package in "${packages[@]}"; do
    state=$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null || true)
    [[ $state == installed ]] || missing+=("$package")
done
[[ ${#missing[@]} -gt 0 ]] || exit 0

as_root=()
if [[ $(id -u) -ne 0 ]]; then
    if ! command -v sudo >/dev/null; then
        echo "install-dependencies: neither root nor sudo; missing: ${missing[*]}"
        exit 0
    fi
    as_root=(sudo)
fi
echo "install-dependencies: installing ${missing[*]}"
"${as_root[@]}" apt-get update
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install --yes --no-install-recommends "${missing[@]}"
