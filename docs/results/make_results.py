#!/usr/bin/env python3
"""Measures the walk over the island and draws the plots of this folder.

    docs/results/make_results.py --walkthrough build/release/bin/walkthrough --out docs/results

Three questions, asked first by Shade, Lischinski, Salesin, DeRose and Snyder in "Hierarchical Image
Caching for Accelerated Walkthroughs of Complex Environments" (1996), section 5: how long does every
frame of the walk take (their figure 5), how does the speed-up grow with the number of frames on one
and the same path (figure 6), and how with the number of trees (figure 7)?

Every run leaves its JSON and a table of its frames in OUT/runs. A run whose files are there is not
repeated, so the script may be interrupted and started again; delete them to measure afresh. Needs
Python 3.9 and nothing else.
"""

import argparse
import csv
import html
import json
import math
import pathlib
import subprocess
import sys
from dataclasses import dataclass, field, replace

# What the paper reports of its own machine, an SGI Indigo2 Maximum Impact of 250 MHz.
PUBLISHED_MACHINE = "SGI Indigo2 Maximum Impact"
PUBLISHED_SPEEDUP = {2: 11.9, 8: 14.1}  # by threshold [px]: 1117 trees, 1200 frames
PUBLISHED_FIRST_FRAME_S = 134
PUBLISHED_LATER_SPEEDUPS = (4.1, 25.2)
PUBLISHED_TREES = 1117
PUBLISHED_FRAMES = 1200
PUBLISHED_BREAK_EVEN_FRAMES = 30  # "faster than geometry with as few as 30 frames"
PUBLISHED_BEST_TREES = 574


@dataclass(frozen=True)
class Run:
    """One run of the walkthrough: the whole path in so many frames."""

    frames: int
    trees: int
    error_px: float
    size: str

    @property
    def name(self) -> str:
        return f"island_{self.trees}_trees_{self.frames}_frames_{self.error_px:g}px_{self.size}"

    @property
    def published_speedup(self) -> "float | None":
        """Of the paper, for the same walk at the same threshold."""
        same = self.trees == PUBLISHED_TREES and self.frames == PUBLISHED_FRAMES
        return PUBLISHED_SPEEDUP.get(self.error_px) if same else None

    @property
    def reference_every(self) -> int:
        """Geometry is drawn on about this many frames: all of a short walk, few of a long one."""
        most = 16
        return max(1, math.ceil(self.frames / most))


@dataclass(frozen=True)
class Campaign:
    """All that is to be measured."""

    size: str
    walk: int  # frames of the walk of figures 5 and 7
    frames: tuple[int, ...]
    trees: tuple[int, ...]
    thresholds: tuple[int, ...] = (2, 8)

    @property
    def all_trees(self) -> int:
        return self.trees[-1]

    def frame_runs(self) -> list[Run]:
        return [Run(n, self.all_trees, self.thresholds[0], self.size) for n in self.frames]

    def tree_runs(self) -> list[Run]:
        return [Run(self.walk, n, self.thresholds[0], self.size) for n in self.trees]

    def walk_runs(self) -> list[Run]:
        return [Run(self.walk, self.all_trees, px, self.size) for px in self.thresholds]

    def runs(self) -> list[Run]:
        """Every run once, the shortest first."""
        every = set(self.frame_runs() + self.tree_runs() + self.walk_runs())
        return sorted(every, key=lambda run: (run.frames * run.trees, run.error_px))


FULL = Campaign(
    size="640x480",
    walk=PUBLISHED_FRAMES,
    frames=(2, 5, 10, 30, 60, 120, 240, 480, 1200, 2400),
    trees=(35, 70, 140, 279, 559, PUBLISHED_TREES),
)
QUICK = Campaign(size="160x120", walk=60, frames=(2, 5, 10, 30, 60), trees=(5, 10, 20))


@dataclass
class Measured:
    """What one run left behind."""

    run: Run
    report: dict
    frames: list[dict] = field(default_factory=list)

    @property
    def speedup(self) -> float:
        return self.report["speedup"]["overall"]

    def column(self, name: str) -> list[tuple[int, float]]:
        """Frame and value of a column, where it was measured."""
        return [(int(row["frame"]), float(row[name])) for row in self.frames if row[name]]

    def later_speedups(self) -> tuple[float, float]:
        """Least and most of the sampled frames, without the first, which pays for the images."""
        times = dict(self.column("frame_ms"))
        ratios = [ms / times[frame] for frame, ms in self.column("reference_ms") if frame > 0]
        return min(ratios), max(ratios)


def read(run: Run, folder: pathlib.Path) -> "Measured | None":
    """The results of a run, or None where they are not there in full."""
    report = folder / f"{run.name}.json"
    table = folder / f"{run.name}.csv"
    if not report.exists() or not table.exists():
        return None
    with table.open(newline="") as stream:
        frames = list(csv.DictReader(stream))
    if len(frames) != run.frames:
        return None
    return Measured(run, json.loads(report.read_text()), frames)


def measure(run: Run, walkthrough: pathlib.Path, folder: pathlib.Path) -> Measured:
    command = [
        str(walkthrough),
        *("--scene", "island", "--trees", str(run.trees), "--size", run.size),
        *("--technique", "image-cache", "--preset", "shade1996"),
        *("--error-px", f"{run.error_px:g}", "--whole-path", str(run.frames)),
        *("--reference", str(run.reference_every)),
        *("--json", str(folder / f"{run.name}.json")),
        *("--frames-csv", str(folder / f"{run.name}.csv")),
    ]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}\nended with {done.returncode}: {done.stderr.strip()}")
    measured = read(run, folder)
    if measured is None:
        sys.exit(f"{' '.join(command)}\nleft no complete results in {folder}")
    return measured


def measure_all(
    campaign: Campaign, walkthrough: pathlib.Path, folder: pathlib.Path
) -> dict[Run, Measured]:
    folder.mkdir(parents=True, exist_ok=True)
    results = {}
    runs = campaign.runs()
    for number, run in enumerate(runs, 1):
        print(f"{number}/{len(runs)} {run.name}: ", end="", flush=True)
        there = read(run, folder)
        results[run] = there or measure(run, walkthrough, folder)
        print(f"{results[run].speedup:.2f} x{' (was there)' if there else ''}", flush=True)
    devices = {measured.report["device"] for measured in results.values()}
    if len(devices) > 1:
        sys.exit(f"runs of several devices are in {folder}: {', '.join(sorted(devices))}")
    return results


# Tables.


def write_table(file: pathlib.Path, measured: list[Measured]) -> None:
    def row(one: Measured) -> dict:
        report = one.report
        peak = report["memory"]["image_bytes_peak"]
        return {
            "trees": one.run.trees,
            "triangles": report["scene"]["triangles"],
            "frames": one.run.frames,
            "error_px": report["error_px"],
            "speedup": report["speedup"]["overall"],
            "speedup_without_first": report["speedup"]["without_first"],
            "first_ms": report["frame_ms"]["first"],
            "mean_ms": report["frame_ms"]["mean"],
            "median_ms": report["frame_ms"]["median"],
            "p99_ms": report["frame_ms"]["p99"],
            "geometry_first_ms": report["reference_frame_ms"]["first"],
            "geometry_mean_ms": report["reference_frame_ms"]["total"] / one.run.frames,
            "geometry_frames_sampled": report["reference_frame_ms"]["sampled"],
            "psnr_db_median": report["image"]["psnr_db_median"],
            "psnr_db_min": report["image"]["psnr_db_min"],
            "images_created": report["work"]["images_created"],
            "image_mib_peak": None if peak is None else peak / 2**20,
            "device": report["device"],
        }

    def cell(value: object) -> object:
        return f"{value:.6g}" if isinstance(value, float) else value

    rows = [row(one) for one in measured]
    with file.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        for one in rows:
            writer.writerow({name: cell(value) for name, value in one.items()})


# Plots.

INK = "#1f2933"
QUIET = "#66727f"
GRID = "#e3e8ed"
GEOMETRY = "#1f2933"
IMAGES = ("#c8102e", "#1769aa")  # by threshold
PAPER = "#8a6d00"


@dataclass
class Axis:
    """Values to places along one side of a plot."""

    title: str
    lo: float
    hi: float
    ticks: list[tuple[float, str]]
    log: bool = False

    def share(self, value: float) -> float:
        if self.log:
            return math.log(value / self.lo) / math.log(self.hi / self.lo)
        return (value - self.lo) / (self.hi - self.lo)


def number_text(value: float) -> str:
    """12000 as 12,000; no trailing zeros."""
    return f"{value:,.0f}" if value >= 1 else f"{value:g}"


def linear_axis(title: str, most: float) -> Axis:
    """From 0 to a round value above `most`, in four to ten steps."""
    step = 10 ** math.floor(math.log10(most / 4))
    step *= max(factor for factor in (1, 2, 5) if 4 * factor * step <= most)
    count = math.ceil(most / step)
    ticks = [(i * step, number_text(i * step) if i else "0") for i in range(count + 1)]
    return Axis(title, 0, count * step, ticks)


def log_axis(title: str, values: list[float]) -> Axis:
    """From one round value to another, labelled 1, 2, 5, 10 or in whole decades if there are many."""
    decades = range(math.floor(math.log10(min(values))), math.ceil(math.log10(max(values))) + 1)
    fine = [factor * 10.0**decade for decade in decades for factor in (1, 2, 5)]
    lo = max(value for value in fine if value <= min(values) * (1 + 1e-9))
    hi = min((value for value in fine if value >= max(values)), default=fine[-1])
    if hi <= lo:
        hi = 2 * lo
    ticks = [value for value in fine if lo <= value <= hi]
    many = 10
    if len(ticks) > many:
        whole = [value for value in ticks if abs(math.log10(value) % 1) < 1e-9]
        ticks = whole
    return Axis(title, lo, hi, [(value, number_text(value)) for value in ticks], log=True)


def category_axis(title: str, values: list[float], labels: list[str]) -> Axis:
    """Logarithmic, with a little room on both sides, labelled at the values themselves."""
    room = 1.25
    return Axis(title, values[0] / room, values[-1] * room, list(zip(values, labels)), log=True)


class Plot:
    """Draws one SVG."""

    WIDTH, HEIGHT = 860, 560
    LEFT, RIGHT, TOP, BOTTOM = 84, 28, 78, 142
    FONT = "Helvetica, Arial, 'Liberation Sans', sans-serif"

    def __init__(self, title: str, x: Axis, y: Axis, caption: list[str]) -> None:
        self.x = x
        self.y = y
        self.key_x = float(self.LEFT)
        self.parts: list[str] = []
        self.text(self.LEFT, 32, title, size=20, weight="bold")
        self.draw_axes()
        for line, words in enumerate(caption):
            self.text(self.LEFT, self.HEIGHT - 52 + 18 * line, words, size=13, color=QUIET)

    def at(self, x: float, y: float) -> tuple[float, float]:
        """[px] of a point."""
        width = self.WIDTH - self.LEFT - self.RIGHT
        height = self.HEIGHT - self.TOP - self.BOTTOM
        return (
            self.LEFT + width * self.x.share(x),
            self.HEIGHT - self.BOTTOM - height * self.y.share(y),
        )

    def text(
        self,
        x: float,
        y: float,
        words: str,
        size: int = 14,
        color: str = INK,
        anchor: str = "start",
        weight: str = "normal",
        turn: str = "",
    ) -> None:
        self.parts.append(
            f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" fill="{color}" '
            f'text-anchor="{anchor}" font-weight="{weight}"{turn}>{html.escape(words)}</text>'
        )

    def stroke(
        self, points: list[tuple[float, float]], color: str, width: float, dash: str = ""
    ) -> None:
        places = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.parts.append(
            f'<polyline points="{places}" fill="none" stroke="{color}" stroke-width="{width}" '
            f'stroke-linejoin="round"{dashes}/>'
        )

    def draw_axes(self) -> None:
        bottom = self.HEIGHT - self.BOTTOM
        right = self.WIDTH - self.RIGHT
        for value, label in self.y.ticks:
            _, y = self.at(self.x.lo, value)
            self.stroke([(self.LEFT, y), (right, y)], GRID, 1)
            self.text(self.LEFT - 9, y + 5, label, anchor="end")
        for value, label in self.x.ticks:
            x, _ = self.at(value, self.y.lo)
            self.stroke([(x, self.TOP), (x, bottom)], GRID, 1)
            for line, words in enumerate(label.split("\n")):
                color = QUIET if line else INK
                self.text(x, bottom + 20 + 16 * line, words, color=color, anchor="middle")
        self.stroke([(self.LEFT, bottom), (right, bottom)], INK, 1.2)
        self.stroke([(self.LEFT, self.TOP), (self.LEFT, bottom)], INK, 1.2)
        self.text((self.LEFT + right) / 2, bottom + 60, self.x.title, size=15, anchor="middle")
        middle = (self.TOP + bottom) / 2
        turn = f' transform="rotate(-90 22 {middle:.1f})"'
        self.text(22, middle, self.y.title, size=15, anchor="middle", turn=turn)

    def mark(self, x: float, y: float, color: str, shape: str) -> None:
        if shape == "dot":
            self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{color}"/>')
        else:
            reach = 7
            self.parts.append(
                f'<path d="M{x:.1f},{y - reach:.1f} l{reach},{reach} l{-reach},{reach} '
                f'l{-reach},{-reach} z" fill="white" stroke="{color}" stroke-width="2"/>'
            )

    def key(
        self, label: str, color: str, line: bool = True, shape: str = "", dash: str = ""
    ) -> None:
        """The next entry of the row under the title."""
        y = 56
        x = self.key_x
        if line:
            self.stroke([(x, y), (x + 26, y)], color, 2, dash)
        if shape:
            self.mark(x + 13, y, color, shape)
        self.text(x + 34, y + 5, label)
        average_letter_px = 6.6
        self.key_x += 34 + average_letter_px * len(label) + 22

    def line(
        self,
        points: list[tuple[float, float]],
        label: str,
        color: str,
        width: float = 2,
        dots: bool = True,
    ) -> None:
        places = [self.at(x, y) for x, y in points]
        self.stroke(places, color, width)
        # The first frame, which makes most images, would be lost in the axis.
        for x, y in places if dots else places[:1]:
            self.mark(x, y, color, "dot")
        self.key(label, color, shape="dot" if dots else "")

    def points(self, points: list[tuple[float, float]], label: str, color: str) -> None:
        for point in points:
            x, y = self.at(*point)
            self.mark(x, y, color, "diamond")
        self.key(label, color, line=False, shape="diamond")

    def level(self, y: float, label: str) -> None:
        """A dashed line at one value."""
        dash = "6 4"
        _, at = self.at(self.x.lo, y)
        self.stroke([(self.LEFT, at), (self.WIDTH - self.RIGHT, at)], QUIET, 1.4, dash)
        self.key(label, QUIET, dash=dash)

    def save(self, file: pathlib.Path) -> None:
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.WIDTH}" '
            f'height="{self.HEIGHT}" viewBox="0 0 {self.WIDTH} {self.HEIGHT}" '
            f'font-family="{self.FONT}">\n'
            f'<rect width="{self.WIDTH}" height="{self.HEIGHT}" fill="white"/>\n'
        )
        file.write_text(head + "\n".join(self.parts) + "\n</svg>\n")


def setting(measured: Measured, *more: str) -> str:
    """Where and at what size it was measured, for captions."""
    report = measured.report
    size = f'{report["width"]} x {report["height"]} pixels'
    return ", ".join((report["device"], size, *more)) + "."


def published_points(measured: list[Measured], x: str) -> list[tuple[float, float]]:
    """What the paper has to compare with, by a field of the run."""
    return [
        (getattr(one.run, x), one.run.published_speedup)
        for one in measured
        if one.run.published_speedup is not None
    ]


def plot_frame_times(walks: list[Measured], file: pathlib.Path) -> None:
    """Like figure 5 of the paper."""
    first, *_ = walks
    geometry = first.column("reference_ms")
    times = [ms for walk in walks for _, ms in walk.column("frame_ms")]
    first_ms = first.report["frame_ms"]["first"]
    first_ratio = first_ms / first.report["reference_frame_ms"]["first"]
    least, most = first.later_speedups()
    caption = [
        setting(first),
        f"At {first.run.error_px:g} px the first frame takes {first_ms / 1e3:.1f} s, "
        f"{first_ratio:.1f} times as long as geometry; later ones are {least:.1f} to {most:.1f} "
        "times faster.",
    ]
    if first.run.published_speedup is not None:
        later = " to ".join(f"{value:g}" for value in PUBLISHED_LATER_SPEEDUPS)
        caption.append(
            f"Shade et al. 1996, {PUBLISHED_MACHINE}: {PUBLISHED_FIRST_FRAME_S} s, 2 times as "
            f"long as geometry; later {later} times faster."
        )
    plot = Plot(
        f"Time of every frame, {first.run.trees:,} trees",
        linear_axis("frame of the walk", first.run.frames - 1),
        log_axis("time of a frame [ms]", times + [ms for _, ms in geometry]),
        caption,
    )
    for walk, color in zip(walks, IMAGES):
        label = f"images, {walk.run.error_px:g} px: {walk.speedup:.1f} x overall"
        if walk.run.published_speedup is not None:
            label += f" (1996: {walk.run.published_speedup:g})"
        plot.line(walk.column("frame_ms"), label, color, width=1, dots=False)
    plot.line(geometry, "geometry", GEOMETRY, width=1.6)
    plot.save(file)


def plot_speedups(
    measured: list[Measured],
    field_name: str,
    title: str,
    x: Axis,
    y: Axis,
    caption: list[str],
    file: pathlib.Path,
) -> None:
    plot = Plot(title, x, y, caption)
    points = [(getattr(one.run, field_name), one.speedup) for one in measured]
    plot.level(1, "as fast as geometry")
    plot.line(points, "Farfield", IMAGES[0])
    published = published_points(measured, field_name)
    if published:
        plot.points(published, "Shade et al. 1996", PAPER)
    plot.save(file)


def plot_frames(measured: list[Measured], file: pathlib.Path) -> None:
    """Like figure 6 of the paper."""
    first, *_ = measured
    counts = [one.run.frames for one in measured]
    speedups = [one.speedup for one in measured]
    published = [speedup for _, speedup in published_points(measured, "frames")]
    caption = [
        setting(first, f"{first.run.trees:,} trees", f"{first.run.error_px:g} px"),
        "Time of geometry over time with images, first frames included.",
    ]
    if published:
        caption.append(
            f"Shade et al. 1996, {PUBLISHED_MACHINE}: faster than geometry from "
            f"{PUBLISHED_BREAK_EVEN_FRAMES} frames on."
        )
    plot_speedups(
        measured,
        "frames",
        "Speed-up against the number of frames on one path",
        category_axis("frames on the whole path", counts, [number_text(n) for n in counts]),
        log_axis("speed-up [x]", [1.0, *speedups, *published]),
        caption,
        file,
    )


def plot_trees(measured: list[Measured], file: pathlib.Path) -> None:
    """Like figure 7 of the paper."""
    first, *_ = measured
    counts = [one.run.trees for one in measured]
    labels = [
        f'{one.run.trees:,}\n{one.report["scene"]["triangles"] / 1e6:.1f} M' for one in measured
    ]
    speedups = [one.speedup for one in measured]
    published = [speedup for _, speedup in published_points(measured, "trees")]
    caption = [
        setting(first, f"{first.run.frames:,} frames", f"{first.run.error_px:g} px"),
        "Time of geometry over time with images, first frames included.",
    ]
    if published:
        caption.append(
            f"Shade et al. 1996, {PUBLISHED_MACHINE}: highest at about {PUBLISHED_BEST_TREES} trees."
        )
    plot_speedups(
        measured,
        "trees",
        "Speed-up against the size of the scene",
        category_axis("trees, and triangles of the scene", counts, labels),
        linear_axis("speed-up [x]", max(1.0, *speedups, *published)),
        caption,
        file,
    )


def whole_numbers(text: str) -> "tuple[int, ...]":
    """`2,5,10` of the command line, ascending."""
    numbers = tuple(sorted({int(part) for part in text.split(",")}))
    if not numbers or numbers[0] < 1:
        raise argparse.ArgumentTypeError(f"{text!r} has a number below 1")
    return numbers


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--walkthrough", type=pathlib.Path, required=True, help="the program")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder for all files")
    parser.add_argument(
        "--quick", action="store_true", help="20 trees and 60 frames at most: tries the script out"
    )
    counts = {"type": whole_numbers, "metavar": "N,N,..."}
    parser.add_argument("--frames", **counts, help="frames of the whole path to measure with")
    parser.add_argument("--trees", **counts, help="numbers of trees to measure with")
    arguments = parser.parse_args()
    campaign = QUICK if arguments.quick else FULL
    campaign = replace(
        campaign,
        frames=arguments.frames or campaign.frames,
        trees=arguments.trees or campaign.trees,
    )

    out = arguments.out
    results = measure_all(campaign, arguments.walkthrough, out / "runs")
    by_frames = [results[run] for run in campaign.frame_runs()]
    by_trees = [results[run] for run in campaign.tree_runs()]
    walks = [results[run] for run in campaign.walk_runs()]
    write_table(out / "speedup_frames.csv", by_frames)
    write_table(out / "speedup_trees.csv", by_trees)
    write_table(out / "walks.csv", walks)
    plot_frame_times(walks, out / "frame_times.svg")
    plot_frames(by_frames, out / "speedup_frames.svg")
    plot_trees(by_trees, out / "speedup_trees.svg")


if __name__ == "__main__":
    main()
