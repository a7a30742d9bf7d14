"""Positions from several arrays: `fused` beside what one would write without a joint tracker.

    python benchmarks/fusion.py --seeds 100 130 --cells radio_10db radio3_10db --methods fused step

Every method has the bearings of the same trackers of directions (`svalse`), fitted to each step's
snapshots alone. GOSPA with p = 1 and a cut-off of 5 % of the map. `step` intersects bearings in
each step; `pairs` clusters crossings of pairs before nearest-neighbour Kalman filters; `heat_map`
sums beam spectra and is given the number of sources; `jpda` is Stone Soup's (extra `bench`). With
--cache, directions and bearings of the draws are kept in a folder.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import joblib
from station_fusion.cells import CELLS
from station_fusion.draws import draw
from station_fusion.methods import METHODS
from station_fusion.scores import HEADER, Score, row, score


def compare(cell: str, seed: int, methods: list[str], cache: Path | None) -> dict[str, Score]:
    """Return the scores of the methods on one draw of a cell."""
    drawn = draw if cache is None else joblib.Memory(cache, verbose=0).cache(draw)
    one = drawn(CELLS[cell], seed)
    runs = {name: METHODS[name](one) for name in methods}
    return {name: score(one.trial, run, ms, one.station_ms) for name, (run, ms) in runs.items()}


def main() -> None:
    """Print a table for each cell."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", nargs=2, type=int, default=(100, 130), metavar=("A", "B"))
    parser.add_argument("--cells", nargs="*", default=list(CELLS), choices=CELLS, metavar="CELL")
    parser.add_argument("--methods", nargs="*", default=list(METHODS), choices=METHODS)
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--cache", type=Path, help="folder of the draws' bearings")
    options = parser.parse_args()
    seeds = range(*options.seeds)
    with joblib.Parallel(options.jobs) as parallel:
        for cell in options.cells:
            task = joblib.delayed(compare)
            results = parallel(task(cell, s, options.methods, options.cache) for s in seeds)
            print(f"\n{cell}, seeds {seeds.start} to {seeds.stop - 1}\n\n{HEADER}")
            for name in options.methods:
                reference = [each["step"] for each in results] if "step" in results[0] else None
                print(row(name, [each[name] for each in results], reference), flush=True)


if __name__ == "__main__":
    main()
