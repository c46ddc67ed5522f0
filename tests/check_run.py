#!/usr/bin/env python3
"""Checks what a walkthrough of the island has written: its JSON and one of its pictures. It has to
have measured disparity (--measure) and the truth (--truth).

    tests/check_run.py SUMMARY.json FRAME.png

Ends with 1 and one line for each thing that is wrong. Needs nothing but Python itself.
"""

import json
import math
import struct
import sys
import zlib

# The report of a run, key for key. What was not measured is null; a whole group may be null only
# where its name is in MAY_BE_NULL.
REPORT = {
    "scene": {"name", "triangles", "instances", "build_ms", "nodes", "depth"},
    "technique": None,
    "preset": None,
    "backend": None,
    "device": None,
    "width": None,
    "height": None,
    "fov_deg": None,
    "error_px": None,
    "frames": None,
    "frame_ms": {"first", "mean", "median", "p95", "p99", "max", "total"},
    "reference_frame_ms": {"first", "mean", "median", "p95", "max", "sampled", "total"},
    "speedup": {"overall", "without_first", "min", "max"},
    "plan_ms": {"mean", "p95", "max"},
    "disparity_px": {"median", "p99", "max", "bound", "over_bound", "tightness"},
    "image": {
        "psnr_db_min", "psnr_db_median", "ssim_median", "flip_mean", "missing_fraction",
        "extra_fraction",
    },
    "truth": {
        "psnr_db_min", "psnr_db_median", "ssim_median", "flip_mean", "missing_fraction",
        "extra_fraction", "reference_psnr_db_median",
    },
    "work": {
        "triangles_per_frame", "draw_calls_per_frame", "image_quads_per_frame",
        "splats_per_frame", "cubes_per_frame", "images_created", "images_reused",
        "texels_created", "deferred", "evicted", "stale", "new", "combined",
        "reused", "impossible", "keyframes", "budget_misses",
    },
    "memory": {
        "image_bytes_peak", "image_budget_bytes", "aov_bytes", "hierarchy_bytes", "scene_bytes",
    },
    "cost_model": None,
}
MAY_BE_NULL = {"disparity_px", "image", "truth"}


def keys_wrong(report):
    """Lines about keys that are missing or that nobody knows."""
    wrong = []
    for key in sorted(REPORT.keys() - report.keys()):
        wrong.append(f"'{key}' is missing")
    for key in sorted(report.keys() - REPORT.keys()):
        wrong.append(f"'{key}' is not a key of a report")
    for key, expected in REPORT.items():
        found = report.get(key)
        if expected is None or key not in report or (found is None and key in MAY_BE_NULL):
            continue
        if not isinstance(found, dict):
            wrong.append(f"'{key}' is {found!r}, not an object")
            continue
        for name in sorted(expected ^ found.keys()):
            wrong.append(f"'{key}.{name}' is {'missing' if name in expected else 'unknown'}")
    return wrong


def figures_wrong(report):
    """Lines about figures that cannot be, or that make the run worthless."""
    wrong = []

    def positive(*path):
        value = report
        for key in path:
            value = value.get(key) if isinstance(value, dict) else None
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not (number and value > 0):
            wrong.append(f"'{'.'.join(path)}' is {value!r}, not a positive number")
            return None
        return value

    for path in (("scene", "triangles"), ("frame_ms", "total"),
                 ("reference_frame_ms", "total"), ("work", "images_created")):
        positive(*path)
    speedup = positive("speedup", "overall")
    if speedup is not None and speedup <= 1:
        wrong.append(f"'speedup.overall' is {speedup}: slower than plain geometry")
    wrong += disparity_wrong(report, positive)
    wrong += errors_wrong(report, positive)
    return wrong


def disparity_wrong(report, positive):
    """Lines about surface points that are shown where nobody promised them to be."""
    wrong = []
    figures = [positive("disparity_px", name) for name in ("median", "p99", "max", "bound")]
    sizes = [positive(name) for name in ("width", "height", "frames")]
    positive("disparity_px", "tightness")
    positive("memory", "aov_bytes")
    if None in figures + sizes:
        return wrong
    median, p99, largest, bound = figures
    # Percentiles are known to within 1/128 of themselves.
    if not median <= p99 * (1 + 1 / 128) <= largest * (1 + 1 / 64):
        wrong.append(f"'disparity_px' rises from median {median} over p99 {p99} to max {largest}")
    if p99 > bound:
        wrong.append(f"'disparity_px.p99' is {p99}, the largest promise is {bound}")
    over = report["disparity_px"].get("over_bound")
    # The metric estimates from corners of boxes: here and there a pixel may be beyond its promise.
    most = math.prod(sizes) / 10000
    if not isinstance(over, int) or over > most:
        wrong.append(f"'disparity_px.over_bound' is {over!r}, expected at most {most:.0f} pixels")
    return wrong


def errors_wrong(report, positive):
    """Lines about pictures that differ from geometry or the truth by more than foliage does."""
    wrong = []
    least = positive("image", "psnr_db_min")
    if least is not None and least < 25:
        wrong.append(f"'image.psnr_db_min' is {least} dB, expected at least 25")
    images = positive("truth", "psnr_db_median")
    geometry = positive("truth", "reference_psnr_db_median")
    if None not in (images, geometry) and images < geometry - 3:
        wrong.append(f"'truth': images are at {images} dB, plain geometry at {geometry}")
    for group in ("image", "truth"):
        for name in ("missing_fraction", "extra_fraction"):
            share = (report.get(group) or {}).get(name)
            if not isinstance(share, (int, float)) or not 0 <= share <= 0.05:
                wrong.append(f"'{group}.{name}' is {share!r}, expected 0 to 0.05")
    return wrong


def read_png(path):
    """(width, height, rows) of an 8-bit RGB or RGBA picture; rows are lists of (r, g, b)."""
    with open(path, "rb") as file:
        data = file.read()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError("not a PNG file")
    header, packed, at = None, b"", 8
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + length]
        (checksum,) = struct.unpack_from(">I", data, at + 8 + length)
        if zlib.crc32(kind + body) != checksum:
            raise ValueError(f"chunk {kind!r} is damaged")
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    if header is None:
        raise ValueError("no header")
    width, height, bits, colour_type, _, _, interlaced = header
    if bits != 8 or colour_type not in (2, 6) or interlaced:
        raise ValueError(f"{bits} bits of colour type {colour_type} are not read here")
    channels = 3 if colour_type == 2 else 4
    raw = zlib.decompress(packed)
    stride = width * channels
    if len(raw) != height * (stride + 1):
        raise ValueError(f"{len(raw)} bytes of pixels, not {height * (stride + 1)}")
    rows, above = [], bytearray(stride)
    for y in range(height):
        start = y * (stride + 1)
        method = raw[start]
        line = bytearray(raw[start + 1:start + 1 + stride])
        for i in range(stride):
            left = line[i - channels] if i >= channels else 0
            corner = above[i - channels] if i >= channels else 0
            line[i] = (line[i] + predicted(method, left, above[i], corner)) & 0xFF
        rows.append([tuple(line[x * channels:x * channels + 3]) for x in range(width)])
        above = line
    return width, height, rows


def predicted(method, left, up, corner):
    """What the filters of PNG add to a byte."""
    if method == 0:
        return 0
    if method == 1:
        return left
    if method == 2:
        return up
    if method == 3:
        return (left + up) // 2
    if method == 4:
        estimate = left + up - corner
        distances = (abs(estimate - left), abs(estimate - up), abs(estimate - corner))
        return (left, up, corner)[distances.index(min(distances))]
    raise ValueError(f"unknown filter {method}")


def picture_wrong(rows):
    """Lines about a picture that cannot be the island: sky above, green below, and detail."""
    pixels = [pixel for row in rows for pixel in row]
    wrong = []
    colours = len(set(pixels))
    # A thousandth of the pixels: far above any flat or banded picture, far below a wood.
    if colours * 1000 < len(pixels):
        wrong.append(f"only {colours} colours in {len(pixels)} pixels")
    sky = sum(1 for r, g, b in pixels if b > g > r and b >= 150)
    green = sum(1 for r, g, b in pixels if g > r and g > b)
    # From every place of the path the horizon and the wood are both in view.
    for name, count in (("sky", sky), ("green", green)):
        if count < 0.02 * len(pixels):
            wrong.append(f"{name} covers {count} of {len(pixels)} pixels, less than 2 %")
    return wrong


def read_report(path):
    """The report, a JSON object."""
    with open(path, encoding="utf-8") as file:
        report = json.load(file)
    if not isinstance(report, dict):
        raise ValueError("not a JSON object")
    return report


def main(arguments):
    if len(arguments) != 2:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    summary, frame = arguments
    try:
        report = read_report(summary)
    except (OSError, ValueError) as error:
        print(f"{summary}: {error}")
        return 1
    wrong = [f"{summary}: {line}" for line in keys_wrong(report) + figures_wrong(report)]
    try:
        width, height, rows = read_png(frame)
    except (OSError, ValueError, struct.error, zlib.error) as error:
        wrong.append(f"{frame}: {error}")
    else:
        wrong += [f"{frame}: {line}" for line in picture_wrong(rows)]
        announced = (report.get("width"), report.get("height"))
        if announced != (width, height):
            wrong.append(f"{frame}: {width}x{height} pixels, {announced} in the report")
    for line in wrong:
        print(line)
    if not wrong:
        print(f"the run is sound: {report['speedup']['overall']:.1f} times as fast as geometry")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
