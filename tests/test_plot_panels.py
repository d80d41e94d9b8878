"""What pictures are made of: long lines keep their extremes, and every mark is seen."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from compfilt.plot import panels
from compfilt.plot.bins import BINS, Bins


def binned(values, *, cuts=(), **marks):
    """Samples once a second, in blocks between these rows."""
    bins = Bins(["x"])
    edges = [0, *sorted(cuts), len(values)]
    for begin, end in pairwise(edges):
        part = {name: mark[begin:end] for name, mark in marks.items()}
        bins.add(np.arange(float(begin), end), {"x": values[begin:end]}, **part)
    return bins


def whole_bins(values, width):
    return [values[i : i + width] for i in range(0, len(values), width)]


def width_of(n):
    """The least power of two that leaves no more than BINS bins."""
    return 1 << max(0, int(np.ceil(np.log2(max(n, 1) / BINS))))


@settings(max_examples=60, deadline=None)
@given(
    n=st.integers(0, 60_000),
    cuts=st.lists(st.floats(0, 1), max_size=6),
    seed=st.integers(0, 2**32 - 1),
    missing=st.sampled_from([0.0, 0.0001, 0.3, 0.99, 1.0]),
)
def test_every_bin_keeps_its_extremes_gaps_and_marks(n, cuts, seed, missing):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=n)
    values[rng.random(n) < missing] = rng.choice([np.nan, np.inf])
    flags = (rng.random(n) < 1e-4).astype(np.uint8) * np.uint8(16)
    rest = rng.random(n) < 1e-4
    bins = binned(values, cuts=[int(cut * n) for cut in cuts], flags=flags, at_rest=rest)
    width = width_of(n)
    expected = whole_bins(values, width)
    assert bins.rows == n
    np.testing.assert_array_equal(bins.starts[:-1], np.arange(0, n, width))
    assert bins.flags.tolist() == [part.max() for part in whole_bins(flags, width)]
    assert bins.at_rest.tolist() == [part.any() for part in whole_bins(rest, width)]
    assert bins.missing(["x"]).tolist() == [not np.isfinite(part).all() for part in expected]
    x, y = bins.line("x")
    for i, part in enumerate(expected):
        finite = part[np.isfinite(part)]
        drawn = y[(x >= i * width) & (x < (i + 1) * width)]
        assert np.isnan(drawn).any() == (finite.size < part.size)
        if finite.size:
            assert (np.nanmin(drawn), np.nanmax(drawn)) == (finite.min(), finite.max())
    known = ~np.isnan(y)
    np.testing.assert_array_equal(y[known], values[x[known].astype(int)])
    assert (np.diff(x) >= 0).all()


@pytest.mark.parametrize("n", [0, 1, BINS])
def test_few_samples_are_drawn_one_by_one(n):
    values = np.random.default_rng(1).normal(size=n)
    values[::7] = np.nan
    x, y = binned(values).line("x")
    np.testing.assert_array_equal(x, np.arange(n))
    np.testing.assert_array_equal(y, values)


@pytest.mark.parametrize("kind", ["value", "spike", "flag", "rest"])
def test_one_sample_in_a_million_is_seen(kind):
    """As black pixels of a picture, against one without it."""
    n, row = 1_000_000, 654_321
    values, flags, rest = np.zeros(n), np.zeros(n, np.uint8), np.zeros(n, np.bool_)
    pictures = []
    for _ in range(2):
        figure = Figure(figsize=(10.0, 4.0), dpi=100)
        both = figure.subplots(2)
        bins = binned(values, flags=flags, at_rest=rest)
        panels.draw_lines(both[0], bins, {"x": "x"}, "angle", "deg")
        both[0].set_ylim(-1.0, 2.0)
        panels.draw_rest(both[0], bins)
        panels.draw_flags(both[1], bins)
        both[1].set_yticks([])
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        pictures.append(np.asarray(canvas.buffer_rgba()).astype(int))
        {"value": values, "spike": values, "flag": flags, "rest": rest}[kind][row] = (
            np.nan if kind == "value" else 1
        )
    changed = np.flatnonzero((pictures[0] != pictures[1]).any(axis=(0, 2)))
    left, right = both[0].get_window_extent().intervalx
    assert changed.size
    assert np.abs(changed - (left + 0.654321 * (right - left))).max() <= 6


@pytest.mark.parametrize(("unit", "turn"), [("deg", 360.0), ("rad", 2 * np.pi), ("", None)])
def test_angles_are_not_joined_where_they_wrap(unit, turn):
    bins = binned((np.linspace(0.0, 3.0, 301) % 1.0 - 0.5) * (turn or 360.0))
    axes = Figure().subplots()
    panels.draw_lines(axes, bins, {"x": "yaw"}, "angle", unit, wraps=True)
    assert np.isnan(axes.lines[0].get_ydata()).sum() == (0 if turn is None else 3)
    axes = Figure().subplots()
    panels.draw_lines(axes, bins, {"x": "yaw"}, "angle", "deg")
    assert np.isfinite(axes.lines[0].get_ydata()).all()


def test_values_between_gaps_are_dots():
    values = np.array([1.0, np.nan, 2.0, 3.0, np.nan, 4.0])
    axes = Figure().subplots()
    panels.draw_lines(axes, binned(values), {"x": "x"}, "angle", "deg")
    assert axes.lines[1].get_xydata().tolist() == [[0.0, 1.0], [5.0, 4.0]]


def test_a_body_that_spins_is_not_an_empty_picture():
    """In every bin the angle goes through all values: no two extremes are joined."""
    turning = np.arange(1_000_000) * 3.7 % 360.0 - 180.0
    axes = Figure().subplots()
    panels.draw_lines(axes, binned(turning), {"x": "yaw"}, "angle", "deg", wraps=True)
    assert axes.lines[1].get_xdata().size > BINS


@pytest.mark.parametrize(
    ("marked", "expected"),
    [
        ([0, 0, 0, 0], []),
        ([1, 1, 1, 1], [(0.0, 3.0)]),
        ([0, 1, 1, 0], [(1.0, 3.0)]),
        ([1, 0, 0, 1], [(0.0, 1.0), (3.0, 3.0)]),
        ([], []),
    ],
)
def test_spans(marked, expected):
    starts = np.append(np.arange(float(len(marked))), max(len(marked) - 1, 0))
    assert panels.spans(starts, np.array(marked, np.bool_)) == expected


def test_pauses_that_cannot_be_seen_are_left_out():
    bins = binned(np.zeros(1_000_000), at_rest=np.arange(1_000_000) % 2)
    assert panels.spans(bins.starts, bins.at_rest) == [(0.0, 999_999.0)]
