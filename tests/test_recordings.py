"""The tilt and attitude filters on real recordings, where they are at hand."""

import os
from pathlib import Path

import numpy as np
import pytest

import accuracy
import compfilt as cf

ROOT = Path(__file__).resolve().parent.parent
FOLDER = Path(os.environ.get("COMPFILT_RECORDINGS", ROOT.parent / "shared" / "broad"))

pytestmark = pytest.mark.skipif(
    not any(FOLDER.glob("*.parquet")), reason="no recordings: set COMPFILT_RECORDINGS to a folder of them"
)


@pytest.fixture(scope="module")
def recordings() -> list[accuracy.Recording]:
    return [accuracy.read(path) for path in sorted(FOLDER.glob("*.parquet"))]


@pytest.mark.parametrize("design", [cf.FirstOrder(3.0), cf.PiForm(0.35, 0.0006)], ids=str)
def test_inclination_is_as_good_as_the_baseline(recordings, design):
    """About 6 degrees are known for the first-order form with Euler rates; the accelerometer alone has 22."""
    assert np.mean(accuracy.error_of(design, recordings)) < 6.5


def test_leaving_out_the_euler_rates_is_worse(recordings):
    """The body rates taken for angle rates, as if the sensor stayed level."""

    def error(recording: accuracy.Recording) -> float:
        measured = cf.tilt(recording.acc)
        angles = cf.FirstOrder(3.0).filter(measured, recording.gyr[:, :2], t=recording.t, period=2 * np.pi)
        return accuracy.inclination_error(recording, accuracy.up_of_angles(angles))

    naive = np.mean([error(recording) for recording in recordings])
    assert naive > 2 * np.mean(accuracy.error_of(cf.FirstOrder(3.0), recordings))


def test_a_recording_in_pieces_gives_the_same_bits(recordings):
    recording = recordings[0]
    tilt = cf.TiltFilter(cf.PiForm(0.35, 0.0006))
    whole = tilt.estimate(recording.gyr, recording.acc, t=recording.t).angles
    stream = tilt.stream()
    pieces = np.array_split(np.arange(recording.t.size), 17)
    parts = [stream.process(recording.gyr[p], recording.acc[p], recording.t[p]) for p in pieces]
    assert np.array_equal(np.concatenate(parts), whole, equal_nan=True)


def errors_of(attitude, recordings, dtype=float) -> list[float]:
    """The inclination error of an attitude filter on each recording, in one precision."""
    errors = []
    for recording in recordings:
        gyr, acc = recording.gyr.astype(dtype), recording.acc.astype(dtype)
        estimate = attitude.estimate(gyr, acc, t=recording.t)
        assert np.isfinite(estimate.quaternion).all()
        assert not estimate.flags.any()
        errors.append(accuracy.inclination_error(recording, estimate.up.astype(float)))
    return errors


@pytest.mark.parametrize(
    ("attitude", "bound"),
    [(cf.GravityFilter(), 0.73), (cf.GravityFilter(gyro_delay=0.0025), 0.67)],
    ids=["no delay", "delay"],
)
def test_gravity_filter_finds_the_vertical(recordings, attitude, bound):
    """VQF has 0.705 degrees on fifteen trials of BROAD, and 0.723 on thirty."""
    double, single = (errors_of(attitude, recordings, dtype) for dtype in (np.float64, np.float32))
    assert np.mean(double) <= bound
    np.testing.assert_allclose(single, double, rtol=0, atol=0.01)


@pytest.mark.parametrize(
    ("attitude", "bound"),
    [
        (cf.Mahony(0.2), 3.0),
        (cf.Mahony(0.2, 0.003), 2.5),
        (cf.Mahony(0.2, 0.003, "passive"), 2.5),
        (cf.Mahony(1.0, 0.3), 10.0),
    ],
    ids=str,
)
def test_mahony_is_better_than_the_accelerometer_alone(recordings, attitude, bound):
    errors = errors_of(attitude, recordings)
    alone = [accuracy.inclination_error(r, accuracy.up_of_angles(cf.tilt(r.acc))) for r in recordings]
    assert (np.array(errors) < alone).all()
    assert np.mean(errors) < bound


def test_mahony_direct_is_finite(recordings):
    """No more: it turns with what the accelerometer of the moment says, and that is far off in motion."""
    assert np.isfinite(errors_of(cf.Mahony(0.2, 0.003, "direct"), recordings)).all()


def test_the_cuts_of_the_bench(recordings):
    """What --rate-divisor, --rest and --start-in-motion do to a recording."""
    recording = recordings[0]
    slow = accuracy.at_lower_rate(recording, 3)
    count = recording.t.size // 3
    assert [array.shape[0] for array in (slow.t, slow.gyr, slow.acc, slow.up, slow.counts)] == 5 * [count]
    np.testing.assert_allclose(slow.gyr[7], recording.gyr[21:24].mean(axis=0))
    assert slow.t[7] == recording.t[23]
    np.testing.assert_array_equal(slow.up[7], recording.up[23])
    begins = recording.t[np.argmax(recording.counts)]
    for seconds in (-0.5, 5.0):
        cut = accuracy.beginning(recording, seconds)
        assert 0 <= cut.t[0] - (begins + seconds) < 0.004
        np.testing.assert_array_equal(cut.gyr[-1], recording.gyr[-1])


def test_every_filter_of_the_bench_runs(recordings):
    """Each of them runs, and has a finite error."""
    short = [accuracy.part(recordings[0], slice(0, 20_000))]
    rows = dict(accuracy.attitude_rows(short, alone=True))
    assert "GravityFilter()" in rows
    assert np.isfinite(list(rows.values())).all()
