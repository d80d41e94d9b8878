"""The offline answer: against least squares over all blocks at once, its phase and its gain, its ends, and bad samples."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import attitude_reference as ref
import compfilt as cf
from designs import assert_same_bits, precisions
from test_gyro_delay import FS, disturbed, shaken
from test_self_calibration import BIAS, DEGREE, MATRIX, delay_of, tilt_error

DT = 1 / FS
TAU = 5.0
UP = np.array([0.0, 0.0, 9.81])

few = settings(max_examples=8)


def smooth(samples, **keywords):
    """On fs where that describes the steps, otherwise on t."""
    clock = {"fs": 1 / samples.dt[0]} if np.ptp(samples.dt) == 0 else {"t": samples.t}
    return cf.GravityFilter(**keywords).smooth(**samples.arrays, **clock)


def unbiased(**keywords):
    """Nothing to be learnt: a gyro that reads zero then holds the frame still, and the smoother is all there is."""
    return cf.GravityFilter(bias_limit=1e-13, **keywords)


# ------------------------------------------------------------------------------------------------------- the reference


def least_squares(forces, times, tau):
    """The smoothed force of every block: all the model says, as one system of equations.

    The integral V of force - m is measured as 0 with the variance 1/T after every block; m is a random walk of the density omega0^4;
    the first m is the first force to 10 m/s^2, and V is 0 to 1 before it.
    """
    count, density = len(forces), (math.sqrt(2.0) / tau) ** 4
    # Unknowns: V before the first block, and all m.
    integrals = np.hstack([np.ones((count, 1)), -np.tril(np.ones((count, count))) * times])
    steps = np.hstack([np.zeros((count - 1, 1)), np.diff(np.eye(count), axis=0)])
    priors = np.zeros((2, count + 1))
    priors[0, 0], priors[1, 1] = 1.0, 0.1
    weights = np.concatenate([np.sqrt(times), 1 / np.sqrt(density * times[1:]), np.ones(2)])
    right = np.concatenate(
        [-np.cumsum(forces * times[:, None], axis=0), np.zeros((count, 3)), forces[:1] / 10]
    )
    A = np.vstack([integrals, steps, priors])
    return np.linalg.lstsq(weights[:, None] * A, weights[:, None] * right, rcond=None)[0][1:]


def strapdown(samples, bias, matrix, delay, hold):
    """The frame after every sample, and the mean force of every block with its duration and its middle."""
    held, frame, frames, blocks, block = ref.HeldRate(hold), np.eye(3), [], [], []
    for n, (gyr, acc, _, dt) in enumerate(samples.rows()):
        rate, flags = held.take(gyr, dt)
        rate = np.zeros(3) if flags & ref.GYR_MISSING else rate - bias - matrix @ rate
        frame = frame @ ref.exp(rate * dt)
        frames.append(frame)
        force = None if ref.unit(acc) is None else frame @ (acc - delay * np.cross(rate, acc))
        block.append((dt, force))
        time = sum(step for step, _ in block)
        there = [(step, force) for step, force in block if force is not None]
        if time + dt / 2 >= 0.1 and sum(step for step, _ in there) > 0:
            force = sum(step * force for step, force in there) / sum(step for step, _ in there)
            blocks.append((force, time, np.sum(samples.dt[: n + 1]) - time / 2))
            block = []
    forces, times, middles = (np.array(part) for part in zip(*blocks, strict=True))
    return np.array(frames), forces, times, middles


def expected_up(samples, estimate, tau=TAU, *, delay=0.0, hold=0.1):
    """With the calibration that the forward pass has found, from a dense solution; a log without gaps."""
    calibration = estimate.gyro_bias[-1], estimate.calibration, delay + delay_of(estimate.state)
    frames, forces, times, middles = strapdown(samples, *calibration, hold)
    smoothed = least_squares(forces, times, tau)
    at = np.cumsum(samples.dt) - samples.dt / 2
    world = np.column_stack([np.interp(at, middles, part) for part in smoothed.T])
    up = np.einsum("nij,ni->nj", frames, world)
    return up / np.linalg.norm(up, axis=1)[:, None]


@pytest.mark.parametrize("clock", ["fs", "t"])
def test_like_least_squares(clock):
    rng = np.random.default_rng(1)
    dt = np.full(2500, DT)
    if clock == "t":
        dt = rng.uniform(0.002, 0.02, 2500)
        dt[[0, 1000]], dt[1600] = 0.0, 0.4
    _, samples = ref.random_samples(rng, dt)
    samples = disturbed(rng, samples, bias=BIAS, matrix=MATRIX)
    estimate = smooth(samples)
    np.testing.assert_allclose(estimate.up, expected_up(samples, estimate), atol=1e-8)
    keywords = {"tau": 2.0, "gyro_delay": 0.004, "self_calibrating": True}
    estimate = smooth(samples, **keywords)
    np.testing.assert_allclose(estimate.up, expected_up(samples, estimate, 2.0, delay=0.004), atol=1e-8)


def test_like_least_squares_with_missing_samples():
    rng = np.random.default_rng(2)
    _, samples = ref.random_samples(rng, np.full(3000, DT))
    samples = ref.with_gaps(rng, samples, DT)
    samples.acc[1000:1100] = np.nan
    samples.acc[:3] = 0.0
    design = cf.GravityFilter()
    estimate = design.smooth(samples.gyr, samples.acc, fs=FS, hold=0.0953)
    np.testing.assert_allclose(estimate.up, expected_up(samples, estimate, hold=0.0953), atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(estimate.up, axis=1), 1.0, atol=1e-12)


@few
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 60),
    fs=st.sampled_from([3.0, 9.0, 15.0, 100.0, 1000.0]),
)
def test_short_logs_like_least_squares(seed, count, fs):
    """Down to one block, of any number of samples."""
    rng = np.random.default_rng(seed)
    _, samples = ref.random_samples(rng, np.full(max(count, math.ceil(fs / 9)), 1 / fs))
    estimate = smooth(samples)
    np.testing.assert_allclose(estimate.up, expected_up(samples, estimate), atol=1e-8)


# ---------------------------------------------------------------------------------------------------- phase and gain


def still(acc, design=None, **clock):
    """A gyro that reads nothing, and what is left of the force: its first components, since up is normalised."""
    clock = clock or {"fs": FS}
    estimate = (design or unbiased()).smooth(np.zeros_like(acc), acc, **clock)
    return ref.G * estimate.up[:, :2] / estimate.up[:, 2:]


def test_a_disturbance_forward_and_backward_is_the_same():
    """Far from the ends; a block is ten samples."""
    rng = np.random.default_rng(3)
    acc = np.tile(UP, (30000, 1))
    acc[14000:16000, :2] += rng.normal(size=(2000, 2))
    there, back = still(acc), still(acc[::-1])
    assert np.abs(there).max() > 0.01
    np.testing.assert_allclose(back[5000:25000], there[::-1][5000:25000], atol=1e-6)


def test_a_symmetric_disturbance_is_not_delayed():
    acc = np.tile(UP, (20000, 1))
    acc[9500:10500, 0] += 1.0
    tilted = still(acc)[:, 0]
    np.testing.assert_allclose(tilted[5000:15000], tilted[::-1][5000:15000], atol=1e-6)
    assert np.argmax(tilted) in range(9990, 10010)
    # Online it comes late.
    up = unbiased(self_calibrating=True).estimate(np.zeros_like(acc), acc, fs=FS).up[:, 0]
    assert np.argmax(up) > 10300


@pytest.mark.parametrize("tau", [2.0, 5.0])
@pytest.mark.parametrize("ratio", [0.3, 1.0, 2.0])
def test_the_gain_is_that_of_a_butterworth_low_pass_squared(tau, ratio):
    """1/(1 + (omega/omega0)^4), and no phase."""
    omega0 = math.sqrt(2.0) / tau
    omega = ratio * omega0
    t = np.arange(1, 40001) / FS
    acc = np.tile(UP, (40000, 1))
    size = 0.01
    acc[:, 0] += size * np.sin(omega * t)
    tilted = still(acc, unbiased(tau=tau, self_calibrating=True))[10000:30000, 0] * UP[2] / ref.G
    # Between two samples stands the force of the step.
    basis = np.column_stack([np.sin(omega * t), np.cos(omega * t)])[10000:30000]
    (sine, cosine), *_ = np.linalg.lstsq(basis, tilted, rcond=None)
    gain = 1 / (1 + ratio**4)
    assert sine / size == pytest.approx(gain, rel=0.05 * ratio)
    # Blocks are at the middle of their steps: half a sample.
    assert abs(cosine / sine) < 1.5 * omega / FS + 1e-3


def test_what_does_not_change_stays():
    """At the ends as well."""
    acc = np.tile([1.0, -2.0, 9.0], (777, 1))
    estimate = unbiased().smooth(np.zeros_like(acc), acc, fs=FS)
    np.testing.assert_allclose(estimate.up, acc / np.linalg.norm(acc[0]), atol=1e-12)


def test_a_body_that_only_turns_is_reproduced():
    """An ideal gyro, no accelerations: exact from the first sample to the last."""
    rng = np.random.default_rng(4)
    motion = ref.random_motion(rng, np.full(3000, DT))
    estimate = smooth(motion.samples())
    off = ref.angles_between_directions(estimate.up, motion.R[1:, 2])
    assert off.max() < 1e-9
    # A gyro with a constant bias, that rested.
    rates = np.concatenate([np.zeros((500, 3)), motion.gyr])
    motion = ref.moved(rates, DT)
    samples = motion.samples(bias=BIAS)
    off = ref.angles_between_directions(smooth(samples).up, motion.R[1:, 2])
    assert off.max() < 0.2 * DEGREE


@pytest.mark.parametrize("seed", range(3))
def test_better_than_online(seed):
    rng = np.random.default_rng(seed)
    samples, up = shaken(rng, 60)
    samples = disturbed(rng, samples, bias=BIAS, gyro_noise=0.005, acc_noise=0.1)
    online = cf.GravityFilter(self_calibrating=True).estimate(samples.gyr, samples.acc, fs=FS)
    offline = smooth(samples)
    assert tilt_error(offline, up) < 0.5 * tilt_error(online, up)
    # What was known only later counts from the start.
    start = ref.angles_between_directions(offline.up, up)[:1000]
    assert math.sqrt(np.mean(start**2)) < 0.5 * math.sqrt(
        np.mean(ref.angles_between_directions(online.up, up)[:1000] ** 2)
    )


# ---------------------------------------------------------------------------------------------------- quaternions


@pytest.mark.parametrize("field", [None, (0.0, 20.0, -40.0)], ids=["gravity alone", "magnetometer"])
def test_quaternions_have_the_vertical_and_the_gyros_yaw(field):
    rng = np.random.default_rng(5)
    motion = ref.random_motion(rng, np.full(3000, DT))
    clean = motion.samples(ref.waves(rng, np.cumsum(motion.dt), 1.0, fastest=8.0), field)
    estimate = smooth(clean)
    R = ref.matrices(estimate.quaternion)
    np.testing.assert_allclose(R[:, 2], estimate.up, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(estimate.quaternion, axis=1), 1.0, atol=1e-12)
    off = ref.angles_between(
        R, motion.R[1:] if field else R[:1] @ np.swapaxes(motion.R[1:2], 1, 2) @ motion.R[1:]
    )
    assert off.max() < 3 * DEGREE


def test_a_known_calibration_is_where_it_begins():
    samples, _ = shaken(np.random.default_rng(6), 20)
    design = cf.GravityFilter(self_calibrating=True, calibration=MATRIX)
    estimate = design.smooth(samples.gyr[:200], samples.acc[:200], fs=FS)
    np.testing.assert_array_equal(estimate.calibration, MATRIX)


def test_what_plays_no_part():
    """The output's turn ahead, and the low-pass of a filter that does not calibrate itself."""
    samples, _ = shaken(np.random.default_rng(15), 20)
    plain = smooth(samples)
    for keywords in ({"advance": 0.1}, {"order": 4, "split": 2}, {"tau": 1.0, "zeta": 2.0}):
        assert_same_bits(smooth(samples, **keywords).up, plain.up)


def test_a_given_heading_is_taken_over():
    motion = ref.random_motion(np.random.default_rng(16), np.full(500, DT))
    samples = motion.samples()
    estimate = cf.GravityFilter().smooth(samples.gyr, samples.acc, fs=FS, initial=motion.start)
    assert ref.angles_between(ref.matrices(estimate.quaternion), motion.R[1:]).max() < 0.001


# ------------------------------------------------------------------------------------------------- results and dtypes


@precisions
def test_flags_rest_and_state_are_the_forward_passs(dtype):
    rng = np.random.default_rng(7)
    samples, _ = shaken(rng, 30, rest=5, end=5)
    samples = ref.with_gaps(rng, disturbed(rng, samples, bias=BIAS, gyro_noise=0.001), DT).astype(dtype)
    offline = smooth(samples)
    double = samples.astype(np.float64)
    online = cf.GravityFilter(self_calibrating=True).estimate(double.gyr, double.acc, fs=FS)
    for name in ("flags", "at_rest"):
        assert_same_bits(getattr(offline, name), getattr(online, name))
    assert_same_bits(offline.calibration, online.calibration.astype(dtype))
    assert offline.state == online.state
    assert offline.counts == online.counts
    bias = np.tile(online.gyro_bias[-1], (3000, 1)).astype(dtype)
    np.testing.assert_array_equal(offline.gyro_bias, bias)
    # The arithmetic is in float64, and the result in float32 where all signals are.
    for name in ("quaternion", "up", "gyro_bias"):
        assert_same_bits(getattr(offline, name), getattr(smooth(double), name).astype(dtype))
    assert smooth(samples.changed(gyr=double.gyr)).up.dtype == np.float64


def test_a_self_calibrating_filter_smooths_the_same():
    samples, _ = shaken(np.random.default_rng(8), 20)
    plain, own = (
        cf.GravityFilter(self_calibrating=learns).smooth(samples.gyr, samples.acc, fs=FS)
        for learns in (False, True)
    )
    assert_same_bits(plain.up, own.up)


def test_t_and_fs_agree():
    """But for the first step, which fs knows to last a period."""
    samples, _ = shaken(np.random.default_rng(9), 60)
    design = cf.GravityFilter()
    by_fs = design.smooth(samples.gyr, samples.acc, fs=FS)
    by_t = design.smooth(samples.gyr, samples.acc, t=1e5 + np.arange(1, 6001) / FS)
    assert ref.angles_between_directions(by_fs.up, by_t.up).max() < 0.1 * DEGREE


def test_nothing_gives_nothing():
    for clock in ({"fs": FS}, {"t": np.zeros(0)}):
        estimate = cf.GravityFilter().smooth(np.zeros((0, 3)), np.zeros((0, 3)), **clock)
        assert estimate.up.shape == (0, 3)
        assert estimate.quaternion.shape == (0, 4)
        assert estimate.flags.shape == (0,)


@pytest.mark.parametrize("count", [1, 3, 9])
def test_a_log_shorter_than_a_block_is_the_forward_passs(count):
    rng = np.random.default_rng(10)
    _, samples = ref.random_samples(rng, np.full(count, DT))
    estimate = smooth(samples)
    online = cf.GravityFilter(self_calibrating=True).estimate(samples.gyr, samples.acc, fs=FS)
    assert_same_bits(estimate.up, online.up)
    assert_same_bits(estimate.quaternion, online.quaternion)


# ---------------------------------------------------------------------------------------------------- gaps and NaN


def noisy_still(rng, count):
    acc = UP + 0.5 * rng.normal(size=(count, 3))
    acc[:, :2] += 2 * np.sin(np.linspace(0, rng.uniform(3, 9), count))[:, None]
    return acc


@pytest.mark.parametrize("gap", [1.5, 20.0, 3600.0])
def test_segments_between_gaps_stand_for_themselves(gap):
    """Nothing is known of the pause: each is smoothed as if it were alone."""
    rng = np.random.default_rng(11)
    lengths = [900, 4, 1234, 600]
    acc = noisy_still(rng, sum(lengths))
    t, starts = np.arange(len(acc)) / FS, np.cumsum(lengths)[:-1]
    for start in starts:
        t[start:] += gap
    both = unbiased().smooth(np.zeros_like(acc), acc, t=t)
    for piece in np.split(np.arange(len(acc)), starts):
        alone = unbiased().smooth(np.zeros((len(piece), 3)), acc[piece], t=t[piece])
        np.testing.assert_allclose(both.up[piece], alone.up, atol=1e-6)
    assert np.flatnonzero(both.flags & cf.Flags.RESTARTED).tolist() == starts.tolist()


def test_a_first_segment_shorter_than_a_block_is_not_the_next_ones():
    acc = np.tile([9.81, 0.0, 0.0], (500, 1))
    acc[5:] = UP
    t = np.arange(500) / FS + 20.0 * (np.arange(500) >= 5)
    up = cf.GravityFilter().smooth(np.zeros_like(acc), acc, t=t).up
    np.testing.assert_allclose(up[:5], np.tile([1.0, 0.0, 0.0], (5, 1)), atol=1e-6)
    np.testing.assert_allclose(up[5:], np.tile([0.0, 0.0, 1.0], (495, 1)), atol=1e-6)


def test_one_sample_after_a_gap_is_one_sample():
    """It does not stand for the time of the pause."""
    acc = np.tile(UP, (4000, 1))
    acc[2000, 0] = 3.0
    t = np.arange(4000) / FS + 5.0 * (np.arange(4000) >= 2000)
    up = unbiased().smooth(np.zeros_like(acc), acc, t=t).up
    assert np.degrees(np.abs(up[:, 0]).max()) < 1.0


def test_time_that_begins_anew_is_a_gap():
    rng = np.random.default_rng(12)
    acc = noisy_still(rng, 2000)
    t = np.r_[np.arange(1000), np.arange(1000)] / FS
    both = unbiased().smooth(np.zeros_like(acc), acc, t=t, backwards="restart")
    for piece in (slice(0, 1000), slice(1000, 2000)):
        alone = unbiased().smooth(np.zeros((1000, 3)), acc[piece], t=t[piece])
        np.testing.assert_allclose(both.up[piece], alone.up, atol=1e-6)
    with pytest.raises(ValueError, match="t must not"):
        unbiased().smooth(np.zeros_like(acc), acc, t=t)


@precisions
@pytest.mark.parametrize(
    ("name", "value"),
    [("acc", math.nan), ("acc", math.inf), ("acc", 0.0), ("acc", 160.0), ("acc", -160.0), ("gyr", math.nan)],
)
def test_bad_samples_are_left_out(dtype, name, value):
    """Missing and clipped ones. Half a second of the body's own motion then no longer averages out."""
    rng = np.random.default_rng(13)
    samples, up = shaken(rng, 60)
    samples = disturbed(rng, samples, bias=BIAS, gyro_noise=0.001, acc_noise=0.03)
    hurt = samples.arrays[name].copy()
    hurt[3000 : 3050 if name == "acc" else 3004] = value
    whole = smooth(samples, acc_range=156.0)
    holed = smooth(samples.changed(**{name: hurt}).astype(dtype), acc_range=156.0)
    assert np.isfinite(holed.quaternion).all()
    assert tilt_error(holed, up) < tilt_error(whole, up) + (0.3 if name == "acc" else 0.1) * DEGREE
    assert holed.flags[3000]
    assert not np.delete(holed.flags, np.arange(3000, 3050)).any()


def test_nothing_but_missing_samples():
    estimate = cf.GravityFilter().smooth(np.full((200, 3), np.nan), np.full((200, 3), np.nan), fs=FS)
    assert np.isnan(estimate.up).all()
    assert (estimate.flags & cf.Flags.NOT_STARTED == cf.Flags.NOT_STARTED).all()


def test_what_came_before_the_first_vertical_is_known_in_hindsight():
    """Its measurement is missing, but it is not before the start."""
    motion = ref.random_motion(np.random.default_rng(14), np.full(1000, DT))
    samples = motion.samples()
    samples.acc[:30] = np.nan
    estimate = smooth(samples)
    assert ref.angles_between_directions(estimate.up, motion.R[1:, 2]).max() < 1e-9
    np.testing.assert_array_equal(estimate.flags, 30 * [cf.Flags.MEASUREMENT_MISSING] + 970 * [0])


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"fs": None}, ValueError, "give fs in Hz or t in seconds"),
        ({"t": np.arange(50.0)}, ValueError, "give fs in Hz or t in seconds"),
        ({"fs": 0.0}, ValueError, "fs must"),
        ({"acc": np.ones((49, 3))}, ValueError, "same number of samples"),
        ({"gyr": np.ones((50, 2))}, ValueError, "gyr must have the shape"),
        ({"gyr": np.ones((50, 3), complex)}, TypeError, "gyr"),
        ({"missing": "raise", "acc": np.full((50, 3), np.nan)}, ValueError, "acc has a missing sample"),
        ({"missing": "no"}, ValueError, "missing must be"),
        ({"backwards": "no"}, ValueError, "backwards must be"),
        ({"hold": -1.0}, ValueError, "hold must"),
    ],
)
def test_arguments_are_checked(change, error, message):
    arguments = {"gyr": np.zeros((50, 3)), "acc": np.ones((50, 3)), "fs": FS, **change}
    with pytest.raises(error, match=message):
        cf.GravityFilter().smooth(**arguments)
