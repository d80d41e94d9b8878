"""Gains from recordings with truth: the least error on a grid, cross-validation, logs through recipes."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pyarrow import csv

import compfilt as cf
from compfilt import simulate
from compfilt.design import AttitudeRecording, LinearRecording, TiltRecording, from_recordings
from compfilt.design.log import LogRecording, from_logs
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.recipe import parse_recipe

FS = 100.0


def recording(seed, *, seconds=60, noise=0.1, drift=0.1):
    """The best tau is noise/drift."""
    rng = np.random.default_rng(seed)
    rate = np.cos(np.arange(seconds * FS) / FS)
    angle = np.cumsum(rate) / FS
    return LinearRecording(
        angle + rng.normal(0.0, noise, angle.size), rate + rng.normal(0.0, drift, angle.size), angle, FS
    )


def rms(design, recordings):
    return np.sqrt(np.mean(np.concatenate([each.squared_errors(design) for each in recordings])))


@pytest.mark.parametrize("count", [1, 3])
def test_no_tau_on_a_grid_is_better(count):
    recordings = [recording(seed) for seed in range(count)]
    chosen = from_recordings(recordings)
    grid = [rms(cf.FirstOrder(tau), recordings) for tau in np.geomspace(0.05, 20.0, 101)]
    measured = dict(chosen.measured)
    error, crossed = measured.values()
    assert error == pytest.approx(rms(chosen.design, recordings), rel=1e-12)
    assert error <= min(grid) * (1 + 1e-6)
    assert error <= crossed < 1.2 * error
    assert chosen.sensitivity[0].halved == pytest.approx(
        rms(cf.FirstOrder(2 * chosen.design.tau), recordings)
    )
    assert abs(chosen.sensitivity[0].slope) < 0.02


def test_two_gains_are_found_with_a_bias():
    each = recording(0)
    biased = LinearRecording(each.measurement, each.derivative + 0.3, each.truth, FS)
    first, second = (dict(from_recordings([biased], kind=kind).measured) for kind in ("first_order", "pi"))
    assert min(second.values()) < 0.8 * min(first.values())


def test_cross_validation_tells_what_the_gains_are_worth_elsewhere():
    """Each fold is scored with the gains of the others: with other noise in one half, those are wrong."""
    recordings = [recording(0, noise=0.02, drift=0.5), recording(1, noise=0.5, drift=0.02)]
    error, crossed = dict(from_recordings(recordings).measured).values()
    alone = [from_recordings([each]).design for each in recordings]
    expected = np.sqrt(np.mean([rms(alone[1], recordings[:1]) ** 2, rms(alone[0], recordings[1:]) ** 2]))
    assert crossed == pytest.approx(expected, rel=1e-3)
    assert crossed > 1.5 * error


def test_what_is_not_known_does_not_count():
    each = recording(0)
    truth = each.truth.copy()
    truth[: truth.size // 20] = np.nan
    wrong = each.truth.copy()
    wrong[: truth.size // 20] = 99.0
    known = from_recordings([LinearRecording(each.measurement, each.derivative, truth, FS)])
    assert min(dict(known.measured).values()) < 0.1
    assert (
        min(
            dict(
                from_recordings([LinearRecording(each.measurement, each.derivative, wrong, FS)]).measured
            ).values()
        )
        > 1
    )


def test_an_angle_wraps():
    each = recording(0)
    turns = LinearRecording(
        np.angle(np.exp(1j * (each.measurement + 3.0))),
        each.derivative,
        each.truth + 3.0,
        FS,
        period=2 * np.pi,
    )
    assert from_recordings([turns]).design.tau == pytest.approx(from_recordings([each]).design.tau, rel=1e-3)


def seat(seed=0, duration=60.0):
    log = simulate.child_seat(seed=seed, duration=duration)
    return {name: np.asarray(values) for name, values in log.items()}


def test_tilt():
    log = seat()
    gyro = np.radians(np.column_stack([log[name] for name in ("gx", "gy", "gz")]))
    acc = 9.80665 * np.column_stack([log[name] for name in ("ax", "ay", "az")])
    truth = np.radians(np.column_stack([log["true_roll"], log["true_pitch"]]))
    each = TiltRecording(gyro, acc, truth, FS)
    chosen = from_recordings([each], folds=3)
    angles = cf.TiltFilter(chosen.design).estimate(gyro, acc, fs=FS).angles
    expected = np.sqrt(np.mean((angles - truth) ** 2))
    assert dict(chosen.measured)["error on the recordings (RMS)"] == pytest.approx(expected, rel=1e-9)


def attitude(*, truth):
    """Two minutes of a seat that leans, with the accelerations of the road."""
    log = seat(duration=120.0)
    roll, pitch = np.radians(log["true_roll"]), np.radians(log["true_pitch"])
    up = np.column_stack([-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])
    gyro = np.radians(np.column_stack([log[name] for name in ("gx", "gy", "gz")]))
    acc = 9.80665 * np.column_stack([log[name] for name in ("ax", "ay", "az")])
    return AttitudeRecording(gyro, acc, FS, up if truth else None, log["t"] > 10.0)


def test_attitude_with_truth_and_without():
    """The offline estimate chooses nearly what the truth chooses, and the error is the angle between the verticals."""
    true = attitude(truth=True)
    best, chosen = (
        from_recordings([each], kind="pi", folds=2).design for each in (true, attitude(truth=False))
    )
    assert rms_known(chosen, true) < 1.1 * rms_known(best, true)
    up = cf.Mahony.from_design(best).estimate(true.gyro, true.acc, fs=FS).up
    angle = np.arccos(np.clip(np.sum(up * true.up, axis=1), -1.0, 1.0))[true.counts]
    assert rms_known(best, true) == pytest.approx(np.sqrt(np.mean(angle**2)), rel=1e-6)


def rms_known(design, recording):
    return np.sqrt(np.nanmean(recording.squared_errors(design)))


RECIPE = """
version = 1
[log]
time = { column = "t", unit = "s" }
gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "g" }
axes = "flu"
[filter]
kind = "tilt"
design = { kind = "first_order", tau = 0.5 }
[output]
columns = ["roll", "pitch"]
unit = "deg"
"""


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    for seed in (0, 1):
        simulate.write(simulate.child_seat(seed=seed, duration=60.0), folder / f"{seed}.parquet")
    return [folder / "0.parquet", folder / "1.parquet"]


def test_logs_through_a_recipe(logs):
    """The error that is told is that of the recipe with the design that is told."""
    truth = {"roll": "true_roll", "pitch": "true_pitch"}
    chosen = from_logs(logs, parse_recipe(RECIPE), truth)
    signals = [seat(seed) for seed in (0, 1)]
    squares = []
    for log in signals:
        angles = np.degrees(
            cf.TiltFilter(chosen.design)
            .estimate(
                np.radians(np.column_stack([log[name] for name in ("gx", "gy", "gz")])),
                9.80665 * np.column_stack([log[name] for name in ("ax", "ay", "az")]),
                t=log["t"],
            )
            .angles
        )
        squares.append((angles - np.column_stack([log["true_roll"], log["true_pitch"]])) ** 2)
    expected = np.sqrt(np.mean(np.concatenate(squares)))
    assert dict(chosen.measured)["error on the recordings (RMS)"] == pytest.approx(expected, rel=1e-6)
    assert isinstance(chosen.design, cf.FirstOrder)


def test_the_kind_is_the_recipe_s_unless_another_is_asked_for(logs):
    recipe = parse_recipe(
        RECIPE.replace('"first_order", tau = 0.5', '"butterworth", omega0 = 1.0, order = 2, split = 1')
    )
    assert from_logs(logs[:1], recipe, {"roll": "true_roll"}, folds=2).design.split == 1
    other = from_logs(logs[:1], recipe, {"roll": "true_roll"}, kind="first_order", folds=2)
    assert isinstance(other.design, cf.FirstOrder)


@pytest.mark.parametrize("axes", ["flu", "frd"])
@pytest.mark.parametrize("time", ['{ column = "t", unit = "s" }', None])
def test_logs_without_truth(logs, axes, time):
    """The offline estimate stands in for it, in the recipe's axes and unit: what it chooses is near the best."""
    text = RECIPE if time else RECIPE.replace('time = { column = "t", unit = "s" }', "rate = 100.0")
    signs = "" if axes == "flu" else ", scale = [1, -1, -1] }"
    if signs:
        text = (
            text.replace('"deg/s" }', '"deg/s"' + signs)
            .replace('"g" }', '"g"' + signs)
            .replace('"flu"', '"frd"')
        )
    recipe = parse_recipe(text)
    best, chosen = (from_logs(logs[:1], recipe, truth, folds=2) for truth in ({"roll": "true_roll"}, None))
    assert ["against the offline estimate" in "".join(each.warnings) for each in (best, chosen)] == [
        False,
        True,
    ]
    grid = LogRecording(recipe, pq.read_table(logs[0]), {"roll": "true_roll"})
    assert rms_known(chosen.design, grid) < 1.25 * rms_known(best.design, grid)


def test_logs_that_do_not_serve(logs):
    recipe = parse_recipe(RECIPE)
    with pytest.raises(LogError, match=r'0\.parquet: .*"nothing"'):
        from_logs(logs, recipe, {"roll": "nothing"})
    attitude = RECIPE.replace('"tilt"', '"attitude"').replace(
        'design = { kind = "first_order", tau = 0.5 }', 'method = "gravity"'
    )
    reason = (
        'kind = "attitude" and method = "gravity" has no design to choose gains for: its one number is tau'
    )
    with pytest.raises(UsageError, match=reason):
        from_logs(logs, parse_recipe(attitude), {"roll": "true_roll"})
    for wrong, key in (("kp = 0.0", "kp must be positive"), ("kp = 1.0\nki = -1.0", "ki must be")):
        with pytest.raises(UsageError, match=rf"recipe: \[filter\] {key}"):
            from_logs(logs, parse_recipe(mahony(wrong)))
    with pytest.raises(UsageError, match="must be a chain of order 1 or 2"):
        from_logs(logs, parse_recipe(mahony("kp = 1.0")), kind="third_order")


@pytest.mark.parametrize("column", ["gx", "az", "true_roll"])
@pytest.mark.parametrize("text", [RECIPE, None], ids=["tilt", "mahony"])
def test_a_column_without_a_value_is_refused(logs, tmp_path, text, column):
    """The filter would coast, and the gains that are told would mean nothing."""
    table = pq.read_table(logs[0])
    holes = pa.array(np.full(len(table), np.nan))
    path = tmp_path / "holes.parquet"
    pq.write_table(table.set_column(table.schema.get_field_index(column), column, holes), path)
    truths = [{"roll": "true_roll"}] if column == "true_roll" else [{"roll": "true_roll"}, None]
    for truth in truths:
        with pytest.raises(
            LogError, match=rf'^\S*holes\.parquet: the column "{column}" must have values: all of them'
        ):
            from_logs([path], parse_recipe(text or mahony("kp = 1.0")), truth)


@pytest.mark.parametrize(("ending", "place"), [("csv", "line 6"), ("parquet", "row 5")])
def test_a_bad_sample_is_named_by_its_line_in_a_text(tmp_path, ending, place):
    log = seat()
    log["gx"][4] = np.nan
    path, table = tmp_path / f"log.{ending}", pa.table(log)
    (csv.write_csv if ending == "csv" else pq.write_table)(table, path)
    strict = parse_recipe(RECIPE + '\n[policy]\nmissing = "fail"\n')
    with pytest.raises(LogError, match=rf'log\.{ending}: {place} has no number in column "gx"'):
        from_logs([path], strict, {"roll": "true_roll"}, folds=2)


def mahony(gains, axes="flu"):
    """The recipe with Mahony's filter."""
    signs = "" if axes == "flu" else ", scale = [1, -1, -1]"
    return (
        RECIPE.replace('"tilt"', '"attitude"\nmethod = "mahony"')
        .replace('design = { kind = "first_order", tau = 0.5 }', gains)
        .replace('"deg/s"', f'"deg/s"{signs}')
        .replace('"g" }', f'"g"{signs} }}')
        .replace('"flu"', f'"{axes}"')
    )


GAINS = [
    ("kp = 1.0", cf.FirstOrder),
    ("kp = 1.0\nki = 0.1", cf.PiForm),
    ('design = { kind = "butterworth", omega0 = 1.0 }', cf.Butterworth),
]


@pytest.mark.parametrize(("gains", "kind"), GAINS)
def test_a_mahony_recipe_with_truth(logs, gains, kind):
    """The kind is that of the recipe's gains, and the error that is told is that of Mahony's filter with those chosen."""
    chosen = from_logs(logs[:1], parse_recipe(mahony(gains)), {"roll": "true_roll"}, folds=2)
    assert type(chosen.design) is kind
    log = seat()
    estimate = cf.Mahony.from_design(chosen.design).estimate(*signals_of(log), t=log["t"])
    roll = np.degrees(np.arctan2(estimate.up[:, 1], estimate.up[:, 2]))
    expected = np.sqrt(np.mean((roll - log["true_roll"]) ** 2))
    assert dict(chosen.measured)["error on the recordings (RMS)"] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("axes", ["flu", "frd"])
def test_a_mahony_recipe_without_truth(logs, axes):
    """It chooses what `AttitudeRecording` chooses for the same signals, whatever the axes, told in the recipe's unit."""
    chosen = from_logs(logs[:1], parse_recipe(mahony("kp = 1.0", axes)), folds=2)
    log = seat()
    gyro, acc = signals_of(log)
    up = np.asarray(cf.GravityFilter().smooth(gyro, acc, t=log["t"]).up)
    estimate = cf.Mahony.from_design(chosen.design).estimate(gyro, acc, t=log["t"]).up
    expected = np.degrees(np.sqrt(np.mean(np.arccos(np.clip(np.sum(up * estimate, axis=1), -1, 1)) ** 2)))
    assert dict(chosen.measured)["error on the recordings (RMS)"] == pytest.approx(expected, rel=1e-4)
    alone = from_recordings([AttitudeRecording(gyro, acc, FS)], folds=2)
    assert chosen.design.tau == pytest.approx(alone.design.tau, rel=0.02)


def test_the_line_for_a_mahony_recipe_is_one(logs):
    line = from_logs(logs[:1], parse_recipe(mahony("kp = 1.0\nki = 0.1")), kind="pi", folds=2).recipe_line()
    assert parse_recipe(mahony(line)).filter.linear.build() is not None


def signals_of(log):
    gyro = np.radians(np.column_stack([log[name] for name in ("gx", "gy", "gz")]))
    return gyro, 9.80665 * np.column_stack([log[name] for name in ("ax", "ay", "az")])


def test_a_recording_reads_its_rate_off_the_log(logs):
    each = LogRecording(parse_recipe(RECIPE), pq.read_table(logs[0]), {"roll": "true_roll"})
    assert each.fs == pytest.approx(FS, rel=1e-3)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: from_recordings([]), "recordings must have at least one"),
        (lambda: from_recordings([recording(0, seconds=5)], folds=1), "folds must be at least 2"),
        (
            lambda: from_recordings([LinearRecording(np.ones(500), np.ones(500), np.full(500, np.nan), FS)]),
            "known truth in every fold",
        ),
        (lambda: from_recordings([recording(0, seconds=5)], kind="tilt"), "kind must be one of"),
    ],
)
def test_errors_name_the_argument(call, words):
    with pytest.raises(ValueError, match=words):
        call()
