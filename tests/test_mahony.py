"""Mahony's filters against a slow reference, the linear filter and theory; at the end, what every attitude filter promises."""

import copy
import math
import re
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import attitude_reference as ref
import compfilt as cf
from designs import assert_same_bits, pickled, precisions, restored, same
from test_contract import layouts, not_real, pieces, plans, read_only, seeds, time_steps

FS = 100.0
DT = 1 / FS
FIELD = np.array([0.0, 20.0, -40.0])
FORMS = ["explicit", "passive", "direct"]

few = settings(max_examples=6)
some = settings(max_examples=15)

forms = pytest.mark.parametrize("form", FORMS)
fields = pytest.mark.parametrize("field", [None, FIELD], ids=["gravity alone", "magnetometer"])
clocks = pytest.mark.parametrize("clock", ["fs", "t"])
gains = pytest.mark.parametrize(("kp", "ki"), [(2.0, 0.0), (1.0, 0.5)], ids=["proportional", "with bias"])


def steps_of(clock, count, rng, pauses=(0.4, 3.0)):
    """Time steps: all the same, or with jitter, a repeated time, and pauses."""
    if clock == "fs":
        return np.full(count, DT)
    dt = rng.uniform(0.002, 0.02, count)
    dt[[0, count // 3]] = 0.0
    for n, pause in enumerate(pauses):
        dt[count // 2 + 40 * n] = pause
    return dt


def clock_of(samples):
    """fs where that describes the steps, otherwise t."""
    return {"fs": 1 / samples.dt[0]} if np.ptp(samples.dt) == 0 else {"t": samples.t}


def run(design, samples, **keywords):
    return design.estimate(**samples.arrays, **clock_of(samples), **keywords)


def check_like_the_reference(estimate, expected, tolerance):
    """All but AMBIGUOUS, which has its own test."""
    for name, got, wanted in (
        ("attitude", ref.matrices(estimate.quaternion), expected.R),
        ("up", estimate.up, expected.up),
        ("bias", estimate.gyro_bias, expected.bias),
    ):
        np.testing.assert_allclose(got, wanted, rtol=0, atol=tolerance, err_msg=name)
    np.testing.assert_array_equal(estimate.flags & ~np.uint8(ref.AMBIGUOUS), expected.flags)
    np.testing.assert_array_equal(estimate.at_rest, expected.at_rest)


def errors(estimate, motion):
    """The angle to the truth in rad, one a sample."""
    return ref.angles_between(ref.matrices(estimate.quaternion), motion.R[1:])


def tilt_errors(estimate, motion):
    return ref.angles_between_directions(estimate.up, motion.R[1:, 2])


def quaternion(axis, angle):
    return [math.cos(angle / 2), *(math.sin(angle / 2) * np.asarray(axis, dtype=float))]


# ------------------------------------------------------------------------------------------------ against the reference


def test_the_reference_turns_like_matrix_exponentials():
    rng = np.random.default_rng(0)
    for size in (1e-9, 1.0, 10.0):
        turn = size * rng.normal(size=3)
        expected = ref.linear.linalg.expm(ref.linear.cross_matrix(turn))
        np.testing.assert_allclose(ref.exp(turn), expected, atol=1e-13)
        start, end = rng.normal(size=(2, 3))
        start, end = start / np.linalg.norm(start), end / np.linalg.norm(end)
        np.testing.assert_allclose(ref.smallest_turn(start, end) @ start, end, atol=1e-13)


@forms
@fields
@gains
@clocks
def test_like_the_reference(form, field, kp, ki, clock):
    """Half-angle series cost up to 1e-11 of a turn."""
    rng = np.random.default_rng(8)
    motion, samples = ref.random_samples(rng, steps_of(clock, 200, rng), field=field)
    for initial in (None, motion.start):
        expected = ref.Mahony(kp, ki, form).run(samples, initial)
        for dtype, tolerance in ((np.float64, 1e-9), (np.float32, 2e-4)):
            estimate = run(cf.Mahony(kp, ki, form), samples.astype(dtype), initial=initial)
            assert estimate.quaternion.dtype == dtype
            check_like_the_reference(estimate, expected, tolerance)


@forms
@fields
@gains
@clocks
def test_like_the_reference_with_missing_samples(form, field, kp, ki, clock):
    rng = np.random.default_rng(9)
    _, samples = ref.random_samples(rng, steps_of(clock, 300, rng), field=field)
    samples = ref.with_gaps(rng, samples, DT)
    samples.acc[:3] = np.nan
    # A hold and a range that no sum of steps and no sample meets by chance.
    expected = ref.Mahony(kp, ki, form, hold=0.0953, acc_range=14.0).run(samples)
    assert set(np.unique(expected.flags & ref.ACC_MISSING)) == {0, 1}
    estimate = run(cf.Mahony(kp, ki, form, acc_range=14.0), samples, hold=0.0953)
    check_like_the_reference(estimate, expected, 1e-9)


@forms
def test_like_the_reference_where_the_bias_meets_its_limit(form):
    rng = np.random.default_rng(10)
    _, samples = ref.random_samples(rng, np.full(300, DT), field=FIELD)
    samples = samples.changed(gyr=samples.gyr + 0.3)
    expected = ref.Mahony(2.0, 4.0, form, bias_limit=0.05).run(samples)
    assert np.isclose(np.linalg.norm(expected.bias, axis=1), 0.05).mean() > 0.3
    check_like_the_reference(run(cf.Mahony(2.0, 4.0, form, bias_limit=0.05), samples), expected, 1e-9)


# ---------------------------------------------------------------------------------------------------- exact properties


@forms
@fields
@some
@given(seed=seeds, dt=time_steps(120), gone=st.lists(st.integers(1, 119), max_size=20))
def test_consistent_input_is_reproduced(form, field, seed, dt, gone):
    """Started at the motion, whatever the gains, the time steps and the missing directions: complementarity on the rotations."""
    rng = np.random.default_rng(seed)
    dt[0] = 0.0
    motion = ref.random_motion(rng, dt)
    samples = motion.samples(field=field)
    samples.acc[gone] = np.nan
    if field is not None:
        samples.mag[rng.integers(1, 120, 10)] = np.nan
    design = cf.Mahony(*rng.uniform([0.1, 0.0], [20.0, 5.0]), form)
    estimate = design.estimate(**samples.arrays, t=samples.t, initial=motion.start)
    assert errors(estimate, motion).max() < 1e-9
    assert np.abs(estimate.gyro_bias).max() < 1e-9


LOOPS = {
    "first order": cf.FirstOrder(0.5),
    "pi": cf.PiForm(2.0, 1.5),
    "butterworth": cf.Butterworth(3.0, q=0.7),
    "chain": cf.Chain([1.5, 0.25]),
}


@forms
@pytest.mark.parametrize("loop", LOOPS.values(), ids=LOOPS)
@pytest.mark.parametrize("axis", [0, 1, 2], ids=["roll", "pitch", "yaw"])
@clocks
def test_small_errors_obey_the_linear_filter(form, loop, axis, clock):
    """A turn about one axis is the linear filter of the design, with its gaps; about the vertical by the magnetometer."""
    rng = np.random.default_rng(3)
    dt = steps_of(clock, 400, rng)
    size = 1e-4  # rad: what the sine leaves out is of its third power
    u, y = size * rng.normal(size=(2, 400))
    gone = rng.random(400) < 0.2
    gone[0] = False
    holed = {"y": np.where(gone, np.nan, y), "u": u.copy()}
    holed["u"][100:105] = np.nan
    directions = {"acc": np.tile([0.0, 0.0, 9.81], (400, 1)), "mag": np.tile(FIELD, (400, 1))}
    measured = "mag" if axis == 2 else "acc"
    turn = -holed["y"][:, None] * np.eye(3)[axis]
    directions[measured] = directions[measured] + np.cross(turn, directions[measured])
    if axis == 2:  # then the vertical corrects whenever it is there
        directions["acc"][gone] = np.nan
    samples = ref.Samples(np.outer(holed["u"], np.eye(3)[axis]), directions["acc"], dt, directions["mag"])
    if axis != 2:
        samples = ref.Samples(samples.gyr, samples.acc, dt)
    clock = clock_of(samples)
    linear = loop.estimate(holed["y"], holed["u"], initial=0.0, **clock)
    estimate = cf.Mahony.from_design(loop, form).estimate(**samples.arrays, **clock, initial=[1, 0, 0, 0])
    np.testing.assert_allclose(2 * estimate.quaternion[:, 1 + axis], linear.levels[0], atol=1e-7 * size)
    if loop.order == 2:
        np.testing.assert_allclose(estimate.gyro_bias[:, axis], -linear.levels[1], atol=1e-6 * size)


@forms
def test_the_start_is_the_mean_of_the_measurements(form):
    """Until that takes longer than the filter's own memory."""
    rng = np.random.default_rng(4)
    noise = 1e-3 * rng.normal(size=(2000, 2))
    acc = 9.81 * np.column_stack([noise, np.ones(2000)])
    up = cf.Mahony(0.5, form=form).estimate(np.zeros((2000, 3)), acc, fs=FS).up[:, :2]
    count = np.arange(1, 2001)[:, None]
    mean = np.cumsum(noise, axis=0) / count
    own_memory = count[:, 0] > 1 + 1 / (DT * 0.5)
    np.testing.assert_allclose(up[~own_memory], mean[~own_memory], atol=2e-8)
    assert np.abs(up - mean)[own_memory].max() > 1e-6


def test_a_given_start_is_no_mean():
    """Who gives an attitude knows it."""
    tilted = np.tile([0.0, 6.0, 8.0], (1, 1))
    start = [1.0, 0.0, 0.0, 0.0]
    estimate = cf.Mahony(0.5).estimate(np.zeros((1, 3)), tilted, fs=FS, initial=start)
    assert 0 < estimate.up[0, 1] < 0.01


@forms
def test_equivariance_under_turns_of_the_body(form):
    """A sensor that is mounted otherwise sees the same world."""
    rng = np.random.default_rng(11)
    _, samples = ref.random_samples(rng, np.full(500, DT), field=FIELD)
    S = ref.random_attitude(rng)
    turned = samples.changed(**{name: array @ S.T for name, array in samples.arrays.items()})
    one, other = (run(cf.Mahony(1.0, 0.3, form), each) for each in (samples, turned))
    np.testing.assert_allclose(ref.matrices(other.quaternion) @ S, ref.matrices(one.quaternion), atol=1e-10)
    np.testing.assert_allclose(other.gyro_bias, one.gyro_bias @ S.T, atol=1e-10)
    # Without a magnetometer the heading at the start depends on the body's axes, the vertical does not.
    one, other = (cf.Mahony(1.0, 0.3, form).estimate(each.gyr, each.acc, fs=FS) for each in (samples, turned))
    np.testing.assert_allclose(other.up, one.up @ S.T, atol=1e-10)
    np.testing.assert_allclose(other.gyro_bias, one.gyro_bias @ S.T, atol=1e-10)


@forms
def test_equivariance_under_turns_of_the_world(form):
    """Without a magnetometer the heading is a matter of the start: it moves nothing else."""
    rng = np.random.default_rng(12)
    motion, samples = ref.random_samples(rng, np.full(500, DT))
    Z = ref.exp(1.3 * ref.UP)
    one = run(cf.Mahony(1.0, 0.3, form), samples, initial=motion.start)
    other = run(cf.Mahony(1.0, 0.3, form), samples, initial=ref.quaternions(Z @ motion.R[0]))
    np.testing.assert_allclose(ref.matrices(other.quaternion), Z @ ref.matrices(one.quaternion), atol=1e-10)
    np.testing.assert_allclose(other.up, one.up, atol=1e-10)
    np.testing.assert_allclose(other.gyro_bias, one.gyro_bias, atol=1e-10)


@forms
def test_lengths_of_directions_do_not_matter(form):
    rng = np.random.default_rng(13)
    _, samples = ref.random_samples(rng, np.full(200, DT), field=FIELD)
    scaled = samples.changed(acc=samples.acc * 2.0**-300, mag=samples.mag * 2.0**200)
    one, other = (run(cf.Mahony(1.0, 0.3, form), each) for each in (samples, scaled))
    assert_same_bits(other.quaternion, one.quaternion)


@forms
def test_yaw_is_not_observed_without_a_magnetometer(form):
    """A gyro's bias about the vertical runs into the heading, and is not taken for one."""
    gyr = np.tile([0.0, 0.0, 0.02], (3000, 1))
    estimate = cf.Mahony(1.0, 0.3, form).estimate(gyr, np.tile([0.0, 0.0, 9.81], (3000, 1)), fs=FS)
    yaw = 2 * np.arctan2(estimate.quaternion[:, 3], estimate.quaternion[:, 0])
    np.testing.assert_allclose(yaw, 0.02 * np.arange(3000) / FS, atol=1e-9)
    np.testing.assert_allclose(estimate.up, np.tile([0.0, 0.0, 1.0], (3000, 1)), atol=1e-14)
    np.testing.assert_allclose(estimate.gyro_bias, 0.0, atol=1e-14)


# --------------------------------------------------------------------------------------------------------- convergence


@forms
@fields
def test_convergence_from_any_attitude(form, field):
    """Mahony's theorem: of a body that turns, from all attitudes but a set of measure zero."""
    rng = np.random.default_rng(20)
    motion = ref.random_motion(rng, np.full(1500, DT))
    samples = motion.samples(field=field)
    for _ in range(40):
        start = ref.quaternions(ref.random_attitude(rng))
        estimate = run(cf.Mahony(2.0, form=form), samples, initial=start)
        final = tilt_errors(estimate, motion) if field is None else errors(estimate, motion)
        assert final[-1] < 1e-5


AXES = {"east": ref.EAST, "north": ref.NORTH, "up": ref.UP, "north-east": np.array([0.6, 0.8, 0.0])}
# Half a turn about an axis; about the vertical only where a magnetometer sees it.
EQUILIBRIA = {f"{name}, gravity alone": (None, axis) for name, axis in AXES.items() if name != "up"} | {
    f"{name}, magnetometer": (FIELD, axis) for name, axis in AXES.items()
}
equilibria = pytest.mark.parametrize(("field", "axis"), EQUILIBRIA.values(), ids=EQUILIBRIA)


@forms
@equilibria
def test_convergence_from_next_to_the_unstable_equilibria(form, field, axis):
    """There the error grows from its distance e as exp(kp t): it takes ln(2/e)/kp, but it happens."""
    kp, distance = 2.0, 1e-6
    motion = ref.at_rest(2000, DT)
    estimate = run(
        cf.Mahony(kp, form=form), motion.samples(field=field), initial=quaternion(axis, math.pi - distance)
    )
    off = tilt_errors(estimate, motion) if field is None else errors(estimate, motion)
    half_way = math.log(2 / distance) / kp
    assert off[round(FS * (half_way - 2))] > 3.0
    assert off[round(FS * (half_way + 3))] < 0.1
    assert off[-1] < 1e-5


@forms
@equilibria
@precisions
def test_the_unstable_equilibria_are_flagged(form, field, axis, dtype):
    """At exactly 180 degrees the innovation says nothing; noise gets the estimate away."""
    rng = np.random.default_rng(21)
    motion = ref.at_rest(2500, DT)
    still = motion.samples(field=field).astype(dtype)
    start = quaternion(axis, math.pi)
    estimate = run(cf.Mahony(2.0, form=form), still.changed(), initial=start)
    assert np.isfinite(estimate.quaternion).all()
    assert (estimate.flags[:10] & cf.Flags.AMBIGUOUS == cf.Flags.AMBIGUOUS).all()
    noisy = {name: array + 0.01 * rng.normal(size=array.shape) for name, array in still.arrays.items()}
    estimate = run(cf.Mahony(2.0, form=form), still.changed(**noisy), initial=start)
    assert not (estimate.flags[-500:] & cf.Flags.AMBIGUOUS).any()
    off = tilt_errors(estimate, motion) if field is None else errors(estimate, motion)
    assert off[-1] < 0.01


@forms
@fields
def test_the_bias_is_found(form, field):
    """On a motion that shows all of it; the bias of the gyro is what it reads too much."""
    rng = np.random.default_rng(22)
    motion = ref.random_motion(rng, np.full(5000, 0.03), rate=1.0)
    for _ in range(5):
        bias = 0.03 * rng.normal(size=3)
        samples = motion.samples(field=field, bias=bias)
        estimate = run(cf.Mahony(1.0, 0.25, form, bias_limit=1.0), samples)
        assert np.linalg.norm(estimate.gyro_bias[-1] - bias) < 1e-3 * np.linalg.norm(bias)


@forms
@fields
@few
@given(seed=seeds, limit=st.floats(1e-3, 1.0))
def test_the_bias_is_bounded(form, field, seed, limit):
    rng = np.random.default_rng(seed)
    _, samples = ref.random_samples(rng, np.full(100, DT), field=field, acceleration=30.0)
    many = samples.changed(
        gyr=np.tile(samples.gyr + 5.0, (10, 1)),
        acc=np.tile(samples.acc, (10, 1)),
        dt=np.full(1000, DT),
        mag=None if field is None else np.tile(samples.mag, (10, 1)),
    )
    size = np.linalg.norm(run(cf.Mahony(3.0, 30.0, form, bias_limit=limit), many).gyro_bias, axis=1)
    assert size.max() <= limit * (1 + 1e-12)
    assert size.max() > 0.99 * limit


# ------------------------------------------------------------------------------------------------------ hard motions

HARD = {
    "loops of roll": ([4.0, 0.0, 0.0], np.eye(3)),
    "loops of pitch": ([0.0, 4.0, 0.0], np.eye(3)),
    "loops of yaw": ([0.0, 0.0, 4.0], np.eye(3)),
    "nose up, rolling": ([4.0, 0.0, 0.0], ref.exp(-math.pi / 2 * ref.NORTH)),
    "nose down, yawing": ([0.0, 0.0, 4.0], ref.exp(math.pi / 2 * ref.NORTH)),
    "upside down, pitching": ([0.0, 4.0, 0.0], ref.exp(math.pi * ref.EAST)),
    "askew": ([2.5, -2.0, 2.5], ref.exp(np.array([0.3, 2.0, 0.5]))),
}


@forms
@fields
@pytest.mark.parametrize("name", HARD)
def test_every_attitude_is_like_every_other(form, field, name):
    """Through +-90 degrees of pitch and +-180 of roll and yaw, exactly; noise does no more than elsewhere."""
    rate, start = HARD[name]
    motion = ref.moved(np.tile(rate, (800, 1)), math.pi / 400, start)  # 4 rad/s: 100 samples a loop
    samples = motion.samples(field=field)
    estimate = run(cf.Mahony(1.0, 0.2, form), samples, initial=motion.start)
    assert errors(estimate, motion).max() < 1e-9
    rng = np.random.default_rng(1)
    noisy = {
        name: array * (1 + 0.02 * rng.normal(size=array.shape)) for name, array in samples.arrays.items()
    }
    noisy["gyr"] = samples.gyr
    estimate = run(cf.Mahony(1.0, form=form), samples.changed(**noisy), initial=motion.start)
    assert tilt_errors(estimate, motion).max() < 0.03


# -------------------------------------------------------------------------------------------------------- bad samples

HURT = slice(1000, 1030)
DAMAGES = {
    "no accelerometer": ("acc", math.nan, ref.ACC_MISSING),
    "infinite accelerometer": ("acc", -math.inf, ref.ACC_MISSING),
    "zero accelerometer": ("acc", 0.0, ref.ACC_MISSING),
    "clipped accelerometer": ("acc", 160.0, ref.ACC_MISSING),
    "accelerometer clipped below": ("acc", -160.0, ref.ACC_MISSING),
    "huge accelerometer": ("acc", 1e308, ref.ACC_MISSING),
    "no magnetometer": ("mag", math.nan, ref.MAG_MISSING),
    "zero magnetometer": ("mag", 0.0, ref.MAG_MISSING),
    "no gyro": ("gyr", math.nan, None),
    "infinite gyro": ("gyr", math.inf, None),
    "saturated gyro": ("gyr", 2.0, 0),
}
HURTS = {
    f"{name}, gravity alone": (None, damage) for name, damage in DAMAGES.items() if damage[0] != "mag"
} | {f"{name}, magnetometer": (FIELD, damage) for name, damage in DAMAGES.items()}
damages = pytest.mark.parametrize(("field", "damage"), HURTS.values(), ids=HURTS)


@forms
@damages
@precisions
def test_recovery_from_bad_samples(form, field, dtype, damage):
    """Finite throughout, flagged where it happens and nowhere else, and right again after five time constants."""
    signal, value, flag = damage
    kp = 2.0
    motion = hurt_motion()
    clean = motion.samples(field=field)
    arrays = {name: array.copy() for name, array in clean.arrays.items()}
    with np.errstate(over="ignore"):
        arrays[signal][HURT] = np.clip(arrays[signal][HURT], -value, value) if flag == 0 else value
        samples = clean.changed(**arrays).astype(dtype)
    estimate = run(cf.Mahony(kp, form=form, acc_range=156.0), samples, initial=motion.start)
    off = tilt_errors(estimate, motion) if field is None else errors(estimate, motion)
    check_recovered(estimate, off, 1 / kp, exact={np.float32: 2e-3, np.float64: 1e-6}[dtype])
    check_flags(estimate, flag)


def check_flags(estimate, flag):
    """Where the damage is and nowhere else; None is a gyro that is held and then given up."""
    flags = np.zeros(len(estimate.flags), np.uint8)
    flags[HURT] = ref.GYR_MISSING if flag is None else flag
    if flag is None:
        held = HURT.start + round(0.1 * FS)
        flags[HURT.start : held] = ref.GYR_HELD
        # A tie between the hold and a sum of steps.
        flags[held - 1 : held + 1] = estimate.flags[held - 1 : held + 1]
    np.testing.assert_array_equal(estimate.flags, flags)


def hurt_motion():
    """Twenty seconds, the same for all."""
    if not hasattr(hurt_motion, "made"):
        hurt_motion.made = ref.random_motion(np.random.default_rng(30), np.full(2000, DT))
    return hurt_motion.made


def check_recovered(estimate, off, time_constants, exact, left=0.05):
    """Five time constants leave e^-5, and somewhat more of an error so large that its sine is small."""
    for array in (estimate.quaternion, estimate.up, estimate.gyro_bias):
        assert np.isfinite(array).all()
    assert off[: HURT.start].max() < exact
    after = HURT.stop + math.ceil(5 * time_constants * FS)
    assert off[after:].max() < left * off[HURT].max() + exact


@forms
def test_an_accelerometer_that_clips_unseen_is_forgotten(form):
    """Without a range a clipped sample is a wrong direction, no more."""
    motion = hurt_motion()
    samples = motion.samples()
    samples.acc[HURT] = np.clip(samples.acc[HURT] * 5, -8.0, 8.0)
    estimate = run(cf.Mahony(2.0, form=form), samples, initial=motion.start)
    assert not estimate.flags.any()
    check_recovered(estimate, tilt_errors(estimate, motion), 0.5, 1e-6)


@precisions
@pytest.mark.parametrize("bad", [0.0, math.nan, math.inf, -math.inf])
def test_nothing_is_known_before_the_first_vertical(dtype, bad):
    gyr, acc = np.zeros((8, 3), dtype), np.tile(np.array([0.0, 6.0, 8.0], dtype), (8, 1))
    acc[:5] = bad
    mag = np.tile(FIELD.astype(dtype), (8, 1))
    estimate = cf.Mahony(1.0, 0.1).estimate(gyr, acc, fs=FS, mag=mag)
    assert np.isnan(estimate.quaternion[:5]).all()
    assert np.isnan(estimate.up[:5]).all()
    np.testing.assert_array_equal(estimate.flags, 5 * [cf.Flags.NOT_STARTED | 1] + 3 * [0])
    np.testing.assert_allclose(estimate.up[5:], np.tile([0.0, 0.6, 0.8], (3, 1)), atol=1e-6)


@forms
def test_a_missing_gyro_is_held_and_then_stands_still(form):
    rate = np.array([0.0, 0.0, 0.5])
    gyr = np.tile(rate, (60, 1))
    gyr[20:50] = np.nan
    acc = np.tile([0.0, 0.0, 9.81], (60, 1))
    estimate = cf.Mahony(1.0, form=form).estimate(gyr, acc, fs=FS, hold=0.105, initial=[1, 0, 0, 0])
    np.testing.assert_array_equal(estimate.flags[20:50], 10 * [cf.Flags.DERIVATIVE_HELD] + 20 * [4])
    yaw = 2 * np.arctan2(estimate.quaternion[:, 3], estimate.quaternion[:, 0])
    turning = np.r_[np.ones(30), np.zeros(20), np.ones(10)]
    np.testing.assert_allclose(yaw, 0.5 * DT * np.cumsum(turning), atol=1e-12)


@forms
@pytest.mark.parametrize("field", [None, FIELD], ids=["gravity alone", "magnetometer"])
def test_repeated_times_repeat_the_estimate(form, field):
    rng = np.random.default_rng(31)
    dt = rng.uniform(0.005, 0.02, 60)
    repeats = [0, 1, 2, 20, 40, 41, 59]
    dt[repeats] = 0.0
    _, samples = ref.random_samples(rng, dt, field=field)
    estimate = run(cf.Mahony(1.0, 0.5, form), samples)
    assert not estimate.flags.any()
    for n in repeats[1:]:
        np.testing.assert_allclose(estimate.quaternion[n], estimate.quaternion[n - 1], atol=1e-15)
        np.testing.assert_array_equal(estimate.gyro_bias[n], estimate.gyro_bias[n - 1])


# -------------------------------------------------------------------------------------------------------- magnetometer


@pytest.mark.parametrize("form", ["explicit", "passive"])
@some
@given(seed=seeds)
def test_the_magnetometer_never_tilts_the_estimate(form, seed):
    """Whatever it says, on a vertical that is right. A bias that it has found wrong can, when the body turns: there is none here."""
    rng = np.random.default_rng(seed)
    motion = ref.random_motion(rng, np.full(150, DT))
    samples = motion.samples(field=FIELD)
    samples.mag[:] = rng.normal(size=samples.mag.shape)
    estimate = run(cf.Mahony(rng.uniform(0.1, 30), form=form), samples, initial=motion.start)
    assert tilt_errors(estimate, motion).max() < 1e-9
    assert errors(estimate, motion).max() > 1e-3


@forms
def test_the_magnetometer_never_tilts_a_still_body(form):
    """Not even through the bias, which stays along the vertical."""
    rng = np.random.default_rng(33)
    motion = ref.at_rest(500, DT, ref.random_attitude(rng))
    samples = motion.samples(field=FIELD)
    samples.mag[:] = rng.normal(size=samples.mag.shape)
    estimate = run(cf.Mahony(2.0, 1.0, form), samples, initial=motion.start)
    assert tilt_errors(estimate, motion).max() < 1e-9
    along = (estimate.gyro_bias @ motion.R[0].T)[:, :2]
    assert np.abs(along).max() < 1e-9
    assert np.abs(estimate.gyro_bias).max() > 1e-3


@forms
def test_a_vertical_field_has_no_north(form):
    """It is as good as missing, and says so."""
    motion = ref.random_motion(np.random.default_rng(34), np.full(200, DT))
    vertical = run(cf.Mahony(1.0, 0.1, form), motion.samples(field=[0.0, 0.0, -40.0]))
    alone = run(cf.Mahony(1.0, 0.1, form), motion.samples())
    np.testing.assert_array_equal(vertical.quaternion, alone.quaternion)
    assert (vertical.flags & cf.Flags.MAGNETOMETER_MISSING == cf.Flags.MAGNETOMETER_MISSING).all()


@forms
def test_the_first_field_sets_the_heading(form):
    motion = ref.random_motion(np.random.default_rng(35), np.full(300, DT))
    samples = motion.samples(field=FIELD)
    samples.mag[:120] = np.nan
    estimate = run(cf.Mahony(0.1, form=form), samples)
    np.testing.assert_array_equal(estimate.flags, 120 * [cf.Flags.MAGNETOMETER_MISSING] + 180 * [0])
    assert errors(estimate, motion)[:120].min() > 0.01
    assert errors(estimate, motion)[120:].max() < 1e-9


@forms
@pytest.mark.parametrize("every", [2, 10, 50])
def test_a_slow_magnetometer_pulls_as_fast(form, every):
    """After missing measurements the gains are those for the time since the last correction: of the heading, here."""
    motion = ref.at_rest(1000, DT)
    samples = motion.samples(field=FIELD)
    samples.mag[np.arange(1000) % every != every - 1] = np.nan
    estimate = run(cf.Mahony(1.0, form=form), samples, initial=quaternion(ref.UP, 0.01))
    # Backward Euler with the steps between the fields.
    expected = 0.01 * (1 + every * DT) ** -np.floor(np.arange(1, 1001) / every)
    np.testing.assert_allclose(errors(estimate, motion), expected, atol=1e-6)


@forms
def test_a_gap_of_the_accelerometer_is_the_same_beside_a_magnetometer(form):
    """The vertical has been missing for as long."""
    motion = ref.at_rest(300, DT)
    start = quaternion(ref.EAST, 0.3)
    ups = []
    for field in (None, FIELD):
        samples = motion.samples(field=field)
        samples.acc[:100] = np.nan
        ups.append(run(cf.Mahony(1.0, form=form), samples, initial=start).up)
    np.testing.assert_allclose(ups[1][100:], ups[0][100:], atol=1e-6)


# ---------------------------------------------------------------------------------------------------------- from_design


@pytest.mark.parametrize("form", [*FORMS, None])
def test_from_design(form):
    keywords = {} if form is None else {"form": form}
    given = cf.Mahony.from_design(cf.PiForm(2.0, 0.5), **keywords, bias_limit=0.2, acc_range=80.0)
    assert given == cf.Mahony(2.0, 0.5, form or "explicit", bias_limit=0.2, acc_range=80.0)
    assert cf.Mahony.from_design(cf.FirstOrder(0.25), **keywords) == cf.Mahony(4.0, **keywords)
    butterworth = cf.Mahony.from_design(cf.Butterworth(2.0), **keywords)
    assert (butterworth.kp, butterworth.ki) == cf.Butterworth(2.0).coefficients
    assert (given.kp, given.ki, given.form, given.bias_limit, given.acc_range) == (
        *(2.0, 0.5),
        form or "explicit",
        *(0.2, 80.0),
    )
    assert cf.Mahony(1.0).acc_range is None


# ---------------------------------------------------------------------------------------------------- outside checks


def outside_motion():
    """A minute of turning with small accelerations, and the vertical in body axes."""
    rng = np.random.default_rng(40)
    dt = np.full(6000, DT)
    motion = ref.random_motion(rng, dt, rate=0.5)
    return motion, motion.samples(ref.waves(rng, np.cumsum(dt), 0.1, slowest=2.0, fastest=8.0))


def check_same_vertical(up, q, degrees):
    """After the first ten seconds."""
    off = np.degrees(ref.angles_between_directions(up, ref.matrices(q)[:, 2]))
    assert off[1000:].max() < degrees


def test_against_ahrs():
    ahrs = pytest.importorskip("ahrs")
    _, samples = outside_motion()
    other = ahrs.filters.Mahony(gyr=samples.gyr, acc=samples.acc, frequency=FS, k_P=1.0, k_I=0.1)
    check_same_vertical(run(cf.Mahony(1.0, 0.1), samples).up, other.Q, 1.0)


def test_against_vqf():
    vqf = pytest.importorskip("vqf")
    _, samples = outside_motion()
    other = vqf.VQF(DT).updateBatch(samples.gyr, samples.acc)["quat6D"]
    check_same_vertical(run(cf.Mahony(1.0, 0.1), samples).up, other, 1.0)


# ----------------------------------------------------------------------------- what every attitude filter promises: signals

EVERY = {
    "explicit": cf.Mahony(1.0, 0.5, acc_range=50.0),
    "passive": cf.Mahony(3.0, form="passive"),
    "direct": cf.Mahony(1.0, 0.5, "direct", bias_limit=0.02),
    "gravity": cf.GravityFilter(2.0, rest_time=0.05),
    "gravity 1": cf.GravityFilter(0.3, order=1, acc_range=50.0),
    "gravity 5": cf.GravityFilter(
        0.7, order=5, split=3, gyro_delay=0.004, advance=0.01, rest_time=0.02, heading_tau=0.5
    ),
}
every = pytest.mark.parametrize("design", EVERY.values(), ids=EVERY)
# Where the binding is tested and not the filter.
both = pytest.mark.parametrize("design", [EVERY["explicit"], EVERY["gravity"]], ids=["mahony", "gravity"])
with_and_without = pytest.mark.parametrize("magnetic", [False, True], ids=["gravity alone", "magnetometer"])

NAMES = ("gyr", "acc", "mag")
RESULTS = ("quaternion", "up", "gyro_bias", "at_rest", "flags")
odd = st.one_of(
    st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -0.0, 49.0, 50.0]), st.floats(-1e6, 1e6, width=32)
)


def noise(rows, magnetic=True, seed=1, dtype=float):
    """A gyro, an accelerometer and perhaps a magnetometer that have little to do with each other; still in between."""
    rng = np.random.default_rng(seed)
    loud = np.where(np.arange(rows) // 30 % 2 == 0, 1.0, 1e-4)[:, None]
    gyr, acc, mag = rng.normal(size=(3, rows, 3)) * loud
    arrays = {"gyr": gyr, "acc": 5.0 * acc + [1.0, 2.0, 9.0], "mag": 20.0 * mag + [5.0, 20.0, -30.0]}
    return {name: array.astype(dtype) for name, array in arrays.items() if magnetic or name != "mag"}


@st.composite
def signals(draw, dtype=float):
    """Noise with odd values, whole zero vectors and runs of missing samples strewn in."""
    rows = draw(st.one_of(st.integers(1, 40), st.integers(41, 300)))
    arrays = noise(rows, draw(st.booleans()), draw(seeds), dtype)
    places = st.tuples(st.sampled_from(list(arrays)), st.integers(0, rows - 1), st.integers(0, 2))
    for (name, row, axis), value in draw(st.lists(st.tuples(places, odd), max_size=6)):
        arrays[name][row, axis] = value
    runs = st.tuples(places, st.integers(1, 30), st.sampled_from([math.nan, 0.0]))
    for (name, row, _), length, value in draw(st.lists(runs, max_size=3)):
        arrays[name][row : row + length] = value
    return arrays


def cut(arrays, part):
    return {name: array[part] for name, array in arrays.items()}


def rows_of(arrays):
    return len(arrays["gyr"])


def one_by_one(stream, arrays, steps):
    """Quaternions of the samples, each on its own."""
    rows = (cut(arrays, n) for n in range(rows_of(arrays)))
    got = [stream.update(**row, dt=dt) for row, dt in zip(rows, steps, strict=True)]
    return np.array(got, dtype=arrays["gyr"].dtype).reshape(-1, 4)


def check_same_results(got, expected, part=slice(None)):
    for name in RESULTS:
        assert_same_bits(getattr(got, name), getattr(expected, name)[part])


# ------------------------------------------------------------------------ what every attitude filter promises: pieces


def run_piece(design, stream, way, arrays, clock, keywords):
    """Quaternions of a piece, by one of the ways to get them."""
    if way == "update":
        return one_by_one(stream, arrays, [None] * rows_of(arrays))
    if way == "process":
        return stream.process(**arrays, **clock)
    if way == "estimate":
        return stream.estimate(**arrays, **clock).quaternion
    estimate = design.estimate(**arrays, initial=stream.state, **(clock or {"fs": FS}), **keywords)
    stream.state = estimate.state
    return estimate.quaternion


def check_chunks(design, arrays, plan, t=None, **keywords):
    """All pieces together are the whole: outputs, and the state at the end."""
    clock = {"fs": FS} if t is None else {"t": t}
    whole = design.estimate(**arrays, **clock, **keywords)
    stream = design.stream(fs=None if t is not None else FS, dtype=arrays["gyr"].dtype, **keywords)
    parts = []
    for part, way, pause in pieces(plan, rows_of(arrays)):
        piece_clock = {} if t is None else {"t": t[part]}
        parts.append(run_piece(design, stream, way, cut(arrays, part), piece_clock, keywords))
        stream = pause(stream)
    assert_same_bits(np.concatenate(parts), whole.quaternion)
    assert stream.state == whole.state


holds = st.sampled_from([{}, {}, {"hold": 0.0}, {"hold": 0.025}, {"hold": 1.0}])


@every
@precisions
@some
@given(data=st.data(), plan=plans, keywords=holds)
def test_whole_is_any_chunking(design, dtype, data, plan, keywords):
    check_chunks(design, data.draw(signals(dtype)), plan, **keywords)


@every
@precisions
@few
@given(data=st.data(), plan=plans, keywords=holds, backwards=st.booleans())
def test_whole_is_any_chunking_with_times(design, dtype, data, plan, keywords, backwards):
    arrays = data.draw(signals(dtype))
    t = 1.7e9 + np.cumsum(data.draw(time_steps(rows_of(arrays))))
    policy = {}
    if backwards:
        t[len(t) // 2 :] -= 3.0
        policy = {"backwards": "restart"}
    plan = [(length, "process" if way == "update" else way, pause) for length, way, pause in plan]
    check_chunks(design, arrays, plan, t, **keywords, **policy)


@every
@precisions
@with_and_without
@pytest.mark.parametrize("pause", [same, pickled, copy.copy, copy.deepcopy, restored])
def test_all_results_in_pieces(design, dtype, magnetic, pause):
    """Not only the quaternion; and the flags of the pieces are those of the whole."""
    arrays = noise(200, magnetic, dtype=dtype)
    arrays["acc"][[0, 90]] = math.nan
    arrays["gyr"][100:130] = math.nan
    whole = design.estimate(**arrays, fs=FS)
    stream = design.stream(fs=FS, dtype=dtype)
    for part in (slice(0, 1), slice(1, 95), slice(95, 95), slice(95, 110), slice(110, 200)):
        check_same_results(stream.estimate(**cut(arrays, part)), whole, part)
        stream = pause(stream)
    assert stream.state == whole.state


@every
@precisions
@with_and_without
def test_updates_with_the_steps_between_times_are_the_whole(design, dtype, magnetic):
    arrays = noise(150, magnetic, dtype=dtype)
    arrays["acc"][40:50], arrays["gyr"][60:90] = math.nan, math.nan
    t = np.cumsum(np.random.default_rng(2).uniform(0.002, 0.02, 150))
    steps = np.diff(t, prepend=t[0])
    stream = design.stream(dtype=dtype)
    assert_same_bits(one_by_one(stream, arrays, steps), design.estimate(**arrays, t=t).quaternion)


@every
def test_a_state_runs_on_at_another_rate(design):
    """It is physical: with the other rate's steps it is the same as one stream with those steps."""
    arrays = noise(80)
    expected = one_by_one(design.stream(), arrays, 40 * [1 / 128] + 40 * [1 / 32])
    state = design.estimate(**cut(arrays, slice(40)), fs=128.0).state
    got = design.estimate(**cut(arrays, slice(40, 80)), fs=32.0, initial=state)
    assert_same_bits(got.quaternion, expected[40:])


@every
def test_time_goes_on_from_a_state(design):
    arrays = noise(60)
    t = 5.0 + np.cumsum(np.random.default_rng(3).uniform(0.005, 0.02, 60))
    whole = design.estimate(**arrays, t=t)
    first = design.estimate(**cut(arrays, slice(30)), t=t[:30])
    assert first.state.time == t[29]
    second = design.estimate(**cut(arrays, slice(30, 60)), t=t[30:], initial=first.state)
    check_same_results(second, whole, slice(30, 60))


@every
def test_samples_without_a_magnetometer_in_between(design):
    """A block without one is no block of missing ones: nothing is flagged."""
    arrays = noise(90)
    stream = design.stream(fs=FS)
    stream.process(**cut(arrays, slice(30)))
    bare = {name: arrays[name][30:60] for name in ("gyr", "acc")}
    flags = stream.estimate(**bare).flags
    assert not (flags & cf.Flags.MAGNETOMETER_MISSING).any()
    assert np.isfinite(stream.process(**cut(arrays, slice(60, 90)))).all()


@every
@pytest.mark.parametrize("shift", [1, 40, 99])
def test_backwards_restarts(design, shift):
    """As if what follows came first, flagged."""
    arrays, t = noise(100), np.arange(100) / FS
    t[shift:] -= 2.0
    estimate = design.estimate(**arrays, t=t, backwards="restart")
    afresh = design.estimate(**cut(arrays, slice(shift, 100)), t=t[shift:])
    assert estimate.flags[shift] == afresh.flags[0] | cf.Flags.RESTARTED
    assert_same_bits(estimate.quaternion[shift:], afresh.quaternion)
    assert_same_bits(estimate.gyro_bias[shift:], afresh.gyro_bias)


@every
@precisions
def test_a_given_start(design, dtype):
    """The quaternion before the first sample: of any length, and the same with both signs."""
    arrays = noise(50, magnetic=False, dtype=dtype)
    start = np.array([0.5, -0.1, 0.3, 0.8])
    one = design.estimate(**arrays, fs=FS, initial=start)
    for other in (8 * start, start.tolist(), start.astype("f4") if dtype == np.float32 else tuple(start)):
        np.testing.assert_allclose(
            design.estimate(**arrays, fs=FS, initial=other).quaternion,
            one.quaternion,
            atol=10 * np.finfo(dtype).eps,
        )
    negative = design.estimate(**arrays, fs=FS, initial=-start)
    assert_same_bits(negative.quaternion, -one.quaternion)
    assert_same_bits(negative.up, one.up)
    # At a first step of no time the start is the estimate, as far as it is not turned ahead.
    arrays["gyr"][0] = 0.0
    first = design.estimate(**cut(arrays, slice(1)), t=[0.0], initial=start).quaternion[0]
    np.testing.assert_allclose(first, start / np.linalg.norm(start), atol=1e-6)


# ------------------------------------------------------------------------ what every attitude filter promises: arrays


@both
@precisions
@layouts
def test_layout_in_memory_does_not_matter(design, dtype, layout):
    laid = {name: layout(array) for name, array in noise(100, dtype=dtype).items()}
    plain = {name: np.array(array, dtype=dtype, order="C") for name, array in laid.items()}
    expected = design.estimate(**plain, fs=FS)
    check_same_results(design.estimate(**laid, fs=FS), expected)
    for name in NAMES:
        check_same_results(design.estimate(**{**plain, name: laid[name]}, fs=FS), expected)
    streams = [design.stream(fs=FS, dtype=dtype) for _ in range(2)]
    assert_same_bits(streams[0].process(**laid), expected.quaternion)
    assert_same_bits(streams[1].update(**cut(laid, 0)), expected.quaternion[0])


@both
@with_and_without
def test_precision_is_kept(design, magnetic):
    arrays = noise(20, magnetic, dtype=np.float32)
    estimate = design.estimate(**arrays, fs=FS)
    for name in ("quaternion", "up", "gyro_bias"):
        assert getattr(estimate, name).dtype == np.float32
    assert estimate.state.dtype == "float32"
    assert (estimate.at_rest.dtype, estimate.flags.dtype) == (bool, np.uint8)
    for name in arrays:
        mixed = {**arrays, name: arrays[name].astype(float)}
        double = {key: array.astype(float) for key, array in arrays.items()}
        check_same_results(design.estimate(**mixed, fs=FS), design.estimate(**double, fs=FS))


@both
@pytest.mark.parametrize("dtype", ["i1", "i2", "i4", "i8", "u1", "u4", "u8", "f2", "g", ">i4"])
def test_other_real_numbers_become_float64(design, dtype):
    arrays = {name: np.abs(array).astype(dtype) for name, array in noise(50).items()}
    double = {name: array.astype(float) for name, array in arrays.items()}
    check_same_results(design.estimate(**arrays, fs=FS), design.estimate(**double, fs=FS))


@both
@pytest.mark.parametrize("make", [np.ndarray.tolist, memoryview, lambda a: tuple(map(tuple, a))])
def test_sequences_become_arrays(design, make):
    arrays = noise(20)
    made = {name: make(array) for name, array in arrays.items()}
    check_same_results(design.estimate(**made, fs=FS), design.estimate(**arrays, fs=FS))


@both
def test_masked_samples_are_missing(design):
    arrays = noise(30)
    hidden = np.zeros((30, 3), bool)
    hidden[[5, 9, 10], [0, 1, 2]] = True
    masked = {name: np.ma.array(array, mask=hidden) for name, array in arrays.items()}
    holed = {name: np.where(hidden, math.nan, array) for name, array in arrays.items()}
    check_same_results(design.estimate(**masked, fs=FS), design.estimate(**holed, fs=FS))


@both
def test_inputs_stay_as_they_are(design):
    arrays = noise(50)
    arrays["gyr"][7], arrays["acc"][9] = math.nan, 0.0
    before = copy.deepcopy(arrays)
    frozen = {name: read_only(array) for name, array in arrays.items()}
    check_same_results(design.estimate(**frozen, fs=FS), design.estimate(**arrays, fs=FS))
    for name, array in before.items():
        np.testing.assert_array_equal(arrays[name], array)


@both
@with_and_without
def test_nothing_in_nothing_out(design, magnetic):
    arrays = noise(0, magnetic)
    for keywords in ({"fs": FS}, {"t": []}):
        estimate = design.estimate(**arrays, **keywords)
        assert [getattr(estimate, name).shape for name in RESULTS] == [(0, 4), (0, 3), (0, 3), (0,), (0,)]
        assert set(estimate.counts.values()) == {0}
        fresh = design.stream(fs=keywords.get("fs")).state
        assert estimate.state == fresh


@both
def test_counts_are_those_of_the_flags(design):
    arrays = noise(100)
    arrays["acc"][:3], arrays["gyr"][50:52], arrays["mag"][60:70] = math.nan, math.nan, 0.0
    estimate = design.estimate(**arrays, fs=FS)
    expected = {flag.name.lower(): int((estimate.flags & flag != 0).sum()) for flag in cf.Flags}
    assert estimate.counts == expected
    assert expected["measurement_missing"] == expected["not_started"] == 3
    assert expected["derivative_held"] == 2
    assert expected["magnetometer_missing"] >= 10


# --------------------------------------------------------------------- what every attitude filter promises: arithmetic


@pytest.mark.parametrize("design", [cf.Mahony(1.0, 0.1), cf.GravityFilter()], ids=repr)
def test_quaternions_keep_their_length(design):
    """Three million steps of float32 in one batch; ten million take more than ten seconds of the suite's thirty."""
    count = 3_000_000
    rng = np.random.default_rng(50)
    gyr, acc = rng.standard_normal((2, count, 3), dtype=np.float32)
    q = design.estimate(gyr, acc, fs=FS).quaternion
    length = np.sqrt(np.einsum("ij,ij->i", q, q, dtype=float))
    assert np.abs(length - 1).max() < 3 * np.finfo(np.float32).eps


def extreme(dtype):
    limit = float(np.finfo(dtype).max)
    smallest = float(np.finfo(dtype).smallest_subnormal)
    values = [limit, -limit, math.sqrt(limit), 0.0, smallest, -smallest, 1.0]
    return st.one_of(st.sampled_from(values), st.floats(-limit, limit, width=np.finfo(dtype).bits))


@every
@precisions
@some
@given(data=st.data(), seed=seeds, magnetic=st.booleans())
def test_finite_in_finite_out(design, dtype, data, seed, magnetic):
    """Even where the state overflows: then the filter starts anew from the measurement and says so."""
    palette = np.array(data.draw(st.lists(extreme(dtype), min_size=2, max_size=6)), dtype=dtype)
    rng = np.random.default_rng(seed)
    names = NAMES if magnetic else NAMES[:2]
    arrays = {name: rng.choice(palette, size=(100, 3)) for name in names}
    arrays["acc"][0] = [0.0, 0.0, 9.81]
    estimate = design.estimate(**arrays, fs=FS)
    for name in ("quaternion", "up", "gyro_bias"):
        assert np.isfinite(getattr(estimate, name)).all(), name
    length = np.linalg.norm(estimate.quaternion.astype(float), axis=1)
    assert np.abs(length - 1).max() < 8 * np.finfo(dtype).eps
    assert_same_bits(one_by_one(design.stream(fs=FS, dtype=dtype), arrays, [None] * 100), estimate.quaternion)


@every
@precisions
@with_and_without
def test_extremes_are_forgotten(design, dtype, magnetic):
    """Nothing that was finite stays in the state for ever."""
    limit = np.finfo(dtype).max
    rng = np.random.default_rng(51)
    motion = ref.at_rest(4000, DT)
    calm = motion.samples(field=FIELD if magnetic else None).astype(dtype)
    arrays = {name: array.copy() for name, array in calm.arrays.items()}
    for array in arrays.values():
        array[100:110] = rng.choice(np.array([limit, -limit], dtype), size=(10, 3))
    estimate = design.estimate(**arrays, fs=FS)
    undisturbed = design.estimate(**calm.arrays, fs=FS)
    np.testing.assert_allclose(estimate.up[-1], [0.0, 0.0, 1.0], atol=1e-3)
    np.testing.assert_array_equal(estimate.at_rest[-1], undisturbed.at_rest[-1])
    if magnetic:
        np.testing.assert_allclose(np.abs(estimate.quaternion[-1]), [1.0, 0.0, 0.0, 0.0], atol=1e-3)


@every
@precisions
@some
@given(data=st.data(), magnetic=st.booleans())
def test_times_of_any_kind(design, dtype, data, magnetic):
    """Repeated, next to each other, far apart: finite from the first measurement on, and of unit length."""
    arrays = noise(60, magnetic, data.draw(seeds), dtype)
    steps = st.sampled_from([0.0, 0.0, 1e-12, 1e-3, 0.01, 0.15, 0.99, 1.01, 7.0, 1e4, 1e9])
    t = np.cumsum(data.draw(st.lists(steps, min_size=60, max_size=60)))
    estimate = design.estimate(**arrays, t=t)
    length = np.linalg.norm(estimate.quaternion.astype(float), axis=1)
    assert np.abs(length - 1).max() < 8 * np.finfo(dtype).eps
    largest = np.abs(estimate.gyro_bias).max()
    assert largest <= design.bias_limit * (1 + 4 * np.finfo(dtype).eps)


@every
@some
@given(data=st.data(), bad=st.sampled_from([math.nan, math.inf, -math.inf]), repeated=st.booleans())
def test_what_is_missing_leaves_nothing_behind(design, data, bad, repeated):
    """A missing sample is missing, whatever stands in it, at any step."""
    arrays = noise(60, seed=data.draw(seeds))
    gone = data.draw(st.lists(st.tuples(st.sampled_from(NAMES), st.integers(0, 59)), max_size=10))
    t = np.arange(60) / FS
    for name, row in gone:
        arrays[name][row] = math.nan
        if repeated and row:
            t[row:] -= t[row] - t[row - 1]
    other = copy.deepcopy(arrays)
    for name, row in gone:
        other[name][row] = [bad, 1.0, 2.0]
    one, two = (design.estimate(**each, t=t) for each in (arrays, other))
    check_same_results(two, one)
    numbers = one.state.__reduce__()[1][4][0]
    assert not np.isnan(numbers).any()


# ------------------------------------------------------------- what every attitude filter promises: copies, comparison

DIFFERENT_MAHONY = [
    cf.Mahony(1.0, 0.1),
    cf.Mahony(1.5, 0.1),
    cf.Mahony(1.0),
    cf.Mahony(1.0, 0.1, "passive"),
    cf.Mahony(1.0, 0.1, "direct"),
    cf.Mahony(1.0, 0.1, bias_limit=0.2),
    cf.Mahony(1.0, 0.1, acc_range=150.0),
]
DIFFERENT_GRAVITY = [
    cf.GravityFilter(),
    cf.GravityFilter(2.0),
    cf.GravityFilter(order=1),
    cf.GravityFilter(order=3),
    cf.GravityFilter(split=2),
    cf.GravityFilter(zeta=0.7),
    cf.GravityFilter(gyro_delay=0.0025),
    cf.GravityFilter(advance=0.0025),
    cf.GravityFilter(rest_time=1.0),
    cf.GravityFilter(rest_rate=0.03),
    cf.GravityFilter(rest_force=0.6),
    cf.GravityFilter(rest_drift=0.2),
    cf.GravityFilter(bias_limit=0.03),
    cf.GravityFilter(heading_tau=5.0),
    cf.GravityFilter(acc_range=150.0),
]
DIFFERENT = DIFFERENT_MAHONY + DIFFERENT_GRAVITY
different = pytest.mark.parametrize("design", DIFFERENT, ids=range(len(DIFFERENT)))
copies = pytest.mark.parametrize("duplicate", [pickled, copy.copy, copy.deepcopy])


@different
@copies
def test_filters_are_copied_and_compared(design, duplicate):
    other = duplicate(design)
    assert other == design
    assert hash(other) == hash(design)
    assert repr(other) == repr(design)
    assert type(other) is type(design)


def test_filters_differ():
    for i, first in enumerate(DIFFERENT):
        for j, second in enumerate(DIFFERENT):
            assert (first == second) == (i == j)
            assert (first != second) == (i != j)
    assert len(set(DIFFERENT)) == len(DIFFERENT)
    assert cf.Mahony(1.0) != 1.0
    assert cf.GravityFilter() != "GravityFilter"
    assert cf.Mahony(1.0, -0.0) == cf.Mahony(1.0, 0.0)
    assert hash(cf.Mahony(1.0, -0.0)) == hash(cf.Mahony(1.0, 0.0))
    assert hash(cf.GravityFilter(gyro_delay=-0.0)) == hash(cf.GravityFilter())


@different
def test_repr_makes_the_filter(design):
    assert eval(repr(design), vars(cf)) == design


@every
@precisions
@copies
def test_streams_are_copied_and_compared(design, dtype, duplicate):
    arrays = noise(20, dtype=dtype)
    stream = design.stream(fs=FS, dtype=dtype, missing="raise", hold=0.3)
    stream.process(**arrays)
    other = duplicate(stream)
    assert other == stream
    assert other.state == stream.state
    assert_same_bits(other.process(**arrays), stream.process(**arrays))
    other.update(**cut(arrays, 0))
    assert other != stream
    with pytest.raises(ValueError, match="missing"):
        other.update([math.nan, 0.0, 0.0], [0.0, 0.0, 9.81])
    assert repr(stream).startswith(repr(design))


STREAMS_DIFFER = [
    {"fs": 50.0},
    {"fs": None},
    {"dtype": "f4"},
    {"initial": [0.0, 1.0, 0.0, 0.0]},
    {"missing": "raise"},
    {"hold": 0.2},
    {"backwards": "restart"},
]


@both
@pytest.mark.parametrize("keywords", STREAMS_DIFFER, ids=str)
def test_streams_that_would_go_on_differently_differ(design, keywords):
    plain = {"fs": FS, "initial": [1.0, 0.0, 0.0, 0.0]}
    assert design.stream(**plain) == design.stream(**plain)
    assert design.stream(**plain) != design.stream(**{**plain, **keywords})
    assert design.stream(**plain) != 1.0
    assert cf.Mahony(7.0).stream(**plain) != design.stream(**plain)


@every
@precisions
@copies
def test_states_are_copied_and_compared(design, dtype, duplicate):
    stream = design.stream(dtype=dtype)
    empty = stream.state
    stream.process(**noise(3, dtype=dtype), t=[0.0, 0.1, 0.3])
    for state in (empty, stream.state):
        other = duplicate(state)
        assert other == state
        assert (other.order, other.channels, other.dtype) == (4, 1, np.dtype(dtype).name)
        assert other.time == state.time
    assert stream.state != empty
    assert stream.state.time == 0.3


@every
def test_the_state_shows_the_quaternion(design):
    """The filter's own: turned ahead only by the rate."""
    arrays = noise(30)
    arrays["gyr"][-15:] = math.nan  # then it stands still
    estimate = design.estimate(**arrays, fs=FS)
    np.testing.assert_allclose(estimate.state.levels[:, 0], estimate.quaternion[-1], atol=1e-15)


@every
def test_a_state_is_a_snapshot(design):
    arrays = noise(30)
    stream = design.stream(fs=FS)
    stream.process(**arrays)
    state = stream.state
    expected = stream.process(**arrays)
    assert stream.state != state
    stream.state = state
    assert_same_bits(stream.process(**arrays), expected)


@every
def test_reset_forgets(design):
    arrays = noise(30)
    stream = design.stream(fs=FS)
    expected = stream.process(**arrays)
    stream.reset()
    assert stream.state == design.stream(fs=FS).state
    assert_same_bits(stream.process(**arrays), expected)
    start = [0.0, 0.6, 0.0, 0.8]
    stream.reset(start)
    assert_same_bits(stream.process(**arrays), design.estimate(**arrays, fs=FS, initial=start).quaternion)
    timed = design.stream()
    timed.process(**cut(arrays, slice(1)), t=[100.0])
    timed.reset()
    assert timed.state.time is None
    assert np.isfinite(timed.process(**cut(arrays, slice(1)), t=[3.0])).all()


@every
def test_many_threads_at_once(design):
    """A filter has no state of its own."""
    arrays = noise(20_000)
    expected = design.estimate(**arrays, fs=FS).quaternion
    got = []
    threads = [
        threading.Thread(target=lambda: got.append(design.estimate(**arrays, fs=FS).quaternion))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(got) == 4
    for each in got:
        assert_same_bits(each, expected)


# ------------------------------------------------------------------------ what every attitude filter promises: refusals


def check_refused(kind, pattern, call, *arguments, **keywords):
    """One sentence that matches, and no more."""
    with pytest.raises(kind) as caught:
        call(*arguments, **keywords)
    message = " ".join([str(caught.value), *getattr(caught.value, "__notes__", [])])
    assert re.search(pattern, message), message
    assert not message.endswith("."), message
    assert "\n" not in message, message


NUMBERS = {
    "Mahony": (cf.Mahony, {"kp": 1.0, "bias_limit": 0.1, "acc_range": 150.0}),
    "Mahony.from_design": (
        lambda **keywords: cf.Mahony.from_design(cf.PiForm(1.0, 0.1), **keywords),
        {"bias_limit": 0.1, "acc_range": 150.0},
    ),
    "GravityFilter": (
        cf.GravityFilter,
        {
            "tau": 3.0,
            "zeta": 0.5,
            "rest_time": 1.5,
            "rest_rate": 0.03,
            "rest_force": 0.5,
            "rest_drift": 0.1,
            "bias_limit": 0.03,
            "heading_tau": 10.0,
            "acc_range": 150.0,
        },
    ),
}
parameters = pytest.mark.parametrize(
    ("maker", "name"), [(maker, name) for maker, (_, names) in NUMBERS.items() for name in names]
)


@parameters
@pytest.mark.parametrize("bad", [0.0, -0.0, -1.0, math.nan, math.inf, -math.inf])
def test_parameters_must_be_positive_and_finite(maker, name, bad):
    make, names = NUMBERS[maker]
    check_refused(ValueError, f"^{name} must be positive and finite", make, **{**names, name: bad})


@parameters
@pytest.mark.parametrize("bad", ["1", [1.0], 1j])
def test_parameters_must_be_numbers(maker, name, bad):
    make, names = NUMBERS[maker]
    check_refused(TypeError, f"'{name}'", make, **{**names, name: bad})


WHOLE = "^{} must lie between 1 and"
BAD_FILTERS = [
    (ValueError, "^ki must be finite and not negative", lambda: cf.Mahony(1.0, -0.1)),
    (ValueError, "^ki must be finite and not negative", lambda: cf.Mahony(1.0, math.nan)),
    (ValueError, "^ki must be finite and not negative", lambda: cf.Mahony(1.0, math.inf)),
    (
        ValueError,
        '^form must be "explicit" or "passive" or "direct", got "x"',
        lambda: cf.Mahony(1.0, 0.1, "x"),
    ),
    (TypeError, "'form'", lambda: cf.Mahony(1.0, 0.1, 1)),
    (TypeError, "positional", lambda: cf.Mahony(1.0, 0.1, "direct", 0.1)),
    (TypeError, "gain", lambda: cf.Mahony(1.0, gain=1.0)),
    (TypeError, "kp", cf.Mahony),
    (TypeError, "^design must be a linear filter", lambda: cf.Mahony.from_design(1.0)),
    (
        ValueError,
        "^design must be a chain of order 1 or 2",
        lambda: cf.Mahony.from_design(cf.ThirdOrder(1.0)),
    ),
    (ValueError, "^design must be a chain", lambda: cf.Mahony.from_design(cf.RateFilter(1.0))),
    (ValueError, "^design must be a chain", lambda: cf.Mahony.from_design(cf.Butterworth(1.0, 3))),
    (ValueError, "^design must be a chain", lambda: cf.Mahony.from_design(cf.Butterworth(1.0, split=1))),
    (ValueError, "^design must be a chain", lambda: cf.Mahony.from_design(cf.SecondOrderInertial(1.0))),
    (ValueError, '^form must be .*got ""', lambda: cf.Mahony.from_design(cf.FirstOrder(1.0), "")),
    (ValueError, WHOLE.format("order"), lambda: cf.GravityFilter(order=0)),
    (ValueError, WHOLE.format("order"), lambda: cf.GravityFilter(order=7)),
    (ValueError, WHOLE.format("order"), lambda: cf.GravityFilter(order=-1)),
    (ValueError, WHOLE.format("split"), lambda: cf.GravityFilter(split=0)),
    (ValueError, WHOLE.format("split"), lambda: cf.GravityFilter(split=3)),
    (ValueError, WHOLE.format("split"), lambda: cf.GravityFilter(split=-2)),
    (TypeError, "'order'", lambda: cf.GravityFilter(order=2.0)),
    (TypeError, "'split'", lambda: cf.GravityFilter(split=None)),
    (ValueError, "^zeta goes with order=2", lambda: cf.GravityFilter(order=3, zeta=0.5)),
    (ValueError, "^gyro_delay must be finite", lambda: cf.GravityFilter(gyro_delay=math.nan)),
    (ValueError, "^gyro_delay must be finite", lambda: cf.GravityFilter(gyro_delay=-math.inf)),
    (ValueError, "^advance must be finite", lambda: cf.GravityFilter(advance=math.nan)),
    (ValueError, "^advance must be finite", lambda: cf.GravityFilter(advance=math.inf)),
    (TypeError, "positional", lambda: cf.GravityFilter(3.0, 2)),
    (ValueError, "^tau must", lambda: cf.GravityFilter(1e-320)),
    (ValueError, "^tau must", lambda: cf.GravityFilter(1e300, order=6)),
]


@pytest.mark.parametrize(("kind", "pattern", "make"), BAD_FILTERS)
def test_filters_that_cannot_be(kind, pattern, make):
    check_refused(kind, pattern, make)


SIX = noise(6)
T6 = np.arange(6) / FS
ANY_INITIAL = "^initial must be a quaternion, four finite numbers that are not all zero, or a State"
BAD_KEYWORDS = [
    ("^fs must be positive and finite", {"fs": 0.0}),
    ("^fs must be positive and finite", {"fs": -FS}),
    ("^fs must be positive and finite", {"fs": math.nan}),
    ("^fs must be positive and finite", {"fs": math.inf}),
    ("^give fs in Hz or t in seconds, one of them", {}),
    ("^give fs in Hz or t in seconds, one of them", {"fs": FS, "t": T6}),
    ("^t must not run backwards: row 1 is", {"t": T6[::-1]}),
    ("^t must be finite: row 0 is NaN", {"t": [math.nan, 1, 2, 3, 4, 5]}),
    (r"^t must have the shape \(6,\).*got \[5\]", {"t": T6[:5]}),
    (r"^t must have the shape \(6,\).*got \[6, 1\]: time is axis 0", {"t": T6[:, None]}),
    ('^missing must be "coast" or "raise", got "skip"', {"fs": FS, "missing": "skip"}),
    ('^backwards must be "raise" or "restart", got "sort"', {"fs": FS, "backwards": "sort"}),
    ("^hold must be finite and not negative", {"fs": FS, "hold": -0.1}),
    ("^hold must be finite and not negative", {"fs": FS, "hold": math.nan}),
    ("^hold must be finite and not negative", {"fs": FS, "hold": math.inf}),
    (ANY_INITIAL, {"fs": FS, "initial": [1.0, 0.0, 0.0]}),
    (ANY_INITIAL, {"fs": FS, "initial": np.zeros(4)}),
    (ANY_INITIAL, {"fs": FS, "initial": np.ones((1, 4))}),
    (ANY_INITIAL, {"fs": FS, "initial": 1.0}),
    (ANY_INITIAL, {"fs": FS, "initial": []}),
    (ANY_INITIAL, {"fs": FS, "initial": [1.0, math.nan, 0.0, 0.0]}),
    (ANY_INITIAL, {"fs": FS, "initial": [1.0, math.inf, 0.0, 0.0]}),
]


def calls(design, arrays, **keywords):
    """The two ways to run a filter on arrays."""
    yield lambda: design.estimate(**arrays, **keywords)
    clock = {key: keywords.pop(key) for key in ("t",) if key in keywords}
    yield lambda: design.stream(**keywords).process(**arrays, **clock)


@both
@pytest.mark.parametrize(("pattern", "keywords"), BAD_KEYWORDS)
def test_keywords_that_cannot_work(design, pattern, keywords):
    for call in calls(design, SIX, **keywords):
        check_refused(ValueError, pattern, call)


@both
@pytest.mark.parametrize("name", ["fs", "hold", "missing", "backwards"])
def test_keywords_must_have_their_type(design, name):
    for call in calls(design, SIX, **{"fs": FS, name: [1]}):
        check_refused(TypeError, f"'{name}'", call)


@both
def test_signals_come_first_and_all_else_by_name(design):
    check_refused(TypeError, "positional", design.estimate, SIX["gyr"], SIX["acc"], FS)
    check_refused(TypeError, "rate", design.estimate, SIX["gyr"], SIX["acc"], rate=FS)
    check_refused(TypeError, "acc", design.estimate, SIX["gyr"], fs=FS)


SHAPES = [
    (r"^{name} must have the shape \(samples, 3\), got \[6\]", (6,)),
    (r"^{name} must have the shape \(samples, 3\), got \[6, 2\]", (6, 2)),
    (
        r"^{name} must have the shape \(samples, 3\), got \[3, 6\]: it looks transposed, time is axis 0",
        (3, 6),
    ),
    (r"^{name} must have the shape \(samples, 3\), got \[6, 3, 1\]", (6, 3, 1)),
    (r"^{name} must have the shape \(samples, 3\), got \[\]", ()),
]


@both
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("pattern", "shape"), SHAPES)
def test_shapes_that_cannot_work(design, name, pattern, shape):
    for call in calls(design, {**SIX, name: np.zeros(shape)}, fs=FS):
        check_refused(ValueError, pattern.format(name=name), call)


@both
@pytest.mark.parametrize("name", ["acc", "mag"])
def test_signals_must_be_of_one_length(design, name):
    pattern = f"^gyr and {name} must have the same number of samples, got 6 and 5"
    for call in calls(design, {**SIX, name: SIX[name][:5]}, fs=FS):
        check_refused(ValueError, pattern, call)


@both
@not_real
def test_arrays_of_anything_else_are_refused_by_name(design, bad):
    for name in NAMES:
        if bad is None and name == "mag":
            continue
        for call in calls(design, {**SIX, name: bad}, fs=FS):
            check_refused(TypeError, f"^{name} must", call)
    if bad is not None:
        check_refused(TypeError, "^t must", design.estimate, **SIX, t=bad)
        check_refused(TypeError, "^initial must", design.estimate, **SIX, fs=FS, initial=bad)


@both
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_missing_raise_names_signal_and_row(design, name, bad):
    holed = {**SIX, name: SIX[name].copy()}
    holed[name][4, 1] = bad
    pattern = f'^{name} has a missing sample .*row 4, column 1, and missing is "raise"'
    for call in calls(design, holed, fs=FS, missing="raise"):
        check_refused(ValueError, pattern, call)
    stream = design.stream(fs=FS, missing="raise")
    stream.process(**SIX)
    before = stream.state
    check_refused(ValueError, f"^{name} is missing", stream.update, **cut(holed, 4))
    check_refused(ValueError, f"^{name} has a missing sample", stream.process, **holed)
    assert stream.state == before


@both
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("bad", [1.0, [1.0], [1.0, 2.0], [1.0, 2.0, 3.0, 4.0], [[1.0, 2.0, 3.0]]])
def test_samples_are_three_numbers(design, name, bad):
    stream = design.stream(fs=FS, initial=[1.0, 0.0, 0.0, 0.0])
    before = stream.state
    sample = {**cut(SIX, 0), name: bad}
    check_refused(ValueError, f"^{name} must be three numbers, got the shape", stream.update, **sample)
    assert stream.state == before


@both
def test_the_clock_of_a_stream(design):
    stream = design.stream(initial=[1.0, 0.0, 0.0, 0.0])
    before = stream.state
    sample = cut(SIX, 0)
    check_refused(ValueError, "^give dt in seconds: this stream has no fs", stream.update, **sample)
    check_refused(ValueError, "^give fs in Hz or t in seconds", stream.process, **SIX)
    check_refused(ValueError, "^give fs in Hz or t in seconds", design.stream(fs=FS).process, **SIX, t=T6)
    for bad in (-0.01, -math.inf, math.nan, math.inf):
        for each in (stream, design.stream(fs=FS)):
            check_refused(ValueError, "^dt must be finite and not negative", each.update, **sample, dt=bad)
    assert stream.state == before


@both
@pytest.mark.parametrize(
    ("pattern", "dtype"),
    [
        ("^dtype must be float32 or float64, got float16", "f2"),
        ("^dtype must be float32 or float64, got int64", np.int64),
        ("'nonsense'", "nonsense"),
    ],
)
def test_streams_that_cannot_work(design, pattern, dtype):
    check_refused(TypeError, pattern, design.stream, fs=FS, dtype=dtype)


def foreign(design):
    """States of other filters and what is wrong with them."""
    kind = "^the state belongs to another kind of filter"
    for other in EVERY.values():
        if other.stream().state.kind != design.stream().state.kind:
            yield kind, other.stream(initial=[1.0, 0.0, 0.0, 0.0])
    yield "^the state is of order 2 .* order 4", cf.PiForm(1.0, 1.0).stream(initial=0.0)
    yield "^the state is of dtype float32, the filter of dtype float64", design.stream(dtype="f4")


@every
def test_foreign_states_are_refused_and_change_nothing(design):
    for pattern, other in foreign(design):
        check_refused(ValueError, pattern, design.estimate, **SIX, fs=FS, initial=other.state)
        stream = design.stream(initial=[0.0, 1.0, 0.0, 0.0])
        before = stream.state
        check_refused(ValueError, pattern, stream.reset, other.state)
        check_refused(ValueError, pattern, setattr, stream, "state", other.state)
        assert stream.state == before
    check_refused(TypeError, "State", setattr, stream, "state", [1.0, 0.0, 0.0, 0.0])
    # A state with its numbers cut off is none of this filter, whatever it says.
    make, (order, dtype, time, kind, numbers) = before.__reduce__()
    short = make(order, dtype, time, kind, [numbers[0][:-1]])
    check_refused(ValueError, "^the state belongs to another kind", setattr, stream, "state", short)
    assert stream.state == before


@both
@pytest.mark.parametrize("bad", [[1.0, 2.0], [0.0, 0.0, 0.0, 0.0], [math.nan, 0.0, 0.0, 1.0]])
def test_reset_that_is_refused_changes_nothing(design, bad):
    stream = design.stream(fs=FS)
    stream.process(**SIX)
    before = stream.state
    check_refused(ValueError, ANY_INITIAL, stream.reset, bad)
    assert stream.state == before


@both
def test_attributes_are_read_only(design):
    estimate = design.estimate(**SIX, fs=FS)
    for thing, name in (
        *((design, name) for name in ("bias_limit", "acc_range", "cutoff")),
        *((estimate, name) for name in (*RESULTS, "state", "counts")),
        (design.stream(), "fs"),
    ):
        with pytest.raises(AttributeError):
            setattr(thing, name, 1.0)


def test_parameters_that_vanish_in_single_precision_are_refused_when_it_is_used():
    for design, name in ((cf.Mahony(1e-50), "kp|coefficients|fs"), (cf.GravityFilter(1e50), "tau|fs")):
        assert design.estimate(**SIX, fs=FS).quaternion.dtype == float
        single = {key: array.astype("f4") for key, array in SIX.items()}
        check_refused(ValueError, f"^({name}) must", design.estimate, **single, fs=FS)
        check_refused(ValueError, f"^({name}) must", design.stream, fs=FS, dtype="f4")
