"""The balancing cube's pipeline: six sensors to body rate, gravity, angles and wheel rates."""

import copy
import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import compfilt as cf
import reference as ref
import rigid_body as rb
from designs import assert_same_bits, pickled, precisions, same
from test_array import check_names_an_open_axis, make, refused

FS = 200.0
few = settings(max_examples=10)
seeds = st.integers(0, 2**32 - 1)
SENSORS = rb.thesis_cube()
PI = cf.PiForm(2.0, 0.5)
modes = pytest.mark.parametrize(
    "mode", [{"rates": "output"}, {"rates": "frozen", "at": rb.BALANCED}], ids=["output", "frozen"]
)
gyros = pytest.mark.parametrize("gyro", ["unknown", "known"])


def array():
    return make(SENSORS)


def cube(design=PI, **keywords):
    return cf.Cube(array(), design, **keywords)


def motion(t, size=1.0):
    """The cube swings about its corner and turns about the vertical."""
    centre = (0.5, *rb.BALANCED)
    return rb.swing(t, centre, size * np.array([0.4, 0.3, 0.5]), (3.0, 5.0, 4.0))


def seen(moving):
    """gyr, acc of perfect sensors."""
    return rb.rates_read(SENSORS, moving), rb.accelerations_read(SENSORS, moving)


def noisy(rows, seed=1, dtype=float, gaps=True):
    """gyr, acc, wheel of a swinging cube with noise and samples missing here and there."""
    rng = np.random.default_rng(seed)
    gyr, acc = seen(motion(np.arange(rows) / FS))
    gyr, acc = gyr + 0.05 * rng.normal(size=gyr.shape), acc + 0.3 * rng.normal(size=acc.shape)
    wheel = rng.normal(size=(rows, 3))
    if gaps:
        for signal, count in ((gyr, rows // 4), (acc, rows // 8), (wheel, rows // 20)):
            for place in zip(*(rng.integers(0, size, count) for size in signal.shape), strict=True):
                signal[place] = np.nan
        gyr[rows // 3 : rows // 3 + rows // 6] = np.nan  # all six gyros, for longer than the hold
        acc[rows // 2 : rows // 2 + 5] = np.nan
    return gyr.astype(dtype), acc.astype(dtype), wheel.astype(dtype)


def error(got, truth):
    """Largest difference of angles, on the circle."""
    return np.abs(ref.wrap(got - truth, 2 * math.pi)).max()


# ------------------------------------------------------------------------------------------------------- against truth


@gyros
@pytest.mark.parametrize("design", [cf.FirstOrder(0.5), PI, cf.Butterworth(3.0, 2, split=1)], ids=repr)
def test_angles_are_those_of_the_motion(design, gyro):
    """The error is of the first order in the sample period: the rates are samples and the angles those of the step before."""
    errors = []
    for fs in (500.0, 1000.0, 2000.0):
        moving = motion(np.arange(int(2 * fs)) / fs)
        estimate = cube(design, gyro=gyro).estimate(*seen(moving), t=np.arange(int(2 * fs)) / fs)
        errors.append(error(estimate.angles, moving.angles[:, 1:]))
    assert errors[2] < 2e-3
    assert 1.8 < errors[0] / errors[1] < 2.2
    assert 1.8 < errors[1] / errors[2] < 2.2


@gyros
def test_parts_are_those_of_the_motion(gyro):
    moving = motion(np.arange(300) / FS)
    wheel = np.random.default_rng(2).normal(size=(300, 3))
    estimate = cube(gyro=gyro).estimate(*seen(moving), wheel, fs=FS)
    np.testing.assert_allclose(estimate.body_rate, moving.omega, rtol=0, atol=1e-13)
    np.testing.assert_allclose(estimate.gravity, moving.gravity, rtol=0, atol=1e-11)
    np.testing.assert_allclose(estimate.wheel_rate, moving.omega + wheel, rtol=0, atol=1e-13)
    assert estimate.angles.shape == (300, 2)


@gyros
def test_angles_against_the_slow_filter(gyro):
    """Every step by the reference, from the truth's rates and gravity, with noise on both sensors."""
    rows = 200
    gyr, acc, _ = noisy(rows, gaps=False)
    start = motion(np.zeros(1)).angles[0, 1:]
    estimate = cube(gyro=gyro).estimate(gyr, acc, fs=FS, initial=start)
    rate = rb.mean_rate(SENSORS, gyr)
    gravity, _ = rb.extract(SENSORS, acc, rate if gyro == "known" else None)
    expected = ref.tilt_filter(ref.pi_form(2.0, 0.5), rate, gravity, 1 / FS, axes="cube", initial=start)
    assert error(estimate.angles, expected) < 1e-10


def test_extraction_frees_the_angles_from_the_motion():
    """One sensor's own reading taken as gravity errs by the acceleration of its place; the array does not."""
    fs = 1000.0
    t = np.arange(int(3 * fs)) / fs
    moving = rb.swing(t, (0.0, *rb.BALANCED), (0.3, 0.2, 0.2), (9.0, 12.0, 10.0))
    gyr, acc = seen(moving)
    with_array = cube(cf.FirstOrder(0.5)).estimate(gyr, acc, t=t)
    truth = moving.angles[:, 1:]
    for sensor in range(6):
        reading = acc[:, sensor] @ SENSORS.rotations[sensor]
        raw = cf.TiltFilter(cf.FirstOrder(0.5), axes="cube").estimate(moving.omega, reading, t=t)
        assert error(cf.tilt(reading, axes="cube"), truth) > math.radians(6)
        assert error(raw.angles, truth) > 5 * error(with_array.angles, truth)
    assert error(cf.tilt(with_array.gravity, axes="cube"), truth) < 1e-10
    assert error(with_array.angles, truth) < math.radians(0.5)


def test_known_rate_lowers_the_noise():
    rows = 2000
    gyr, acc, _ = noisy(rows, gaps=False)
    truth = motion(np.arange(rows) / FS).gravity
    spread = [
        np.std(cube(gyro=gyro).estimate(gyr, acc, fs=FS).gravity - truth) for gyro in ("known", "unknown")
    ]
    assert spread[0] < 0.7 * spread[1]


# -------------------------------------------------------------------------------------------------- frozen and output


def frozen_and_output(size):
    """Largest errors of the angles on a swing of this size about the operating point, hardly corrected by gravity."""
    t = np.arange(8000) / 4000
    moving = motion(t, size)
    start = moving.angles[0, 1:]
    design = cf.FirstOrder(20.0)
    signals = seen(moving)
    return [
        error(cube(design, **mode).estimate(*signals, t=t, initial=start).angles, moving.angles[:, 1:])
        for mode in ({"rates": "frozen", "at": rb.BALANCED}, {"rates": "output"})
    ]


def test_frozen_rates_err_with_the_square_of_the_swing():
    """S1's linear filter holds near its operating point; the rates at the filter's output hold everywhere."""
    errors = {size: frozen_and_output(size) for size in (0.05, 0.1, 1.0)}
    assert 3.0 < errors[0.1][0] / errors[0.05][0] < 5.0
    assert errors[0.05][0] < 2e-3
    assert errors[1.0][0] > math.radians(5)
    assert errors[1.0][1] < 5e-3


def test_frozen_rates_hold_at_their_operating_point():
    """A turn about the vertical leaves the angles where they are: there, both modes are right."""
    t = np.arange(1000) / 1000
    moving = rb.cube_motion(
        np.column_stack([2.0 * t, *np.full((2, 1000), np.array(rb.BALANCED)[:, None])]),
        np.tile([2.0, 0.0, 0.0], (1000, 1)),
        np.zeros((1000, 3)),
    )
    for mode in ({"rates": "frozen", "at": rb.BALANCED}, {"rates": "output"}):
        estimate = cube(**mode).estimate(*seen(moving), t=t)
        assert error(estimate.angles, np.array(rb.BALANCED)) < 1e-12
    aside = cube(rates="frozen", at=(0.0, 0.0)).estimate(*seen(moving), t=t)
    assert error(aside.angles, np.array(rb.BALANCED)) > 0.1


# ----------------------------------------------------------------------------------------------------- sum of its parts


def by_parts(design, gyr, acc, mode, gyro, **keywords):
    parts = array()
    rate = parts.body_rate(gyr)
    gravity = parts.gravity(acc, rate) if gyro == "known" else parts.gravity(acc)
    return rate, gravity, cf.TiltFilter(design, axes="cube", **mode).estimate(rate, gravity, **keywords)


OPTIONS = [
    {"fs": FS},
    {"t": 5.0 + np.cumsum(np.random.default_rng(3).uniform(0.001, 0.02, 240))},
    {"fs": FS, "initial": (0.1, -0.2)},
    {"fs": FS, "rule": "matched"},
    {"fs": FS, "hold": 0.02, "gap_cap": 0.01},
    {
        "t": np.concatenate([np.arange(120), np.arange(120)]) / FS,
        "backwards": "restart",
        "initial": (0.0, 1.0),
    },
]


@modes
@gyros
@precisions
@pytest.mark.parametrize("keywords", OPTIONS, ids=", ".join)
def test_cube_is_its_parts_bit_for_bit(mode, gyro, dtype, keywords):
    gyr, acc, wheel = noisy(240, dtype=dtype)
    estimate = cube(**mode, gyro=gyro).estimate(gyr, acc, wheel, **keywords)
    rate, gravity, tilt = by_parts(PI, gyr, acc, mode, gyro, **keywords)
    assert_same_bits(estimate.body_rate, rate)
    assert_same_bits(estimate.gravity, gravity)
    assert_same_bits(estimate.wheel_rate, rate + wheel)
    assert_same_bits(estimate.angles, tilt.angles)
    assert_same_bits(estimate.bias, tilt.bias)
    assert_same_bits(estimate.levels, tilt.levels)
    left_out = np.where(np.isfinite(gyr).all(axis=(1, 2)), 0, cf.Flags.SENSOR_MISSING)
    np.testing.assert_array_equal(estimate.flags, tilt.flags | left_out)
    assert estimate.counts == {**tilt.counts, "sensor_missing": (left_out != 0).sum()}
    assert estimate.angles.dtype == dtype


@pytest.mark.parametrize(
    "design", [cf.FirstOrder(0.5), cf.Butterworth(3.0, 3), cf.Chain([6.0, 13.0, 12.0, 4.0])], ids=repr
)
def test_any_design_of_an_angle(design):
    gyr, acc, _ = noisy(120)
    estimate = cf.Cube(array(), design).estimate(gyr, acc, fs=FS)
    _, _, tilt = by_parts(design, gyr, acc, {}, "unknown", fs=FS)
    assert_same_bits(estimate.angles, tilt.angles)
    assert_same_bits(estimate.levels, tilt.levels)


@precisions
def test_wheel_rates(dtype):
    """u_R = u_K + the wheels' rates against the body, S1 (1.5); without the wheels there are none."""
    gyr, acc, wheel = noisy(60, dtype=dtype)
    with_wheel = cube().estimate(gyr, acc, wheel, fs=FS)
    without = cube().estimate(gyr, acc, fs=FS)
    assert_same_bits(with_wheel.wheel_rate, with_wheel.body_rate + wheel)
    assert without.wheel_rate is None
    assert_same_bits(with_wheel.angles, without.angles)
    assert_same_bits(with_wheel.flags, without.flags)


@gyros
@few
@given(seed=seeds)
def test_layouts_of_any_mounting(gyro, seed):
    """Sensors at any place and any way round give the same angles, to rounding."""
    rng = np.random.default_rng(seed)
    rotations = [rb.random_rotation(rng) for _ in range(7)]
    sensors = rb.layout(rng.uniform(-0.1, 0.1, (7, 3)), rotations)
    moving = motion(np.arange(100) / FS)
    other = cf.Cube(make(sensors), PI, gyro=gyro).estimate(
        rb.rates_read(sensors, moving), rb.accelerations_read(sensors, moving), fs=FS
    )
    expected = cube(gyro=gyro).estimate(*seen(moving), fs=FS)
    assert error(other.angles, expected.angles) < 1e-9 * rb.condition(sensors)


# ----------------------------------------------------------------------------------------------------------- in pieces

lengths = st.integers(0, 80)
ways = st.sampled_from(["process", "process", "estimate", "call", "update"])


def restored(made_by, stream, **keywords):
    """A new stream that is given the state only."""
    other = made_by.stream(**keywords)
    other.state = stream.state
    return other


def run_piece(made_by, stream, way, signals, clock, part):
    """Angles of a piece, by one of the ways to run it."""
    gyr, acc, wheel = (signal[part] for signal in signals)
    times = {} if clock is None else {"t": clock[part]}
    if way == "update" and clock is None:
        rows = [stream.update(*row).angles for row in zip(gyr, acc, wheel, strict=True)]
        return np.array(rows, dtype=gyr.dtype).reshape(-1, 2)
    if way == "estimate":
        return stream.estimate(gyr, acc, wheel, **times).angles
    if way == "call":
        estimate = made_by.estimate(gyr, acc, wheel, initial=stream.state, **times or {"fs": FS})
        stream.state = estimate.state
        return estimate.angles
    return stream.process(gyr, acc, **times)


@modes
@gyros
@precisions
@few
@given(
    plan=st.lists(
        st.tuples(lengths, ways, st.sampled_from(["go on", "store", "copy", "restore"])), max_size=7
    ),
    seed=seeds,
    timed=st.booleans(),
)
def test_whole_is_any_chunking(mode, gyro, dtype, plan, seed, timed):
    """Bit for bit, streams stored and taken up again in between."""
    signals = noisy(200, seed, dtype)
    clock = 5.0 + np.cumsum(np.random.default_rng(seed).uniform(0.001, 0.02, 200)) if timed else None
    made_by = cube(**mode, gyro=gyro)
    whole = made_by.estimate(*signals, **({"fs": FS} if clock is None else {"t": clock}))
    keywords = {"fs": None if timed else FS, "dtype": dtype}
    stream = made_by.stream(**keywords)
    pauses = {
        "go on": same,
        "store": pickled,
        "copy": copy.deepcopy,
        "restore": lambda one: restored(made_by, one, **keywords),
    }
    parts, start = [], 0
    for length, way, pause in [*plan, (200, "process", "go on")]:
        part = slice(start, min(start + length, 200))
        parts.append(run_piece(made_by, stream, way, signals, clock, part))
        stream = pauses[pause](stream)
        start = part.stop
    assert_same_bits(np.concatenate(parts), whole.angles)
    assert stream.state == whole.state
    assert_same_bits(stream.state.levels, whole.state.levels)


@gyros
@precisions
def test_stream_estimate_has_every_part(gyro, dtype):
    signals = noisy(150, dtype=dtype)
    whole = cube(gyro=gyro).estimate(*signals, fs=FS)
    stream = cube(gyro=gyro).stream(fs=FS, dtype=dtype)
    pieces = [stream.estimate(*(signal[cut] for signal in signals)) for cut in (slice(0, 61), slice(61, 150))]
    for name in ("angles", "bias", "body_rate", "wheel_rate", "gravity", "flags"):
        assert_same_bits(np.concatenate([getattr(piece, name) for piece in pieces]), getattr(whole, name))
    assert_same_bits(np.concatenate([piece.levels for piece in pieces], axis=1), whole.levels)
    assert {key: sum(piece.counts[key] for piece in pieces) for key in whole.counts} == whole.counts
    assert pieces[1].state == whole.state == stream.state


def test_updates_with_steps_are_the_whole_with_times():
    gyr, acc, _ = noisy(120)
    t = np.cumsum(np.random.default_rng(4).uniform(0.001, 0.02, 120))
    stream = cube().stream()
    steps = np.diff(t, prepend=t[0])
    rows = [stream.update(*row, dt=dt).angles for *row, dt in zip(gyr, acc, steps, strict=True)]
    assert_same_bits(np.array(rows), cube().estimate(gyr, acc, t=t).angles)


def test_wheel_does_not_move_a_stream():
    gyr, acc, wheel = noisy(50)
    one, two = cube().stream(fs=FS), cube().stream(fs=FS)
    for row in range(50):
        first, second = one.update(gyr[row], acc[row], wheel[row]), two.update(gyr[row], acc[row])
        assert_same_bits(first.angles, second.angles)
    assert one.state == two.state


# ------------------------------------------------------------------------------------------------------ missing samples


def test_gyro_that_fails_is_left_out_of_the_mean():
    gyr, acc, _ = noisy(100, gaps=False)
    broken = gyr.copy()
    broken[20:, 3, 1] = np.nan
    estimate = cube().estimate(broken, acc, fs=FS)
    others = np.delete(np.arange(6), 3)
    expected = np.mean([gyr[20:, i] @ SENSORS.rotations[i] for i in others], axis=0)
    np.testing.assert_allclose(estimate.body_rate[20:], expected, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(estimate.flags, np.where(np.arange(100) < 20, 0, cf.Flags.SENSOR_MISSING))
    assert np.isfinite(estimate.angles).all()


@gyros
def test_accelerometer_that_fails_leaves_the_filter_coasting(gyro):
    """Gravity needs all its channels; without them the angles go on by the gyros, and the flags say so."""
    fs = 1000.0
    moving = motion(np.arange(1000) / fs)
    gyr, acc = seen(moving)
    acc[300:500, 2, 0] = np.nan
    estimate = cube(gyro=gyro).estimate(gyr, acc, fs=fs)
    gone = np.zeros(1000, bool)
    gone[300:500] = True
    np.testing.assert_array_equal(np.isnan(estimate.gravity), np.tile(gone[:, None], (1, 3)))
    missing = (estimate.flags & cf.Flags.MEASUREMENT_MISSING) != 0
    np.testing.assert_array_equal(missing.reshape(1000, -1).all(axis=1), gone)
    np.testing.assert_array_equal(missing.reshape(1000, -1).any(axis=1), gone)
    assert error(estimate.angles, moving.angles[:, 1:]) < 0.01


def test_unused_channels_may_fail():
    gyr, acc, _ = noisy(100, gaps=False)
    expected = cube().estimate(gyr, acc, fs=FS)
    acc[:, ~SENSORS.channels] = np.nan
    got = cube().estimate(gyr, acc, fs=FS)
    assert_same_bits(got.angles, expected.angles)
    assert got.counts == expected.counts


def test_all_gyros_missing_hold_the_rates():
    gyr, acc, _ = noisy(200, gaps=False)
    gyr[50:150] = np.nan
    estimate = cube().estimate(gyr, acc, fs=FS, hold=0.1)
    assert np.isnan(estimate.body_rate[50:150]).all()
    held = (estimate.flags & cf.Flags.DERIVATIVE_HELD) != 0
    missing = (estimate.flags & cf.Flags.DERIVATIVE_MISSING) != 0
    assert held[51:68].all()
    assert missing[72:150].all()
    assert np.isfinite(estimate.angles).all()
    known = cube(gyro="known").estimate(gyr, acc, fs=FS)
    assert np.isnan(known.gravity[50:150]).all()
    assert ((known.flags[50:150] & cf.Flags.MEASUREMENT_MISSING) != 0).all()


@pytest.mark.parametrize("gyro", ["unknown", "known"])
def test_missing_raise(gyro):
    gyr, acc, _ = noisy(20, gaps=False)
    holed = acc.copy()
    holed[7, 0, 1] = np.nan
    assert "missing" in refused(cube(gyro=gyro).estimate, gyr, holed, fs=FS, missing="raise")
    holed = gyr.copy()
    holed[7] = np.nan
    assert "missing" in refused(cube(gyro=gyro).estimate, holed, acc, fs=FS, missing="raise")


# ---------------------------------------------------------------------------------------------------------------- arrays


@precisions
def test_precision_is_kept(dtype):
    signals = noisy(80, dtype=dtype, gaps=False)
    estimate = cube().estimate(*signals, fs=FS)
    for name in ("angles", "bias", "levels", "body_rate", "wheel_rate", "gravity"):
        assert getattr(estimate, name).dtype == dtype
    double = cube().estimate(*noisy(80, gaps=False), fs=FS)
    assert error(estimate.angles, double.angles) < (2e-5 if dtype == np.float32 else 1e-15)


def test_strides_lists_and_empty_arrays():
    signals = noisy(40)
    expected = cube().estimate(*signals, fs=FS)
    for laid in (
        [np.asfortranarray(signal) for signal in signals],
        [np.repeat(signal, 3, axis=0)[::3] for signal in signals],
        [signal[::-1].copy()[::-1] for signal in signals],
        [signal.tolist() for signal in signals],
    ):
        got = cube().estimate(*laid, fs=FS)
        for name in ("angles", "wheel_rate", "gravity", "flags"):
            assert_same_bits(getattr(got, name), getattr(expected, name))
    empty = cube().estimate(*(signal[:0] for signal in signals), fs=FS)
    assert empty.angles.shape == (0, 2)
    assert empty.gravity.shape == empty.body_rate.shape == empty.wheel_rate.shape == (0, 3)


def test_inputs_stay_as_they_are():
    signals = noisy(40)
    before = [signal.copy() for signal in signals]
    cube().estimate(*signals, fs=FS)
    cube().stream(fs=FS).estimate(*signals)
    for now, then in zip(signals, before, strict=True):
        np.testing.assert_array_equal(now, then)


# --------------------------------------------------------------------------------------------------------------- objects


@pytest.mark.parametrize("duplicate", [pickled, copy.copy, copy.deepcopy])
@modes
@gyros
def test_cubes_and_streams_are_copied_and_compared(duplicate, mode, gyro):
    made = cube(**mode, gyro=gyro)
    other = duplicate(made)
    assert other == made
    assert repr(other) == repr(made)
    gyr, acc, _ = noisy(30)
    assert_same_bits(other.estimate(gyr, acc, fs=FS).angles, made.estimate(gyr, acc, fs=FS).angles)
    stream = made.stream(fs=FS)
    stream.process(gyr, acc)
    twin = duplicate(stream)
    assert twin == stream
    assert_same_bits(twin.process(gyr, acc), stream.process(gyr, acc))
    twin.update(gyr[0], acc[0])
    assert twin != stream


def test_cubes_differ():
    other_array = make(rb.thesis_sensors(1.5 * SENSORS.positions))
    cubes = [
        cube(),
        cube(gyro="known"),
        cube(cf.FirstOrder(1.0)),
        cube(rates="frozen", at=(0.0, 0.0)),
        cube(rates="frozen", at=rb.BALANCED),
        cf.Cube(other_array, PI),
    ]
    for i, first in enumerate(cubes):
        for j, second in enumerate(cubes):
            assert (first == second) == (i == j)
    assert cubes[0] != 1.0
    assert repr(cubes[0]).startswith("Cube(")


# ---------------------------------------------------------------------------------------------------------------- errors


def test_cube_that_needs_the_gyro():
    """Six sensors in the middle of the faces: gravity takes the known rate."""
    sensors = rb.face_centres()
    parts = make(sensors)
    moving = motion(np.arange(100) / FS)
    signals = rb.rates_read(sensors, moving), rb.accelerations_read(sensors, moving)
    estimate = cf.Cube(parts, PI, gyro="known").estimate(*signals, fs=FS)
    np.testing.assert_allclose(estimate.gravity, moving.gravity, atol=1e-12)
    # Where it is refused is left open, that it is refused is not.
    message = refused(lambda: cf.Cube(parts, PI).estimate(*signals, fs=FS))
    check_names_an_open_axis(message, [False] * 3)


BAD_CUBES = [
    (ValueError, "rates", {"rates": "x"}),
    (ValueError, "gyro", {"gyro": "x"}),
    (ValueError, "at", {"rates": "frozen", "at": (math.nan, 0.0)}),
]


@pytest.mark.parametrize(("kind", "name", "keywords"), BAD_CUBES)
def test_cubes_that_cannot_work(kind, name, keywords):
    assert re.search(rf"\b{name}\b", refused(cf.Cube, array(), PI, kind=kind, **keywords))


def test_cube_is_made_of_an_array_and_a_design():
    refused(cf.Cube, SENSORS.positions, PI, kind=TypeError)
    refused(cf.Cube, array(), 1.0, kind=TypeError)
    assert "derivative" in refused(cf.Cube, array(), cf.ThirdOrder(1.0))


BAD_SIGNALS = [
    ("gyr", np.zeros((9, 5, 3)), np.zeros((9, 6, 3)), None),
    ("gyr", np.zeros((9, 3)), np.zeros((9, 6, 3)), None),
    ("acc", np.zeros((9, 6, 3)), np.zeros((9, 5, 3)), None),
    ("acc", np.zeros((9, 6, 3)), np.zeros((9, 3)), None),
    ("acc|gyr", np.zeros((9, 6, 3)), np.zeros((8, 6, 3)), None),
    ("wheel", np.zeros((9, 6, 3)), np.zeros((9, 6, 3)), np.zeros((8, 3))),
    ("wheel", np.zeros((9, 6, 3)), np.zeros((9, 6, 3)), np.zeros((9, 2))),
    ("wheel", np.zeros((9, 6, 3)), np.zeros((9, 6, 3)), np.zeros(3)),
]


@pytest.mark.parametrize(("name", "gyr", "acc", "wheel"), BAD_SIGNALS)
def test_signals_must_fit(name, gyr, acc, wheel):
    stream = cube().stream(fs=FS)
    before = stream.state
    for call, keywords in ((cube().estimate, {"fs": FS}), (stream.estimate, {})):
        assert re.search(rf"\b({name})\b", refused(call, gyr, acc, wheel, **keywords))
    assert stream.state == before


def test_signals_must_be_real_numbers():
    good = np.zeros((9, 6, 3))
    for name, signals in (
        ("gyr", (good > 1, good)),
        ("acc", (good, good + 1j)),
        ("wheel", (good, good, "1")),
    ):
        assert re.search(rf"\b{name}\b", refused(cube().estimate, *signals, fs=FS, kind=TypeError))


def test_samples_must_fit():
    stream = cube().stream(fs=FS)
    before = stream.state
    good = np.zeros((6, 3))
    for name, sample in (
        ("gyr", (np.zeros((5, 3)), good)),
        ("acc", (good, np.zeros(3))),
        ("wheel", (good, good, [1.0])),
    ):
        assert re.search(rf"\b{name}\b", refused(stream.update, *sample))
    assert stream.state == before


def test_clock_is_one_of_two():
    gyr, acc, _ = noisy(20)
    refused(cube().estimate, gyr, acc)
    refused(cube().estimate, gyr, acc, fs=FS, t=np.arange(20) / FS)
    assert re.search(r"\bfs\b", refused(cube().estimate, gyr, acc, fs=-1.0))


# ----------------------------------------------------------------------------------------------------------- rate filter


@gyros
@pytest.mark.parametrize("axis", range(3))
def test_rate_filter_fed_with_the_arrays_angular_acceleration(gyro, axis):
    """S0 (30) on a swinging cube: the same as the loop over the formula, and without the gyro's bias."""
    rng = np.random.default_rng(5)
    moving = motion(np.arange(2000) / 1000)
    gyr, acc = seen(moving)
    parts = array()
    biased = parts.body_rate(gyr + 0.05 * rng.normal(size=gyr.shape)) + 0.3
    acceleration = parts.angular_acceleration(acc, moving.omega if gyro == "known" else None)
    np.testing.assert_allclose(acceleration, moving.alpha, rtol=0, atol=1e-9)
    tau, truth, rate = 0.1, moving.omega[:, axis], biased[:, axis]
    got = cf.RateFilter(tau).filter(rate, acceleration[:, axis], fs=1000.0, initial=truth[0])
    keywords = {"initial": truth[0], "gyro_before": truth[0]}
    expected = ref.rate_filter(tau, rate, moving.alpha[:, axis], 1 / 1000, **keywords)
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-9)
    assert abs(np.mean((got - truth)[1000:])) < 0.03
    assert np.mean((rate - truth)[1000:]) > 0.29
