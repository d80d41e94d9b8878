"""The search for the delay between gyro and accelerometer, on motions whose delay is known to the millisecond."""

import math
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import attitude_reference as ref
import compfilt as cf

FS = 100.0
FINE = 5
"""Steps of the motion in a sample: delays are multiples of two milliseconds, and at most forty."""


# ---------------------------------------------------------------------------------------------------- motions


def products(turns):
    """The products of all first turns, quaternions (x, y, z, w): (n, ...) along axis 0, by doubling."""
    whole, step = turns, 1
    while step < len(turns):
        ahead = Rotation.from_quat(whole[:-step]) * Rotation.from_quat(whole[step:])
        whole = np.concatenate([whole[:step], ahead.as_quat()])
        step *= 2
    return whole


def attitudes(turns):
    """The same for many turns: within each sample first, then over the samples."""
    within = [turns[0::FINE]]
    for n in range(1, FINE):
        within.append((Rotation.from_quat(within[-1]) * Rotation.from_quat(turns[n::FINE])).as_quat())
    before = np.concatenate([[[0.0, 0.0, 0.0, 1.0]], products(within[-1])[:-1]])
    return Rotation.from_quat(np.repeat(before, FINE, axis=0)) * Rotation.from_quat(
        np.stack(within, axis=1).reshape(-1, 4)
    )


def shaken(
    rng,
    seconds,
    *,
    rate=1.5,
    turns=(0.5, 6.0),
    acceleration=3.0,
    late=0.0,
    instantaneous=False,
    rest=0.0,
    end=0.0,
):
    """A body that turns and shakes, and the world's up in its axes.

    The rates are constant within a fifth of a sample, and the gyro reads the exact mean of a sample's turn, or the last of these
    rates; the rates are sines of ``turns`` rad/s. The accelerations are sines that are fast enough to leave no speed behind. The accelerometer reads what was ``late``
    seconds ago. The body rests for the first ``rest`` seconds and the last ``end``.
    """
    lag, count, margin = round(late * FS * FINE), round(seconds * FS), 4
    t = np.arange(1, (count + 2 * margin) * FINE + 1) / (FS * FINE) - margin / FS
    moving = np.clip(np.minimum(t - rest, seconds - end - t) / 2, 0, 1)[:, None] if rest or end else 1.0
    rates = moving * ref.waves(rng, t, rate, *turns)
    force = ref.G * ref.UP + moving * ref.waves(rng, t, acceleration, slowest=2.0, fastest=12.0)
    R = Rotation.random(random_state=rng) * attitudes(Rotation.from_rotvec(rates / (FS * FINE)).as_quat())
    now = FINE * np.arange(margin + 1, margin + count + 1) - 1
    gyr = rates[now] if instantaneous else FS * (R[now - FINE].inv() * R[now]).as_rotvec()
    acc = R[now - lag].inv().apply(force[now - lag])
    return ref.Samples(gyr, acc, np.full(count, 1 / FS)), R[now].inv().apply(ref.UP)


def disturbed(rng, samples, *, bias=0.0, matrix=0.0, gyro_noise=0.0, acc_noise=0.0):
    """The gyro reads g where g - bias - matrix g is the truth, and both sensors are noisy."""
    gyr = np.linalg.solve(np.eye(3) - matrix, (samples.gyr + bias).T).T
    return samples.changed(
        gyr=gyr + gyro_noise * rng.normal(size=gyr.shape),
        acc=samples.acc + acc_noise * rng.normal(size=gyr.shape),
    )


def recordings(late, seeds=range(4), seconds=60, **keywords):
    made = [shaken(np.random.default_rng(seed), seconds, late=late, **keywords)[0] for seed in seeds]
    return [samples.gyr for samples in made], [samples.acc for samples in made]


# ------------------------------------------------------------------------------------------------- what is found


def test_the_motions_are_what_they_say():
    """Turned by its gyro a body without acceleration sees the vertical where it was; a late accelerometer sees it where it had been."""
    rng = np.random.default_rng(0)
    samples, up = shaken(rng, 10, acceleration=0.0)
    turns = Rotation.from_rotvec(samples.gyr / FS)
    np.testing.assert_allclose(turns[1:].inv().apply(up[:-1]), up[1:], atol=1e-12)
    np.testing.assert_allclose(samples.acc, ref.G * up, atol=1e-12)
    late, _ = shaken(np.random.default_rng(0), 10, acceleration=0.0, late=0.03)
    np.testing.assert_allclose(late.acc[3:], samples.acc[:-3], atol=1e-12)
    ahead = late.acc - 0.03 * np.cross(samples.gyr, late.acc)
    assert np.abs(ahead - samples.acc).max() < 0.2 * np.abs(late.acc - samples.acc).max()


@pytest.mark.parametrize(
    "late", [-0.010, -0.004, 0.0, 0.002, 0.006, 0.012], ids=lambda late: f"{1e3 * late:g} ms"
)
def test_the_delay_of_an_accelerometer(late):
    """Positive where it is late. A minute alone may be some milliseconds off."""
    gyr, acc = recordings(late)
    alone = [cf.find_gyro_delay(g, a, fs=FS) for g, a in zip(gyr, acc, strict=True)]
    np.testing.assert_allclose(np.median(alone), late, rtol=0.1, atol=0.001)
    np.testing.assert_allclose(cf.find_gyro_delay(gyr, acc, fs=FS), late, rtol=0.05, atol=0.001)


def test_instantaneous_rates_are_half_a_period_early():
    gyr, acc = recordings(0.0, instantaneous=True)
    assert abs(cf.find_gyro_delay(gyr, acc, fs=FS) - 0.5 / FS) < 0.0015
    gyr, acc = recordings(0.004, instantaneous=True)
    assert abs(cf.find_gyro_delay(gyr, acc, fs=FS) - 0.5 / FS - 0.004) < 0.0015


def test_what_is_found_is_what_helps():
    """With the delay that was found the filter has less error, and without what it was given nothing is left to be found."""
    rng = np.random.default_rng(3)
    samples, up = shaken(rng, 60, late=0.02, rate=3.0)
    found = cf.find_gyro_delay(samples.gyr, samples.acc, fs=FS)

    def error(delay):
        estimate = cf.GravityFilter(gyro_delay=delay).estimate(samples.gyr, samples.acc, fs=FS)
        return math.sqrt(np.mean(ref.angles_between_directions(estimate.up, up)[1000:] ** 2))

    assert error(found) < 0.8 * error(0.0)
    ahead = samples.acc - found * np.cross(samples.gyr, samples.acc)
    assert abs(cf.find_gyro_delay(samples.gyr, ahead, fs=FS)) < 0.001


def test_noise_and_bias_do_not_hide_it():
    rng = np.random.default_rng(4)
    gyr, acc = [], []
    for _ in range(4):
        # It rests first: the bias is known then.
        samples, _ = shaken(rng, 60, late=0.004, rest=6.0)
        samples = disturbed(
            rng, samples, bias=np.array([0.01, -0.008, 0.005]), gyro_noise=0.005, acc_noise=0.1
        )
        gyr.append(samples.gyr)
        acc.append(samples.acc)
    assert abs(cf.find_gyro_delay(gyr, acc, fs=FS) - 0.004) < 0.001


def test_the_sample_rate_counts():
    """The same numbers at another rate are another motion: everything is slower, the delay as well."""
    samples, _ = shaken(np.random.default_rng(5), 120, late=0.006)
    every = samples.gyr.reshape(-1, 2, 3).mean(axis=1), samples.acc[1::2]
    both = cf.find_gyro_delay(samples.gyr, samples.acc, fs=FS), cf.find_gyro_delay(*every, fs=FS / 2)
    np.testing.assert_allclose(both, 0.006, atol=0.0012)


def test_a_recording_without_turns_says_nothing():
    rng = np.random.default_rng(6)
    samples, _ = shaken(rng, 60, rate=0.0)
    for noise in (0.0, 0.002):
        shaking = disturbed(rng, samples, gyro_noise=noise, acc_noise=0.05)
        assert abs(cf.find_gyro_delay(shaking.gyr, shaking.acc, fs=FS)) < 0.001
    # It does not spoil what others say.
    gyr, acc = recordings(0.008, range(2))
    alone = cf.find_gyro_delay(gyr, acc, fs=FS)
    together = cf.find_gyro_delay([*gyr, shaking.gyr], [*acc, shaking.acc], fs=FS)
    assert abs(together - alone) < 0.0005


def test_recordings_count_together():
    """Of any lengths; neither their order nor the kind of sequence matters, and one is like a list of one."""
    gyr, acc = recordings(0.004, range(3))
    gyr[1], acc[1] = gyr[1][:4000], acc[1][:4000]
    alone = [cf.find_gyro_delay(g, a, fs=FS) for g, a in zip(gyr, acc, strict=True)]
    together = cf.find_gyro_delay(gyr, acc, fs=FS)
    assert min(alone) < together < max(alone)
    assert cf.find_gyro_delay(gyr[:1], acc[:1], fs=FS) == alone[0]
    assert cf.find_gyro_delay(tuple(gyr), tuple(acc), fs=FS) == together
    np.testing.assert_allclose(cf.find_gyro_delay(gyr[::-1], acc[::-1], fs=FS), together, atol=1e-5)
    stacked = np.stack([gyr[0], gyr[2]]), np.stack([acc[0], acc[2]])
    assert cf.find_gyro_delay(*stacked, fs=FS) == cf.find_gyro_delay(
        list(stacked[0]), list(stacked[1]), fs=FS
    )
    # Nested lists are a recording or recordings as well.
    assert cf.find_gyro_delay(gyr[0].tolist(), acc[0].tolist(), fs=FS) == alone[0]
    assert cf.find_gyro_delay([gyr[0].tolist()], [acc[0].tolist()], fs=FS) == alone[0]


def test_single_precision_is_as_good():
    samples, _ = shaken(np.random.default_rng(7), 60, late=0.004)
    double = cf.find_gyro_delay(samples.gyr, samples.acc, fs=FS)
    single = samples.astype(np.float32)
    assert abs(cf.find_gyro_delay(single.gyr, single.acc, fs=FS) - double) < 1e-5


def test_turns_of_the_body_change_nothing():
    """The least sum of lengths does not know the axes."""
    samples, _ = shaken(np.random.default_rng(8), 60, late=0.004)
    S = ref.random_attitude(np.random.default_rng(9))
    turned = cf.find_gyro_delay(samples.gyr @ S.T, samples.acc @ S.T, fs=FS)
    np.testing.assert_allclose(turned, cf.find_gyro_delay(samples.gyr, samples.acc, fs=FS), atol=1e-7)


def test_rests_do_not_count():
    """A long rest before and after the motion says nothing about the delay."""
    samples, _ = shaken(np.random.default_rng(10), 100, late=0.006, rest=30.0, end=20.0)
    assert abs(cf.find_gyro_delay(samples.gyr, samples.acc, fs=FS) - 0.006) < 0.0015


# -------------------------------------------------------------------------------------------------------- bad samples


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["gyr", "acc"])
def test_missing_samples_are_left_out(name, value):
    samples, _ = shaken(np.random.default_rng(11), 60, late=0.004)
    whole = cf.find_gyro_delay(samples.gyr, samples.acc, fs=FS)
    array = samples.arrays[name].copy()
    array[2000:2004] = value
    array[3000, 1] = value
    array[:3] = value
    holed = samples.changed(**{name: array})
    assert abs(cf.find_gyro_delay(holed.gyr, holed.acc, fs=FS) - whole) < 0.0005


@pytest.mark.parametrize("name", ["gyr", "acc"])
def test_what_a_long_hole_upsets_is_left_out(name):
    """While the gyro is gone the body turns unseen: what follows is like a start."""
    samples, _ = shaken(np.random.default_rng(12), 90, late=0.004)
    array = samples.arrays[name].copy()
    array[3000:3200] = np.nan
    holed = samples.changed(**{name: array})
    assert abs(cf.find_gyro_delay(holed.gyr, holed.acc, fs=FS) - 0.004) < 0.002


# ------------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize("fs", [0.0, -1.0, math.nan, math.inf])
def test_the_sample_rate_is_checked(fs):
    with pytest.raises(ValueError, match="fs must be positive and finite"):
        cf.find_gyro_delay(np.zeros((2000, 3)), np.ones((2000, 3)), fs=fs)


def still(seconds):
    count = round(FS * seconds)
    return np.zeros((count, 3)), np.tile([0.0, 0.0, 9.81], (count, 1))


@pytest.mark.parametrize(
    ("gyr", "acc"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3))),
        ([], []),
        (np.ones((100, 3)), np.ones((100, 3))),
        still(60),
        ([still(60)[0]], [still(60)[1]]),
        (np.full((2000, 3), np.nan), np.full((2000, 3), np.nan)),
        (np.ones((2000, 3)), np.full((2000, 3), np.nan)),
    ],
    ids=["empty", "no recording", "a second", "at rest", "a list at rest", "NaN", "no accelerometer"],
)
def test_what_says_nothing_is_an_error(gyr, acc):
    with pytest.raises(ValueError, match=r"gyr (and acc )?must"):
        cf.find_gyro_delay(gyr, acc, fs=FS)


def test_shapes_are_checked():
    gyr, acc = recordings(0.0, range(2), 12)
    with pytest.raises(ValueError, match=re.escape("the same number of recordings, got 2 and 1")):
        cf.find_gyro_delay(gyr, acc[:1], fs=FS)
    with pytest.raises(ValueError, match="the same number of samples"):
        cf.find_gyro_delay(gyr[0], acc[0][:-1], fs=FS)
    with pytest.raises(ValueError, match="gyr"):
        cf.find_gyro_delay(gyr[0][:, :2], acc[0], fs=FS)
    with pytest.raises(ValueError, match="gyr"):
        cf.find_gyro_delay(gyr[0].ravel(), acc[0].ravel(), fs=FS)
    with pytest.raises(TypeError, match="gyr"):
        cf.find_gyro_delay(gyr[0].astype(complex), acc[0], fs=FS)
