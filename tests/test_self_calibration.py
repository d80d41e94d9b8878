"""The gravity filter that calibrates itself: against a slow reference, on motions whose bias and matrix are known, and hurt."""

import copy
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import attitude_reference as ref
import compfilt as cf
from designs import assert_same_bits, pickled, precisions, restored, same
from test_gyro_delay import FS, disturbed, shaken

DT = 1 / FS
DEGREE = math.pi / 180
BIAS = DEGREE * np.array([0.5, -0.4, 0.3])
MATRIX = np.array([[0.01, 0.004, -0.003], [0.004, -0.008, 0.005], [-0.003, 0.005, 0.012]])
FIELD = np.array([0.0, 20.0, -40.0])

few = settings(max_examples=5)
clocks = pytest.mark.parametrize("clock", ["fs", "t"])


def filter_of(**keywords):
    return cf.GravityFilter(self_calibrating=True, **keywords)


def clock_of(samples):
    return {"fs": 1 / samples.dt[0]} if np.ptp(samples.dt) == 0 else {"t": samples.t}


def run(samples, *, hold=0.1, initial=None, **keywords):
    design = filter_of(**keywords)
    return design.estimate(**samples.arrays, **clock_of(samples), hold=hold, initial=initial)


def delay_of(state):
    """What was learnt of the delay: with it a state ends, but for the age before it and three marks."""
    numbers = state.__reduce__()[1][4][0]
    return numbers[-4]


def symmetric(matrix):
    return (matrix + matrix.T) / 2


def tilt_error(estimate, up, after=0.0):
    """Root mean square in rad."""
    off = ref.angles_between_directions(estimate.up, up)[round(FS * after) :]
    return math.sqrt(np.mean(off**2))


# ------------------------------------------------------------------------------------------------------- the reference


class SelfCalibration(ref.GravityFilter):
    """The listing, block by block, with all sums made at the end of a block.

    What is learnt is b, M row by row, and the delay; what was known of M is added to it. Every parameter c has the sensitivities S_m and S_v of the low-passed force m and its
    velocity v, and the information I about it.

    * A block ends with the sample that is nearest to 0.1 s; of the first only the mean force counts.
    * A block without a force turns m's sensitivities, and does nothing else.
    * Nothing is learnt in the first 3 s, nor at rest, where the bias follows the gyro.
    * At the time t after the start the damping is at least 3/t and the stiffness 3/t^2, as far as (0.3/T_b)^2 allows.
    """

    block, walk, noise, learn_after, first_speed, stiffest = 0.1, 0.01 * DEGREE, 1.0, 3.0, 3.0, 0.3
    sigma = np.array(3 * [DEGREE] + 9 * [0.006] + [0.010])

    def __init__(self, tau=5.0, *, zeta=0.5, calibration=None, bias_limit=2 * DEGREE, **keywords):
        super().__init__(tau, zeta=zeta, bias_limit=bias_limit, **keywords)
        self.omega0, self.zeta = math.sqrt(2.0) / tau, zeta
        self.limits = np.array(3 * [bias_limit] + 9 * [0.05] + [0.020])
        self.learnt = np.zeros(13)
        self.known = np.zeros((3, 3)) if calibration is None else np.asarray(calibration)
        self.information = 1 / self.sigma**2
        self.begin(None)

    def begin(self, force):
        self.frame, self.m, self.v, self.age, self.settled = np.eye(3), force, np.zeros(3), 0.0, False
        self.S_m, self.S_v = np.zeros((2, 13, 3))
        self.samples = []
        self.started = force is not None

    def start_from(self, R):
        self.begin(ref.G * R[2])
        self.R, self.heading_known, self.age, self.settled = R, True, math.inf, True

    @property
    def up(self):
        return ref.unit(self.frame.T @ self.m)

    @property
    def matrix(self):
        return self.known + self.learnt[3:12].reshape(3, 3)

    def step(self, gyr, acc, mag, dt):
        held, flags = self.rate.take(gyr, dt)
        rate = np.zeros(3) if flags & ref.GYR_MISSING else held - self.learnt[:3] - self.matrix @ held
        there = ref.unit(acc) is not None and np.abs(acc).max() < self.acc_range
        flags |= 0 if there else ref.ACC_MISSING
        turn, seen = ref.exp(rate * dt), dt
        self.R = self.R @ turn
        if dt > self.gap and self.started:
            self.begin(None)
            self.rest.renew()
            seen, flags = 0.0, flags | ref.RESTARTED
        if self.started:
            self.frame, self.age = self.frame @ turn, self.age + dt
        elif there:
            self.begin(acc)
        else:
            flags |= ref.NOT_STARTED
        self.find_rest(gyr, acc if there else None, seen)
        if not self.started:
            return flags
        self.samples.append((seen, self.frame, rate, acc if there else None))
        if sum(sample[0] for sample in self.samples) + seen / 2 >= self.block:
            self.finish()
        self.bias = self.learnt[:3].copy()
        level = ref.smallest_turn(self.up, self.R[2])
        self.R = self.R @ (ref.exp(math.pi * ref.EAST) if level is None else level)
        return flags | self.turn_to_north(mag, dt)

    def find_rest(self, gyr, acc, dt):
        self.rest.bias = self.learnt[:3]
        self.resting = acc is not None and np.isfinite(gyr).all()
        if self.resting:
            self.resting = self.rest.sees(gyr, acc, dt)
        else:
            self.rest.disturb()
        self.learnt[:3] = self.rest.bias

    def finish(self):
        samples, self.samples = self.samples, []
        T = np.array([dt for dt, *_ in samples])
        R, w = (np.array(part) for part in zip(*((R, w) for _, R, w, _ in samples), strict=True))
        turned = np.concatenate(
            [
                np.einsum("n,nij->ji", T, R),
                np.einsum("n,nir,nk->rki", T, R, w).reshape(9, 3),
                np.zeros((1, 3)),
            ]
        )
        change = np.cross(turned, 0.0 if self.m is None else self.m)
        forces = [(dt, R @ f, -R @ np.cross(w, f)) for dt, R, w, f in samples if f is not None]
        if not forces:
            self.S_m = self.S_m + change
            return
        weights = np.array([dt for dt, *_ in forces])
        force, ahead = (
            weights @ np.array(part) / weights.sum() for part in list(zip(*forces, strict=True))[1:]
        )
        force = force + ahead * (self.delay + self.learnt[12])
        if not self.settled:
            self.m, self.settled = force, True
            return
        time = T.sum()
        self.v = self.v + time * (force - self.m)
        self.S_v = self.S_v - time * (self.S_m + change / 2)
        self.S_m = self.S_m + change
        self.S_v[12] += time * ahead
        if not self.resting and self.age > self.learn_after:
            self.learn(time)
        self.move(time)

    def learn(self, time):
        self.information[:3] /= 1 + self.information[:3] * self.walk**2 * time
        for c in range(13):
            self.information[c] += self.S_v[c] @ self.S_v[c] * time / self.noise
            wanted = self.learnt[c] - self.S_v[c] @ self.v * time / (self.noise * self.information[c])
            change = min(max(wanted, -self.limits[c]), self.limits[c]) - self.learnt[c]
            self.learnt[c] += change
            self.m = self.m + change * self.S_m[c]
            self.v = self.v + change * self.S_v[c]

    def move(self, time):
        damping = max(2 * self.zeta * self.omega0, self.first_speed / self.age)
        stiffness = max(self.omega0**2, self.first_speed / self.age**2)
        stiffness = min(stiffness, (self.stiffest / time) ** 2)
        self.m, self.S_m = self.m + stiffness * time * self.v, self.S_m + stiffness * time * self.S_v
        kept = 1 / (1 + damping * time)
        self.v, self.S_v = kept * self.v, kept * self.S_v


def check_like_the_reference(samples, tolerance=1e-9, *, initial=None, hold=0.1, **keywords):
    slow = SelfCalibration(**keywords, hold=hold)
    expected = slow.run(samples, initial)
    estimate = run(samples, hold=hold, initial=initial, **keywords)
    for name, got, wanted in (
        ("attitude", ref.matrices(estimate.quaternion), expected.R),
        ("up", estimate.up, expected.up),
        ("bias", estimate.gyro_bias, expected.bias),
        ("matrix", estimate.calibration, slow.matrix),
        ("delay", delay_of(estimate.state), slow.learnt[12]),
    ):
        np.testing.assert_allclose(got, wanted, rtol=0, atol=tolerance, err_msg=name)
    np.testing.assert_array_equal(estimate.flags, expected.flags)
    np.testing.assert_array_equal(estimate.at_rest, expected.at_rest)
    return expected


def steps_of(clock, count, rng):
    if clock == "fs":
        return np.full(count, DT)
    dt = rng.uniform(0.002, 0.02, count)
    dt[[0, count // 3]] = 0.0
    dt[count // 4] = 0.4
    return dt


@clocks
@pytest.mark.parametrize("field", [None, FIELD], ids=["gravity alone", "magnetometer"])
def test_like_the_reference(clock, field):
    rng = np.random.default_rng(1)
    _, samples = ref.random_samples(rng, steps_of(clock, 3000, rng), field=field)
    expected = check_like_the_reference(samples)
    assert np.ptp(expected.bias[:, 0]) > 1e-3
    assert not expected.at_rest.any()


def test_like_the_reference_with_options():
    rng = np.random.default_rng(2)
    motion, samples = ref.random_samples(rng, np.full(1500, DT))
    keywords = {"tau": 2.0, "zeta": 0.8, "gyro_delay": -0.004, "bias_limit": 0.004, "calibration": MATRIX}
    check_like_the_reference(samples, **keywords)
    check_like_the_reference(samples, initial=motion.start)


def test_like_the_reference_with_rests():
    """Rest, motion, rest, motion: the bias from the gyro and from the motion by turns."""
    rng = np.random.default_rng(3)
    samples, _ = shaken(rng, 20, rest=5, end=5)
    samples = disturbed(rng, samples, bias=BIAS, gyro_noise=0.002, acc_noise=0.02)
    twice = {name: np.tile(array, (2, 1)) for name, array in samples.arrays.items()}
    expected = check_like_the_reference(ref.Samples(**twice, dt=np.full(4000, DT)))
    assert 0.2 < expected.at_rest.mean() < 0.8


@clocks
def test_like_the_reference_with_missing_samples(clock):
    rng = np.random.default_rng(4)
    _, samples = ref.random_samples(rng, steps_of(clock, 2000, rng), field=FIELD)
    samples = ref.with_gaps(rng, samples, DT)
    samples.acc[:3] = np.nan
    expected = check_like_the_reference(samples, acc_range=14.0, hold=0.0953)
    assert set(np.unique(expected.flags & ref.ACC_MISSING)) == {0, 1}


def test_like_the_reference_after_a_gap():
    """The vertical begins anew; what was learnt stays; the pause itself counts for nothing."""
    rng = np.random.default_rng(5)
    dt = steps_of("t", 2500, rng)
    dt[[1200, 1900]] = 3.0
    _, samples = ref.random_samples(rng, dt)
    expected = check_like_the_reference(samples)
    assert np.flatnonzero(expected.flags & ref.RESTARTED).tolist() == [1200, 1900]


def test_after_a_gap_it_starts_like_a_new_one():
    """Where nothing was learnt."""
    rng = np.random.default_rng(6)
    _, samples = ref.random_samples(rng, np.full(800, DT), acceleration=1.0)
    samples = samples.changed(gyr=samples.gyr * (np.arange(800) >= 400)[:, None])
    t = np.arange(800) / FS + 30.0 * (np.arange(800) >= 400)
    design = filter_of(bias_limit=1e-13)
    whole = design.estimate(samples.gyr[200:], samples.acc[200:], t=t[200:])
    alone = design.estimate(samples.gyr[400:], samples.acc[400:], t=t[400:])
    np.testing.assert_allclose(whole.up[200:450], alone.up[:250], atol=1e-6)


def test_a_pause_is_no_rest():
    """Nobody knows what the body did in it."""
    t = np.arange(400) / FS + 5.0 * (np.arange(400) >= 100)
    gyr, acc = np.full((400, 3), 0.02), np.tile([0.0, 0.0, 9.81], (400, 1))
    estimate = filter_of().estimate(gyr, acc, t=t)
    assert not estimate.at_rest[:245].any()
    assert estimate.at_rest[255:].all()
    assert np.abs(estimate.gyro_bias).max() < 0.0201


# ---------------------------------------------------------------------------------------------------------- convergence


@pytest.mark.parametrize("seed", range(3))
def test_the_bias_is_learnt_from_the_motion(seed):
    rng = np.random.default_rng(seed)
    samples, up = shaken(rng, 120)
    samples = disturbed(rng, samples, bias=BIAS, gyro_noise=0.001, acc_noise=0.03)
    estimate = run(samples)
    assert not estimate.at_rest.any()
    assert np.linalg.norm(estimate.gyro_bias[-1] - BIAS) < 0.15 * np.linalg.norm(BIAS)
    plain = cf.GravityFilter().estimate(samples.gyr, samples.acc, fs=FS)
    assert tilt_error(estimate, up, 40) < 0.5 * tilt_error(plain, up, 40)


@pytest.fixture(scope="module")
def turning():
    """Five minutes of fast turns, four recordings: everything about the gyro shows."""
    made = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        samples, up = shaken(rng, 300, rate=8.0, turns=(0.05, 6.0), late=0.004)
        samples = disturbed(rng, samples, bias=BIAS, matrix=MATRIX, gyro_noise=0.001, acc_noise=0.03)
        made.append((samples, up, run(samples)))
    return made


def test_bias_matrix_and_delay_are_learnt_together(turning):
    wrong_bias = [np.linalg.norm(estimate.gyro_bias[-1] - BIAS) for *_, estimate in turning]
    wrong_matrix = [np.linalg.norm(symmetric(estimate.calibration) - MATRIX) for *_, estimate in turning]
    assert np.mean(wrong_bias) < 0.35 * np.linalg.norm(BIAS)
    assert np.mean(wrong_matrix) < 0.2 * np.linalg.norm(MATRIX)
    for *_, estimate in turning:
        assert abs(delay_of(estimate.state) - 0.004) < 0.002


def test_a_known_calibration_helps_from_the_start(turning):
    for samples, up, estimate in turning:
        short = samples.changed(gyr=samples.gyr[:3000], acc=samples.acc[:3000], dt=samples.dt[:3000])
        own, given = run(short), run(short, calibration=MATRIX)
        assert tilt_error(given, up[:3000], 5) < 0.7 * tilt_error(own, up[:3000], 5)
        # From one run to the next.
        handed_on = run(short, calibration=estimate.calibration)
        assert tilt_error(handed_on, up[:3000], 5) < 0.8 * tilt_error(own, up[:3000], 5)


@pytest.mark.parametrize("size", [0.03, 0.2], ids=["small", "large"])
def test_a_known_calibration_is_kept(size):
    """Before anything is learnt exactly, and afterwards where the motion agrees with it."""
    rng = np.random.default_rng(7)
    M = size * np.array([[1.0, 0.2, 0.0], [-0.2, -1.0, 0.0], [0.0, 0.3, 0.5]])
    samples, up = shaken(rng, 40)
    samples = disturbed(rng, samples, matrix=M)
    stream = filter_of(calibration=M).stream(fs=FS)
    first = stream.estimate(samples.gyr[:250], samples.acc[:250])
    np.testing.assert_array_equal(first.calibration, M)
    last = stream.estimate(samples.gyr[250:], samples.acc[250:])
    assert np.abs(last.calibration - M).max() < 0.004
    assert tilt_error(last, up[250:], 10) < 1.5 * DEGREE
    stream.reset()
    np.testing.assert_array_equal(stream.estimate(samples.gyr[:50], samples.acc[:50]).calibration, M)


@pytest.mark.parametrize("late", [-0.004, 0.0, 0.006])
def test_the_delay_is_learnt(late):
    rng = np.random.default_rng(8)
    samples, up = shaken(rng, 120, late=late, rate=3.0)
    estimate = run(samples)
    assert abs(delay_of(estimate.state) - late) < 0.002
    # A given delay is where the search begins.
    known = run(samples, gyro_delay=late)
    assert abs(delay_of(known.state)) < 0.002
    assert tilt_error(known, up) < 1.1 * tilt_error(estimate, up)


def test_a_wrong_start_is_unlearnt():
    """The clean motion of an ideal gyro takes a wrong matrix and a wrong delay back."""
    rng = np.random.default_rng(9)
    samples, _ = shaken(rng, 240, rate=8.0, turns=(0.05, 6.0))
    estimate = run(samples, calibration=MATRIX, gyro_delay=0.006)
    assert np.linalg.norm(symmetric(estimate.calibration)) < 0.4 * np.linalg.norm(MATRIX)
    assert abs(delay_of(estimate.state) + 0.006) < 0.002


def test_at_rest_the_bias_is_the_gyros():
    rng = np.random.default_rng(10)
    samples, up = shaken(rng, 40, rest=10, end=10)
    samples = disturbed(rng, samples, bias=BIAS, gyro_noise=0.002, acc_noise=0.02)
    estimate = run(samples)
    assert not estimate.at_rest[:149].any()
    assert estimate.at_rest[170:950].all()
    assert not estimate.at_rest[1200:2800].any()
    assert np.linalg.norm(estimate.gyro_bias[950] - BIAS) < 0.002
    # Once known, it is kept through the motion.
    assert np.linalg.norm(estimate.gyro_bias[1000:] - BIAS, axis=1).max() < 0.2 * DEGREE
    assert tilt_error(estimate, up, 5) < 0.5 * DEGREE


def test_a_constant_bias_at_rest_is_found_exactly():
    gyr, acc = np.tile(BIAS, (400, 1)), np.tile([0.0, 6.0, 8.0], (400, 1))
    estimate = filter_of().estimate(gyr, acc, fs=FS)
    np.testing.assert_array_equal(estimate.gyro_bias[:149], 0.0)
    np.testing.assert_allclose(estimate.gyro_bias[151:], gyr[151:], atol=1e-15)
    np.testing.assert_allclose(estimate.calibration, 0.0, atol=1e-12)


def test_what_turns_away_unseen_is_known_for_what_it_is():
    """While the accelerometer is missing the wrong bias turns the estimate away, and the sensitivities say by how much."""
    off = []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        samples, up = shaken(rng, 30, acceleration=1.0)
        samples = disturbed(rng, samples, bias=BIAS)
        samples.acc[600:1100] = np.nan
        off.append(tilt_error(run(samples), up, 12))
    assert np.mean(off) < 0.65 * DEGREE


# --------------------------------------------------------------------------------------------------------------- bounds


@few
@given(seed=st.integers(0, 2**32 - 1), size=st.floats(0.1, 30.0), limit=st.floats(1e-3, 0.2))
def test_what_is_learnt_is_bounded(seed, size, limit):
    """Whatever the sensors say."""
    rng = np.random.default_rng(seed)
    gyr, acc = size * rng.normal(size=(2000, 3)), 5 * size * rng.normal(size=(2000, 3)) + [0.0, 0.0, 9.81]
    stream = filter_of(bias_limit=limit).stream(fs=FS)
    for part in np.array_split(np.arange(2000), 20):
        estimate = stream.estimate(gyr[part], acc[part])
        assert np.abs(estimate.gyro_bias).max() <= limit * (1 + 1e-12)
        assert np.abs(estimate.calibration).max() <= 0.05 * (1 + 1e-12)
        assert abs(delay_of(estimate.state)) <= 0.020 * (1 + 1e-12)
        np.testing.assert_allclose(np.linalg.norm(estimate.quaternion, axis=1), 1.0, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(estimate.up, axis=1), 1.0, atol=1e-12)


def test_a_bias_beyond_the_limit_stops_at_it():
    rng = np.random.default_rng(12)
    samples, _ = shaken(rng, 60)
    estimate = run(disturbed(rng, samples, bias=np.array([0.1, 0.0, -0.1])))
    bias = estimate.gyro_bias[2000:]
    assert np.abs(estimate.gyro_bias).max() <= 2 * DEGREE
    np.testing.assert_allclose(bias[-1, [0, 2]], [2 * DEGREE, -2 * DEGREE], atol=0.005)


# ---------------------------------------------------------------------------------------------------- the same bits


def mixed(rng, dtype=float, field=None):
    """A rest, a motion with missing samples, 25 s; the gyro is biased."""
    samples, _ = shaken(rng, 25, rest=4)
    samples = disturbed(rng, samples, bias=BIAS, matrix=MATRIX, gyro_noise=0.002, acc_noise=0.03)
    if field is not None:
        samples = samples.changed(
            mag=np.tile(np.asarray(field, float), (len(samples), 1)) + rng.normal(size=(2500, 3))
        )
    return ref.with_gaps(rng, samples, DT).astype(dtype)


def check_same(estimate, expected):
    for name in ("quaternion", "up", "gyro_bias", "at_rest", "flags", "calibration"):
        assert_same_bits(getattr(estimate, name), getattr(expected, name))
    assert estimate.state == expected.state


@precisions
@clocks
@pytest.mark.parametrize("pause", [same, pickled, copy.deepcopy, restored])
def test_pieces_give_the_bits_of_the_whole(dtype, clock, pause):
    rng = np.random.default_rng(13)
    samples = mixed(rng, dtype, FIELD)
    t = np.cumsum(rng.uniform(0.005, 0.015, len(samples))) if clock == "t" else None
    design = filter_of(gyro_delay=0.002, calibration=MATRIX)
    clock = {"fs": FS} if t is None else {"t": t}
    whole = design.estimate(**samples.arrays, **clock)
    stream = design.stream(fs=None if t is not None else FS, dtype=dtype)
    cuts = np.sort(rng.integers(0, len(samples), 12))
    parts = []
    for piece in np.split(np.arange(len(samples)), cuts):
        stream = pause(stream)
        arrays = {name: array[piece] for name, array in samples.arrays.items()}
        parts.append(stream.estimate(**arrays, t=None if t is None else t[piece]))
    for name in ("quaternion", "up", "gyro_bias", "at_rest", "flags"):
        assert_same_bits(np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name))
    assert_same_bits(parts[-1].calibration, whole.calibration)
    assert stream.state == whole.state


@precisions
def test_sample_by_sample_gives_the_bits_of_the_whole(dtype):
    samples = mixed(np.random.default_rng(14), dtype)
    whole = filter_of().estimate(**samples.arrays, fs=FS)
    stream = filter_of().stream(fs=FS, dtype=dtype)
    live = [stream.update(gyr, acc) for gyr, acc in zip(samples.gyr, samples.acc, strict=True)]
    assert_same_bits(np.array(live), whole.quaternion)
    assert stream.state == whole.state


def test_a_state_goes_on():
    samples = mixed(np.random.default_rng(15))
    whole = filter_of().estimate(**samples.arrays, fs=FS)
    first = filter_of().estimate(samples.gyr[:1234], samples.acc[:1234], fs=FS)
    state = pickled(first.state)
    assert state == first.state
    check_same(
        filter_of().estimate(samples.gyr[1234:], samples.acc[1234:], fs=FS, initial=state), Tail(whole, 1234)
    )


class Tail:
    """The end of an estimate."""

    def __init__(self, estimate, start):
        for name in ("quaternion", "up", "gyro_bias", "at_rest", "flags"):
            setattr(self, name, getattr(estimate, name)[start:])
        self.calibration, self.state = estimate.calibration, estimate.state


def test_the_past_does_not_leak():
    """A filter that was reset is a new one."""
    samples = mixed(np.random.default_rng(16))
    design = filter_of(calibration=MATRIX)
    stream = design.stream(fs=FS)
    first = stream.estimate(**samples.arrays)
    stream.reset()
    check_same(stream.estimate(**samples.arrays), first)


def test_designs_pickle_and_compare():
    design = filter_of(gyro_delay=0.002, calibration=MATRIX, tau=4.0, zeta=0.7)
    for other in (pickled(design), copy.copy(design), copy.deepcopy(design)):
        assert other == design
        assert hash(other) == hash(design)
    assert design != filter_of(gyro_delay=0.002, tau=4.0, zeta=0.7)
    np.testing.assert_array_equal(pickled(design).calibration, MATRIX)
    assert "self_calibrating=True" in repr(design)
    assert (filter_of().tau, filter_of().zeta, filter_of().calibration) == (5.0, 0.5, None)


def test_single_precision_learns_the_same(turning):
    samples, up, double = turning[0]
    single = run(samples.astype(np.float32))
    for name in ("quaternion", "up", "gyro_bias", "calibration"):
        assert getattr(single, name).dtype == np.float32
    np.testing.assert_allclose(single.gyro_bias[-1], double.gyro_bias[-1], atol=0.03 * DEGREE)
    np.testing.assert_allclose(single.calibration, double.calibration, atol=5e-4)
    assert tilt_error(single, up) < 1.02 * tilt_error(double, up)
    np.testing.assert_allclose(np.linalg.norm(single.quaternion, axis=1), 1.0, atol=1e-6)


# --------------------------------------------------------------------------------------------------------- equivariance


@pytest.mark.parametrize("signs", [(1, -1, -1), (-1, 1, -1), (-1, -1, 1)])
def test_half_turns_of_the_body_change_nothing(signs):
    """Every sum has the same terms: b turns with the body, and M on both sides."""
    samples = mixed(np.random.default_rng(17))
    signs = np.array(signs, float)
    one, other = run(samples), run(samples.changed(gyr=signs * samples.gyr, acc=signs * samples.acc))
    np.testing.assert_allclose(other.up, signs * one.up, atol=1e-12)
    np.testing.assert_allclose(other.gyro_bias, signs * one.gyro_bias, atol=1e-12)
    np.testing.assert_allclose(other.calibration, np.outer(signs, signs) * one.calibration, atol=1e-12)
    np.testing.assert_array_equal(other.flags, one.flags)
    np.testing.assert_array_equal(other.at_rest, one.at_rest)


def test_any_turn_of_the_body_is_learnt_as_well(turning):
    """The parameters are learnt one after the other: b and M are those of the turned body only where they end."""
    for seed, (samples, up, one) in enumerate(turning[:2]):
        S = ref.random_attitude(np.random.default_rng(seed))
        other = run(samples.changed(gyr=samples.gyr @ S.T, acc=samples.acc @ S.T))
        assert tilt_error(other, up @ S.T, 60) < 1.5 * tilt_error(one, up, 60)
        assert np.linalg.norm(other.gyro_bias[-1] - S @ one.gyro_bias[-1]) < 0.6 * np.linalg.norm(BIAS)
        expected = symmetric(S @ one.calibration @ S.T)
        assert np.linalg.norm(symmetric(other.calibration) - expected) < 0.4 * np.linalg.norm(MATRIX)


# ---------------------------------------------------------------------------------------------------------- bad samples


HURT = slice(1500, 1600)
DAMAGES = {
    "no accelerometer": ("acc", math.nan, {1}),
    "infinite accelerometer": ("acc", math.inf, {1}),
    "zero accelerometer": ("acc", 0.0, {1}),
    "clipped accelerometer": ("acc", 160.0, {1}),
    "clipped below": ("acc", -160.0, {1}),
    "huge accelerometer": ("acc", 1e308, {1}),
    "no gyro": ("gyr", math.nan, {2, 4}),
    "infinite gyro": ("gyr", -math.inf, {2, 4}),
    "nothing": ("both", math.nan, {3, 5}),
}


@precisions
@pytest.mark.parametrize("damage", DAMAGES)
def test_recovery_from_bad_samples(dtype, damage):
    signal, value, flags = DAMAGES[damage]
    rng = np.random.default_rng(18)
    samples, up = shaken(rng, 45)
    hurt = samples.changed(gyr=samples.gyr.copy(), acc=samples.acc.copy())
    for name in ("gyr", "acc") if signal == "both" else (signal,):
        hurt.arrays[name][HURT] = value
    with np.errstate(over="ignore"):
        hurt = hurt.astype(dtype)
    whole, estimate = run(samples.astype(dtype), acc_range=156.0), run(hurt, acc_range=156.0)
    for array in (estimate.quaternion, estimate.up, estimate.gyro_bias, estimate.calibration):
        assert np.isfinite(array).all()
    assert set(estimate.flags[HURT].tolist()) == flags
    assert not estimate.flags[: HURT.start].any()
    assert not estimate.flags[HURT.stop :].any()
    assert_same_bits(estimate.up[: HURT.start], whole.up[: HURT.start])
    # An error leaves like the filter's poles, of real part -1/tau at this damping ratio.
    off = ref.angles_between_directions(estimate.up, up)
    left = (
        1.5
        * off[HURT.start : HURT.stop + 10].max()
        * math.exp(-(35 - HURT.stop / FS) / (5.0 * math.sqrt(2.0)))
    )
    assert tilt_error(estimate, up, 35) < 1.5 * tilt_error(whole, up, 35) + left
    # While the gyro is gone the body turns unseen, and that is blamed on its bias.
    assert np.abs(estimate.gyro_bias[-1]).max() < 0.4 * DEGREE


@precisions
@few
@given(seed=st.integers(0, 2**32 - 1))
def test_never_poisoned(dtype, seed):
    """Any numbers at all, and then a rest: the vertical is back."""
    rng = np.random.default_rng(seed)
    odd = np.array([math.nan, math.inf, -math.inf, 0.0, 1e-300, 1e30, -1e30, 1e200, -1e308, 3.0])
    gyr, acc = (
        np.where(rng.random((300, 3)) < 0.2, rng.choice(odd, (300, 3)), rng.normal(size=(300, 3)))
        for _ in "ab"
    )
    gyr = np.concatenate([gyr, np.tile(BIAS, (1500, 1))])
    acc = np.concatenate([acc, np.tile([0.0, 6.0, 8.0], (1500, 1))])
    with np.errstate(over="ignore"):
        gyr, acc = gyr.astype(dtype), acc.astype(dtype)
    t = np.cumsum(np.where(np.arange(1800) == 310, 2.0, DT))
    estimate = filter_of().estimate(gyr, acc, t=t)
    np.testing.assert_allclose(estimate.up[-1], [0.0, 0.6, 0.8], atol=1e-3)
    np.testing.assert_allclose(estimate.gyro_bias[-1], BIAS, atol=1e-4)
    assert np.isfinite(estimate.quaternion[311:]).all()
    assert np.abs(estimate.gyro_bias).max() <= 2 * DEGREE * (1 + 1e-6)
    assert np.abs(estimate.calibration).max() <= 0.05 * (1 + 1e-6)


def test_a_large_sample_is_forgotten():
    """Of the size that a shock has, without a known range."""
    rng = np.random.default_rng(19)
    samples, up = shaken(rng, 60)
    samples.acc[1000] *= 30
    estimate = run(samples)
    assert tilt_error(estimate, up, 45) < 1.5 * DEGREE


@precisions
@pytest.mark.parametrize("bad", [0.0, math.nan, math.inf])
def test_nothing_is_known_before_the_first_vertical(dtype, bad):
    gyr, acc = np.zeros((30, 3), dtype), np.tile(np.array([0.0, 6.0, 8.0], dtype), (30, 1))
    acc[:5] = bad
    estimate = filter_of().estimate(gyr, acc, fs=FS)
    assert np.isnan(estimate.quaternion[:5]).all()
    np.testing.assert_array_equal(estimate.flags, 5 * [cf.Flags.NOT_STARTED | 1] + 25 * [0])
    np.testing.assert_allclose(estimate.up[5:], np.tile([0.0, 0.6, 0.8], (25, 1)), atol=1e-6)


def test_a_gap_keeps_what_was_learnt():
    rng = np.random.default_rng(20)
    samples, up = shaken(rng, 60)
    samples = disturbed(rng, samples, bias=BIAS)
    t = samples.t + 5.0 * (np.arange(6000) >= 4000)
    kept = filter_of().estimate(samples.gyr, samples.acc, t=t)
    assert kept.flags[4000] == cf.Flags.RESTARTED
    np.testing.assert_array_equal(kept.gyro_bias[4000:4200], np.tile(kept.gyro_bias[3999], (200, 1)))
    np.testing.assert_allclose(np.linalg.norm(kept.quaternion, axis=1), 1.0, atol=1e-12)
    off = np.abs(ref.angles_between_directions(kept.up, up))[5000:]
    assert math.sqrt(np.mean(off**2)) < 1.5 * DEGREE


def test_back_in_time_is_an_error_or_a_restart():
    samples = mixed(np.random.default_rng(21))
    t = np.arange(2500) / FS
    t[1500:] -= 12.0
    with pytest.raises(ValueError, match="t must not"):
        filter_of().estimate(samples.gyr, samples.acc, t=t)
    both = filter_of(calibration=MATRIX).estimate(samples.gyr, samples.acc, t=t, backwards="restart")
    alone = filter_of(calibration=MATRIX).estimate(samples.gyr[1500:], samples.acc[1500:], t=t[1500:])
    assert_same_bits(both.up[1500:], alone.up)
    assert_same_bits(both.calibration, alone.calibration)
    assert both.flags[1500] & cf.Flags.RESTARTED


# --------------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"order": 3}, "self_calibrating goes with order=2 and split=1"),
        ({"split": 2}, "self_calibrating goes with order=2 and split=1"),
        ({"calibration": np.full((3, 3), 0.6)}, "calibration must be nine numbers below"),
        ({"calibration": np.full((3, 3), np.nan)}, "calibration must be nine numbers below"),
        ({"tau": 0.0}, "tau must be positive"),
        ({"tau": math.nan}, "tau must be positive"),
        ({"zeta": -1.0}, "zeta must be positive"),
        ({"gyro_delay": math.inf}, "gyro_delay must be finite"),
        ({"bias_limit": 0.0}, "bias_limit must be positive"),
        ({"rest_time": -1.0}, "rest_time must be positive"),
        ({"acc_range": 0.0}, "acc_range must be positive"),
    ],
)
def test_parameters_are_checked(keywords, message):
    with pytest.raises(ValueError, match=message):
        filter_of(**keywords)


@pytest.mark.parametrize("calibration", [np.zeros(9), np.zeros((3, 2)), "M"])
def test_a_calibration_has_three_rows_of_three(calibration):
    with pytest.raises((TypeError, ValueError)):
        filter_of(calibration=calibration)


def test_a_calibration_goes_with_self_calibration():
    with pytest.raises(ValueError, match="calibration goes with self_calibrating=True"):
        cf.GravityFilter(calibration=np.zeros((3, 3)))
    assert cf.GravityFilter().estimate(np.zeros((5, 3)), np.ones((5, 3)), fs=FS).calibration is None


def test_a_plain_filters_state_is_refused():
    state = cf.GravityFilter().estimate(np.zeros((5, 3)), np.ones((5, 3)), fs=FS).state
    with pytest.raises(ValueError, match="another kind"):
        filter_of().estimate(np.zeros((5, 3)), np.ones((5, 3)), fs=FS, initial=state)
