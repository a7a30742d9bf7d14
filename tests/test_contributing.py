"""The tracker of CONTRIBUTING.md: size, imports, accuracy, conformance checks; and the reader."""

import re
import subprocess
import sys
from pathlib import Path

TEXT = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")
SECTION = TEXT.split("### A tracker in 40 lines", 1)[1]
CODE = SECTION.split("```python\n", 1)[1].split("```", 1)[0]

SCRIPT = """
import numpy as np
import forgetting_music
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import create
from arrivals.trackers.conformance import check_tracker

model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.01)
rng = np.random.default_rng(0)
phases = np.exp(2j * np.pi * rng.random((30, 2)))
z = model.simulate(np.full((30, 2), [-0.4, 0.3]), phases, rng)
doa = create("forgetting_music", measurement=model).run(z).doa[-1]
np.testing.assert_allclose(np.sort(doa), [-0.4, 0.3], atol=0.01)
z[1, 3] = np.nan
check_tracker(lambda: create("forgetting_music", measurement=model), z[:6])
print("passed")
"""


def test_tracker_of_contributing_has_40_lines_and_no_private_imports() -> None:
    assert len(CODE.splitlines()) <= 40
    assert max(map(len, CODE.splitlines())) <= 100
    assert not re.search(r"import.*\b_|\._[a-z]", CODE)


def test_tracker_of_contributing_passes_the_conformance_checks(tmp_path: Path) -> None:
    (tmp_path / "forgetting_music.py").write_text(CODE, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stdout, done.returncode) == ("passed\n", 0), done.stderr


def test_reader_of_contributing_is_that_of_the_plugin() -> None:
    plugin = Path(__file__).parent / "plugin" / "counts_file.py"
    assert f"```python\n{plugin.read_text(encoding='utf-8')}```" in TEXT
