"""A tracker and a reader of another package, installed separately, are found and checked."""

import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

PLUGIN = Path(__file__).parent / "plugin"


def run(*command: str | Path, cwd: Path) -> str:
    """Run a command and return its output; show the output if it fails."""
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the interpreter of an environment with the plug-in and all packages of this one."""
    folder = tmp_path_factory.mktemp("plugin")
    venv.create(folder / "env", with_pip=False)
    scheme = {"base": str(folder / "env"), "platbase": str(folder / "env")}
    site = Path(sysconfig.get_path("purelib", "venv", vars=scheme))
    here = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    (site / "outer.pth").write_text(
        "".join(f"import site; site.addsitedir({path!r})\n" for path in sorted(here)),
        encoding="utf-8",
    )
    executable = Path(sysconfig.get_path("scripts", "venv", vars=scheme), Path(sys.executable).name)
    ignored = shutil.ignore_patterns("__pycache__", "*.egg-info")
    source = shutil.copytree(
        PLUGIN, folder / "source", ignore=ignored, copy_function=shutil.copyfile
    )
    source.chmod(0o755)  # the source folder may be read-only
    pip = [sys.executable, "-m", "pip", "--python", str(executable)]
    install = ["install", "--no-index", "--no-deps", "--no-build-isolation", str(source)]
    run(*pip, *install, cwd=folder)
    return executable


def test_plugin_is_not_in_this_environment() -> None:
    from arrivals.trackers import available

    assert "lag_one" not in available()


def test_plugin_is_listed_imported_and_created(python: Path, tmp_path: Path) -> None:
    script = """
import sys
import arrivals.trackers
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import Tracker, available, create, find

assert {"lag_one", "svalse"} <= set(available()), available()
assert "lag_one" not in sys.modules, "it must be imported on demand only"
kind = find("lag_one")
assert (kind.__module__, kind.__name__) == ("lag_one", "LagOne")
array = SensorArray.ula(8, spacing=0.5)
tracker = create("lag_one", measurement=ArraySnapshot(array, wavelength=1.0), memory=0.25)
tracker.update(array.steering_vector(0.4, 1.0))
assert abs(tracker.estimate.doa[0] - 0.4) < 1e-9
again = Tracker.from_dict(tracker.to_dict())
assert (type(again), again.memory) == (kind, 0.25)
print("made")
"""
    assert run(python, "-c", script, cwd=tmp_path) == "made\n"


def test_plugin_passes_the_checks(python: Path, tmp_path: Path) -> None:
    script = """
import numpy as np
from arrivals.measurement_models import ArraySnapshot, SensorArray
from arrivals.trackers import create
from arrivals.trackers.conformance import check_tracker

model = ArraySnapshot(SensorArray.ula(8, spacing=0.5), wavelength=1.0, noise=0.01)
z = model.simulate([[0.4], [0.41], [0.42], [0.43]], 1.0, np.random.default_rng(0))
z[1, 3] = np.nan
check_tracker(lambda: create("lag_one", measurement=model), z)
print("passed")
"""
    assert run(python, "-c", script, cwd=tmp_path) == "passed\n"


def test_plugin_with_a_registered_name_is_refused(python: Path, tmp_path: Path) -> None:
    script = """
from lag_one import LagOne
from arrivals.trackers import register

try:
    register("svalse")(LagOne)
except ValueError as error:
    print(error)
"""
    expected = "the tracker name 'svalse' is taken by arrivals.trackers.svalse.svalse.SVALSE\n"
    assert run(python, "-c", script, cwd=tmp_path) == expected


def test_reader_of_a_plugin_is_imported_for_its_suffix_and_its_content(
    python: Path, tmp_path: Path
) -> None:
    script = """
import sys, warnings
import numpy as np
from arrivals.recordings import read

counts = np.arange(-6, 6, dtype="<i4").reshape(4, 3)
content = b"COUNTS 500 3\\n" + counts.tobytes()
for name in ("a.counts", "a.data", "cut.counts"):
    with open(name, "wb") as file:
        file.write(content[:-1] if name.startswith("cut") else content)
np.save("b.npy", counts)
assert read("b.npy").n_channels == 3
assert "counts_file" not in sys.modules, "it must be imported on demand only"
for name in ("a.counts", "a.data"):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        recording = read(name)
    assert recording.rate == 500
    assert np.array_equal(recording.samples, counts / 2**31)
    lines = [str(each.message) for each in caught]
    assert "the reader 'broken', counts_file:ABSENT, cannot be loaded" in lines[0], lines
    assert len(lines) == (1 if name == "a.counts" else 2), lines
try:
    read("cut.counts")
except ValueError as error:
    print(error)
"""
    words = run(python, "-W", "ignore", "-c", script, cwd=tmp_path)
    assert words == "cut.counts: truncated: 11 bytes after 3 samples\n"
