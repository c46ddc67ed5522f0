#!/usr/bin/env python3
"""Runs bench/compare on small files and reads what it prints."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

COMPARE = pathlib.Path(__file__).resolve().parents[2] / "bench" / "compare"


def entry(name, real_time, unit="ns", **more):
    return {"name": name, "run_name": name, "run_type": "iteration", "real_time": real_time,
            "cpu_time": 1e9, "time_unit": unit, "items_per_second": 5.0, **more}


def median(name, real_time, **more):
    return {**entry(name, real_time, **more), "name": f"{name}_median", "run_type": "aggregate",
            "aggregate_name": "median"}


class CompareTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name, content):
        path = self.folder / name
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    def results(self, name, *entries, host="a"):
        context = {"host_name": host, "num_cpus": 2}
        return self.write(name, {"context": context, "benchmarks": list(entries)})

    def compare(self, *arguments):
        done = subprocess.run(
            [sys.executable, str(COMPARE), *map(str, arguments)], capture_output=True, text=True
        )
        return done.returncode, done.stdout, done.stderr

    def lines(self, before, after, *options):
        """The lines of the output as words."""
        status, out, _ = self.compare(
            *options, self.results("before.json", *before), self.results("after.json", *after)
        )
        self.assertEqual(status, 0)
        return [line.split() for line in out.splitlines()]

    def test_sorts_by_ratio_and_marks_changes(self):
        before = [entry("same", 100), entry("slow", 100), entry("fast", 3, "ms")]
        after = [entry("slow", 0.25, "us"), entry("fast", 1, "ms"), entry("same", 109)]
        head, *rows, summary = self.lines(before, after)
        self.assertEqual(head, ["benchmark", "before", "after", "ratio", "error"])
        self.assertEqual(rows, [
            ["fast", "3", "ms", "1", "ms", "0.333", "faster"],
            ["same", "100", "ns", "109", "ns", "1.090"],
            ["slow", "100", "ns", "250", "ns", "2.500", "slower"],
        ])
        self.assertEqual(" ".join(summary), "3 compared: 1 faster, 1 slower by more than 1.1")

    def test_threshold(self):
        rows = self.lines([entry("a", 100)], [entry("a", 109)], "--threshold", "1.05")
        self.assertEqual(rows[1][-1], "slower")
        rows = self.lines([entry("a", 100)], [entry("a", 40)], "--threshold", "3")
        self.assertEqual(rows[1][-1], "0.400")
        # The threshold itself is no change yet.
        rows = self.lines([entry("a", 100)], [entry("a", 200)], "--threshold", "2")
        self.assertEqual(rows[1][-1], "2.000")
        files = [self.results(name, entry("a", 1)) for name in ("x.json", "y.json")]
        for wrong in ("0.9", "nan", "inf", "fast"):
            status, _, err = self.compare("--threshold", wrong, *files)
            self.assertEqual(status, 2)
            self.assertIn(wrong, err)

    def test_fails_only_when_asked_and_slower(self):
        quick = self.results("quick.json", entry("a", 100))
        slow = self.results("slow.json", entry("a", 150))
        self.assertEqual(self.compare(quick, slow)[0], 0)
        self.assertEqual(self.compare("--fail-slower", quick, slow)[0], 1)
        self.assertEqual(self.compare("--fail-slower", slow, quick)[0], 0)
        self.assertEqual(self.compare("--fail-slower", quick, quick)[0], 0)

    def test_medians_of_repetitions(self):
        # The median that the file has counts for more than the repetitions beside it, and other
        # aggregates count for nothing.
        mean = {**median("a", 7000), "aggregate_name": "mean"}
        before = [entry("a", 1), entry("a", 2), median("a", 50), mean]
        # Where there is none it is taken: of 9, 10 and 1000.
        after = [entry("a", 9), entry("a", 1000), entry("a", 10)]
        _, row, _ = self.lines(before, after)
        self.assertEqual(row[:6], ["a", "50", "ns", "10", "ns", "0.200"])

    def test_errors_stand_beside_times(self):
        before = [entry("a", 100, error_px=0.5, error_rad=0.0, depth=3), entry("b", 1)]
        after = [entry("a", 50, error_px=0.75, error_rad=0.0, depth=9), entry("b", 1, error_px=2)]
        _, a, b, _ = self.lines(before, after)
        self.assertEqual(
            " ".join(a), "a 100 ns 50 ns 0.500 faster error_px 0.5 -> 0.75 LARGER, error_rad 0 -> 0"
        )
        self.assertEqual(" ".join(b), "b 1 ns 1 ns 1.000 error_px - -> 2")
        # An error that appears is larger by any threshold; one that shrinks is not.
        _, a, _ = self.lines([entry("a", 1, error_px=0)], [entry("a", 1, error_px=1e-9)])
        self.assertEqual(a[-1], "LARGER")
        _, a, _ = self.lines([entry("a", 1, error_px=2)], [entry("a", 1, error_px=1)])
        self.assertEqual(a[-1], "1")

    def test_names_in_one_file_alone(self):
        failing = {"name": "c", "run_name": "c", "run_type": "iteration", "error_occurred": True,
                   "error_message": "no device"}
        rows = self.lines([entry("a", 1), entry("c", 1)], [entry("b", 2000), failing])
        out = [" ".join(row) for row in rows]
        self.assertEqual(len(out), 4)
        self.assertRegex(out[0], r"^only in .*before\.json: a, 1 ns$")
        self.assertRegex(out[1], r"^only in .*after\.json: b, 2 us$")
        self.assertRegex(out[2], r"^failed in .*after\.json: c: no device$")
        self.assertEqual(out[3], "0 compared: 0 faster, 0 slower by more than 1.1")

    def test_says_when_machines_differ(self):
        _, out, _ = self.compare(
            self.results("x.json", entry("a", 1)), self.results("y.json", entry("a", 1), host="b")
        )
        self.assertIn("different machines, ('a', 2) and ('b', 2)", out.splitlines()[0])

    def test_files_without_benchmarks(self):
        empty = self.results("empty.json")
        status, out, _ = self.compare(empty, empty)
        self.assertEqual((status, out), (0, "0 compared: 0 faster, 0 slower by more than 1.1\n"))

    def test_bad_files_are_named_with_the_field(self):
        good = self.results("good.json", entry("a", 1))
        cases = {
            "{": "bad.json: not JSON",
            "[]": "bad.json: 'benchmarks' is not a list",
            '{"benchmarks": [3]}': "bad.json: benchmarks[0] is 3, expected an object",
            '{"benchmarks": [{}]}': "bad.json: benchmarks[0].name is None, expected text",
        }
        fields = {
            "benchmarks[1].real_time is 0, expected more than 0": entry("b", 0),
            "benchmarks[1].real_time is nan, expected more than 0": entry("b", float("nan")),
            "benchmarks[1].real_time is 'x', expected a number": entry("b", "x"),
            "benchmarks[1].time_unit is 'h', expected one of ns, us, ms, s": entry("b", 1, "h"),
            "benchmarks[1].error_px is None, expected a number": entry("b", 1, error_px=None),
        }
        for message, wrong in fields.items():
            cases[json.dumps({"benchmarks": [entry("a", 1), wrong]})] = message
        for content, message in cases.items():
            with self.subTest(message):
                bad = self.write("bad.json", content)
                for files in ((bad, good), (good, bad)):
                    status, _, err = self.compare(*files)
                    self.assertEqual(status, 2)
                    self.assertIn(message, err)
                    self.assertIn("bad.json", err)
        status, _, err = self.compare(good, self.folder / "missing.json")
        self.assertEqual(status, 2)
        self.assertIn("missing.json: No such file", err)


if __name__ == "__main__":
    unittest.main()
