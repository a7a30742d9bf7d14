"""Constructors of models and settings, their methods, and functions, with malformed arguments."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import numpy as np

from arrivals.measurement_models import MeasurementModel
from arrivals.motion_models import MotionModel
from fuzzing.judging import Call
from fuzzing.model_cases import CLASSES, FUNCTIONS, Arguments, state_of
from fuzzing.values import malformed, value_of

MAY_BE_NAN = (  # or infinite, as documented
    "sphere_bound", "range_bound",
    "numbers", "real_numbers", "rows", "bootstrap_interval", "circular_nees", "coverage",
    "position_nees", "position_coverage", "sdr",
)  # fmt: skip
MODEST = 1e100  # of arguments from which a result has to be finite


def kinds() -> list[str]:
    """Return the names of the classes, and of the functions."""
    return [*CLASSES, *FUNCTIONS]


def calls(kind: str, rng: np.random.Generator) -> Iterator[Call]:
    """Yield a construction with one or two malformed parameters, or calls of methods."""
    if kind in FUNCTIONS:
        function, arguments = FUNCTIONS[kind]
        for _ in range(2):
            yield call_of(kind, function, arguments, rng)
        return
    make, cases = CLASSES[kind]
    params = cases[int(rng.integers(len(cases)))]
    model = make(**params)
    for _ in range(2):
        methods = list(_methods(model))
        if rng.random() < 0.5 or not methods:
            yield _construction(make, params, rng)
        else:
            name, arguments = methods[int(rng.integers(len(methods)))]
            yield call_of(f"{kind}.{name}", getattr(model, name), arguments, rng)


def call_of(name: str, function: Any, valid: Arguments, rng: np.random.Generator) -> Call:
    """Return a call with one malformed argument, now and then two."""
    arguments, texts = copy.deepcopy(valid), {}
    for _ in range(1 if rng.random() < 0.8 else 2):
        key = str(rng.choice(list(valid)))
        texts[key] = malformed(rng, valid[key])
        arguments[key] = value_of(texts[key], valid[key])
    shown = ", ".join(f"{key}={text}" for key, text in texts.items())
    modest = all(_is_modest(value) for value in arguments.values())

    def check(result: Any) -> str | None:
        silent = modest and name not in MAY_BE_NAN and not _is_finite(result)
        return f"silent NaN or inf: {result!r:.80}" if silent else None

    # what a function of the user raises comes through
    by_user = name.startswith("Function")
    own: Any = {"allowed": (Exception,), "deliberate": False} if by_user else {}
    return Call(f"{name}({shown})", lambda: function(**arguments), None,
                tuple(arguments.values()), check, extreme=not modest, **own)  # fmt: skip


def _construction(make: Any, params: Arguments, rng: np.random.Generator) -> Call:
    call = call_of(make.__name__, make, params, rng)
    call.check = _use
    return call


def _use(model: Any) -> str | None:
    """Use a model that was constructed: its methods at a valid state, its copies."""
    hash(model)
    if model != copy.deepcopy(model):
        return "not equal to its copy"
    repr(model)
    for name, arguments in list(_methods(model))[:4]:
        result = getattr(model, name)(**arguments)
        if not _is_finite(result):
            return f"silent NaN or inf in {name}: {result!r:.80}"
    return None


def _methods(model: Any) -> Iterator[tuple[str, Arguments]]:
    """Yield the methods of the Gaussian interface with valid arguments."""
    rng = np.random.default_rng(0)
    x = state_of(model)
    if isinstance(model, MotionModel):
        yield "f", {"x": x, "dt": 1.0}
        yield "F", {"x": x, "dt": 1.0}
        yield "Q", {"dt": 1.0}
        yield "sample", {"x": x, "rng": rng, "dt": 1.0}
    if isinstance(model, MeasurementModel):
        x = _fitting(model)
        z = np.linspace(0.1, 0.2, model.dim_z)
        yield "h", {"x": x}
        yield "H", {"x": x}
        yield "sample", {"x": x, "rng": rng}
        yield "residual", {"z": z, "z_pred": z}
        yield "for_state", {"names": ["x", "vx", "y", "vy", "doa", "delay"]}


def _fitting(model: MeasurementModel) -> Any:
    """Return a state of a size that the measurement takes."""
    for n in (len(model.needs), 3, 2, 4, 1, 6):
        x = np.linspace(0.3, 0.7, n)
        try:
            model.h(x)
        except ValueError:
            continue
        return x
    return np.linspace(0.3, 0.7, 4)


def _is_modest(value: Any) -> bool:
    """Return whether a result of the value has to be finite."""
    parts = value if isinstance(value, list | tuple) else (value,)
    if any(np.ma.isMaskedArray(part) or hasattr(part, "to_numpy") for part in parts):
        return False
    if any(isinstance(part, np.ndarray) and part.dtype == object for part in (value, *parts)):
        return False  # numpy 2.0 takes arrays in it as numbers, with a warning
    try:
        with np.errstate(all="ignore"):
            numbers = np.abs(np.asarray(value, dtype=np.complex128))
    except OverflowError:
        return False
    except (TypeError, ValueError, RecursionError):
        return not isinstance(value, list | tuple | np.ndarray)
    return bool(((numbers < MODEST) & ((numbers > 1 / MODEST) | (numbers == 0))).all())


def _is_finite(result: Any) -> bool:
    if isinstance(result, tuple):
        return all(map(_is_finite, result))
    try:
        return bool(np.isfinite(np.asarray(result, dtype=np.complex128)).all())
    except (TypeError, ValueError):
        return True
