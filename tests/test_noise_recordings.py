"""Noise of real recordings, where they are at hand: motion is refused with its times, and the rests are analysed."""

import os
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from compfilt import noise
from compfilt.logs.errors import LogError
from compfilt.noise.log import analyse_log

ROOT = Path(__file__).resolve().parent.parent
FOLDER = Path(os.environ.get("COMPFILT_RECORDINGS", ROOT.parent / "shared" / "broad"))
PATHS = sorted(FOLDER.glob("*.parquet"))

pytestmark = pytest.mark.skipif(
    not PATHS, reason="no recordings: set COMPFILT_RECORDINGS to a folder of them"
)


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_motion_is_found_where_the_cameras_saw_it(path):
    """All of it, and nothing in the first 25 s and the last 10 s but a knock, in which the sensor lies still."""
    read = pq.read_table(path)
    t, gyro, acc = (
        np.column_stack([read[name].to_numpy() for name in names]).astype(float)
        for names in (("t",), ("gx", "gy", "gz"), ("ax", "ay", "az"))
    )
    moves = read["movement"].to_numpy().astype(bool)
    t = t[:, 0]
    spans = noise.find_motion(gyro, acc, fs=1.0 / np.mean(np.diff(t)))
    found = np.zeros(t.size, bool)
    for start, end in spans:
        found |= (t >= start) & (t <= end)
    assert np.mean(found[moves]) > 0.95
    still = (t < 25.0) | (t > t[-1] - 10.0)
    assert np.mean(found[still & ~moves]) < 0.02


@pytest.mark.parametrize("path", PATHS[:3], ids=lambda path: path.stem)
def test_the_rest_is_analysed(path):
    """One sensor made all of them; as its steps are as large as its noise, that differs with the bias."""
    with pytest.raises(
        LogError, match=r"^not at rest from .* s: --from and --until choose a part, --longest-rest"
    ):
        analyse_log(path, gyro_unit="rad/s")
    report = analyse_log(path, gyro_unit="rad/s", only_longest_rest=True)
    for channel in report.gyro:
        assert np.degrees(channel.density) == pytest.approx(0.006, rel=0.33)
        assert np.degrees(channel.step) == pytest.approx(0.061, rel=0.01)
    for channel in report.accelerometer[:2]:
        assert channel.density == pytest.approx(0.0027, rel=0.15)
