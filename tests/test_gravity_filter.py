"""The gravity filter against a slow reference, the linear filter and theory; what it shares with Mahony's is in test_mahony.py."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import attitude_reference as ref
import compfilt as cf
from designs import precisions
from test_contract import seeds, time_steps
from test_mahony import (
    DT,
    FIELD,
    FS,
    HARD,
    HURT,
    check_flags,
    check_like_the_reference,
    check_recovered,
    check_same_vertical,
    clocks,
    damages,
    errors,
    fields,
    hurt_motion,
    outside_motion,
    quaternion,
    run,
    steps_of,
    tilt_errors,
)

few = settings(max_examples=6)
some = settings(max_examples=15)

DEGREE = math.radians(1.0)
SHAPES = [(1, 1), (2, 1), (2, 2), (3, 1), (4, 2), (5, 3), (6, 6)]
shapes = pytest.mark.parametrize(("order", "split"), SHAPES)

# ------------------------------------------------------------------------------------------------ against the reference


def check(samples, tolerance=1e-9, initial=None, hold=0.0953, **parameters):
    """The library like the reference; the hold is one that no sum of steps meets by chance."""
    expected = ref.GravityFilter(**parameters, hold=hold).run(samples, initial)
    estimate = run(cf.GravityFilter(**parameters), samples, initial=initial, hold=hold)
    check_like_the_reference(estimate, expected, tolerance)
    return expected


@shapes
@fields
@clocks
def test_like_the_reference(order, split, field, clock):
    """Half-angle series cost up to 1e-11 of a turn."""
    rng = np.random.default_rng(8)
    motion, samples = ref.random_samples(rng, steps_of(clock, 200, rng, (0.08, 3.0)), field=field)
    for initial in (None, motion.start):
        expected = check(samples, initial=initial, tau=2.0, order=order, split=split)
        single = run(cf.GravityFilter(2.0, order=order, split=split), samples.astype("f4"), initial=initial)
        assert single.quaternion.dtype == np.float32
        check_like_the_reference(single, expected, 3e-4)


@shapes
@fields
@clocks
def test_like_the_reference_with_missing_samples(order, split, field, clock):
    rng = np.random.default_rng(9)
    _, samples = ref.random_samples(rng, steps_of(clock, 300, rng, (0.08, 3.0)), field=field)
    samples = ref.with_gaps(rng, samples, DT)
    samples.acc[:3] = np.nan
    expected = check(samples, tau=1.0, order=order, split=split, acc_range=14.0, advance=0.02)
    assert set(np.unique(expected.flags & ref.ACC_MISSING)) == {0, 1}


def stop_and_go(rng, seconds, bias=0.0, field=None, noise=1.0, dt=DT):
    """Rest and motion by turns of seven to nine seconds, a gyro with a bias, ordinary noise."""
    count = round(seconds / dt)
    t = np.arange(count) * dt
    changes = np.cumsum(rng.uniform(7.0, 9.0, round(seconds)))
    moves = np.searchsorted(changes, t) % 2 == 1
    motion = ref.moved(ref.waves(rng, t, 2.0) * moves[:, None], dt, ref.random_attitude(rng))
    samples = motion.samples(ref.waves(rng, t, 2.0) * moves[:, None], field, bias=np.broadcast_to(bias, 3))
    sizes = {"gyr": 0.003, "acc": 0.03, "mag": 0.5}
    noisy = {
        name: array + noise * sizes[name] * rng.normal(size=array.shape)
        for name, array in samples.arrays.items()
    }
    return motion, samples.changed(**noisy), moves


@few
@given(seed=seeds)
def test_like_the_reference_with_rests_and_any_parameters(seed):
    rng = np.random.default_rng(seed)
    field = [None, FIELD][rng.integers(2)]
    _, samples, _ = stop_and_go(rng, 24.0, 0.01, field, dt=0.03)
    samples.acc[rng.integers(1, 800, 2)], samples.gyr[rng.integers(1, 800, 2)] = np.nan, np.nan
    expected = check(
        samples,
        tau=rng.uniform(0.5, 5.0),
        zeta=rng.uniform(0.3, 2.0),
        split=int(rng.integers(1, 3)),
        advance=rng.uniform(-0.05, 0.05),
        rest_time=rng.uniform(0.3, 1.0),
        rest_rate=rng.uniform(0.015, 0.05),
        rest_force=rng.uniform(0.2, 0.6),
        rest_drift=rng.uniform(0.03, 0.2),
        bias_limit=rng.uniform(0.012, 0.05),
        heading_tau=rng.uniform(0.5, 10.0),
        acc_range=40.0,
    )
    assert expected.at_rest.any()
    assert np.abs(expected.bias).max() > 0


@pytest.mark.parametrize("delay", [0.004, -0.02])
@pytest.mark.parametrize("start", [None, "given"])
def test_like_the_reference_with_a_delay(delay, start):
    """The first specific force, too, is moved ahead."""
    motion, samples = ref.random_samples(np.random.default_rng(10), np.full(300, DT))
    check(samples, initial=motion.start if start else None, gyro_delay=delay)


@pytest.mark.parametrize("fs", [2.0, 5.0, 12.0, 1000.0])
def test_like_the_reference_at_any_rate(fs):
    """A sample period is no gap, however long."""
    _, samples = ref.random_samples(np.random.default_rng(11), np.full(150, 1 / fs), rate=0.3)
    check(samples, tau=4.0)


# ---------------------------------------------------------------------------------------------------- exact properties


def linear_design(tau, order, split, zeta):
    """The linear filter of these parameters."""
    omega0 = math.sqrt(2.0) / tau
    if order == 2:
        return cf.Chain([2 * zeta * omega0, omega0**2], split=split)
    return cf.Butterworth(omega0, order, split=split)


@shapes
@clocks
def test_in_the_world_it_is_the_linear_filter(order, split, clock):
    """Of the specific force, component by component: with an exact gyro the turning frame is the world."""
    rng = np.random.default_rng(12)
    dt = steps_of(clock, 300, rng, (0.08,))
    motion = ref.random_motion(rng, dt)
    force = ref.G * ref.UP + ref.waves(rng, np.cumsum(dt), 6.0, fastest=10.0)
    samples = motion.samples(force - ref.G * ref.UP)
    design = linear_design(1.5, order, split, 0.8)
    keywords = {"fs": FS} if clock == "fs" else {"t": samples.t}
    low = design.filter(force, np.zeros_like(force), initial=ref.G * motion.R[0] @ motion.R[0][2], **keywords)
    zeta = 0.8 if order == 2 else None
    estimate = run(cf.GravityFilter(1.5, order=order, split=split, zeta=zeta), samples, initial=motion.start)
    up = (motion.R[1:] @ estimate.up[..., None])[..., 0]
    np.testing.assert_allclose(up, low / np.linalg.norm(low, axis=1, keepdims=True), atol=1e-9)


@shapes
@fields
@few
@given(seed=seeds, dt=time_steps(120), gone=st.lists(st.integers(1, 119), max_size=20))
def test_consistent_input_is_reproduced(order, split, field, seed, dt, gone):
    """Started at the motion, whatever the design, the time steps and the missing samples of all but the gyro."""
    rng = np.random.default_rng(seed)
    dt[0] = 0.0
    motion = ref.random_motion(rng, dt)
    samples = motion.samples(field=field)
    samples.acc[gone] = np.nan
    if field is not None:
        samples.mag[rng.integers(1, 120, 10)] = np.nan
    design = cf.GravityFilter(rng.uniform(0.1, 20.0), order=order, split=split)
    estimate = design.estimate(**samples.arrays, t=samples.t, initial=motion.start)
    off = tilt_errors(estimate, motion)
    # Started anew over next to no time, the coefficients of the higher orders are huge and leave few digits.
    exact = 1e-8 if order < 4 else 1e-5
    assert np.nanmax(off) < exact
    # A pause of more than a second with no sample after it waits for the next.
    waiting = estimate.flags & cf.Flags.NOT_STARTED != 0
    np.testing.assert_array_equal(np.isnan(off), waiting)
    assert np.nanmax(errors(estimate, motion)) < exact


def test_equivariance_under_turns_of_the_body():
    """A sensor that is mounted otherwise sees the same world."""
    rng = np.random.default_rng(13)
    _, samples = ref.random_samples(rng, np.full(500, DT), field=FIELD)
    S = ref.random_attitude(rng)
    turned = samples.changed(**{name: array @ S.T for name, array in samples.arrays.items()})
    one, other = (run(cf.GravityFilter(gyro_delay=0.003), each) for each in (samples, turned))
    np.testing.assert_allclose(ref.matrices(other.quaternion) @ S, ref.matrices(one.quaternion), atol=1e-10)
    np.testing.assert_allclose(other.up, one.up @ S.T, atol=1e-10)


def test_equivariance_under_turns_of_the_world():
    """Without a magnetometer the heading is a matter of the start: it moves nothing else."""
    rng = np.random.default_rng(14)
    motion, samples, _ = stop_and_go(rng, 10.0, 0.01)
    Z = ref.exp(1.3 * ref.UP)
    one = run(cf.GravityFilter(), samples, initial=motion.start)
    other = run(cf.GravityFilter(), samples, initial=ref.quaternions(Z @ motion.R[0]))
    np.testing.assert_allclose(ref.matrices(other.quaternion), Z @ ref.matrices(one.quaternion), atol=1e-10)
    np.testing.assert_allclose(other.up, one.up, atol=1e-10)
    np.testing.assert_allclose(other.gyro_bias, one.gyro_bias, atol=1e-12)


def test_the_quaternion_has_the_vertical_of_up():
    _, samples = ref.random_samples(np.random.default_rng(15), np.full(500, DT), field=FIELD)
    for each in (samples, ref.Samples(samples.gyr, samples.acc, samples.dt)):
        estimate = run(cf.GravityFilter(), each)
        np.testing.assert_allclose(ref.matrices(estimate.quaternion)[:, 2], estimate.up, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(estimate.up, axis=1), 1.0, atol=1e-14)


@precisions
@pytest.mark.parametrize("axis", [ref.EAST, ref.NORTH], ids=["x", "y"])
def test_a_body_that_is_put_upside_down_is_upside_down(axis, dtype):
    """Unseen by the gyro, along a line through zero: then the turn is not unique, but the quaternion keeps to its vertical."""
    acc = np.tile(np.array([0.0, 0.0, 9.81], dtype), (1000, 1))
    acc[200:] *= -1
    start = quaternion(axis, math.pi)  # the other way round: the same with the start instead of the flip
    for initial in (None, start):
        estimate = cf.GravityFilter(1.0).estimate(np.zeros((1000, 3), dtype), acc, fs=FS, initial=initial)
        assert np.isfinite(estimate.quaternion).all()
        np.testing.assert_allclose(estimate.up[-1], [0.0, 0.0, -1.0], atol=1e-3)
        np.testing.assert_allclose(ref.matrices(estimate.quaternion)[:, 2], estimate.up, atol=1e-5)


def test_yaw_is_not_observed_without_a_magnetometer():
    """It is the integral of the gyro, with what the gyro reads too much."""
    rng = np.random.default_rng(16)
    motion = ref.random_motion(rng, np.full(2000, DT), rate=1.0)
    around = 0.01 * motion.R[1:, 2]  # about the vertical, in body axes
    clean = motion.samples()
    estimate = run(cf.GravityFilter(), clean.changed(gyr=clean.gyr + around), initial=motion.start)
    assert tilt_errors(estimate, motion).max() < 1e-3
    np.testing.assert_allclose(errors(estimate, motion), 0.01 * DT * np.arange(1, 2001), atol=1e-3)


@pytest.mark.parametrize("name", HARD)
@fields
def test_every_attitude_is_like_every_other(field, name):
    """Through +-90 degrees of pitch and +-180 of roll and yaw."""
    rate, start = HARD[name]
    motion = ref.moved(np.tile(rate, (800, 1)), math.pi / 400, start)  # 4 rad/s: 100 samples a loop
    samples = motion.samples(field=field)
    assert errors(run(cf.GravityFilter(), samples, initial=motion.start), motion).max() < 1e-9
    rng = np.random.default_rng(1)
    noisy = samples.changed(acc=samples.acc + 0.3 * rng.normal(size=samples.acc.shape))
    assert tilt_errors(run(cf.GravityFilter(), noisy, initial=motion.start), motion).max() < 0.01


# --------------------------------------------------------------------------------------------------- start, convergence


@shapes
def test_a_wrong_start_is_forgotten(order, split):
    """From any attitude, an opposite one too; the filter is linear: there is no equilibrium but the truth."""
    motion = ref.random_motion(np.random.default_rng(17), np.full(1500, DT))
    for axis, angle in ((ref.EAST, 1.0), (ref.NORTH, math.pi - 1e-9), (np.array([0.6, 0.8, 0.0]), math.pi)):
        wrong = ref.quaternions(ref.exp(angle * axis) @ motion.R[0])
        design = cf.GravityFilter(0.5, order=order, split=split)
        estimate = run(design, motion.samples(), initial=wrong)
        assert tilt_errors(estimate, motion)[-1] < 1e-3


def test_at_the_start_the_filter_is_as_fast_as_the_time_since_allows():
    """A first sample that is 30 degrees wrong is forgotten within tenths of a second, not within three times tau."""
    acc = np.tile([0.0, 0.0, 9.81], (500, 1))
    acc[0] = [4.905, 0.0, 8.496]
    estimate = cf.GravityFilter(10.0).estimate(np.zeros((500, 3)), acc, fs=FS)
    off = ref.angles_between_directions(estimate.up, ref.UP)
    assert off[0] > 0.5
    assert off[20] < 0.1 * off[0]
    assert off[100] < 0.01 * off[0]
    # With a given start there is no such hurry.
    start = quaternion(ref.NORTH, -math.pi / 6)
    estimate = cf.GravityFilter(10.0).estimate(np.zeros((500, 3)), acc, fs=FS, initial=start)
    assert ref.angles_between_directions(estimate.up, ref.UP)[100] > 0.9 * off[0]


def test_at_the_start_noise_is_averaged_from_the_first_sample_on():
    """Not each sample believed until tau has passed: after t seconds the error is near that of a mean over t."""
    rng = np.random.default_rng(18)
    off = []
    for _ in range(200):
        acc = rng.normal([0.0, 0.0, 9.81], 1.0, (200, 3))
        off.append(cf.GravityFilter(10.0).estimate(np.zeros((200, 3)), acc, fs=FS).up[:, 0] * 9.81)
    size = np.std(off, axis=0)
    count = np.arange(1, 201)
    assert (size * np.sqrt(count))[10:].max() < 2.5


def test_a_repeated_first_time_changes_nothing():
    """Two samples at the time of the start: the second has no time to count for."""
    _, samples = ref.random_samples(np.random.default_rng(19), np.r_[0.0, 0.0, np.full(98, DT)], field=FIELD)
    estimate = run(cf.GravityFilter(), samples)
    assert not estimate.flags.any()
    np.testing.assert_allclose(estimate.quaternion[1], estimate.quaternion[0], atol=1e-15)
    check(samples)


@fields
def test_repeated_times_repeat_the_estimate(field):
    rng = np.random.default_rng(20)
    dt = rng.uniform(0.005, 0.02, 60)
    repeats = [0, 20, 40, 41, 59]
    dt[repeats] = 0.0
    _, samples = ref.random_samples(rng, dt, field=field)
    estimate = run(cf.GravityFilter(), samples)
    assert not estimate.flags.any()
    for n in repeats[1:]:
        np.testing.assert_allclose(estimate.quaternion[n], estimate.quaternion[n - 1], atol=1e-14)


@fields
def test_a_given_start_with_times_is_kept(field):
    """The first step lasts no time: the magnetometer has none to move the heading in."""
    motion = ref.at_rest(5, DT, ref.exp(0.5 * ref.UP))
    samples = motion.samples(field=field)
    start = [1.0, 0.0, 0.0, 0.0]
    estimate = cf.GravityFilter().estimate(**samples.arrays, t=np.arange(5) * DT, initial=start)
    assert not estimate.flags.any()
    np.testing.assert_allclose(estimate.quaternion[0], start, atol=1e-15)


# ------------------------------------------------------------------------------------------------------- rest and bias


def still(count, bias=0.0, noise=0.0, seed=0, R=None):
    """A body at rest."""
    samples = ref.at_rest(count, DT, R).samples(bias=np.broadcast_to(bias, 3))
    rng = np.random.default_rng(seed)
    return samples.changed(
        gyr=samples.gyr + noise * 0.003 * rng.normal(size=(count, 3)),
        acc=samples.acc + noise * 0.03 * rng.normal(size=(count, 3)),
    )


def test_rest_is_found_after_its_time_and_the_bias_at_once():
    bias = np.array([0.01, -0.02, 0.03])
    estimate = run(cf.GravityFilter(), still(400, bias))
    begun = int(np.argmax(estimate.at_rest))
    assert abs(begun - 150) <= 1
    assert estimate.at_rest[begun:].all()
    np.testing.assert_array_equal(estimate.gyro_bias[:begun], 0.0)
    np.testing.assert_allclose(estimate.gyro_bias[begun:], np.tile(bias, (400 - begun, 1)), atol=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_the_bias_is_learned_at_rest_and_kept_in_motion(seed):
    rng = np.random.default_rng(seed)
    bias = rng.uniform(-0.02, 0.02, 3)
    _, samples, moves = stop_and_go(rng, 50.0, bias)
    estimate = run(cf.GravityFilter(), samples)
    assert not estimate.at_rest[moves & np.roll(moves, 30)].any()
    # The low-passes take about three seconds to forget the motion, a rest counts after another 1.5 s.
    starts = np.flatnonzero(moves[:-1] & ~moves[1:])
    for start in starts[starts < 4300]:
        assert estimate.at_rest[start + 600 : start + 699].all()
    held = np.diff(estimate.gyro_bias, axis=0)[~estimate.at_rest[1:]]
    np.testing.assert_array_equal(held, 0.0)
    after_the_first = np.flatnonzero(estimate.at_rest)[0] + 40
    assert np.abs(estimate.gyro_bias[after_the_first:] - bias).max() < 0.002


@pytest.mark.parametrize("rate", [0.6, 1.0, 1.9])
@some
@given(seed=seeds)
def test_a_slow_turn_about_a_horizontal_axis_is_no_rest(rate, seed):
    """The vertical drifts in the body, though the gyro reads no more than a bias might be."""
    rng = np.random.default_rng(seed)
    R = ref.random_attitude(rng)
    heading = rng.uniform(0, 2 * math.pi)
    across = np.array([math.cos(heading), math.sin(heading), 0.0])
    motion = ref.moved(np.tile(rate * DEGREE * R.T @ across, (1000, 1)), DT, R)
    estimate = run(cf.GravityFilter(), motion.samples())
    assert not estimate.at_rest.any()
    np.testing.assert_array_equal(estimate.gyro_bias, 0.0)
    assert tilt_errors(estimate, motion).max() < 1e-9


@pytest.mark.parametrize(("rate", "rests"), [(1.9, True), (2.1, False), (-2.1, False), (30.0, False)])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_turn_faster_than_the_bias_limit_is_no_rest(rate, rests, axis):
    """About the vertical nothing else tells them apart: a slower one is taken for a bias."""
    R = ref.standing(np.eye(3)[axis])
    motion = ref.moved(np.tile(rate * DEGREE * np.eye(3)[axis], (600, 1)), DT, R)
    estimate = run(cf.GravityFilter(), motion.samples())
    assert estimate.at_rest.any() == rests
    np.testing.assert_allclose(estimate.gyro_bias[-1, axis], rate * DEGREE if rests else 0.0, atol=1e-12)
    limited = run(cf.GravityFilter(bias_limit=abs(rate) * DEGREE * 1.01), motion.samples())
    assert limited.at_rest.any()


def shaken(signal, size, hz=8.0):
    """At rest, but for one sensor."""
    samples = still(600)
    arrays = {name: array.copy() for name, array in samples.arrays.items()}
    arrays[signal][:, 0] += size * np.sin(2 * math.pi * hz * np.arange(600) * DT)
    return samples.changed(**arrays)


@pytest.mark.parametrize(
    ("samples", "parameter", "below", "above"),
    [
        (shaken("gyr", 0.05), "rest_rate", 0.045, 0.055),
        (shaken("acc", 0.8), "rest_force", 0.7, 0.9),
        (shaken("acc", 0.4, hz=0.1), "rest_drift", 0.03, 0.9),
        (still(600), "rest_time", 5.9, 6.1),
        (still(600, [0.0, 0.0, 0.05]), "bias_limit", 0.049, 0.051),
    ],
    ids=["rest_rate", "rest_force", "rest_drift", "rest_time", "bias_limit"],
)
def test_every_threshold_of_rest(samples, parameter, below, above):
    rests = [run(cf.GravityFilter(**{parameter: value}), samples).at_rest.any() for value in (below, above)]
    assert rests == ([True, False] if parameter == "rest_time" else [False, True])


@pytest.mark.parametrize("signal", ["gyr", "acc"])
def test_a_missing_sample_ends_a_rest(signal):
    samples = still(600, 0.01)
    getattr(samples, signal)[300, 1] = np.nan
    estimate = run(cf.GravityFilter(), samples)
    assert estimate.at_rest[299]
    assert not estimate.at_rest[300:448].any()
    assert estimate.at_rest[452:].all()
    np.testing.assert_allclose(estimate.gyro_bias[300:], 0.01, atol=1e-12)


@pytest.mark.parametrize("signal", ["gyr", "acc"])
@pytest.mark.parametrize("clock", [{"fs": FS}, {"t": np.arange(600) * DT}], ids=["fs", "t"])
def test_a_missing_first_sample_does_not_keep_from_rest(signal, clock):
    """Though with times its step lasts no time."""
    samples = still(600, 0.01)
    getattr(samples, signal)[0] = np.nan
    estimate = cf.GravityFilter().estimate(**samples.arrays, **clock)
    assert estimate.at_rest[200:].all()
    np.testing.assert_allclose(estimate.gyro_bias[-1], 0.01, atol=1e-12)


def test_a_repeated_first_time_does_not_keep_from_rest():
    samples = still(600, 0.01)
    dt = samples.dt.copy()
    dt[:2] = 0.0
    estimate = cf.GravityFilter().estimate(samples.gyr, samples.acc, t=np.cumsum(dt))
    assert estimate.at_rest[200:].all()
    np.testing.assert_allclose(estimate.gyro_bias[-1], 0.01, atol=1e-12)


@pytest.mark.parametrize("rests_before", [False, True])
@pytest.mark.parametrize("pause", [1.2, 3.0, 20.0, 1e4])
def test_a_pause_is_no_rest(rests_before, pause):
    """One sample after it knows nothing of the bias; what was known before stays."""
    samples = still(600, 0.01, noise=1.0)
    dt = samples.dt.copy()
    start = 400 if rests_before else 100
    dt[0], dt[start] = 0.0, pause
    estimate = cf.GravityFilter().estimate(samples.gyr, samples.acc, t=np.cumsum(dt))
    assert estimate.flags[start] == cf.Flags.RESTARTED
    assert not estimate.at_rest[start : start + 148].any()
    assert estimate.at_rest[start + 152]
    kept = estimate.gyro_bias[start : start + 148] - estimate.gyro_bias[start - 1]
    np.testing.assert_array_equal(kept, 0.0)
    assert np.abs(estimate.gyro_bias[-1] - 0.01).max() < 0.002


@pytest.mark.parametrize("fs", [0.01, 0.2, 0.9, 1.1, 3.0])
def test_the_bias_does_not_run_away_at_low_rates(fs):
    rng = np.random.default_rng(21)
    gyr = 0.01 + 0.003 * rng.normal(size=(300, 3))
    estimate = cf.GravityFilter().estimate(gyr, np.tile([0.0, 0.0, 9.81], (300, 1)), fs=fs)
    assert np.abs(estimate.gyro_bias).max() < 0.02


@some
@given(seed=seeds, limit=st.floats(1e-3, 0.1))
def test_the_bias_is_bounded(seed, limit):
    """On every axis, whatever the gyro reads."""
    rng = np.random.default_rng(seed)
    gyr = rng.uniform(-1.5, 1.5, 3) * limit + 1e-3 * rng.normal(size=(500, 3))
    acc = np.tile([0.0, 0.0, 9.81], (500, 1))
    estimate = cf.GravityFilter(bias_limit=limit, rest_time=0.1).estimate(gyr, acc, fs=FS)
    assert np.abs(estimate.gyro_bias).max() <= limit * (1 + 1e-12)


def test_a_rest_undoes_the_gyros_bias_in_the_attitude():
    """With the bias known, yaw no longer drifts."""
    samples = still(3000, [0.0, 0.0, 0.02])
    q = run(cf.GravityFilter(), samples).quaternion
    yaw = 2 * np.arctan2(q[:, 3], q[:, 0])
    assert yaw[149] > 0.02
    np.testing.assert_allclose(yaw[160:], yaw[160], atol=1e-9)


# --------------------------------------------------------------------------------------------------- gaps, bad samples


@pytest.mark.parametrize("order", [1, 2])
def test_a_pause_starts_the_vertical_anew(order):
    """Flagged; bias and heading are kept."""
    rng = np.random.default_rng(22)
    _, samples, moves = stop_and_go(rng, 13.0, 0.01)
    dt = samples.dt.copy()
    dt[0], dt[1100] = 0.0, 1.5
    samples = samples.changed(dt=dt)
    assert moves[1000:1200].all()
    estimate = run(cf.GravityFilter(order=order), samples)
    np.testing.assert_array_equal(np.flatnonzero(estimate.flags), [1100])
    np.testing.assert_allclose(
        estimate.up[1100], samples.acc[1100] / np.linalg.norm(samples.acc[1100]), atol=1e-12
    )
    np.testing.assert_array_equal(estimate.gyro_bias[1100], estimate.gyro_bias[1099])
    afresh = cf.GravityFilter(order=order).estimate(
        samples.gyr[1100:], samples.acc[1100:], t=samples.t[1100:]
    )
    assert np.abs(afresh.up[1] - estimate.up[1101]).max() < 0.01


@pytest.mark.parametrize("pause", [0.5, 0.99])
def test_a_short_pause_is_a_long_step(pause):
    samples = still(300)
    dt = samples.dt.copy()
    dt[0], dt[200] = 0.0, pause
    estimate = cf.GravityFilter().estimate(samples.gyr, samples.acc, t=np.cumsum(dt))
    assert not estimate.flags.any()


def test_after_missing_samples_one_sample_does_not_count_for_all():
    """At most for a tenth of a second: accelerations do not average out in one sample."""
    motion = ref.at_rest(400, DT)
    moves = {}
    for gone in (5, 20, 80):
        samples = motion.samples()
        samples.acc[200 : 200 + gone] = np.nan
        samples.acc[200 + gone] = [3.0, 0.0, 9.81]
        moves[gone] = run(cf.GravityFilter(), samples, initial=motion.start).up[200 + gone, 0]
    assert moves[5] < 0.9 * moves[20]
    np.testing.assert_allclose(moves[80], moves[20], rtol=1e-9)


# Of poles at a real part of -zeta omega0 = -0.71/tau, 0.03 is left after five time constants.
LEFT = 0.06


@damages
@precisions
def test_recovery_from_bad_samples(field, dtype, damage):
    """Finite throughout, flagged where it happens and nowhere else, and the vertical is right again after five time constants."""
    signal, value, flag = damage
    tau = 0.7
    motion = hurt_motion()
    clean = motion.samples(field=field)
    arrays = {name: array.copy() for name, array in clean.arrays.items()}
    with np.errstate(over="ignore"):
        arrays[signal][HURT] = np.clip(arrays[signal][HURT], -value, value) if flag == 0 else value
        samples = clean.changed(**arrays).astype(dtype)
    estimate = run(cf.GravityFilter(tau, acc_range=156.0), samples, initial=motion.start)
    exact = {np.float32: 2e-3, np.float64: 1e-6}[dtype]
    check_recovered(estimate, tilt_errors(estimate, motion), tau, exact, LEFT)
    check_flags(estimate, flag)


def test_an_accelerometer_that_clips_unseen_is_forgotten():
    motion = hurt_motion()
    samples = motion.samples()
    samples.acc[HURT] = np.clip(samples.acc[HURT] * 5, -8.0, 8.0)
    estimate = run(cf.GravityFilter(0.7), samples, initial=motion.start)
    assert not estimate.flags.any()
    check_recovered(estimate, tilt_errors(estimate, motion), 0.7, 1e-6, LEFT)


@precisions
@pytest.mark.parametrize("bad", [0.0, math.nan, math.inf, -math.inf])
def test_nothing_is_known_before_the_first_vertical(dtype, bad):
    gyr, acc = np.zeros((8, 3), dtype), np.tile(np.array([0.0, 6.0, 8.0], dtype), (8, 1))
    acc[:5] = bad
    estimate = cf.GravityFilter().estimate(gyr, acc, fs=FS)
    assert np.isnan(estimate.quaternion[:5]).all()
    assert np.isnan(estimate.up[:5]).all()
    np.testing.assert_array_equal(estimate.flags, 5 * [cf.Flags.NOT_STARTED | 1] + 3 * [0])
    np.testing.assert_allclose(estimate.up[5:], np.tile([0.0, 0.6, 0.8], (3, 1)), atol=1e-6)


def test_a_gyro_that_is_missing_for_long_stands_still_whatever_its_bias():
    samples = still(600, [0.0, 0.0, 0.02])
    samples.gyr[300:] = np.nan
    estimate = run(cf.GravityFilter(), samples, hold=0.105)
    np.testing.assert_array_equal(
        estimate.flags[300:], 10 * [cf.Flags.DERIVATIVE_HELD] + 290 * [cf.Flags.DERIVATIVE_MISSING]
    )
    np.testing.assert_allclose(
        estimate.quaternion[300:], np.tile(estimate.quaternion[299], (300, 1)), atol=1e-12
    )


# -------------------------------------------------------------------------------------------------------- magnetometer


@some
@given(seed=seeds)
def test_the_magnetometer_never_tilts_the_estimate(seed):
    """Whatever it says: up, bias and rest are what they are without it."""
    rng = np.random.default_rng(seed)
    _, samples, _ = stop_and_go(rng, 6.0, 0.01, FIELD, dt=0.02)
    samples.mag[:] = 30 * rng.normal(size=samples.mag.shape)
    samples.mag[rng.random(300) < 0.1] = np.nan
    one = run(cf.GravityFilter(), samples)
    other = cf.GravityFilter().estimate(samples.gyr, samples.acc, fs=50.0)
    for name in ("gyro_bias", "at_rest"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_allclose(one.up, other.up, rtol=0, atol=1e-14)


@pytest.mark.parametrize("every", [1, 7, 40])
def test_the_heading_is_a_first_order_filter(every):
    """However often there is a field; the field's time constant is heading_tau."""
    motion = ref.at_rest(3000, DT)
    samples = motion.samples(field=FIELD)
    samples.mag[np.arange(3000) % every != every - 1] = np.nan
    state = run(
        cf.GravityFilter(heading_tau=2.0), motion.samples(field=FIELD)
    ).state  # the mean has become long
    turned = ref.exp(0.01 * ref.UP)
    samples = samples.changed(mag=samples.mag @ turned.T)
    estimate = cf.GravityFilter(heading_tau=2.0).estimate(**samples.arrays, fs=FS, initial=state)
    yaw = 2 * np.arctan2(estimate.quaternion[:, 3], estimate.quaternion[:, 0])
    expected = -0.01 * (1 - np.exp(-np.arange(1, 3001) * DT / 2.0))
    np.testing.assert_allclose(yaw[every - 1 :: every], expected[every - 1 :: every], atol=0.01 * DT * every)


def test_the_first_fields_are_averaged():
    rng = np.random.default_rng(23)
    motion = ref.at_rest(500, DT)
    samples = motion.samples(field=FIELD)
    off = 0.01 * rng.normal(size=500)
    samples.mag[:] = np.column_stack([20 * np.sin(off), 20 * np.cos(off), np.full(500, -40.0)])
    q = run(cf.GravityFilter(heading_tau=10.0), samples).quaternion
    np.testing.assert_allclose(
        2 * np.arctan2(q[:, 3], q[:, 0]), np.cumsum(off) / np.arange(1, 501), atol=1e-5
    )


def test_the_first_field_sets_the_heading():
    motion = ref.random_motion(np.random.default_rng(24), np.full(300, DT))
    samples = motion.samples(field=FIELD)
    samples.mag[:120] = np.nan
    estimate = run(cf.GravityFilter(), samples)
    np.testing.assert_array_equal(estimate.flags, 120 * [cf.Flags.MAGNETOMETER_MISSING] + 180 * [0])
    assert errors(estimate, motion)[:120].min() > 0.01
    assert errors(estimate, motion)[120:].max() < 1e-9


def test_a_heading_that_is_half_a_turn_wrong_comes_back():
    motion = ref.at_rest(6000, DT)
    estimate = run(cf.GravityFilter(heading_tau=2.0), motion.samples(field=FIELD), initial=[0, 0, 0, 1])
    assert errors(estimate, motion)[-1] < 1e-3


def test_a_vertical_field_has_no_north():
    """It is as good as missing, and says so."""
    motion = ref.random_motion(np.random.default_rng(25), np.full(200, DT))
    vertical = run(cf.GravityFilter(), motion.samples(field=[0.0, 0.0, -40.0]))
    alone = run(cf.GravityFilter(), motion.samples())
    np.testing.assert_array_equal(vertical.quaternion, alone.quaternion)
    assert (vertical.flags == cf.Flags.MAGNETOMETER_MISSING).all()


# --------------------------------------------------------------------------------------------------------------- delay


def swinging(seed):
    """A sensor half a metre from the point about which it turns: accelerations that go with the rate. 400 Hz."""
    rng = np.random.default_rng(seed)
    dt = 0.0025
    motion = ref.moved(ref.waves(rng, np.arange(6000) * dt, 3.0, slowest=2.0, fastest=12.0), dt)
    place = motion.R @ [0.5, 0.0, 0.0]
    acceleration = np.zeros((6000, 3))
    acceleration[:-1] = np.diff(place, n=2, axis=0) / dt**2
    return motion, motion.samples(acceleration), dt


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("lag", [1, -1])
def test_a_late_accelerometer_is_moved_ahead(seed, lag):
    """gyro_delay is how much later its samples are than the frame that the gyro turns; an early one has a negative delay."""
    motion, samples, dt = swinging(seed)
    late = np.roll(samples.acc, lag, axis=0)

    def up(acc, delay):
        return (
            cf.GravityFilter(gyro_delay=delay).estimate(samples.gyr, acc, fs=1 / dt, initial=motion.start).up
        )

    expected = up(samples.acc, 0.0)
    off = [
        np.linalg.norm(up(late, delay) - expected, axis=1)[2000:].max()
        for delay in (0.0, lag * dt, -lag * dt)
    ]
    assert off[1] < 0.35 * off[0]
    assert off[2] > 1.5 * off[0]


@pytest.mark.parametrize("advance", [0.02, -0.01])
def test_advance_turns_the_result_on_and_not_the_filter(advance):
    """By the last rate: in a steady turn it is the attitude of a later time."""
    motion = ref.moved(np.tile([1.0, -2.0, 0.5], (200, 1)), DT, ref.exp(np.array([0.3, 0.2, 0.1])))
    samples = motion.samples()
    plain = run(cf.GravityFilter(), samples, initial=motion.start)
    ahead = run(cf.GravityFilter(advance=advance), samples, initial=motion.start)
    later = round(advance / DT)
    steady = slice(1, -1) if abs(later) < 2 else slice(2, -2)
    np.testing.assert_allclose(
        ref.matrices(ahead.quaternion)[steady],
        np.roll(ref.matrices(plain.quaternion), -later, axis=0)[steady],
        atol=1e-9,
    )
    np.testing.assert_allclose(ahead.up[steady], np.roll(plain.up, -later, axis=0)[steady], atol=1e-9)
    np.testing.assert_array_equal(ahead.gyro_bias, plain.gyro_bias)
    assert ahead.state.levels.shape == plain.state.levels.shape
    np.testing.assert_array_equal(ahead.state.levels, plain.state.levels)


# ---------------------------------------------------------------------------------------------------- outside checks


@pytest.mark.parametrize("parameters", [{}, {"order": 1}, {"order": 3}, {"split": 2}], ids=str)
def test_against_vqf(parameters):
    vqf = pytest.importorskip("vqf")
    _, samples = outside_motion()
    up = run(cf.GravityFilter(**parameters), samples).up
    for other in (vqf.VQF(DT), vqf.BasicVQF(DT)):
        check_same_vertical(up, other.updateBatch(samples.gyr, samples.acc)["quat6D"], 1.0)


def test_against_ahrs():
    ahrs = pytest.importorskip("ahrs")
    _, samples = outside_motion()
    other = ahrs.filters.Mahony(gyr=samples.gyr, acc=samples.acc, frequency=FS, k_P=1.0, k_I=0.1)
    check_same_vertical(run(cf.GravityFilter(), samples).up, other.Q, 1.0)
