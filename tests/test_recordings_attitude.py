"""The gravity filters on real recordings, where they are at hand."""

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


@pytest.fixture(scope="module")
def delay(recordings) -> float:
    """Of all recordings together: they have the same sensor. Their truth does not enter."""
    period = np.median(np.concatenate([np.diff(recording.t) for recording in recordings]))
    gyr, acc = [recording.gyr for recording in recordings], [recording.acc for recording in recordings]
    return cf.find_gyro_delay(gyr, acc, fs=1 / period)


def error(recordings: list[accuracy.Recording], estimate) -> float:
    """The mean over the recordings in degrees; ``estimate`` takes gyr, acc and t."""
    ups = [estimate(recording.gyr, recording.acc, t=recording.t).up for recording in recordings]
    return np.mean([accuracy.inclination_error(*both) for both in zip(recordings, ups, strict=True)])


def test_the_delay_helps(recordings, delay):
    assert 0.0005 < delay < 0.004
    assert error(recordings, cf.GravityFilter(gyro_delay=delay).estimate) < 0.67
    assert error(recordings, cf.GravityFilter().estimate) < 0.71


def test_self_calibration_is_better(recordings):
    assert error(recordings, cf.GravityFilter(self_calibrating=True).estimate) < 0.60


def test_smoothing_is_best(recordings):
    assert error(recordings, cf.GravityFilter().smooth) < 0.53


def test_single_precision_is_as_good(recordings):
    for learns in (False, True):
        design = cf.GravityFilter(self_calibrating=learns)

        def single(gyr, acc, t, design=design):
            return design.estimate(gyr.astype(np.float32), acc.astype(np.float32), t=t)

        double = error(recordings[::5], design.estimate)
        assert abs(error(recordings[::5], single) - double) < 0.01


def test_a_recording_in_pieces_gives_the_same_bits(recordings):
    recording = recordings[0]
    design = cf.GravityFilter(self_calibrating=True)
    whole = design.estimate(recording.gyr, recording.acc, t=recording.t)
    stream = design.stream()
    pieces = np.array_split(np.arange(recording.t.size), 17)
    parts = [stream.process(recording.gyr[p], recording.acc[p], t=recording.t[p]) for p in pieces]
    assert np.array_equal(np.concatenate(parts), whole.quaternion, equal_nan=True)
    assert stream.state == whole.state
