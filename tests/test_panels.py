"""What pictures are made of: long lines keep their extremes, and what cannot be seen is not drawn."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from compfilt.plot import panels


def drawn(axes):
    return axes.lines[0].get_xydata()


@given(st.integers(0, 30_000), st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_a_thinned_line_keeps_its_extremes(n, seed, missing):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=n)
    values[rng.random(n) < missing] = np.nan
    rows = panels.thin(values)
    assert rows.size <= max(panels.POINTS + 2, 1)
    assert (np.diff(rows) > 0).all()
    if n <= panels.POINTS:
        assert rows.tolist() == list(range(n))
        return
    assert (rows[0], rows[-1]) == (0, n - 1)
    starts = np.arange(0, n, -(-2 * n // (panels.POINTS - 2)))
    for extreme in (np.fmin, np.fmax):
        kept = extreme.reduceat(values[rows], np.searchsorted(rows, starts))
        np.testing.assert_array_equal(kept, extreme.reduceat(values, starts))


def test_a_flag_on_every_sample_is_one_tick_a_place():
    figure = Figure()
    axes = figure.subplots()
    flags = np.full(100_000, 64)
    panels.draw_flags(axes, np.arange(100_000.0), flags, panels.set_flags(flags))
    assert axes.lines[0].get_xdata().size == panels.POINTS


@pytest.mark.parametrize(("unit", "turn"), [("deg", 360.0), ("rad", 2 * np.pi), ("", None)])
def test_angles_are_not_joined_where_they_wrap(unit, turn):
    angle = np.linspace(0.0, 3.0, 301) % 1.0 - 0.5
    axes = Figure().subplots()
    panels.draw_lines(axes, np.arange(301.0), {"yaw": angle * (turn or 360.0)}, "angle", unit, wraps=True)
    assert np.isnan(drawn(axes)[:, 1]).sum() == (0 if turn is None else 3)
    axes = Figure().subplots()
    panels.draw_lines(axes, np.arange(301.0), {"yaw": angle * 360.0}, "angle", "deg")
    assert np.isfinite(drawn(axes)).all()


@pytest.mark.parametrize(
    ("rest", "expected"),
    [
        ([0, 0, 0, 0], []),
        ([1, 1, 1, 1], [(0.0, 3.0)]),
        ([0, 1, 1, 0], [(1.0, 3.0)]),
        ([1, 0, 0, 1], [(0.0, 1.0), (3.0, 3.0)]),
        ([], []),
    ],
)
def test_spans(rest, expected):
    assert panels.spans(np.arange(float(len(rest))), np.array(rest)) == expected


def test_pauses_that_cannot_be_seen_are_left_out():
    rest = np.arange(1_000_000) % 2
    found = panels.spans(np.arange(1e6), rest)
    assert found == [(1.0, 999_999.0)]
