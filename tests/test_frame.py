"""Parameters, the registry, estimates and runs."""

import copy
import dataclasses
import importlib.metadata
import json
import pickle
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from arrivals.measurement_models import ArraySnapshot, MeasurementModel, SensorArray
from arrivals.motion_models import BernoulliVonMises, LinearMotion, RandomWalk, VonMisesWalk
from arrivals.params import Configurable, Model
from arrivals.trackers import (
    CBF,
    SVALSE,
    DirectionEstimate,
    Estimate,
    PositionEstimate,
    Run,
    Tracker,
    available,
    create,
    find,
)
from arrivals.trackers.base import missed
from arrivals.trackers.recorder import Recorder, replacing
from arrivals.trackers.registry import Registry
from arrivals.typing import Float

ARRAY = SensorArray.ula(5, spacing=0.5)
SNAPSHOTS = ArraySnapshot(ARRAY, wavelength=1.0)


class Hands(Tracker):
    """Shows what it is told: z holds the directions."""

    def __init__(self, motion: VonMisesWalk | None = None, inner: Tracker | None = None) -> None:
        self.motion, self.inner = motion, inner
        self.x, self.P = np.zeros(1), np.eye(1)
        self.doa = np.zeros(0)

    def predict(self, u: ArrayLike | None = None, *, dt: float = 1.0) -> None:
        self.x = self.x + dt

    def update(self, z: ArrayLike | None) -> None:
        self.doa = np.asarray([] if z is None else z, dtype=float)

    @property
    def estimate(self) -> DirectionEstimate:
        return directions(self.doa)


def directions(doa: ArrayLike, **per_step: Any) -> DirectionEstimate:
    doa = np.asarray(doa, dtype=float)
    label = np.arange(len(doa))
    amplitude = np.asarray(10.0**label, dtype=np.complex128)
    return DirectionEstimate(doa, 0.1 * doa, 0 * doa + 0.5, amplitude, label, **per_step)


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


def test_setting_reaches_into_parts_and_leaves_the_old_ones_alone() -> None:
    tracker = SVALSE(SNAPSHOTS, VonMisesWalkOfSources)
    old = tracker.measurement
    tracker.set_params(motion__kappa=30.0, measurement__array__speed=340.0, merge=0.0)
    assert (tracker.motion.kappa, tracker.merge) == (30.0, 0.0)
    assert tracker.measurement.array.speed == 340.0
    assert old.array.speed is None
    assert VonMisesWalkOfSources.kappa == 20.0


def test_setting_a_part_and_its_parameter_changes_the_new_part() -> None:
    tracker = SVALSE(SNAPSHOTS)
    tracker.set_params(motion__kappa=30.0, motion=BernoulliVonMises(p_activate=0.2))
    assert tracker.motion == BernoulliVonMises(kappa=30.0, p_activate=0.2)


def test_setting_reaches_into_a_tracker_inside_a_tracker() -> None:
    inner = Hands(VonMisesWalk(5.0))
    outer = Hands(inner=inner).set_params(inner__motion__kappa=7.0)
    assert isinstance(outer.inner, Hands)
    assert outer.inner.motion == VonMisesWalk(7.0)
    assert inner.motion == VonMisesWalk(5.0)


@pytest.mark.parametrize(
    ("params", "error", "message"),
    [
        (
            {"kappa": 1.0},
            ValueError,
            "SVALSE has no parameter 'kappa'; it has: carry, engine, kl, max_comp",
        ),
        ({"motion__kapa": 1.0}, ValueError, "BernoulliVonMises has no parameter 'kapa'"),
        ({"merge__x": 1.0}, ValueError, "merge of SVALSE has no parameters of its own"),
        ({"motion__kappa": -1.0}, ValueError, "kappa must be finite and positive; got -1"),
        ({"motion": VonMisesWalk(1.0)}, TypeError, "motion must be a BernoulliVonMises; got Von"),
        ({"tolerance": 1e-3, "posterior": "magic"}, ValueError, "posterior must be one of"),
    ],
)
def test_refused_parameters_change_nothing(
    params: dict[str, Any], error: type[Exception], message: str
) -> None:
    tracker = SVALSE(SNAPSHOTS)
    before = tracker.get_params(deep=False)
    with pytest.raises(error, match=message):
        tracker.set_params(**params)
    assert tracker.get_params(deep=False) == before


def test_model_is_replaced_not_changed() -> None:
    walk = BernoulliVonMises()
    assert walk.replace(kappa=3.0) == BernoulliVonMises(kappa=3.0)
    assert walk == BernoulliVonMises()
    assert SNAPSHOTS.replace(array__speed=2.0).array.speed == 2.0
    with pytest.raises(ValueError, match="VonMisesWalk has no parameter 'mu'; it has: kappa"):
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


def test_constructor_must_name_its_parameters() -> None:
    class Loose(Configurable):
        def __init__(self, **params: Any) -> None:
            pass

    with pytest.raises(TypeError, match=r"Loose must name its parameters; it takes \*\*params"):
        Loose().get_params()


# configurations


def test_configuration_is_plain_and_complete() -> None:
    tracker = SVALSE(SNAPSHOTS, VonMisesWalkOfSources, merge=0.0)
    config = tracker.to_dict()
    assert config["type"] == "svalse"
    assert (
        config["motion"]["type"] == "arrivals.motion_models.bernoulli_von_mises:BernoulliVonMises"
    )
    rebuilt = Tracker.from_dict(json.loads(json.dumps(config)))
    assert isinstance(rebuilt, SVALSE)
    assert rebuilt.get_params(deep=False) == tracker.get_params(deep=False)


def test_configuration_may_hold_a_tracker() -> None:
    outer = Hands(VonMisesWalk(2.0), inner=CBF(SNAPSHOTS, max_sources=2))
    config = json.loads(json.dumps(outer.to_dict()))
    assert config["inner"]["type"] == "cbf"
    rebuilt = Hands.from_dict(config)
    assert isinstance(rebuilt.inner, CBF)
    assert rebuilt.get_params()["inner__max_sources"] == 2
    assert rebuilt.motion == VonMisesWalk(2.0)


@dataclass(frozen=True)
class Several(Model):
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
        ({"type": "svals"}, ValueError, "there is no tracker 'svals'; did you mean svalse"),
        ({"type": "no_module:Thing"}, ValueError, "no class 'no_module:Thing' is installed here"),
        ({"type": "arrivals:Thing"}, ValueError, "no class 'arrivals:Thing' is installed here"),
        ({"type": ":Thing"}, ValueError, "no class ':Thing' is installed here"),
        ({"type": "json:JSONDecoder"}, TypeError, "json:JSONDecoder is not a Tracker"),
        ({"type": "json:dumps"}, TypeError, "json:dumps is not a Tracker"),
        ({"type": "cbf", "thresh": 1.0}, ValueError, "cbf has no parameter 'thresh'"),
        ({"type": "cbf"}, TypeError, "measurement"),
        ({"type": "cbf", "measurement": 1}, TypeError, "measurement must be a ArraySnapshot|an Ar"),
    ],
)
def test_bad_configuration_is_refused(config: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        Tracker.from_dict(config)


def test_configuration_of_another_kind_is_refused() -> None:
    with pytest.raises(TypeError, match="is not a MeasurementModel"):
        MeasurementModel.from_dict(VonMisesWalk(1.0).to_dict())


# the registry


class Animal:
    pass


class Dog(Animal):
    pass


class Cat(Animal):
    pass


@pytest.fixture
def animals() -> Registry[Animal]:
    registry = Registry(Animal, "arrivals.test_animals", "animal")
    registry.register("dog")(Dog)
    return registry


def test_registered_class_is_found_made_and_given_back_unchanged(
    animals: Registry[Animal],
) -> None:
    assert animals.register("cat")(Cat) is Cat
    assert animals.available() == ["cat", "dog"]
    assert animals.find("cat") is Cat
    assert type(animals.create("cat")) is Cat
    assert (animals.name_of(Dog), animals.name_of(Animal)) == ("dog", None)


def test_taken_name_is_an_error_and_no_overwrite(animals: Registry[Animal]) -> None:
    with pytest.raises(ValueError, match=r"animal name 'dog' is taken by test_frame\.Dog"):
        animals.register("dog")(Cat)
    assert animals.find("dog") is Dog
    assert animals.register("dog")(Dog) is Dog  # the same again is no conflict


@pytest.mark.parametrize("stranger", [int, Dog(), lambda: Dog()])
def test_only_what_derives_from_the_base_enters(animals: Registry[Animal], stranger: Any) -> None:
    with pytest.raises(TypeError, match="is no animal: derive it from Animal"):
        animals.register("stranger")(stranger)
    assert animals.available() == ["dog"]


def test_unknown_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(ValueError, match="there is no tracker 'svasle'; did you mean svalse"):
        create("svasle")
    with pytest.raises(
        ValueError, match=r"no tracker 'xyz'; known: ar_kalman_qrd_rls, .*cbf, .*svalse"
    ):
        find("xyz")


def test_built_in_trackers_are_made_by_name() -> None:
    assert {"cbf", "svalse", "valse"} <= set(available())
    tracker = create("cbf", measurement=SNAPSHOTS, max_sources=1)
    assert isinstance(tracker, CBF)
    assert tracker.max_sources == 1


# entry points of other packages


@pytest.fixture
def foreign(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[list[EntryPoint]]:
    """Pretend that packages are installed which bring animals; the list may be added to."""
    (tmp_path / "farm.py").write_text(
        "from test_frame import Animal\nclass Cow(Animal): pass\nclass Rock: pass\n"
    )
    (tmp_path / "farm_facade.py").write_text("from farm import Cow\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sys.modules, "test_frame", sys.modules[__name__])
    points: list[EntryPoint] = []

    def entry_points(*, group: str) -> EntryPoints:
        return EntryPoints(points).select(group=group)

    monkeypatch.setattr("arrivals.trackers.registry.entry_points", entry_points)
    yield points
    for module in ("farm", "farm_facade"):
        sys.modules.pop(module, None)


def point(name: str, value: str, group: str = "arrivals.test_animals") -> EntryPoint:
    return EntryPoint(name=name, value=value, group=group)


def test_foreign_class_is_listed_unloaded_and_imported_on_demand(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign += [point("cow", "farm:Cow"), point("other", "farm:Cow", "another.group")]
    assert animals.available() == ["cow", "dog"]
    assert "farm" not in sys.modules
    cow = animals.find("cow")
    assert (cow.__module__, cow.__name__) == ("farm", "Cow")
    assert animals.find("cow") is cow
    assert type(animals.create("cow")) is cow
    assert animals.name_of(cow) == "cow"


def test_foreign_class_may_be_named_by_another_path(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign.append(point("cow", "farm_facade:Cow"))
    assert animals.find("cow") is animals.find("cow")


def test_package_seen_twice_is_no_collision(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign += [point("cow", "farm:Cow"), point("cow", "farm:Cow")]
    assert animals.find("cow").__name__ == "Cow"


def test_foreign_class_cannot_take_our_name(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign.append(point("dog", "farm:Cow"))
    with pytest.raises(ValueError, match=r"'dog' is taken twice: farm:Cow, test_frame:Dog"):
        animals.find("dog")
    assert animals.available() == ["dog"]


def test_two_foreign_classes_cannot_share_a_name(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign += [point("cow", "farm:Cow"), point("cow", "byre:Cow")]
    with pytest.raises(ValueError, match="'cow' is taken twice: farm:Cow, byre:Cow"):
        animals.create("cow")


def test_foreign_thing_of_the_wrong_kind_is_refused(
    animals: Registry[Animal], foreign: list[EntryPoint]
) -> None:
    foreign.append(point("rock", "farm:Rock"))
    with pytest.raises(TypeError, match=r"Rock.* is no animal: derive it from Animal"):
        animals.find("rock")


def test_our_trackers_come_without_entry_points() -> None:
    ours = [p for p in importlib.metadata.entry_points(group="arrivals.trackers")
            if p.value.startswith("arrivals.")]  # fmt: skip
    assert ours == []


# estimates and their rows


def test_row_of_a_direction_is_in_degrees_and_db() -> None:
    estimate = DirectionEstimate(
        doa=np.deg2rad([30.0, -90.0, 5.0]),
        std=np.deg2rad([1.0, np.nan, 0.0]),
        existence=np.array([0.9, np.nan, 1.0]),
        amplitude=np.array([10j, complex(np.nan, np.nan), 0.0]),
        label=np.array([4, -1, 7]),
    )
    expected = [(4, 30, 1, 0.9, 20), (-1, -90, np.nan, np.nan, np.nan), (7, 5, 0, 1, -np.inf)]
    np.testing.assert_allclose(estimate.rows(), expected, rtol=1e-12)
    assert estimate.columns == ("label", "doa_deg", "std_deg", "existence", "level_db")
    assert set(estimate.per_step()) == {"converged", "iterations", "noise"}
    with pytest.raises(dataclasses.FrozenInstanceError):
        estimate.doa = np.zeros(3)  # type: ignore[misc]


def positions(n: int) -> PositionEstimate:
    return PositionEstimate(
        position=np.array([[1.0, 2.0], [3.0, 4.0]])[:n],
        covariance=np.array([[[4.0, 3.0], [3.0, 9.0]], [[1.0, 0.0], [0.0, 1.0]]])[:n],
        log_amplitude=np.array([np.log(10.0), 0.0])[:n],
        existence=np.array([0.5, np.nan])[:n],
        label=np.array([0, 1])[:n],
    )


def test_row_of_a_position_has_deviations_and_correlation() -> None:
    assert positions(2).columns == (
        "label", "x_m", "y_m", "std_x_m", "std_y_m", "corr", "existence", "level_db",
    )  # fmt: skip
    expected = [(0, 1, 2, 2, 3, 0.5, 0.5, 20), (1, 3, 4, 1, 1, 0, np.nan, 0)]
    np.testing.assert_allclose(positions(2).rows(), expected)
    assert positions(0).rows() == []


def test_bare_estimate_has_no_rows() -> None:
    @dataclass(frozen=True, eq=False)
    class Levels(Estimate):
        level: Float
        per_source = {"level": np.nan}  # noqa: RUF012

    assert Levels(np.zeros(3)).n_found == 3
    with pytest.raises(NotImplementedError):
        Levels(np.zeros(3)).rows()


# runs


def test_run_is_padded_where_less_was_found() -> None:
    run = Hands().run([[0.1, 0.2], None, [0.3], [0.1, 0.2, 0.3]], dt=0.5)
    nan = np.nan
    np.testing.assert_array_equal(
        run.doa, [[0.1, 0.2, nan], [nan] * 3, [0.3, nan, nan], [0.1, 0.2, 0.3]]
    )
    np.testing.assert_array_equal(run.label, [[0, 1, -1], [-1] * 3, [0, -1, -1], [0, 1, 2]])
    assert run.label.dtype.kind == "i"
    assert np.isnan(run.amplitude[1]).all()
    assert run.n_found.tolist() == [2, 0, 1, 3]
    assert run.time.tolist() == [0.0, 0.5, 1.0, 1.5]
    assert run.x.ravel().tolist() == [0.5, 1.0, 1.5, 2.0]
    assert run.converged.tolist() == [True] * 4
    assert (run.n_steps, len(run), run.elapsed > 0) == (4, 4, True)
    assert {"doa", "label", "noise", "time"} <= set(dir(run))
    with pytest.raises(AttributeError, match="this run has no 'position'"):
        _ = run.position


@pytest.mark.parametrize("n_steps", [1, 15, 16, 17, 100])
def test_every_estimate_comes_back_from_a_run(n_steps: int) -> None:
    rng = np.random.default_rng(n_steps)
    given = [
        directions(rng.normal(size=n), converged=bool(n % 2), iterations=int(n), noise=float(n))
        for n in rng.integers(0, 6, n_steps)
    ]
    recorder = Recorder(DirectionEstimate)
    for estimate in given:
        recorder.add(estimate, np.zeros(1))
    run = recorder.run(dt=1.0, elapsed=0.0)
    for step, estimate in enumerate(given):
        again = run.estimate(step)
        assert isinstance(again, DirectionEstimate)
        for name, value in vars(estimate).items():
            np.testing.assert_array_equal(getattr(again, name), value, strict=True)
        assert type(again.converged) is bool
    pickled = pickle.loads(pickle.dumps(run))
    np.testing.assert_array_equal(pickled.doa, run.doa)


def test_run_of_positions() -> None:
    recorder = Recorder(PositionEstimate)
    for n in (0, 2, 1):
        recorder.add(positions(n), np.zeros(4))
    run = recorder.run(dt=1.0, elapsed=0.0)
    assert run.position.shape == (3, 2, 2)
    assert run.covariance.shape == (3, 2, 2, 2)
    assert np.isnan(run.covariance[2, 1]).all()
    np.testing.assert_array_equal(run.estimate(1).rows(), positions(2).rows())


def test_run_of_nothing_has_all_fields(tmp_path: Path) -> None:
    run = Hands().run([])
    assert (len(run), run.n_found.shape, run.doa.shape[0], run.label.dtype.kind) == (
        0,
        (0,),
        0,
        "i",
    )
    assert run.converged.shape == run.noise.shape == (0,)
    run.to_csv(tmp_path / "tracks.csv")
    assert (tmp_path / "tracks.csv").read_text() == HEADER


def test_run_does_not_keep_the_room_it_grew_in() -> None:
    run = Hands().run([[0.1]] * 17)
    assert run.doa.base is None
    assert run.doa.shape == (17, 1)


@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan])
def test_time_runs_forward(dt: float) -> None:
    with pytest.raises(ValueError, match="dt must be finite and positive"):
        Hands().run([[0.1]], dt=dt)


def test_batch_starts_every_sequence_from_the_present_state() -> None:
    tracker = Hands()
    tracker.predict()
    one, two = tracker.run_batch([[[0.1], [0.2]], [None]])
    assert one.x.ravel().tolist() == [2.0, 3.0]
    assert two.x.ravel().tolist() == [2.0]
    assert tracker.x.tolist() == [1.0]


# the tracks file

HEADER = "step,time_s,label,doa_deg,std_deg,existence,level_db\n"


def tracks() -> Run:
    return Hands().run([np.deg2rad([30.0, -10.0]), None, [1 / 3]], dt=0.25)


def test_tracks_file(tmp_path: Path) -> None:
    path = tmp_path / "tracks.csv"
    tracks().to_csv(path)
    assert path.read_bytes().decode() == (
        HEADER
        + "0,0,0,30,3,0.5,0\n"
        + "0,0,1,-10,-1,0.5,20\n"
        + "2,0.5,0,19.0985932,1.90985932,0.5,0\n"
    )
    assert list(tmp_path.iterdir()) == [path]


def test_tracks_file_of_positions(tmp_path: Path) -> None:
    recorder = Recorder(PositionEstimate)
    recorder.add(positions(2), np.zeros(4))
    recorder.run(dt=1.0, elapsed=0.0).to_csv(str(tmp_path / "tracks.csv"))
    assert (tmp_path / "tracks.csv").read_text() == (
        "step,time_s,label,x_m,y_m,std_x_m,std_y_m,corr,existence,level_db\n"
        "0,0,0,1,2,2,3,0.5,0.5,20\n"
        "0,0,1,3,4,1,1,0,,0\n"
    )


def test_tracks_file_takes_other_times(tmp_path: Path) -> None:
    run = tracks()
    run.to_csv(tmp_path / "tracks.csv", time=[10.0, 20.0, 30.5])
    times = [line.split(",")[1] for line in (tmp_path / "tracks.csv").read_text().splitlines()]
    assert times == ["time_s", "10", "10", "30.5"]
    assert run.time.tolist() == [0.0, 0.25, 0.5]
    with pytest.raises(ValueError, match=r"time must have shape \(3,\); got \(2,\)"):
        run.to_csv(tmp_path / "other.csv", time=[1.0, 2.0])
    assert not (tmp_path / "other.csv").exists()


@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()])
def test_error_half_way_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    path = tmp_path / "tracks.csv"
    path.write_text("old")
    run = tracks()

    def rows(self: Run) -> Iterator[tuple[Any, ...]]:
        yield (0, 0.0, 0, 1.0, 1.0, 1.0, 1.0)
        assert len(list(tmp_path.iterdir())) == 2  # the new one is being written beside it
        raise error

    monkeypatch.setattr(Run, "rows", rows)
    with pytest.raises(type(error)):
        run.to_csv(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_file_appears_only_when_complete(tmp_path: Path) -> None:
    path = tmp_path / "new.txt"
    with replacing(path) as file:
        file.write("half\n")
        file.flush()
        assert not path.exists()
    assert path.read_text() == "half\n"


def test_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"folder .*nowhere does not exist"):
        tracks().to_csv(tmp_path / "nowhere" / "tracks.csv")


def test_folder_in_place_of_the_file_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "tracks.csv").mkdir()
    with pytest.raises(OSError, match=r"tracks\.csv"):
        tracks().to_csv(tmp_path / "tracks.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["tracks.csv"]


# missed measurements


@pytest.mark.parametrize(
    "z", [None, np.nan, [np.nan, np.nan], np.full((2, 3), np.nan), complex(np.nan, 0.0)]
)
def test_nothing_but_nan_is_missed(z: ArrayLike | None) -> None:
    assert missed(z)


@pytest.mark.parametrize("z", [0.0, [np.nan, 1.0], np.inf, [], "nan", [True], 3, 1j])
def test_anything_else_is_not(z: ArrayLike) -> None:
    assert not missed(z)


def test_whole_numbers_set_as_parameters_can_be_cloned() -> None:
    from sklearn.base import clone

    model = ArraySnapshot(SensorArray.ula(5, 0.5), 1.0)
    for name, params in (("svalse", {"snr_db": 10, "merge": 0}), ("cbf", {"threshold_db": 6})):
        tracker = create(name, measurement=model).set_params(**params)
        assert clone(tracker).get_params() == tracker.get_params()
        assert isinstance(getattr(tracker, next(iter(params))), float)


def test_a_tracker_that_cannot_be_imported_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    point = EntryPoint("broken", "no_such_package_here:Thing", "arrivals.trackers")
    monkeypatch.setattr("arrivals.trackers.registry.entry_points", lambda group: [point])
    with pytest.raises(ValueError, match="tracker 'broken', no_such_package_here:Thing, cannot"):
        find("broken")
    with pytest.raises(TypeError, match="named by a string; got 3"):
        find(3)  # type: ignore[arg-type]
