"""The tilt filters on real recordings, where they are at hand."""

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
