"""Faults put into real recordings are found, and none is invented on the recordings as they are; where they are at hand."""

import os
from pathlib import Path

import numpy as np
import pytest

import check

ROOT = Path(__file__).resolve().parent.parent
FOLDER = Path(os.environ.get("COMPFILT_RECORDINGS", ROOT.parent / "shared" / "broad"))
PATHS = sorted(FOLDER.glob("*.parquet"))
FAULTS = [fault for fault in check.faults() if fault.name != "clean"]
CLEAN = check.Fault("clean", dict, ())

pytestmark = pytest.mark.skipif(
    not PATHS, reason="no recordings: set COMPFILT_RECORDINGS to a folder of them"
)


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_nothing_is_invented(path):
    assert check.check(check.read(path), CLEAN).wrong == ()


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_is_found(fault):
    """On one recording each, a different one for every fault; benches/check.py has all of them."""
    path = PATHS[FAULTS.index(fault) % min(5, len(PATHS))]
    report = check.check(check.read(path), fault)
    assert check.verdict(report, fault) == "found", str(report)


def test_a_rate_is_measured():
    """285.7 Hz, from a recipe that says twice as much."""
    fault = next(fault for fault in FAULTS if fault.name == "rate stated twice")
    report = check.check(check.read(PATHS[0]), fault)
    measured = float(report.about("rate")[0].fix.removeprefix("rate = "))
    assert np.isclose(measured, 285.714, rtol=0.03)
