"""Channels side by side are channels one at a time, bit for bit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import compfilt as cf
from designs import all_plain, assert_same_bits, few_cases, precisions, random_signals

FS = 100.0
# Rows of a tile, of a turn of channels that lie side by side, and of one of channels that lie in one piece each.
TILE, TURN, PIECE = 16, 1024, 2048
# Channels that one worker takes at least, and at most at once, where all lie side by side.
SHARE, SIDE_BY_SIDE = 1024, 2048
LAYOUTS = ("C", "F", "of a table", "every second", "backwards", "turned")


def laid_out(array, layout):
    """The same numbers at other strides."""
    if layout == "of a table":
        table = np.zeros((array.shape[0], array.shape[1] + 4), array.dtype)
        table[:, 1:-3] = array
        return table[:, 1:-3]
    if layout == "every second":
        wide = np.zeros((array.shape[0] * 2, array.shape[1] * 3), array.dtype)
        wide[::2, ::3] = array
        return wide[::2, ::3]
    if layout == "backwards":
        return array[::-1, ::-1].copy()[::-1, ::-1]
    if layout == "turned":
        return array.T[::-1].copy()[::-1].T
    return np.asarray(array, order=layout)


def one_at_a_time(design, y, u, **keywords):
    """Estimates of each channel for itself, put together."""
    estimates = [design.estimate(y[:, c].copy(), u[:, c].copy(), **keywords) for c in range(y.shape[1])]
    return np.stack([e.levels for e in estimates], axis=2), np.stack([e.flags for e in estimates], axis=1)


def assert_like_single_channels(design, y, u, workers=1, **keywords):
    levels, flags = one_at_a_time(design, y, u, **keywords)
    together = design.estimate(y, u, workers=workers, **keywords)
    assert_same_bits(together.levels, levels)
    assert_same_bits(together.flags, flags)
    out = np.empty_like(y)
    assert_same_bits(design.filter(y, u, workers=workers, out=out, **keywords), levels[0])


@st.composite
def strewn(draw, rows, channels):
    """Signals with missing samples strewn in: mostly few, so that most groups of channels are whole."""
    y, u = random_signals(rows, channels, seed=draw(st.integers(0, 99)))
    rows_with_borders = st.integers(0, rows - 1) | st.sampled_from([0, rows - 1])
    places = st.tuples(st.booleans(), rows_with_borders, st.integers(0, channels - 1), st.integers(1, 30))
    for in_y, row, channel, length in draw(st.lists(places, max_size=5)):
        (y if in_y else u)[row : row + length, channel] = draw(st.sampled_from([np.nan, np.inf]))
    return y, u


@st.composite
def times(draw, rows):
    """Steps that vary, repeat, pause and sometimes run backwards."""
    steps = np.random.default_rng(draw(st.integers(0, 99))).uniform(0.002, 0.02, rows)
    for row in draw(st.lists(st.integers(0, rows - 1), max_size=4)):
        steps[row] = draw(st.sampled_from([0.0, 1.0, -0.5]))
    if draw(st.booleans()):
        steps[rows // 2 :] = 0.01
    return np.cumsum(steps)


@pytest.mark.parametrize("channels", range(1, 21))
@few_cases
def test_any_number_of_channels(case, channels):
    y, u = random_signals(TURN + TILE + 3, channels)
    assert_like_single_channels(case.design, y, u, fs=FS, rule=case.rule)


@pytest.mark.parametrize("channels", [2 * SHARE + 3, SIDE_BY_SIDE + 1, SIDE_BY_SIDE + 8])
@pytest.mark.parametrize("is_complete", [True, False])
@precisions
def test_very_many_channels(channels, is_complete, dtype):
    y, u = random_signals(TILE + 5, channels, dtype=dtype)
    if not is_complete:
        y[:, [0, 9, SHARE - 1, SHARE, channels - 1]] = np.nan
        u[TILE, channels - 5] = np.inf
    design = cf.PiForm(2.0, 1.0)
    levels, flags = one_at_a_time(design, y, u, fs=FS)
    for workers in (1, 2, 3):
        out = design.filter(y, u, fs=FS, workers=workers)
        assert_same_bits(out, levels[0])
        estimate = design.estimate(y, u, fs=FS, workers=workers)
        assert_same_bits(estimate.levels, levels)
        assert_same_bits(estimate.flags, flags)


@all_plain
@precisions
def test_every_design(case, dtype):
    y, u = random_signals(TURN + 5, 9, dtype=dtype)
    y[40, 3] = np.nan
    assert_like_single_channels(case.design, y, u, fs=FS, rule=case.rule)


@pytest.mark.parametrize("of_u", LAYOUTS)
@pytest.mark.parametrize("of_y", LAYOUTS)
@pytest.mark.parametrize("channels", [2, 3, 5, 8, 11])
def test_any_layout(channels, of_y, of_u):
    y, u = random_signals(2 * TURN + 7, channels)
    design = cf.PiForm(2.0, 1.0)
    expected = one_at_a_time(design, y, u, fs=FS)[0][0]
    for of_out in LAYOUTS:
        out = laid_out(np.zeros_like(y), of_out)
        result = design.filter(laid_out(y, of_y), laid_out(u, of_u), fs=FS, out=out)
        assert result is out
        assert_same_bits(out, expected)


@pytest.mark.parametrize(
    "rows", [0, 1, TILE - 1, TILE, TILE + 1, TURN - 1, TURN, TURN + 1, 3 * TURN + TILE + 1]
)
@pytest.mark.parametrize("order", ["C", "F"])
def test_any_length(rows, order):
    y, u = (np.asarray(signal, order=order) for signal in random_signals(rows, 10))
    assert_like_single_channels(cf.ThirdOrder(1.0), y, u, fs=FS)


@precisions
@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("even", [True, False], ids=["even steps", "varying steps"])
@pytest.mark.parametrize("channels", [2, 3, 4, 7, 8, 9, 16])
def test_from_memory_to_memory(channels, even, order, dtype):
    """Over several turns, of which one is not plain and the last is short; also in the place of one of the signals."""
    y, u = random_signals(2 * PIECE + TILE + 11, channels, dtype=dtype)
    y[PIECE + 5, channels - 1] = np.nan
    steps = np.random.default_rng(0).uniform(0.002, 0.02, len(y))
    times = {"fs": FS} if even else {"t": np.cumsum(steps)}
    design = cf.PiForm(2.0, 1.0)
    expected = one_at_a_time(design, y, u, **times)[0][0]
    for place in ("own", "y", "u"):
        signals = {name: np.array(signal, order=order) for name, signal in (("y", y), ("u", u))}
        out = signals.get(place, np.empty_like(signals["y"]))
        assert_same_bits(design.filter(signals["y"], signals["u"], out=out, **times), expected)


@settings(max_examples=30)
@given(data=st.data())
@few_cases
def test_missing_samples_and_workers(case, data):
    rows = data.draw(st.sampled_from([TILE, TURN - 1, TURN + 20, 2 * TURN + 1]))
    channels = data.draw(st.integers(2, 20))
    y, u = data.draw(strewn(rows, channels))
    workers = data.draw(st.integers(1, 3))
    assert_like_single_channels(case.design, y, u, workers=workers, fs=FS, rule=case.rule)


@settings(max_examples=30)
@given(data=st.data())
@few_cases
def test_times_that_vary(case, data):
    rows, channels = (
        data.draw(st.sampled_from([TILE, TURN + 20, 2 * TURN + 1])),
        data.draw(st.integers(2, 20)),
    )
    y, u = data.draw(strewn(rows, channels))
    t = data.draw(times(rows))
    assert_like_single_channels(
        case.design, y, u, workers=data.draw(st.integers(1, 2)), t=t, rule=case.rule, backwards="restart"
    )


@few_cases
def test_the_states_go_on(case):
    y, u = random_signals(3 * TURN, 11)
    cut = TURN + 33
    keywords = {"fs": FS, "rule": case.rule}
    whole = case.design.estimate(y, u, **keywords)
    first = case.design.estimate(y[:cut], u[:cut], **keywords)
    second = case.design.estimate(y[cut:], u[cut:], initial=first.state, **keywords)
    assert_same_bits(np.concatenate([first.levels, second.levels], axis=1), whole.levels)
    assert second.state == whole.state


@pytest.mark.parametrize(
    "options",
    [{"period": 1.0}, {"delay": 0.02}, {"input": "trapezoid"}, {"gap_cap": 0.5}],
    ids=lambda options: next(iter(options)),
)
def test_what_is_no_plain_filter(options):
    y, u = random_signals(TURN + 40, 9)
    assert_like_single_channels(cf.PiForm(2.0, 1.0), y, u, fs=FS, **options)


def test_channels_that_overflow_start_anew():
    y, u = random_signals(TURN + 40, 9)
    y[100:110, 4] = 1.7e308
    y[110:120, 4] = -1.7e308
    assert_like_single_channels(cf.PiForm(90.0, 8100.0), y, u, fs=FS)


def test_many_channels_need_no_exactness_to_be_fast():
    y, u = random_signals(5000, 8)
    design = cf.PiForm(2.0, 1.0)
    assert_same_bits(design.filter(y, u, fs=FS, exact=False), design.filter(y, u, fs=FS))


@pytest.mark.parametrize(
    ("of_y", "of_u", "in_fortran_order"), [("F", "F", True), ("F", "C", False), ("C", "C", False)]
)
def test_a_new_result_lies_in_memory_as_the_signals_do(of_y, of_u, in_fortran_order):
    y, u = random_signals(TURN, 3)
    result = cf.PiForm(2.0, 1.0).filter(laid_out(y, of_y), laid_out(u, of_u), fs=FS)
    assert result.flags.f_contiguous == in_fortran_order
    assert result.flags.c_contiguous != in_fortran_order
