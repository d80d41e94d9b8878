"""exact=False: the sums in another order, the same result to rounding; the same bits for any number of workers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import compfilt as cf
from designs import (
    MATCHED,
    PLAIN,
    Case,
    all_linear_cases,
    assert_same_bits,
    few_cases,
    precisions,
    random_signals,
)

FS = 100.0
# What the binding works in: runs of 8 samples, tiles of 8 runs, blocks of 4 tiles, chunks of 32 blocks; one of several workers
# takes 8 chunks at once, and there are several from so many rows for each on.
RUN, BLOCK, CHUNK = 8, 256, 8192
SHARE = 8 * CHUNK
WORKER = 4 * SHARE
LENGTHS = (0, 1, RUN - 1, RUN, BLOCK - 1, BLOCK, BLOCK + 1, 4 * BLOCK - 1, 4 * BLOCK, 4 * BLOCK + 1)
LONG = (CHUNK - 1, CHUNK, CHUNK + 1, CHUNK + RUN, CHUNK + RUN + 1, 3 * CHUNK + BLOCK + 37)
BOUND = {np.dtype(np.float64): 1e-13, np.dtype(np.float32): 2e-5}
# The levels above are derivatives: what both orders round is a larger part of them.
BOUND_ABOVE = {np.dtype(np.float64): 5e-13, np.dtype(np.float32): 1e-4}


def no_reference(omega):
    """The exact order is what is compared with."""
    raise NotImplementedError(omega)


ORDERS = [
    Case(f"chain {order}, derivative {m}", lambda w, n=order, m=m: binomial(w, n, m), no_reference)
    for order in range(1, 7)
    for m in range(1, order + 1)
]
SPLITS = [
    Case(f"chain {order}, split {split}", lambda w, n=order, s=split: binomial(w, n, 1, s), no_reference)
    for order in range(2, 7)
    for split in range(1, order)
]


def binomial(omega, order, derivative_order, split=None):
    """All poles at -omega."""
    coefficients = np.poly(np.full(order, -omega))[1:]
    return cf.Chain(coefficients.tolist(), derivative_order, split)


def signals(rows, *, seed=1, dtype=float):
    """A slow motion with an offset and noise: sizes of 1."""
    y, u = random_signals(rows, seed=seed)
    slow = np.sin(np.arange(rows) / 300.0)
    return (y * 0.1 + slow + 0.5).astype(dtype), (0.1 * u + 0.01).astype(dtype)


def assert_close(got, expected, bound=None):
    """Within the bound of the range of the expected numbers, missing where they are."""
    got, expected = np.asarray(got), np.asarray(expected)
    assert got.dtype == expected.dtype
    np.testing.assert_array_equal(np.isnan(got), np.isnan(expected))
    if expected.size:
        size = max(np.nanmax(np.abs(expected)), 1e-300)
        error = np.nanmax(np.abs(got.astype(float) - expected)) / size
        assert error <= (bound or BOUND[expected.dtype])


def both(case, y, u, **keywords):
    """Estimates in both orders of the sums, the second with two workers too."""
    design, rule = case.make(keywords.pop("speed", 3.0)), case.rule
    estimate = lambda **more: design.estimate(y, u, fs=FS, rule=rule, **keywords, **more)  # noqa: E731
    exact, blocks, shared = estimate(), estimate(exact=False), estimate(exact=False, workers=2)
    assert_same_bits(shared.levels, blocks.levels)
    assert_same_bits(shared.flags, blocks.flags)
    return exact, blocks


def assert_same_levels(got, expected):
    assert_close(got[0], expected[0])
    for found, wanted in zip(got[1:], expected[1:], strict=True):
        assert_close(found, wanted, BOUND_ABOVE[wanted.dtype])


def assert_same_estimate(exact, blocks):
    assert_same_levels(blocks.levels, exact.levels)
    np.testing.assert_array_equal(blocks.flags, exact.flags)


@pytest.mark.parametrize("case", PLAIN + MATCHED + ORDERS + SPLITS, ids=lambda case: case.name)
@precisions
def test_every_design_is_the_same_to_rounding(case, dtype):
    y, u = signals(2 * CHUNK + 5 * BLOCK + 7, dtype=dtype)
    exact, blocks = both(case, y, u)
    assert_same_estimate(exact, blocks)
    level0 = case.design.filter(y, u, fs=FS, rule=case.rule, exact=False)
    assert_same_bits(level0, blocks.levels[0])


@all_linear_cases
def test_another_order_is_used(case):
    """Otherwise all tests here would compare a thing with itself."""
    y, u = signals(4 * BLOCK * 8)
    exact, blocks = both(case, y, u)
    assert not np.array_equal(exact.levels, blocks.levels)


@pytest.mark.parametrize("rows", LENGTHS + LONG)
@few_cases
def test_any_length(rows, case):
    y, u = signals(rows)
    assert_same_estimate(*both(case, y, u))


@few_cases
@pytest.mark.parametrize("workers", [2, 3])
def test_workers_do_not_change_a_bit(case, workers):
    y, u = signals(3 * WORKER + 3 * CHUNK + 77)
    y[3 * CHUNK + 5] = np.nan
    u[SHARE - 100 : SHARE + 9000] = np.nan
    y[[3 * SHARE - 1, 5 * SHARE]] = np.inf
    keywords = {"fs": FS, "rule": case.rule, "exact": False}
    alone = case.design.estimate(y, u, **keywords)
    shared = case.design.estimate(y, u, **keywords, workers=workers)
    assert_same_bits(shared.levels, alone.levels)
    assert_same_bits(shared.flags, alone.flags)
    assert shared.state == alone.state


@settings(max_examples=30)
@given(data=st.data())
@few_cases
def test_missing_samples_anywhere(case, data):
    rows = data.draw(st.sampled_from([8 * BLOCK, CHUNK + 1, 2 * CHUNK + 300]))
    borders = st.sampled_from([0, 1, RUN, BLOCK - 1, BLOCK, CHUNK - 1, CHUNK, CHUNK + RUN - 1, CHUNK + RUN])
    places = st.tuples(st.booleans(), borders | st.integers(0, rows - 1), st.integers(1, 40))
    y, u = signals(rows, seed=data.draw(st.integers(0, 99)))
    for in_y, row, length in data.draw(st.lists(places, max_size=4)):
        (y if in_y else u)[row : row + length] = data.draw(st.sampled_from([np.nan, np.inf, -np.inf]))
    assert_same_estimate(*both(case, y, u))


@few_cases
@pytest.mark.parametrize("stride", [2, -1, -3])
@pytest.mark.parametrize(("workers", "rows"), [(1, CHUNK + 999), (2, 2 * WORKER + 999)])
def test_strides(case, stride, workers, rows):
    y, u = signals(abs(stride) * rows)
    out = np.zeros_like(y)
    keywords = {"fs": FS, "rule": case.rule, "exact": False}
    expected = case.design.filter(y[::stride].copy(), u[::stride].copy(), **keywords)
    got = case.design.filter(y[::stride], u[::stride], out=out[::stride], workers=workers, **keywords)
    assert_same_bits(got, expected)
    kept = np.ones(out.size, dtype=bool)
    kept[::stride] = False
    assert not out[kept].any()


@few_cases
@pytest.mark.parametrize("channels", [1, 2, 3])
def test_a_few_channels_in_one_piece_each_are_single_ones(case, channels):
    y, u = (np.array([signals(2 * WORKER + 300, seed=s + k)[k] for s in range(channels)]).T for k in (0, 1))
    keywords = {"fs": FS, "rule": case.rule, "exact": False}
    together = case.design.filter(y, u, workers=2, **keywords)
    for channel in range(channels):
        assert_same_bits(together[:, channel], case.design.filter(y[:, channel], u[:, channel], **keywords))


@few_cases
@pytest.mark.parametrize("channels", [2, 3])
def test_channels_side_by_side_stay_exact(case, channels):
    y, u = random_signals(CHUNK + 300, channels)
    exact = case.design.filter(y, u, fs=FS, rule=case.rule)
    assert_same_bits(case.design.filter(y, u, fs=FS, rule=case.rule, exact=False, workers=2), exact)


@all_linear_cases
def test_the_state_goes_on(case):
    rows = CHUNK + 4 * BLOCK + 5
    y, u = signals(2 * rows)
    whole = case.design.estimate(y, u, fs=FS, rule=case.rule)
    keywords = {"fs": FS, "rule": case.rule, "exact": False}
    first = case.design.estimate(y[:rows], u[:rows], **keywords)
    second = case.design.estimate(y[rows:], u[rows:], initial=first.state, **keywords)
    assert_same_levels(np.concatenate([first.levels, second.levels], axis=1), whole.levels)
    after = case.design.stream(fs=FS, rule=case.rule, initial=second.state)
    wanted = case.design.stream(fs=FS, rule=case.rule, initial=whole.state)
    assert_close(np.asarray(after.update(0.3, 0.1)), np.asarray(wanted.update(0.3, 0.1)))


@pytest.mark.parametrize("initial", [2.0, [2.0, -1.0, 0.5]])
def test_initial_levels(initial):
    y, u = signals(CHUNK + 300)
    case = Case("third order", lambda w: cf.ThirdOrder(1 / w), no_reference)
    assert_same_estimate(*both(case, y, u, initial=initial))


@pytest.mark.parametrize("order", range(1, 7))
def test_slow_filters_with_an_offset(order):
    """A time constant of 10 000 samples: what a block takes away is small beside the state, and keeps its own precision."""
    y, u = signals(4 * CHUNK)
    case = Case("slow", lambda w: cf.Butterworth(w, order), no_reference)
    exact, blocks = both(case, y + 10.0, u, speed=0.01)
    assert_close(blocks.levels[0], exact.levels[0], 1e-13 if order <= 2 else 1e-12)


@pytest.mark.parametrize(
    "options",
    [{"period": 1.0}, {"delay": 0.02}, {"input": "trapezoid"}, {"gap_cap": 0.5}],
    ids=lambda options: next(iter(options)),
)
def test_what_is_no_plain_filter_stays_exact(options):
    y, u = signals(2 * CHUNK)
    design = cf.PiForm(2.0, 1.0)
    exact = design.filter(y, u, fs=FS, **options)
    assert_same_bits(design.filter(y, u, fs=FS, exact=False, workers=2, **options), exact)


def test_times_stay_exact():
    y, u = signals(2 * CHUNK)
    t = np.cumsum(np.random.default_rng(1).uniform(0.005, 0.02, y.size))
    design = cf.PiForm(2.0, 1.0)
    assert_same_bits(design.filter(y, u, t=t, exact=False), design.filter(y, u, t=t))


def test_numbers_near_overflow_leave_numbers():
    """The state is never lost, wherever the largest numbers lie."""
    y, u = signals(2 * WORKER)
    for start in (CHUNK + 700, SHARE + CHUNK + 700):
        y[start : start + 10] = 1.7e308
        y[start + 10 : start + 20] = -1.7e308
    case = Case("pi", lambda w: cf.PiForm(w, w**2), no_reference)
    exact, blocks = both(case, y, u, speed=90.0)
    assert np.isfinite(blocks.levels).all()
    assert_close(blocks.levels[0][-500:], exact.levels[0][-500:], 1e-9)


@pytest.mark.parametrize("value", [1e308, -1.1e308])
def test_what_overflows_only_on_the_way_is_done_again(value):
    """A run from zero and what its start adds are both larger than their sum."""
    y, u = signals(2 * WORKER)
    for start in (700, SHARE + CHUNK + 700):
        y[start : start + 20] = value
    case = Case("pi", lambda w: cf.PiForm(w, w**2), no_reference)
    exact, blocks = both(case, y, u, speed=5.0)
    assert np.isfinite(exact.levels).all()
    assert_close(blocks.levels[0], exact.levels[0], 1e-13)
