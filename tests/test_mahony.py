"""Mahony's filters against a slow reference, the linear filter and theory."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import attitude_reference as ref
import compfilt as cf
from designs import precisions
from test_contract import seeds, time_steps

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
    np.testing.assert_allclose(other.quaternion, one.quaternion, rtol=0, atol=1e-13)


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
