"""Streams, states and designs as objects: stored, copied, compared."""

import copy
import math
import tracemalloc

import numpy as np
import pytest

import compfilt as cf
from designs import (
    PLAIN,
    all_cases,
    all_linear_cases,
    assert_same_bits,
    few_cases,
    pickled,
    precisions,
    random_signals,
    restored,
)

FS = 100.0
PI = cf.PiForm(2.0, 1.0)
copies = pytest.mark.parametrize("duplicate", [pickled, copy.copy, copy.deepcopy])

# ------------------------------------------------------------------------------------------------------------ one sample


@all_cases
@precisions
def test_update_returns_level_0(case, dtype):
    stream = case.design.stream(fs=FS, dtype=dtype, rule=case.rule)
    y, u = random_signals(20, dtype=dtype)
    for sample in zip(y, u, strict=True):
        level0 = stream.update(*sample)
        assert isinstance(level0, float)
        assert level0 == stream.state.levels[0, 0]


@precisions
def test_update_of_channels_returns_an_array(dtype):
    stream = PI.stream(fs=FS, channels=3, dtype=dtype)
    level0 = stream.update(np.ones(3), np.zeros(3))
    assert level0.shape == (3,)
    assert level0.dtype == dtype
    assert stream.update([1, 1, 1], [0, 0, 0]).dtype == dtype


def test_one_channel_as_an_array_is_not_a_number():
    stream = PI.stream(fs=FS, channels=1, initial=0.0)
    assert stream.update([1.0], [0.0]).shape == (1,)
    assert stream.process(np.zeros((4, 1)), np.zeros((4, 1))).shape == (4, 1)


def test_waits_for_the_first_measurement():
    stream = PI.stream(fs=FS)
    assert math.isnan(stream.update(math.nan, 1.0))
    assert math.isnan(stream.predict(1.0))
    assert stream.update(0.5, 0.0) == 0.5
    assert stream.state.levels[0, 0] == 0.5


def test_dt_overrides_the_rate_for_one_sample():
    y, u = random_signals(3)
    stream, other = PI.stream(fs=FS, initial=0.0), PI.stream(initial=0.0)
    for dt in (None, 0.3, None):
        assert stream.update(y[0], u[0], dt) == other.update(y[0], u[0], dt or 1 / FS)


def test_no_time_repeats_a_correction_without_effect():
    stream = PI.stream(initial=[1.0, 0.5])
    assert stream.update(7.0, 3.0, 0.0) == 1.0
    np.testing.assert_array_equal(stream.state.levels, [[1.0], [0.5]])


# -------------------------------------------------------------------------------------------------- predict and correct


@all_linear_cases
@precisions
def test_predict_and_correct_are_an_update(case, dtype):
    """To rounding: an update forms the innovation before the prediction. Without a measurement, bit for bit."""
    y, u = random_signals(60, dtype=dtype)
    y[20:30] = np.nan
    steps = np.random.default_rng(4).uniform(0.001, 0.05, 60)
    one, two = (case.design.stream(dtype=dtype, initial=0.5, rule=case.rule) for _ in range(2))
    for sample, rate, dt in zip(y, u, steps, strict=True):
        two.state = one.state
        expected = one.update(sample, rate, dt)
        predicted = two.predict(rate, dt)
        assert two.correct(sample) == pytest.approx(expected, rel=0, abs=float(20 * np.finfo(dtype).eps))
        assert np.isfinite(sample) or predicted == expected


@all_linear_cases
def test_slow_measurement_corrects_a_fast_prediction(case):
    """The same as a batch whose measurement is missing in between."""
    _, u = random_signals(100)
    y = np.full(100, np.nan)
    y[4::5] = random_signals(20)[0]
    expected = case.design.filter(y, u, fs=FS, initial=0.0, rule=case.rule)
    stream = case.design.stream(fs=FS, initial=0.0, rule=case.rule)
    for n in range(100):
        level0 = stream.predict(u[n])
        if n % 5 == 4:
            level0 = stream.correct(y[n])
        assert level0 == expected[n]


@all_linear_cases
@pytest.mark.parametrize("duplicate", [pickled, copy.copy, copy.deepcopy, restored])
@pytest.mark.parametrize("fs", [None, FS])
@pytest.mark.parametrize("predictions", [1, 2])
def test_stored_between_prediction_and_correction(case, duplicate, fs, predictions):
    """The time since the last correction belongs to the state, and so do the gains for it."""
    stream = case.design.stream(fs=fs, initial=0.0, rule=case.rule)
    for dt in (0.03, 0.07)[:predictions]:
        stream.predict(1.0, dt)
    other = duplicate(stream)
    assert other.correct(1.0) == stream.correct(1.0)
    assert other.state == stream.state


def test_nothing_between_prediction_and_correction_changes_nothing():
    """An empty block and a refused sample are nothing."""
    one, two = PI.stream(fs=FS, initial=0.0), PI.stream(fs=FS, initial=0.0)
    for stream in (one, two):
        stream.predict(1.0, 0.07)
    two.process([], [])
    with pytest.raises(ValueError, match=r"^u must"):
        two.predict([1.0, 2.0], 0.5)
    assert two.correct(1.0) == one.correct(1.0)


def test_correct_twice_counts_once():
    """No time has passed since the first correction."""
    stream = PI.stream(fs=FS, initial=0.0)
    stream.predict(1.0)
    first = stream.correct(1.0)
    assert stream.correct(5.0) == first


def test_correct_starts_the_filter():
    stream = PI.stream(fs=FS)
    assert math.isnan(stream.correct(math.nan))
    assert stream.correct(0.25) == 0.25


def test_channels_are_predicted_and_corrected_alone():
    stream = PI.stream(fs=FS, channels=2, initial=0.0)
    alone = [PI.stream(fs=FS, initial=0.0) for _ in range(2)]
    u, y = [1.0, -2.0], [0.5, math.nan]
    assert stream.predict(u).tolist() == [one.predict(rate) for one, rate in zip(alone, u, strict=True)]
    assert stream.correct(y).tolist() == [one.correct(sample) for one, sample in zip(alone, y, strict=True)]


# --------------------------------------------------------------------------------------------------------------- blocks


@all_cases
def test_estimate_of_a_stream_is_the_designs(case):
    y, u = random_signals(300)
    y[10:20] = np.nan
    u[50:100] = np.nan
    expected = case.design.estimate(y, u, fs=FS, rule=case.rule)
    got = case.design.stream(fs=FS, rule=case.rule).estimate(y, u)
    assert_same_bits(got.levels, expected.levels)
    assert_same_bits(got.flags, expected.flags)
    assert got.counts == expected.counts
    assert got.state == expected.state
    assert got.level_names == expected.level_names == case.design.level_names


def test_named_levels_are_copies_and_bias_is_minus_its_level():
    y, u = random_signals(300)
    estimate = cf.ThirdOrder(0.5).estimate(y, u, fs=FS)
    assert estimate.level_names == ("position", "velocity", "minus_bias")
    assert_same_bits(estimate.position, estimate.levels[0])
    assert_same_bits(estimate.velocity, estimate.levels[1])
    assert_same_bits(estimate.bias, -estimate.levels[2])
    estimate.position[:] = 7.0
    assert not (estimate.levels == 7.0).any()
    estimate = PI.estimate(y, u, fs=FS)
    assert_same_bits(estimate.angle, estimate.levels[0])
    assert_same_bits(estimate.bias, -estimate.levels[1])


def test_flags_count_what_happened():
    y, u = np.zeros(60), np.zeros(60)
    y[:3] = y[20:25] = np.nan
    u[30:50] = np.nan
    estimate = PI.estimate(y, u, fs=FS, hold=0.1)
    flags = cf.Flags
    assert (estimate.flags[:3] == flags.NOT_STARTED | flags.MEASUREMENT_MISSING).all()
    assert (estimate.flags[20:25] == flags.MEASUREMENT_MISSING).all()
    assert (estimate.flags[30:39] == flags.DERIVATIVE_HELD).all()
    assert (estimate.flags[41:50] == flags.DERIVATIVE_MISSING).all()
    counts = {name: ((estimate.flags & flag) != 0).sum() for name, flag in flags.__members__.items()}
    assert estimate.counts == {name.lower(): count for name, count in counts.items()}
    assert estimate.counts["measurement_missing"] == 8
    assert estimate.counts["not_started"] == 3
    assert np.isnan(estimate.levels[:, :3]).all()
    assert np.isfinite(estimate.levels[:, 3:]).all()


def test_times_go_on_from_block_to_block():
    stream = PI.stream()
    y, u = random_signals(4)
    t = np.array([5.0, 5.5, 6.25, 6.5])
    expected = PI.filter(y, u, t=t)
    assert_same_bits(stream.process(y[:2], u[:2], t[:2]), expected[:2])
    assert stream.state.time == 5.5
    assert_same_bits(stream.process([], [], []), expected[:0])
    assert stream.state.time == 5.5
    assert_same_bits(stream.process(y[2:], u[2:], t[2:]), expected[2:])
    with pytest.raises(ValueError, match=r"row 0 is 6\.4 s after"):
        stream.process(y[:1], u[:1], [6.4])
    assert stream.state.time == 6.5


# ---------------------------------------------------------------------------------------------------- start and states


STARTS = [
    (None, 2.5, [[2.5, 2.5], [0.0, 0.0]]),
    (None, [1.0, 2.0], [[1.0, 2.0], [0.0, 0.0]]),
    (None, [[1.0, 2.0], [3.0, 4.0]], [[1.0, 2.0], [3.0, 4.0]]),
    (PI.stream(channels=2, initial=0.0), 2.5, [[2.5, 2.5], [0.0, 0.0]]),
]


@pytest.mark.parametrize(("stream", "initial", "expected"), STARTS)
def test_initial_levels_of_channels(stream, initial, expected):
    if stream is None:
        stream = PI.stream(fs=FS, channels=2, initial=initial)
    else:
        stream.reset(initial)
    np.testing.assert_array_equal(stream.state.levels, expected)


def test_initial_levels_of_one_channel():
    for initial, expected in ((2, [2, 0]), ([2], [2, 0]), ([2, 3], [2, 3]), ([[2], [3]], [2, 3])):
        np.testing.assert_array_equal(PI.stream(initial=initial).state.levels[:, 0], expected)


@all_cases
@precisions
@pytest.mark.parametrize("keywords", [{}, {"delay": 0.025}, {"period": 1.0}], ids=str)
def test_state_brings_everything_back(case, dtype, keywords):
    y, u = random_signals(60, dtype=dtype)
    y[35:45] = np.nan
    u[38:50] = np.nan
    stream = case.design.stream(fs=FS, dtype=dtype, rule=case.rule, **keywords)
    stream.process(y[:40], u[:40])
    state = stream.state
    expected = stream.process(y[40:], u[40:])
    other = case.design.stream(fs=FS, dtype=dtype, rule=case.rule, **keywords)
    other.state = pickled(state)
    assert_same_bits(other.process(y[40:], u[40:]), expected)
    assert_same_bits(
        case.design.filter(y[40:], u[40:], fs=FS, rule=case.rule, initial=state, **keywords), expected
    )


def test_state_runs_on_at_another_rate():
    """A state is physical: with the other rate's steps it is the same as one stream with those steps."""
    y, u = random_signals(40)
    mixed = PI.stream(initial=0.0)
    expected = [mixed.update(y[n], u[n], 1 / 128 if n < 20 else 1 / 32) for n in range(40)]
    state = PI.estimate(y[:20], u[:20], fs=128.0, initial=0.0).state
    assert_same_bits(PI.filter(y[20:], u[20:], fs=32.0, initial=state), np.array(expected[20:]))


def test_state_is_a_snapshot():
    stream = PI.stream(fs=FS, initial=0.0)
    state = stream.state
    levels = state.levels
    stream.update(1.0, 1.0)
    np.testing.assert_array_equal(state.levels, levels)
    assert stream.state != state
    levels[:] = 7.0
    assert not (state.levels == 7.0).any()


@all_cases
def test_reset_forgets(case):
    y, u = random_signals(30)
    stream = case.design.stream(fs=FS, rule=case.rule)
    expected = stream.process(y, u)
    stream.reset()
    assert stream.state == case.design.stream(fs=FS, rule=case.rule).state
    assert_same_bits(stream.process(y, u), expected)
    stream.reset(0.25)
    assert_same_bits(stream.process(y, u), case.design.filter(y, u, fs=FS, rule=case.rule, initial=0.25))


def test_reset_forgets_the_time():
    stream = PI.stream()
    stream.process([1.0], [0.0], [100.0])
    stream.reset()
    assert stream.state.time is None
    assert stream.process([2.0], [0.0], [3.0]) == [2.0]


# -------------------------------------------------------------------------------------------------- copies, comparison


@all_cases
@copies
def test_designs_are_copied_and_compared(case, duplicate):
    other = duplicate(case.design)
    assert other == case.design
    assert hash(other) == hash(case.design)
    assert type(other) is type(case.design)
    assert repr(other) == repr(case.design)
    assert other.coefficients == case.design.coefficients


def test_designs_differ():
    designs = [case.make(speed) for case in PLAIN for speed in (1.0, 2.0)]
    for i, first in enumerate(designs):
        for j, second in enumerate(designs):
            assert (first == second) == (i == j)
            assert (first != second) == (i != j)
    assert len(set(designs)) == len(designs)
    assert cf.FirstOrder(1.0) != 1.0
    assert cf.Butterworth(1.0, 3) == cf.Butterworth(1.0, 3, split=3)


@pytest.mark.parametrize("case", PLAIN, ids=lambda case: case.name)
def test_repr_makes_the_design(case):
    assert eval(repr(case.design), vars(cf)) == case.design


@all_cases
@copies
def test_streams_are_copied_and_compared(case, duplicate):
    y, u = random_signals(20)
    stream = case.design.stream(fs=FS, rule=case.rule, period=2.0, missing="raise")
    stream.process(y, u)
    other = duplicate(stream)
    assert other == stream
    assert other.state == stream.state
    assert_same_bits(other.process(y, u), stream.process(y, u))
    other.update(0.5, 0.0)
    assert other != stream
    with pytest.raises(ValueError, match="missing"):
        other.update(math.nan, 0.0)


DIFFERENT = [
    {"fs": 50.0},
    {"fs": None},
    {"channels": 1},
    {"dtype": "f4"},
    {"initial": 0.5},
    {"rule": "matched"},
    {"input": "trapezoid"},
    {"period": 1.0},
    {"delay": 0.01},
    {"missing": "raise"},
    {"hold": 0.2},
    {"gap_cap": 1.0},
    {"backwards": "restart"},
]


@pytest.mark.parametrize("keywords", DIFFERENT, ids=str)
def test_streams_that_would_go_on_differently_differ(keywords):
    same = {"fs": FS, "initial": 0.0}
    assert PI.stream(**same) == PI.stream(**same)
    assert PI.stream(**same) != PI.stream(**{**same, **keywords})
    assert PI.stream(**same) != cf.PiForm(2.0, 1.5).stream(**same)
    assert PI.stream(**same) != 1.0


@copies
def test_states_are_copied_and_compared(duplicate):
    stream = PI.stream(channels=2, dtype="f4")
    empty = stream.state
    stream.process(np.ones((3, 2)), np.ones((3, 2)), [0.0, 0.1, 0.3])
    for state in (empty, stream.state):
        other = duplicate(state)
        assert other == state
        assert (other.order, other.channels, other.dtype) == (2, 2, "float32")
        assert other.time == state.time
        assert_same_bits(other.levels, state.levels)
    assert stream.state != empty
    assert stream.state.time == 0.3
    assert stream.state != 1.0


# --------------------------------------------------------------------------------------------------------------- memory


def allocated_by(call):
    """The most that was allocated at once, in bytes."""
    call()
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@few_cases
@pytest.mark.parametrize("channels", [None, 4])
def test_out_takes_no_more_memory(case, channels):
    y, u = random_signals(20_000, channels)
    out = np.empty_like(y)
    in_place = y.copy()
    keywords = {"fs": FS, "rule": case.rule}
    assert allocated_by(lambda: case.design.filter(y, u, **keywords)) >= y.nbytes
    assert allocated_by(lambda: case.design.filter(y, u, **keywords, out=out)) < 4096
    assert (
        allocated_by(lambda: case.design.filter(in_place, u, **keywords, out=in_place))
        < 4096 + y.nbytes * 1.1
    )


def test_strided_signals_are_not_copied():
    wide = random_signals(20_000, 3)[0]
    out = np.empty(20_000)
    assert allocated_by(lambda: PI.filter(wide[:, 0], wide[:, 1], fs=FS, out=out)) < 4096
    assert allocated_by(lambda: PI.filter(wide[::-1, 0], wide[::-1, 1], fs=FS, out=out)) < 4096


def test_a_stream_does_not_grow():
    stream = PI.stream(fs=FS, delay=0.05)
    y, u = random_signals(2000)
    out_size = y.nbytes
    sizes = {len(pickle_of(stream)) for _ in range(3) if stream.process(y, u).nbytes == out_size}
    assert len(sizes) == 1


def pickle_of(thing):
    _, arguments = thing.state.__reduce__()
    return arguments[3][0]
