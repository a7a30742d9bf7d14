"""Packages, links and wheel agree with the folders, and imports run one way."""

import ast
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("motion_models", "measurement_models", "trackers", "scenarios")
APPLICATIONS = ("recordings", "plots", "live", "cli")  # below src/arrivals
SETUPTOOLS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]


def packaged(folder: Path) -> dict[str, Path]:
    """Return the files of the packages by their place in a wheel."""
    homes = {f"arrivals/{name}": folder / name for name in FOLDERS}
    own = folder / "src" / "arrivals"
    files = {f"arrivals/{path.name}": path for path in own.glob("*.*") if path.is_file()}
    homes |= {f"arrivals/{name}": own / name for name in APPLICATIONS}
    for inside, home in homes.items():
        for path in home.rglob("*"):
            parts = path.relative_to(home).parts
            if path.is_file() and not any(part.startswith((".", "__pycache__")) for part in parts):
                files["/".join([inside, *parts])] = path
    return files


# what is installed


def test_every_folder_with_an_init_is_a_package() -> None:
    result = {
        place.rpartition("/")[0].replace("/", ".")
        for place in packaged(ROOT)
        if place.endswith("/__init__.py")
    }
    assert sorted(SETUPTOOLS["packages"]) == sorted(result)


def test_oldest_versions_are_the_floors() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    floors = dict(requirement.split(">=") for requirement in project["dependencies"])
    lines = (ROOT / "tests" / "oldest.txt").read_text().splitlines()
    oldest = dict(line.split("==") for line in lines if "==" in line)
    assert {name: oldest[name] for name in floors} == floors


def test_every_module_lies_in_a_package() -> None:
    packages = {package.replace(".", "/") for package in SETUPTOOLS["packages"]}
    astray = [
        place
        for place in packaged(ROOT)
        if place.endswith(".py") and place.rpartition("/")[0] not in packages
    ]
    assert astray == []


def test_packages_are_mapped_to_their_folders() -> None:
    mapping = {f"arrivals.{name}": name for name in FOLDERS} | {"arrivals": "src/arrivals"}
    assert SETUPTOOLS["package-dir"] == mapping


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege there")
@pytest.mark.skipif((ROOT / "PKG-INFO").exists(), reason="a source archive has no links")
def test_links_point_to_the_folders() -> None:
    for name in FOLDERS:
        link = ROOT / "src" / "arrivals" / name
        assert link.is_symlink()
        assert not link.readlink().is_absolute()
        assert link.resolve() == ROOT / name


def test_wheel_has_every_file_and_no_other(tmp_path: Path) -> None:
    source = tmp_path / "source"
    ignored = shutil.ignore_patterns(".*", "__pycache__", "*.egg-info", "build", "dist")
    shutil.copytree(ROOT, source, symlinks=True, ignore=ignored, copy_function=shutil.copyfile)
    for folder in [source, *(path for path in source.rglob("*") if path.is_dir())]:
        folder.chmod(0o755)  # the checkout may be one that cannot be written to
    pip = [sys.executable, "-m", "pip", "wheel"]
    options = ["--no-index", "--no-deps", "--no-build-isolation", "-w", str(tmp_path / "wheel")]
    done = subprocess.run(
        [*pip, *options, str(source)],
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    (path,) = (tmp_path / "wheel").glob("arrivals-*.whl")
    with zipfile.ZipFile(path) as wheel:
        names = wheel.namelist()
        (scripts,) = (name for name in names if name.endswith(".dist-info/entry_points.txt"))
        assert "arrivals = arrivals.__main__:main" in wheel.read(scripts).decode()
    inside = {name for name in names if ".dist-info/" not in name}
    assert "arrivals/py.typed" in inside
    assert inside == set(packaged(source))
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names)


# what an import brings along


@pytest.mark.parametrize(
    "module", ["arrivals", "arrivals.trackers", "arrivals.trackers.conformance"]
)
def test_import_is_light(module: str) -> None:
    """scipy alone would take a third of a second; the folder is one where bare names are found."""
    script = f"import sys, {module}; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    tops = {name.partition(".")[0] for name in done.stdout.split()}
    heavy = {"matplotlib", "sklearn", "joblib", "scipy", "filterpy", "tqdm", "pytest"}
    assert tops & {*heavy, *FOLDERS} == set()
    assert "arrivals" in tops


# imports run one way


def imports(source: str) -> Iterator[tuple[str, bool]]:
    """Return the full names that a source imports, and True for those inside a function."""

    def walk(node: ast.AST, inside: bool) -> Iterator[tuple[str, bool]]:
        if isinstance(node, ast.Import):
            yield from ((alias.name, inside) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            home = "." * node.level + (node.module or "")
            yield from ((f"{home}.{alias.name}", inside) for alias in node.names)
        inside = inside or isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
        for child in ast.iter_child_nodes(node):
            yield from walk(child, inside)

    return walk(ast.parse(source), inside=False)


def violations(place: str, source: str) -> list[str]:
    """Return the imports of a module that its place does not allow."""
    folder = place.split("/")[1]
    above: dict[str, tuple[str, ...]] = {
        "motion_models": ("measurement_models", "trackers", "scenarios"),
        "measurement_models": ("motion_models", "trackers", "scenarios"),
        "trackers": ("scenarios", *APPLICATIONS),
        "scenarios": (),
        **dict.fromkeys(APPLICATIONS, ()),
    }
    banned = [f"arrivals.{name}" for name in above.get(folder, FOLDERS)] + [*FOLDERS]
    late = ["filterpy"]  # only inside a function
    if folder not in ("scenarios", *APPLICATIONS):
        banned += ["matplotlib", "sklearn", "joblib", "tqdm", "scipy.io", "soundfile", "h5py"]
    if place.startswith("arrivals/trackers/conformance/"):
        banned.remove("sklearn")
        late.append("sklearn")
    if place == "arrivals/trackers/rss/batch.py":  # sequences in several processes
        banned.remove("joblib")
        late.append("joblib")

    def among(name: str, names: list[str]) -> bool:
        return any(f"{name}.".startswith(f"{other}.") for other in names)

    return [
        name
        for name, inside in imports(source)
        if name.startswith(".") or among(name, banned) or (among(name, late) and not inside)
    ]


MODULES = {
    place: path
    for place, path in packaged(ROOT).items()
    if place.endswith(".py") and place != "arrivals/__main__.py"  # the top, which calls scenarios
}


@pytest.mark.parametrize("place", MODULES)
def test_imports_run_one_way(place: str) -> None:
    assert violations(place, MODULES[place].read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("place", "source"),
    [
        (
            "arrivals/motion_models/a.py",
            "from arrivals.measurement_models.arrays.sensor_array import direction",
        ),
        ("arrivals/motion_models/a.py", "from arrivals import measurement_models"),
        ("arrivals/measurement_models/a.py", "import arrivals.motion_models as m"),
        ("arrivals/measurement_models/a.py", "def f():\n    from arrivals.trackers import find"),
        ("arrivals/trackers/a.py", "from arrivals.scenarios.metrics.gospa import gospa"),
        ("arrivals/trackers/a.py", "def f():\n    import matplotlib.pyplot"),
        ("arrivals/trackers/a.py", "def f():\n    from sklearn.linear_model import HuberRegressor"),
        ("arrivals/trackers/conformance/parameter_checks.py", "from sklearn.base import clone"),
        ("arrivals/trackers/a.py", "from filterpy.common import Saver"),
        ("arrivals/scenarios/a.py", "from trackers import SVALSE"),
        ("arrivals/scenarios/a.py", "from .metrics import gospa"),
        ("arrivals/validation.py", "from arrivals.trackers import find"),
        ("arrivals/validation.py", "def f():\n    from arrivals.motion_models import RandomWalk"),
    ],
)
def test_import_in_the_wrong_direction_is_detected(place: str, source: str) -> None:
    assert violations(place, source)


@pytest.mark.parametrize(
    ("place", "source"),
    [
        ("arrivals/trackers/a.py", "from arrivals.motion_models import RandomWalk\nimport scipy"),
        (
            "arrivals/trackers/conformance/parameter_checks.py",
            "def f():\n    from sklearn.base import clone",
        ),
        ("arrivals/trackers/a.py", "def f():\n    from filterpy.common import Saver"),
        (
            "arrivals/scenarios/a.py",
            "import matplotlib, joblib\nfrom arrivals.trackers import find",
        ),
    ],
)
def test_import_in_the_right_direction_is_not(place: str, source: str) -> None:
    assert violations(place, source) == []
