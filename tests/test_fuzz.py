"""Malformed inputs, kills and interrupts: the harness of benchmarks/fuzz.py with fixed seeds."""

import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzz import part, try_inputs
from fuzzing.judging import Call, judge
from fuzzing.trackers import wrong
from fuzzing.values import all_expressions, value_of
from soak import soak

from arrivals.measurement_models import LinearMeasurement
from arrivals.motion_models import RandomWalk
from arrivals.trackers import Kalman, available, find

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


@pytest.mark.parametrize(("name", "n_inputs"), [("trackers", 330), ("models", 600)])
def test_malformed_arguments_end_in_one_line_and_change_nothing(name: str, n_inputs: int) -> None:
    report = try_inputs(name, 1, range(n_inputs))
    assert report.n_tried >= n_inputs
    faults = list(report.lines())[len(report.tried) + 3 :]
    assert faults == []


@pytest.mark.parametrize(("name", "n_inputs"), [("files", 250), ("cli", 70), ("signals", 16)])
def test_damaged_files_arguments_kills_and_interrupts_have_no_fault(
    name: str, n_inputs: int
) -> None:
    command = [sys.executable, "fuzz.py", name, "--seed", "1", "--inputs", str(n_inputs)]
    done = subprocess.run(command, cwd=BENCHMARKS, capture_output=True, text=True, timeout=120)
    assert done.stderr == ""
    faults = [line for line in done.stdout.splitlines() if line[:1] not in ("|", "")]
    assert faults == []


# the harness itself


def test_every_registered_tracker_is_tried() -> None:
    ours = [name for name in available() if find(name).__module__.startswith("arrivals.")]
    assert [kind for kind in part("trackers").kinds() if kind in ours] == ours


def test_every_expression_has_a_value() -> None:
    values = {text: value_of(text, np.array([1.0, 2.0])) for text in all_expressions()}
    failed = [text for text, value in values.items() if isinstance(value, str) and value == "text"]
    assert failed == ["'text'"]


class Counter:
    def __init__(self) -> None:
        self.n, self.rng = 0, np.random.default_rng(0)

    def refuse_late(self) -> None:
        self.n += 1
        refuse()

    def draw_and_refuse(self) -> None:
        self.rng.random()
        refuse()


def refuse() -> None:
    RandomWalk(-1.0)


def write_into(z: Any) -> None:
    z[0] = 7.0


def warn() -> None:
    warnings.warn("overflow encountered", RuntimeWarning, stacklevel=1)


def raise_lines() -> None:
    raise ValueError("q must be\npositive")


@pytest.mark.parametrize(
    ("run", "what"),
    [
        (lambda: dict[str, int]()["a"], "KeyError"),
        (lambda: np.ones(2) + np.ones(3), "foreign ValueError"),
        (lambda: np.linalg.inv(np.zeros((2, 2))), "LinAlgError"),
        (raise_lines, "multi-line ValueError"),
        (warn, "RuntimeWarning"),
    ],
)
def test_other_error_is_a_fault(run: Any, what: str) -> None:
    fault = judge(Call("call", run))
    assert fault is not None
    assert fault[0].startswith(what)


def test_changed_state_and_argument_are_faults() -> None:
    counter, z = Counter(), np.zeros(2)
    late = judge(Call("late", counter.refuse_late, counter))
    drawn = judge(Call("drawn", counter.draw_and_refuse, counter))
    written = judge(Call("written", lambda: write_into(z), arguments=(z,)))
    assert late is not None
    assert "state.n: 0 became 1" in late[0]
    assert drawn is not None
    assert "state.rng" in drawn[0]
    assert written == ("argument modified", "in the call")


def test_deliberate_error_without_a_change_is_no_fault() -> None:
    assert judge(Call("call", refuse, Counter())) is None


@pytest.mark.parametrize(
    ("name", "value"),
    [("x", np.array([np.nan])), ("P", np.array([[np.inf]])), ("P", np.array([[-1.0]]))],
)
def test_belief_that_is_none_is_a_fault(name: str, value: Any) -> None:
    tracker = Kalman(RandomWalk(1.0, 1), LinearMeasurement([[1.0]], [[1.0]]), [0.0], [[1.0]])
    assert wrong(tracker) is None
    object.__setattr__(tracker, name, value)
    assert wrong(tracker) is not None


@pytest.mark.parametrize("name", ["kalman", "imm", "interpolation_ekf"])
def test_long_run_keeps_memory_and_covariance(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert soak(name, 1500) == []
    assert capsys.readouterr().out.count("\n| ") == 10
