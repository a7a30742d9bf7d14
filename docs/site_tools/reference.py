"""Write the pages of the reference: one a package, and one for each of its public names."""

import importlib
import inspect
from pathlib import Path
from types import ModuleType

PACKAGES = {
    "arrivals": "Recordings in one call",
    "arrivals.measurement_models": "Arrays and measurement models",
    "arrivals.motion_models": "Motion models",
    "arrivals.trackers": "Trackers",
    "arrivals.scenarios": "Scenes, metrics, Monte Carlo studies",
    "arrivals.plots": "Plots",
    "arrivals.recordings": "Recordings and readers of files",
    "arrivals.measurement_models.arrays": "Array files",
    "arrivals.measurement_models.delays": "Real samples of one source",
    "arrivals.measurement_models.manifolds": "Responses of arrays",
    "arrivals.measurement_models.signal_strength": "Propagation and levels",
    "arrivals.motion_models.autoregressive": "Autoregressive models",
    "arrivals.trackers.autoregressive": "Directions and source signals",
    "arrivals.trackers.beamforming": "Beamformers and their kernels",
    "arrivals.trackers.conformance": "Conformance checks",
    "arrivals.trackers.filterpy": "filterpy's constructors",
    "arrivals.trackers.fusion": "Positions by several arrays",
    "arrivals.trackers.gaussian": "Kalman and particle filters",
    "arrivals.trackers.interpolation": "Delay of one source",
    "arrivals.trackers.multi_target": "Detection and association",
    "arrivals.trackers.rss": "Positions from signal strength",
    "arrivals.trackers.sparse_bayes": "Sparse Bayesian learning",
    "arrivals.trackers.subspace": "Subspace methods and their kernels",
    "arrivals.trackers.svalse": "SVALSE and VALSE",
    "arrivals.trackers.wideband": "Talkers and wideband sources",
    "arrivals.scenarios.bounds": "Bounds",
    "arrivals.scenarios.experiments": "Monte Carlo studies",
    "arrivals.scenarios.metrics": "Metrics",
    "arrivals.scenarios.ocean_acoustics": "Sound in shallow water",
    "arrivals.scenarios.reproduce": "Studies of the papers",
    "arrivals.scenarios.room_acoustics": "Sound in rooms",
    "arrivals.scenarios.simulations": "Simulated scenes",
    "arrivals.recordings.check": "Wiring of an array",
    "arrivals.recordings.choice": "Settings that are chosen for a recording",
    "arrivals.recordings.fusion": "Stations files and tables of bearings",
    "arrivals.recordings.networks": "Tables of signal strength",
}


def public_names(package: str) -> list[str]:
    """Return the public names of a package, sorted, those with capitals first."""
    names = importlib.import_module(package).__all__
    return sorted(name for name in names if not name.startswith("__"))


def documented() -> dict[str, str]:
    """Return the full name of each public name's page, by full name.

    A name that several packages export has one page, under the first of them.
    """
    pages: dict[str, str] = {}
    first: dict[int, str] = {}
    for package in PACKAGES:
        module = importlib.import_module(package)
        for name in public_names(package):
            thing = getattr(module, name)
            shared = inspect.isclass(thing) or inspect.isfunction(thing)
            full = f"{package}.{name}"
            pages[full] = first.setdefault(id(thing), full) if shared else full
    return pages


def write(folder: Path) -> None:
    """Write all pages into a folder; those that have not changed keep their time."""
    pages = documented()
    texts = {f"{full}.rst": page_of_name(full, pages) for full in sorted(set(pages.values()))}
    for package in PACKAGES:
        texts[f"{package}.rst"] = page_of_package(package, pages)
    texts["index.rst"] = index()
    folder.mkdir(exist_ok=True)
    for old in set(folder.glob("*.rst")) - {folder / name for name in texts}:
        old.unlink()
    for name, text in texts.items():
        file = folder / name
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")


def index() -> str:
    """Return the page of all packages."""
    lines = [heading("Reference"), "Every public name, by package.", ""]
    lines += ["=" * 60 + " " + "=" * 60, f"{'Package':60} Contents", "=" * 60 + " " + "=" * 60]
    lines += [f"{f':doc:`{name}`':60} {text}" for name, text in PACKAGES.items()]
    lines += ["=" * 60 + " " + "=" * 60, ""]
    return "\n".join([*lines, toctree(PACKAGES)])


def page_of_package(package: str, pages: dict[str, str]) -> str:
    """Return the page of a package: its first line, and a table of its names."""
    module = importlib.import_module(package)
    names = [f"{package}.{name}" for name in public_names(package)]
    own = [name for name in names if pages[name] == name]
    others = [pages[name] for name in names if pages[name] != name]
    parts = [heading(package), f".. module:: {package}", "", first_paragraph(module), ""]
    parts += [table(own), toctree(own)]
    if others:
        parts += ["Also here, documented elsewhere:", "", table(others)]
    return "\n".join(parts)


def page_of_name(full: str, pages: dict[str, str]) -> str:
    """Return the page of a class, a function or a value."""
    package, name = full.rsplit(".", 1)
    thing = getattr(importlib.import_module(package), name)
    if inspect.isclass(thing):
        body = [f".. autoclass:: {full}", "   :members:", "   :show-inheritance:", ""]
        body += inherited(thing, pages)
    elif callable(thing) and getattr(thing, "__doc__", None) and hasattr(thing, "__name__"):
        body = [f".. autofunction:: {full}"]
    else:
        body = [f".. autodata:: {full}", "   :no-value:"]
    return "\n".join([heading(name), *body, ""])


def inherited(thing: type, pages: dict[str, str]) -> list[str]:
    """Return one line a base class, with the public names that a class has from it."""
    documented_classes = classes(pages)
    lines, known = [], {name for name in vars(thing) if not name.startswith("_")}
    for base in thing.__mro__[1:]:
        names = [name for name in vars(base) if not name.startswith("_") and name not in known]
        known |= set(names)
        if not names or not base.__module__.startswith("arrivals"):
            continue
        page = documented_classes.get(base)
        if page is None:
            words = [f"``{name}``" for name in names]
            lines.append(f"From ``{base.__name__}``: {', '.join(words)}.")
        else:
            words = [f":py:obj:`{name} <{page}.{name}>`" for name in names]
            lines.append(f"From :py:class:`~{page}`: {', '.join(words)}.")
        lines.append("")
    return [".. rubric:: Inherited", "", *lines] if lines else []


def classes(pages: dict[str, str]) -> dict[type, str]:
    """Return the full name of the page of each public class."""
    found = {}
    for page in set(pages.values()):
        package, name = page.rsplit(".", 1)
        thing = getattr(importlib.import_module(package), name)
        if inspect.isclass(thing):
            found[thing] = page
    return found


def first_paragraph(module: ModuleType) -> str:
    """Return the first line of a module's docstring."""
    return (inspect.getdoc(module) or "").split("\n\n")[0]


def heading(text: str) -> str:
    """Return a heading in reStructuredText."""
    return f"{text}\n{'=' * len(text)}\n"


def table(names: list[str]) -> str:
    """Return a table of names with their first lines."""
    rows = [f"   ~{name}" for name in names]
    lines = [".. currentmodule:: None", "", ".. autosummary::", "   :nosignatures:", ""]
    return "\n".join([*lines, *rows, ""])


def toctree(names: list[str] | dict[str, str]) -> str:
    """Return a hidden list of pages."""
    return "\n".join([".. toctree::", "   :hidden:", "", *(f"   {name}" for name in names), ""])
