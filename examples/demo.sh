#!/usr/bin/env bash
# Installs what is missing, builds, and walks along a wooded island: 1117 trees, 40 million triangles,
# most of them shown as images under a threshold of two pixels. A few minutes on two cores without a
# GPU. Pictures, figures and, where ffmpeg is there, a film go to out/demo.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

out=out/demo

cmake/install-dependencies.sh build
cmake/install-dependencies.sh demo || echo "demo: no ffmpeg, so no film"
cmake --preset release
cmake --build --preset release --parallel "$(nproc)" --target walkthrough

rm -rf "$out"
mkdir -p "$out"
# Every 20th frame beside the same frame drawn from geometry; the program prints the table.
build/release/bin/walkthrough --scene island --technique image-cache --preset shade1996 \
    --error-px 2 --frames 200 --reference 10 --png 20 --json "$out/summary.json" --out "$out"

if command -v ffmpeg >/dev/null; then
    # Side by side: made of images on the left, of geometry on the right; two pictures a second.
    ffmpeg -nostdin -loglevel error -y \
        -framerate 2 -pattern_type glob -i "$out/frame_*.png" \
        -framerate 2 -pattern_type glob -i "$out/reference_*.png" \
        -filter_complex hstack=inputs=2 -pix_fmt yuv420p "$out/walk.mp4"
fi

echo
echo "frame_*.png       what Farfield drew"
echo "reference_*.png   the same frames from geometry alone"
echo "difference_*.png  where the two differ"
echo "summary.json      every figure of the run"
[[ ! -e $out/walk.mp4 ]] || echo "walk.mp4          both, side by side"
echo "All in $PWD/$out"
