"""Talkers in simulated rooms and small arrays: this library's trackers beside their peers.

Scenes of 8 s by pyroomacoustics' image sources (extra `bench`), all reflections, with voices of
espeak-ng where it is installed, else the shipped ones: three arrays, one or two talkers, standing
or moving, pauses, 20 and 10 dB. GOSPA with a cut-off of 20 degrees, over steps of 128 ms with an
active talker; short pauses and 0.3 s after an utterance cost nothing, found or not. CPU time is
that of one run, bins included.

    python benchmarks/rooms.py --seeds 0 1 --conditions nominal gains diffuse --out rows.csv
"""

from __future__ import annotations

import argparse
import csv
import os
import shutil
import time
import warnings
from collections.abc import Sequence
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from room_talkers.peers import METHODS
from room_talkers.scenes import ARRAYS, CONDITIONS, KINDS, RoomCase
from room_talkers.scores import score, truth_of
from tqdm import tqdm

from arrivals.typing import Float

Row = dict[str, Any]


def compare(case: RoomCase, methods: list[str]) -> list[Row]:
    """Return one row a method: the case, its scores and CPU s per s of audio.

    A tracker that cannot take the measurements is removed from `methods`.
    """
    scene, recording = case.scene, case.record()
    truth = truth_of(recording)
    n_active = truth.active.sum(axis=1)
    rows = []
    for name in list(methods):
        started = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = METHODS[name](scene, recording, n_active)
        except ValueError as error:
            tqdm.write(f"{name} left out: {error}")
            methods.remove(name)
            continue
        cpu = (time.process_time() - started) / scene.duration
        scores = asdict(score(truth, found.doa_deg, found.label, found.std_deg))
        rows.append({"method": name, **asdict(case), **scores, "cpu": cpu})
    return rows


def column(rows: Sequence[Row], key: str) -> Float:
    return np.array([row[key] for row in rows], dtype=np.float64)


def table(rows: Sequence[Row]) -> None:
    """Print means by method, and GOSPA by reverberation time and kind."""
    print("| method | GOSPA, deg | error, deg | missed, % | false a step | in pauses | switches "
          "| CPU s per s |")  # fmt: skip
    print("|---" * 8 + "|")
    names = list(dict.fromkeys(row["method"] for row in rows))
    by_method = {name: [row for row in rows if row["method"] == name] for name in names}
    for name, own in by_method.items():
        g = column(own, "gospa")
        error = column(own, "error")
        mean_error = np.nanmean(error) if np.isfinite(error).any() else np.nan
        print(f"| {name} | {g.mean():.2f} ± {g.std() / np.sqrt(len(g)):.2f} | {mean_error:.1f} "
              f"| {100 * column(own, 'missed').mean():.1f} | {column(own, 'false').mean():.2f} "
              f"| {column(own, 'in_pauses').mean():.2f} | {column(own, 'switches').mean():.2f} "
              f"| {column(own, 'cpu').mean():.4f} |")  # fmt: skip
    coverage(by_method)
    cells = list(dict.fromkeys((row["rt60"], row["kind"]) for row in rows))
    print("\n| GOSPA | " + " | ".join(f"{rt60:g} s, {kind}" for rt60, kind in cells) + " |")
    print("|---" * (len(cells) + 1) + "|")
    for name, own in by_method.items():
        means = [
            column([row for row in own if (row["rt60"], row["kind"]) == cell], "gospa").mean()
            for cell in cells
        ]
        print(f"| {name} | " + " | ".join(f"{mean:.1f}" for mean in means) + " |")


def coverage(by_method: dict[str, list[Row]]) -> None:
    """Print the coverage of the stated deviations by array and by reverberation time."""
    print("\n| within the stated 68 and 95 %, in % | of | errors of 68 | of 95 |")
    print("|---" * 4 + "|")
    for name, own in by_method.items():
        for key in ("array", "rt60"):
            for value in dict.fromkeys(row[key] for row in own):
                some = [row for row in own if row[key] == value]
                shares = [100 * column(some, f"within{level}") for level in (68, 95)]
                if np.isfinite(shares).any():
                    means = " | ".join(f"{np.nanmean(each):.0f}" for each in shares)
                    print(f"| {name} | {key} {value} | {means} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--rt60", type=float, nargs="+", default=[0.25, 0.5], help="s")
    parser.add_argument("--arrays", nargs="+", choices=ARRAYS, default=ARRAYS)
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--conditions", nargs="+", choices=CONDITIONS, default=["nominal"],
                        help="gains off by 1 dB, places by 1 mm; diffuse noise")  # fmt: skip
    parser.add_argument("--methods", nargs="+", choices=list(METHODS), default=list(METHODS))
    parser.add_argument("--out", type=Path, help="CSV file of a row a scene and method")
    options = parser.parse_args()
    installed = shutil.which("espeak-ng") is not None
    print("voices:", "espeak-ng" if installed else "the two shipped recordings, up to 4 kHz")
    rows: list[Row] = []
    methods = list(options.methods)
    for condition in options.conditions:
        cases = [
            RoomCase(array, kind, rt60, seed, condition)
            for seed, array, kind, rt60 in product(
                options.seeds, options.arrays, options.kinds, options.rt60
            )
        ]
        of_condition = [row for case in tqdm(cases, disable=None, leave=False)
                        for row in compare(case, methods)]  # fmt: skip
        print(f"\n## {condition}: {len(cases)} scenes\n")
        table(of_condition)
        rows += of_condition
    if options.out is not None and rows:
        with options.out.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
