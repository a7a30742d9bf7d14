"""Parameters by name, and configurations."""

import copy
import dataclasses
import json
import pickle
import sys
import types
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from recording_tracker import SNAPSHOTS, EchoTracker

from arrivals.measurement_models import ArraySnapshot, MeasurementModel, SensorArray
from arrivals.motion_models import BernoulliVonMises, LinearMotion, RandomWalk, VonMisesWalk
from arrivals.parameters import Configurable, FrozenModel
from arrivals.trackers import (
    CBF,
    SVALSE,
    NewtonSolver,
    Tracker,
    create,
)

# parameters by name


def test_parameters_have_nested_names() -> None:
    tracker = SVALSE(SNAPSHOTS, VonMisesWalkOfSources)
    deep, flat = tracker.get_params(), tracker.get_params(deep=False)
    assert flat["motion"] is tracker.motion
    assert "motion__kappa" not in flat
    assert deep["motion__kappa"] == 20.0
    assert deep["measurement__array__speed"] is None
    assert set(flat) == {name for name in deep if "__" not in name}


VonMisesWalkOfSources = BernoulliVonMises(kappa=20.0)


def test_set_params_replaces_nested_parts() -> None:
    tracker = SVALSE(SNAPSHOTS, VonMisesWalkOfSources)
    old = tracker.measurement
    assert isinstance(old, ArraySnapshot)
    tracker.set_params(motion__kappa=30.0, measurement__array__speed=340.0, solver__merge=0.0)
    assert tracker.motion.kappa == 30.0
    assert tracker.solver == NewtonSolver(merge=0.0)
    assert isinstance(tracker.measurement, ArraySnapshot)
    assert tracker.measurement.array.speed == 340.0
    assert old.array.speed is None
    assert VonMisesWalkOfSources.kappa == 20.0


def test_set_params_of_a_part_and_its_parameter_changes_the_new_part() -> None:
    tracker = SVALSE(SNAPSHOTS)
    tracker.set_params(motion__kappa=30.0, motion=BernoulliVonMises(p_activate=0.2))
    assert tracker.motion == BernoulliVonMises(kappa=30.0, p_activate=0.2)


def test_set_params_reaches_a_nested_tracker() -> None:
    inner = EchoTracker(VonMisesWalk(5.0))
    outer = EchoTracker(inner=inner).set_params(inner__motion__kappa=7.0)
    assert isinstance(outer.inner, EchoTracker)
    assert outer.inner.motion == VonMisesWalk(7.0)
    assert inner.motion == VonMisesWalk(5.0)


@pytest.mark.parametrize(
    ("params", "error", "message"),
    [
        (
            {"kappa": 1.0},
            ValueError,
            "SVALSE has no parameter 'kappa': did you mean motion__kappa",
        ),
        ({"motion__kapa": 1.0}, ValueError, "has no parameter 'kapa': did you mean motion__kappa"),
        ({"motion.kappa": 1.0}, ValueError, "no parameter 'motion.kappa': did you mean motion__k"),
        ({"zzz": 1.0}, ValueError, "SVALSE has no parameter 'zzz': known: carry_existence, "),
        ({"memory__x": 1.0}, ValueError, "memory of SVALSE has no parameters of its own"),
        ({"motion__kappa": -1.0}, ValueError, "kappa must be finite and positive; got -1"),
        ({"motion": VonMisesWalk(1.0)}, TypeError, "motion must be a BernoulliVonMises; got Von"),
        ({"solver__tolerance": 1e-3, "memory": "magic"}, ValueError, "memory must be one of"),
    ],
)
def test_refused_parameters_leave_the_object_unchanged(
    params: dict[str, Any], error: type[Exception], message: str
) -> None:
    tracker = SVALSE(SNAPSHOTS)
    before = tracker.get_params(deep=False)
    with pytest.raises(error, match=message):
        tracker.set_params(**params)
    assert tracker.get_params(deep=False) == before


def test_replace_returns_a_new_model() -> None:
    walk = BernoulliVonMises()
    assert walk.replace(kappa=3.0) == BernoulliVonMises(kappa=3.0)
    assert walk == BernoulliVonMises()
    assert SNAPSHOTS.replace(array__speed=2.0).array.speed == 2.0
    with pytest.raises(ValueError, match="VonMisesWalk has no parameter 'mu': known: kappa"):
        VonMisesWalk(1.0).replace(mu=2.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        walk.kappa = 1.0  # type: ignore[misc]


def test_models_are_shared_by_copies_and_remade_by_pickle() -> None:
    motion = LinearMotion([[1.0, 1.0], [0.0, 1.0]], np.eye(2))
    for model in (motion, SNAPSHOTS, RandomWalk(q=0.5)):
        assert copy.copy(model) is model
        assert copy.deepcopy([model])[0] is model
        loaded = pickle.loads(pickle.dumps(model))
        assert loaded.to_dict() == model.to_dict()


def test_constructor_with_unnamed_parameters_is_refused() -> None:
    class Loose(Configurable):
        def __init__(self, **params: Any) -> None:
            pass

    with pytest.raises(TypeError, match=r"Loose must name its parameters; got \*\*params"):
        Loose().get_params()


# configurations


def test_configuration_is_plain_and_complete() -> None:
    tracker = SVALSE(SNAPSHOTS, VonMisesWalkOfSources, solver=NewtonSolver(merge=0.0))
    config = tracker.to_dict()
    assert config["type"] == "svalse"
    assert config["motion"]["type"] == "arrivals.motion_models:BernoulliVonMises"
    rebuilt = Tracker.from_dict(json.loads(json.dumps(config)))
    assert isinstance(rebuilt, SVALSE)
    assert rebuilt.get_params(deep=False) == tracker.get_params(deep=False)


def test_configuration_contains_nested_trackers() -> None:
    outer = EchoTracker(VonMisesWalk(2.0), inner=CBF(SNAPSHOTS, max_sources=2))
    config = json.loads(json.dumps(outer.to_dict()))
    assert config["inner"]["type"] == "cbf"
    rebuilt = EchoTracker.from_dict(config)
    assert isinstance(rebuilt.inner, CBF)
    assert rebuilt.get_params()["inner__max_sources"] == 2
    assert rebuilt.motion == VonMisesWalk(2.0)


@dataclass(frozen=True)
class Several(FrozenModel):
    parts: Any


def test_list_of_parts_makes_the_round_trip() -> None:
    several = Several([VonMisesWalk(3.0), RandomWalk(q=0.5), 4])
    assert Several.from_dict(json.loads(json.dumps(several.to_dict()))) == several


@pytest.mark.parametrize(
    ("config", "error", "message"),
    [
        ({"kappa": 1.0}, ValueError, "dictionary with the key 'type'"),
        ("svalse", ValueError, "dictionary with the key 'type'; got 'svalse'"),
        ({"type": 3}, ValueError, "no tracker '3'"),
        ({"type": "svals"}, ValueError, "there is no tracker 'svals': did you mean svalse"),
        ({"type": "no_module:Thing"}, ValueError, "there is no class 'no_module:Thing'"),
        ({"type": "arrivals:Thing"}, ValueError, "there is no class 'arrivals:Thing'"),
        ({"type": ":Thing"}, ValueError, "there is no class ':Thing': install"),
        ({"type": "json:JSONDecoder"}, TypeError, "json:JSONDecoder is not a Tracker"),
        ({"type": "json:dumps"}, TypeError, "json:dumps is not a Tracker"),
        ({"type": "cbf", "thresh": 1.0}, ValueError, "cbf has no parameter 'thresh'"),
        ({"type": "cbf"}, TypeError, "measurement"),
        ({"type": "cbf", "measurement": 1}, TypeError, "measurement must be a ArraySnapshot|an Ar"),
    ],
)
def test_invalid_configuration_is_refused(
    config: Any, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        Tracker.from_dict(config)


def test_configuration_of_another_kind_is_refused() -> None:
    with pytest.raises(TypeError, match="is not a MeasurementModel"):
        MeasurementModel.from_dict(VonMisesWalk(1.0).to_dict())


def test_whole_numbers_set_as_parameters_can_be_cloned() -> None:
    from sklearn.base import clone

    model = ArraySnapshot(SensorArray.ula(5, 0.5), 1.0)
    for name, params in (
        ("svalse", {"solver__snr_db": 10, "solver__merge": 0}),
        ("cbf", {"threshold_db": 6}),
    ):
        tracker = create(name, measurement=model).set_params(**params)
        assert clone(tracker).get_params() == tracker.get_params()
        assert isinstance(tracker.get_params()[next(iter(params))], float)


# old names


class Drift(FrozenModel):
    renamed = {"speed": "q", "bound": "limits__upper"}  # noqa: RUF012

    def __init__(self, q: float = 1.0) -> None:
        self.q = q


class FastDrift(Drift):
    renamed = {"rate": "q"}  # noqa: RUF012


@pytest.mark.parametrize("kind", [Drift, FastDrift])
def test_old_parameter_name_is_refused_with_the_new_one(kind: type[Drift]) -> None:
    message = f"{kind.__name__} has no parameter 'speed': it is now called 'q'"
    with pytest.raises(TypeError, match=message):
        kind(speed=2.0)  # type: ignore[call-arg]  # on purpose
    with pytest.raises(ValueError, match=message):
        kind().replace(speed=2.0)
    with pytest.raises(ValueError, match=message):
        Drift.from_dict(kind().to_dict() | {"speed": 2.0})
    with pytest.raises(TypeError, match="it is now 'upper' of 'limits'"):
        kind(bound=2.0)  # type: ignore[call-arg]  # on purpose
    assert kind(3.0).q == 3.0


def test_subclass_has_the_renamed_parameters_of_its_bases() -> None:
    assert FastDrift.renamed == Drift.renamed | {"rate": "q"}


def test_create_refuses_an_old_parameter_name() -> None:
    with pytest.raises(TypeError, match="PeaksGNN has no parameter 'walk': it is now called 'mot"):
        create("peaks_gnn", measurement=SNAPSHOTS, walk=RandomWalk(q=1.0))
    with pytest.raises(ValueError, match="it is now called 'motion'"):
        create("peaks_gnn", measurement=SNAPSHOTS).set_params(walk=RandomWalk(q=1.0))


def test_models_are_named_by_the_public_package() -> None:
    assert SNAPSHOTS.to_dict()["type"] == "arrivals.measurement_models:ArraySnapshot"
    assert Drift().to_dict()["type"].endswith("test_parameters:Drift")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("arrivals.measurement_models.snapshots:ArraySnapshot", "measurement_models:ArraySnapshot"),
        ("arrivals.motion_models.stacked:Stacked", "motion_models:CombinedMotion"),
        ("arrivals.motion_models:Stacked", "motion_models:CombinedMotion"),
        ("arrivals.trackers.kalman_type:KalmanType", "trackers:GaussianFilter"),
    ],
)
def test_old_class_path_is_refused_with_the_public_one(old: str, new: str) -> None:
    with pytest.raises(ValueError, match=f"no class '{old}': it is now called 'arrivals.{new}'"):
        Configurable.from_dict({"type": old})


def test_configuration_does_not_import_other_packages() -> None:
    with pytest.raises(ValueError, match="there is no class 'this:Thing': install and import its"):
        Configurable.from_dict({"type": "this:Thing"})
    assert "this" not in sys.modules


@pytest.mark.parametrize("name", ["os:system", "os:path", "collections:abc.Mapping", "sys:modules"])
def test_configuration_calls_nothing_but_configurable_classes(name: str) -> None:
    for config in ({"type": name}, {"type": "svalse", "motion": {"type": name, "command": "no"}}):
        with pytest.raises((TypeError, ValueError), match=r"is not a|there is no class"):
            Configurable.from_dict(config)


def test_configuration_runs_no_code_of_an_imported_module(monkeypatch: pytest.MonkeyPatch) -> None:
    module = types.ModuleType("lazy")
    module.__getattr__ = lambda name: pytest.fail(name)  # type: ignore[method-assign]  # PEP 562
    monkeypatch.setitem(sys.modules, "lazy", module)
    with pytest.raises(ValueError, match="there is no class 'lazy:Thing'"):
        Configurable.from_dict({"type": "lazy:Thing"})


def test_configuration_that_is_nested_deeply_is_refused() -> None:
    parts: Any = {"type": "svalse"}
    lists: Any = 1.0
    for _ in range(5000):
        parts, lists = {"type": "svalse", "motion": parts}, [lists]
    for config in (parts, lists, {"type": "cbf", "measurement": lists}, {"type": {"a": lists}}):
        with pytest.raises(ValueError, match="config must be nested at most 32 deep; got more"):
            Configurable.from_dict(config)


def test_configuration_with_a_long_name_is_refused() -> None:
    for name in ("arrivals." + "a." * 10**5 + ":T", "a" * 10**6, "arrivals..:T", ":", "a:b:c"):
        with pytest.raises(ValueError, match="there is no"):
            Configurable.from_dict({"type": name})
