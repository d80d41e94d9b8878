"""What every attitude filter promises: arrays, streams, states, copies, refusals."""

import copy
import math
import re
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import attitude_reference as ref
import compfilt as cf
from designs import assert_same_bits, pickled, precisions, restored, same
from test_contract import layouts, not_real, pieces, plans, read_only, seeds, time_steps
from test_mahony import (
    DT,
    FIELD,
    FS,
    few,
    some,
)

# ----------------------------------------------------------------------------- signals

EVERY = {
    "explicit": cf.Mahony(1.0, 0.5, acc_range=50.0),
    "passive": cf.Mahony(3.0, form="passive"),
    "direct": cf.Mahony(1.0, 0.5, "direct", bias_limit=0.02),
    "gravity": cf.GravityFilter(2.0, rest_time=0.05),
    "gravity 1": cf.GravityFilter(0.3, order=1, acc_range=50.0),
    "gravity 5": cf.GravityFilter(
        0.7, order=5, split=3, gyro_delay=0.004, advance=0.01, rest_time=0.02, heading_tau=0.5
    ),
}
every = pytest.mark.parametrize("design", EVERY.values(), ids=EVERY)
# Where the binding is tested and not the filter.
both = pytest.mark.parametrize("design", [EVERY["explicit"], EVERY["gravity"]], ids=["mahony", "gravity"])
with_and_without = pytest.mark.parametrize("magnetic", [False, True], ids=["gravity alone", "magnetometer"])

NAMES = ("gyr", "acc", "mag")
RESULTS = ("quaternion", "up", "gyro_bias", "at_rest", "flags")
odd = st.one_of(
    st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -0.0, 49.0, 50.0]), st.floats(-1e6, 1e6, width=32)
)


def noise(rows, magnetic=True, seed=1, dtype=float):
    """A gyro, an accelerometer and perhaps a magnetometer that have little to do with each other; still in between."""
    rng = np.random.default_rng(seed)
    loud = np.where(np.arange(rows) // 30 % 2 == 0, 1.0, 1e-4)[:, None]
    gyr, acc, mag = rng.normal(size=(3, rows, 3)) * loud
    arrays = {"gyr": gyr, "acc": 5.0 * acc + [1.0, 2.0, 9.0], "mag": 20.0 * mag + [5.0, 20.0, -30.0]}
    return {name: array.astype(dtype) for name, array in arrays.items() if magnetic or name != "mag"}


@st.composite
def signals(draw, dtype=float):
    """Noise with odd values, whole zero vectors and runs of missing samples strewn in."""
    rows = draw(st.one_of(st.integers(1, 40), st.integers(41, 300)))
    arrays = noise(rows, draw(st.booleans()), draw(seeds), dtype)
    places = st.tuples(st.sampled_from(list(arrays)), st.integers(0, rows - 1), st.integers(0, 2))
    for (name, row, axis), value in draw(st.lists(st.tuples(places, odd), max_size=6)):
        arrays[name][row, axis] = value
    runs = st.tuples(places, st.integers(1, 30), st.sampled_from([math.nan, 0.0]))
    for (name, row, _), length, value in draw(st.lists(runs, max_size=3)):
        arrays[name][row : row + length] = value
    return arrays


def cut(arrays, part):
    return {name: array[part] for name, array in arrays.items()}


def rows_of(arrays):
    return len(arrays["gyr"])


def one_by_one(stream, arrays, steps):
    """Quaternions of the samples, each on its own."""
    rows = (cut(arrays, n) for n in range(rows_of(arrays)))
    got = [stream.update(**row, dt=dt) for row, dt in zip(rows, steps, strict=True)]
    return np.array(got, dtype=arrays["gyr"].dtype).reshape(-1, 4)


def check_same_results(got, expected, part=slice(None)):
    for name in RESULTS:
        assert_same_bits(getattr(got, name), getattr(expected, name)[part])


# ------------------------------------------------------------------------ pieces


def run_piece(design, stream, way, arrays, clock, keywords):
    """Quaternions of a piece, by one of the ways to get them."""
    if way == "update":
        return one_by_one(stream, arrays, [None] * rows_of(arrays))
    if way == "process":
        return stream.process(**arrays, **clock)
    if way == "estimate":
        return stream.estimate(**arrays, **clock).quaternion
    estimate = design.estimate(**arrays, initial=stream.state, **(clock or {"fs": FS}), **keywords)
    stream.state = estimate.state
    return estimate.quaternion


def check_chunks(design, arrays, plan, t=None, **keywords):
    """All pieces together are the whole: outputs, and the state at the end."""
    clock = {"fs": FS} if t is None else {"t": t}
    whole = design.estimate(**arrays, **clock, **keywords)
    stream = design.stream(fs=None if t is not None else FS, dtype=arrays["gyr"].dtype, **keywords)
    parts = []
    for part, way, pause in pieces(plan, rows_of(arrays)):
        piece_clock = {} if t is None else {"t": t[part]}
        parts.append(run_piece(design, stream, way, cut(arrays, part), piece_clock, keywords))
        stream = pause(stream)
    assert_same_bits(np.concatenate(parts), whole.quaternion)
    assert stream.state == whole.state


holds = st.sampled_from([{}, {}, {"hold": 0.0}, {"hold": 0.025}, {"hold": 1.0}])


@every
@precisions
@some
@given(data=st.data(), plan=plans, keywords=holds)
def test_whole_is_any_chunking(design, dtype, data, plan, keywords):
    check_chunks(design, data.draw(signals(dtype)), plan, **keywords)


@every
@precisions
@few
@given(data=st.data(), plan=plans, keywords=holds, backwards=st.booleans())
def test_whole_is_any_chunking_with_times(design, dtype, data, plan, keywords, backwards):
    arrays = data.draw(signals(dtype))
    t = 1.7e9 + np.cumsum(data.draw(time_steps(rows_of(arrays))))
    policy = {}
    if backwards:
        t[len(t) // 2 :] -= 3.0
        policy = {"backwards": "restart"}
    plan = [(length, "process" if way == "update" else way, pause) for length, way, pause in plan]
    check_chunks(design, arrays, plan, t, **keywords, **policy)


@every
@precisions
@with_and_without
@pytest.mark.parametrize("pause", [same, pickled, copy.copy, copy.deepcopy, restored])
def test_all_results_in_pieces(design, dtype, magnetic, pause):
    """Not only the quaternion; and the flags of the pieces are those of the whole."""
    arrays = noise(200, magnetic, dtype=dtype)
    arrays["acc"][[0, 90]] = math.nan
    arrays["gyr"][100:130] = math.nan
    whole = design.estimate(**arrays, fs=FS)
    stream = design.stream(fs=FS, dtype=dtype)
    for part in (slice(0, 1), slice(1, 95), slice(95, 95), slice(95, 110), slice(110, 200)):
        check_same_results(stream.estimate(**cut(arrays, part)), whole, part)
        stream = pause(stream)
    assert stream.state == whole.state


@every
@precisions
@with_and_without
def test_updates_with_the_steps_between_times_are_the_whole(design, dtype, magnetic):
    arrays = noise(150, magnetic, dtype=dtype)
    arrays["acc"][40:50], arrays["gyr"][60:90] = math.nan, math.nan
    t = np.cumsum(np.random.default_rng(2).uniform(0.002, 0.02, 150))
    steps = np.diff(t, prepend=t[0])
    stream = design.stream(dtype=dtype)
    assert_same_bits(one_by_one(stream, arrays, steps), design.estimate(**arrays, t=t).quaternion)


@every
def test_a_state_runs_on_at_another_rate(design):
    """It is physical: with the other rate's steps it is the same as one stream with those steps."""
    arrays = noise(80)
    expected = one_by_one(design.stream(), arrays, 40 * [1 / 128] + 40 * [1 / 32])
    state = design.estimate(**cut(arrays, slice(40)), fs=128.0).state
    got = design.estimate(**cut(arrays, slice(40, 80)), fs=32.0, initial=state)
    assert_same_bits(got.quaternion, expected[40:])


@every
def test_time_goes_on_from_a_state(design):
    arrays = noise(60)
    t = 5.0 + np.cumsum(np.random.default_rng(3).uniform(0.005, 0.02, 60))
    whole = design.estimate(**arrays, t=t)
    first = design.estimate(**cut(arrays, slice(30)), t=t[:30])
    assert first.state.time == t[29]
    second = design.estimate(**cut(arrays, slice(30, 60)), t=t[30:], initial=first.state)
    check_same_results(second, whole, slice(30, 60))


@every
def test_samples_without_a_magnetometer_in_between(design):
    """A block without one is no block of missing ones: nothing is flagged."""
    arrays = noise(90)
    stream = design.stream(fs=FS)
    stream.process(**cut(arrays, slice(30)))
    bare = {name: arrays[name][30:60] for name in ("gyr", "acc")}
    flags = stream.estimate(**bare).flags
    assert not (flags & cf.Flags.MAGNETOMETER_MISSING).any()
    assert np.isfinite(stream.process(**cut(arrays, slice(60, 90)))).all()


@every
@pytest.mark.parametrize("shift", [1, 40, 99])
def test_backwards_restarts(design, shift):
    """As if what follows came first, flagged."""
    arrays, t = noise(100), np.arange(100) / FS
    t[shift:] -= 2.0
    estimate = design.estimate(**arrays, t=t, backwards="restart")
    afresh = design.estimate(**cut(arrays, slice(shift, 100)), t=t[shift:])
    assert estimate.flags[shift] == afresh.flags[0] | cf.Flags.RESTARTED
    assert_same_bits(estimate.quaternion[shift:], afresh.quaternion)
    assert_same_bits(estimate.gyro_bias[shift:], afresh.gyro_bias)


@every
@precisions
def test_a_given_start(design, dtype):
    """The quaternion before the first sample: of any length, and the same with both signs."""
    arrays = noise(50, magnetic=False, dtype=dtype)
    start = np.array([0.5, -0.1, 0.3, 0.8])
    one = design.estimate(**arrays, fs=FS, initial=start)
    for other in (8 * start, start.tolist(), start.astype("f4") if dtype == np.float32 else tuple(start)):
        np.testing.assert_allclose(
            design.estimate(**arrays, fs=FS, initial=other).quaternion,
            one.quaternion,
            atol=10 * np.finfo(dtype).eps,
        )
    negative = design.estimate(**arrays, fs=FS, initial=-start)
    assert_same_bits(negative.quaternion, -one.quaternion)
    assert_same_bits(negative.up, one.up)
    # At a first step of no time the start is the estimate, as far as it is not turned ahead.
    arrays["gyr"][0] = 0.0
    first = design.estimate(**cut(arrays, slice(1)), t=[0.0], initial=start).quaternion[0]
    np.testing.assert_allclose(first, start / np.linalg.norm(start), atol=1e-6)


# ------------------------------------------------------------------------ arrays


@both
@precisions
@layouts
def test_layout_in_memory_does_not_matter(design, dtype, layout):
    laid = {name: layout(array) for name, array in noise(100, dtype=dtype).items()}
    plain = {name: np.array(array, dtype=dtype, order="C") for name, array in laid.items()}
    expected = design.estimate(**plain, fs=FS)
    check_same_results(design.estimate(**laid, fs=FS), expected)
    for name in NAMES:
        check_same_results(design.estimate(**{**plain, name: laid[name]}, fs=FS), expected)
    streams = [design.stream(fs=FS, dtype=dtype) for _ in range(2)]
    assert_same_bits(streams[0].process(**laid), expected.quaternion)
    assert_same_bits(streams[1].update(**cut(laid, 0)), expected.quaternion[0])


@both
@with_and_without
def test_precision_is_kept(design, magnetic):
    arrays = noise(20, magnetic, dtype=np.float32)
    estimate = design.estimate(**arrays, fs=FS)
    for name in ("quaternion", "up", "gyro_bias"):
        assert getattr(estimate, name).dtype == np.float32
    assert estimate.state.dtype == "float32"
    assert (estimate.at_rest.dtype, estimate.flags.dtype) == (bool, np.uint8)
    for name in arrays:
        mixed = {**arrays, name: arrays[name].astype(float)}
        double = {key: array.astype(float) for key, array in arrays.items()}
        check_same_results(design.estimate(**mixed, fs=FS), design.estimate(**double, fs=FS))


@both
@pytest.mark.parametrize("dtype", ["i1", "i2", "i4", "i8", "u1", "u4", "u8", "f2", "g", ">i4"])
def test_other_real_numbers_become_float64(design, dtype):
    arrays = {name: np.abs(array).astype(dtype) for name, array in noise(50).items()}
    double = {name: array.astype(float) for name, array in arrays.items()}
    check_same_results(design.estimate(**arrays, fs=FS), design.estimate(**double, fs=FS))


@both
@pytest.mark.parametrize("make", [np.ndarray.tolist, memoryview, lambda a: tuple(map(tuple, a))])
def test_sequences_become_arrays(design, make):
    arrays = noise(20)
    made = {name: make(array) for name, array in arrays.items()}
    check_same_results(design.estimate(**made, fs=FS), design.estimate(**arrays, fs=FS))


@both
def test_masked_samples_are_missing(design):
    arrays = noise(30)
    hidden = np.zeros((30, 3), bool)
    hidden[[5, 9, 10], [0, 1, 2]] = True
    masked = {name: np.ma.array(array, mask=hidden) for name, array in arrays.items()}
    holed = {name: np.where(hidden, math.nan, array) for name, array in arrays.items()}
    check_same_results(design.estimate(**masked, fs=FS), design.estimate(**holed, fs=FS))


@both
def test_inputs_stay_as_they_are(design):
    arrays = noise(50)
    arrays["gyr"][7], arrays["acc"][9] = math.nan, 0.0
    before = copy.deepcopy(arrays)
    frozen = {name: read_only(array) for name, array in arrays.items()}
    check_same_results(design.estimate(**frozen, fs=FS), design.estimate(**arrays, fs=FS))
    for name, array in before.items():
        np.testing.assert_array_equal(arrays[name], array)


@both
@with_and_without
def test_nothing_in_nothing_out(design, magnetic):
    arrays = noise(0, magnetic)
    for keywords in ({"fs": FS}, {"t": []}):
        estimate = design.estimate(**arrays, **keywords)
        assert [getattr(estimate, name).shape for name in RESULTS] == [(0, 4), (0, 3), (0, 3), (0,), (0,)]
        assert set(estimate.counts.values()) == {0}
        fresh = design.stream(fs=keywords.get("fs")).state
        assert estimate.state == fresh


@both
def test_counts_are_those_of_the_flags(design):
    arrays = noise(100)
    arrays["acc"][:3], arrays["gyr"][50:52], arrays["mag"][60:70] = math.nan, math.nan, 0.0
    estimate = design.estimate(**arrays, fs=FS)
    expected = {flag.name.lower(): int((estimate.flags & flag != 0).sum()) for flag in cf.Flags}
    assert estimate.counts == expected
    assert expected["measurement_missing"] == expected["not_started"] == 3
    assert expected["derivative_held"] == 2
    assert expected["magnetometer_missing"] >= 10


# --------------------------------------------------------------------- arithmetic


@pytest.mark.parametrize("design", [cf.Mahony(1.0, 0.1), cf.GravityFilter()], ids=repr)
def test_quaternions_keep_their_length(design):
    """Three million steps of float32 in one batch; ten million take more than ten seconds of the suite's thirty."""
    count = 3_000_000
    rng = np.random.default_rng(50)
    gyr, acc = rng.standard_normal((2, count, 3), dtype=np.float32)
    q = design.estimate(gyr, acc, fs=FS).quaternion
    length = np.sqrt(np.einsum("ij,ij->i", q, q, dtype=float))
    assert np.abs(length - 1).max() < 3 * np.finfo(np.float32).eps


def extreme(dtype):
    limit = float(np.finfo(dtype).max)
    smallest = float(np.finfo(dtype).smallest_subnormal)
    values = [limit, -limit, math.sqrt(limit), 0.0, smallest, -smallest, 1.0]
    return st.one_of(st.sampled_from(values), st.floats(-limit, limit, width=np.finfo(dtype).bits))


@every
@precisions
@some
@given(data=st.data(), seed=seeds, magnetic=st.booleans())
def test_finite_in_finite_out(design, dtype, data, seed, magnetic):
    """Even where the state overflows: then the filter starts anew from the measurement and says so."""
    palette = np.array(data.draw(st.lists(extreme(dtype), min_size=2, max_size=6)), dtype=dtype)
    rng = np.random.default_rng(seed)
    names = NAMES if magnetic else NAMES[:2]
    arrays = {name: rng.choice(palette, size=(100, 3)) for name in names}
    arrays["acc"][0] = [0.0, 0.0, 9.81]
    estimate = design.estimate(**arrays, fs=FS)
    for name in ("quaternion", "up", "gyro_bias"):
        assert np.isfinite(getattr(estimate, name)).all(), name
    length = np.linalg.norm(estimate.quaternion.astype(float), axis=1)
    assert np.abs(length - 1).max() < 8 * np.finfo(dtype).eps
    assert_same_bits(one_by_one(design.stream(fs=FS, dtype=dtype), arrays, [None] * 100), estimate.quaternion)


@every
@precisions
@with_and_without
def test_extremes_are_forgotten(design, dtype, magnetic):
    """Nothing that was finite stays in the state for ever."""
    limit = np.finfo(dtype).max
    rng = np.random.default_rng(51)
    motion = ref.at_rest(4000, DT)
    calm = motion.samples(field=FIELD if magnetic else None).astype(dtype)
    arrays = {name: array.copy() for name, array in calm.arrays.items()}
    for array in arrays.values():
        array[100:110] = rng.choice(np.array([limit, -limit], dtype), size=(10, 3))
    estimate = design.estimate(**arrays, fs=FS)
    undisturbed = design.estimate(**calm.arrays, fs=FS)
    np.testing.assert_allclose(estimate.up[-1], [0.0, 0.0, 1.0], atol=1e-3)
    np.testing.assert_array_equal(estimate.at_rest[-1], undisturbed.at_rest[-1])
    if magnetic:
        np.testing.assert_allclose(np.abs(estimate.quaternion[-1]), [1.0, 0.0, 0.0, 0.0], atol=1e-3)


@every
@precisions
@some
@given(data=st.data(), magnetic=st.booleans())
def test_times_of_any_kind(design, dtype, data, magnetic):
    """Repeated, next to each other, far apart: finite from the first measurement on, and of unit length."""
    arrays = noise(60, magnetic, data.draw(seeds), dtype)
    steps = st.sampled_from([0.0, 0.0, 1e-12, 1e-3, 0.01, 0.15, 0.99, 1.01, 7.0, 1e4, 1e9])
    t = np.cumsum(data.draw(st.lists(steps, min_size=60, max_size=60)))
    estimate = design.estimate(**arrays, t=t)
    length = np.linalg.norm(estimate.quaternion.astype(float), axis=1)
    assert np.abs(length - 1).max() < 8 * np.finfo(dtype).eps
    largest = np.abs(estimate.gyro_bias).max()
    assert largest <= design.bias_limit * (1 + 4 * np.finfo(dtype).eps)


@every
@some
@given(data=st.data(), bad=st.sampled_from([math.nan, math.inf, -math.inf]), repeated=st.booleans())
def test_what_is_missing_leaves_nothing_behind(design, data, bad, repeated):
    """A missing sample is missing, whatever stands in it, at any step."""
    arrays = noise(60, seed=data.draw(seeds))
    gone = data.draw(st.lists(st.tuples(st.sampled_from(NAMES), st.integers(0, 59)), max_size=10))
    t = np.arange(60) / FS
    for name, row in gone:
        arrays[name][row] = math.nan
        if repeated and row:
            t[row:] -= t[row] - t[row - 1]
    other = copy.deepcopy(arrays)
    for name, row in gone:
        other[name][row] = [bad, 1.0, 2.0]
    one, two = (design.estimate(**each, t=t) for each in (arrays, other))
    check_same_results(two, one)
    numbers = one.state.__reduce__()[1][4][0]
    assert not np.isnan(numbers).any()


# ------------------------------------------------------------- copies, comparison

DIFFERENT_MAHONY = [
    cf.Mahony(1.0, 0.1),
    cf.Mahony(1.5, 0.1),
    cf.Mahony(1.0),
    cf.Mahony(1.0, 0.1, "passive"),
    cf.Mahony(1.0, 0.1, "direct"),
    cf.Mahony(1.0, 0.1, bias_limit=0.2),
    cf.Mahony(1.0, 0.1, acc_range=150.0),
]
DIFFERENT_GRAVITY = [
    cf.GravityFilter(),
    cf.GravityFilter(2.0),
    cf.GravityFilter(order=1),
    cf.GravityFilter(order=3),
    cf.GravityFilter(split=2),
    cf.GravityFilter(zeta=0.7),
    cf.GravityFilter(gyro_delay=0.0025),
    cf.GravityFilter(advance=0.0025),
    cf.GravityFilter(rest_time=1.0),
    cf.GravityFilter(rest_rate=0.03),
    cf.GravityFilter(rest_force=0.6),
    cf.GravityFilter(rest_drift=0.2),
    cf.GravityFilter(bias_limit=0.03),
    cf.GravityFilter(heading_tau=5.0),
    cf.GravityFilter(acc_range=150.0),
]
DIFFERENT = DIFFERENT_MAHONY + DIFFERENT_GRAVITY
different = pytest.mark.parametrize("design", DIFFERENT, ids=range(len(DIFFERENT)))
copies = pytest.mark.parametrize("duplicate", [pickled, copy.copy, copy.deepcopy])


@different
@copies
def test_filters_are_copied_and_compared(design, duplicate):
    other = duplicate(design)
    assert other == design
    assert hash(other) == hash(design)
    assert repr(other) == repr(design)
    assert type(other) is type(design)


def test_filters_differ():
    for i, first in enumerate(DIFFERENT):
        for j, second in enumerate(DIFFERENT):
            assert (first == second) == (i == j)
            assert (first != second) == (i != j)
    assert len(set(DIFFERENT)) == len(DIFFERENT)
    assert cf.Mahony(1.0) != 1.0
    assert cf.GravityFilter() != "GravityFilter"
    assert cf.Mahony(1.0, -0.0) == cf.Mahony(1.0, 0.0)
    assert hash(cf.Mahony(1.0, -0.0)) == hash(cf.Mahony(1.0, 0.0))
    assert hash(cf.GravityFilter(gyro_delay=-0.0)) == hash(cf.GravityFilter())


@different
def test_repr_makes_the_filter(design):
    assert eval(repr(design), vars(cf)) == design


@every
@precisions
@copies
def test_streams_are_copied_and_compared(design, dtype, duplicate):
    arrays = noise(20, dtype=dtype)
    stream = design.stream(fs=FS, dtype=dtype, missing="raise", hold=0.3)
    stream.process(**arrays)
    other = duplicate(stream)
    assert other == stream
    assert other.state == stream.state
    assert_same_bits(other.process(**arrays), stream.process(**arrays))
    other.update(**cut(arrays, 0))
    assert other != stream
    with pytest.raises(ValueError, match="missing"):
        other.update([math.nan, 0.0, 0.0], [0.0, 0.0, 9.81])
    assert repr(stream).startswith(repr(design))


STREAMS_DIFFER = [
    {"fs": 50.0},
    {"fs": None},
    {"dtype": "f4"},
    {"initial": [0.0, 1.0, 0.0, 0.0]},
    {"missing": "raise"},
    {"hold": 0.2},
    {"backwards": "restart"},
]


@both
@pytest.mark.parametrize("keywords", STREAMS_DIFFER, ids=str)
def test_streams_that_would_go_on_differently_differ(design, keywords):
    plain = {"fs": FS, "initial": [1.0, 0.0, 0.0, 0.0]}
    assert design.stream(**plain) == design.stream(**plain)
    assert design.stream(**plain) != design.stream(**{**plain, **keywords})
    assert design.stream(**plain) != 1.0
    assert cf.Mahony(7.0).stream(**plain) != design.stream(**plain)


@every
@precisions
@copies
def test_states_are_copied_and_compared(design, dtype, duplicate):
    stream = design.stream(dtype=dtype)
    empty = stream.state
    stream.process(**noise(3, dtype=dtype), t=[0.0, 0.1, 0.3])
    for state in (empty, stream.state):
        other = duplicate(state)
        assert other == state
        assert (other.order, other.channels, other.dtype) == (4, 1, np.dtype(dtype).name)
        assert other.time == state.time
    assert stream.state != empty
    assert stream.state.time == 0.3


@every
def test_the_state_shows_the_quaternion(design):
    """The filter's own: turned ahead only by the rate."""
    arrays = noise(30)
    arrays["gyr"][-15:] = math.nan  # then it stands still
    estimate = design.estimate(**arrays, fs=FS)
    np.testing.assert_allclose(estimate.state.levels[:, 0], estimate.quaternion[-1], atol=1e-15)


@every
def test_a_state_is_a_snapshot(design):
    arrays = noise(30)
    stream = design.stream(fs=FS)
    stream.process(**arrays)
    state = stream.state
    expected = stream.process(**arrays)
    assert stream.state != state
    stream.state = state
    assert_same_bits(stream.process(**arrays), expected)


@every
def test_reset_forgets(design):
    arrays = noise(30)
    stream = design.stream(fs=FS)
    expected = stream.process(**arrays)
    stream.reset()
    assert stream.state == design.stream(fs=FS).state
    assert_same_bits(stream.process(**arrays), expected)
    start = [0.0, 0.6, 0.0, 0.8]
    stream.reset(start)
    assert_same_bits(stream.process(**arrays), design.estimate(**arrays, fs=FS, initial=start).quaternion)
    timed = design.stream()
    timed.process(**cut(arrays, slice(1)), t=[100.0])
    timed.reset()
    assert timed.state.time is None
    assert np.isfinite(timed.process(**cut(arrays, slice(1)), t=[3.0])).all()


@every
def test_many_threads_at_once(design):
    """A filter has no state of its own."""
    arrays = noise(20_000)
    expected = design.estimate(**arrays, fs=FS).quaternion
    got = []
    threads = [
        threading.Thread(target=lambda: got.append(design.estimate(**arrays, fs=FS).quaternion))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(got) == 4
    for each in got:
        assert_same_bits(each, expected)


# ------------------------------------------------------------------------ refusals


def check_refused(kind, pattern, call, *arguments, **keywords):
    """One sentence that matches, and no more."""
    with pytest.raises(kind) as caught:
        call(*arguments, **keywords)
    message = " ".join([str(caught.value), *getattr(caught.value, "__notes__", [])])
    assert re.search(pattern, message), message
    assert not message.endswith("."), message
    assert "\n" not in message, message


NUMBERS = {
    "Mahony": (cf.Mahony, {"kp": 1.0, "bias_limit": 0.1, "acc_range": 150.0}),
    "Mahony.from_design": (
        lambda **keywords: cf.Mahony.from_design(cf.PiForm(1.0, 0.1), **keywords),
        {"bias_limit": 0.1, "acc_range": 150.0},
    ),
    "GravityFilter": (
        cf.GravityFilter,
        {
            "tau": 3.0,
            "zeta": 0.5,
            "rest_time": 1.5,
            "rest_rate": 0.03,
            "rest_force": 0.5,
            "rest_drift": 0.1,
            "bias_limit": 0.03,
            "heading_tau": 10.0,
            "acc_range": 150.0,
        },
    ),
}
parameters = pytest.mark.parametrize(
    ("maker", "name"), [(maker, name) for maker, (_, names) in NUMBERS.items() for name in names]
)


@parameters
@pytest.mark.parametrize("bad", [0.0, -0.0, -1.0, math.nan, math.inf, -math.inf])
def test_parameters_must_be_positive_and_finite(maker, name, bad):
    make, names = NUMBERS[maker]
    check_refused(ValueError, f"^{name} must be positive and finite", make, **{**names, name: bad})


@parameters
@pytest.mark.parametrize("bad", ["1", [1.0], 1j])
def test_parameters_must_be_numbers(maker, name, bad):
    make, names = NUMBERS[maker]
    check_refused(TypeError, f"'{name}'", make, **{**names, name: bad})


WHOLE = "^{} must lie between 1 and"
BAD_FILTERS = [
    (ValueError, "^ki must be finite and not negative", lambda: cf.Mahony(1.0, -0.1)),
    (ValueError, "^ki must be finite and not negative", lambda: cf.Mahony(1.0, math.nan)),
    (ValueError, "^ki must be finite and not negative", lambda: cf.Mahony(1.0, math.inf)),
    (
        ValueError,
        '^form must be "explicit" or "passive" or "direct", got "x"',
        lambda: cf.Mahony(1.0, 0.1, "x"),
    ),
    (TypeError, "'form'", lambda: cf.Mahony(1.0, 0.1, 1)),
    (TypeError, "positional", lambda: cf.Mahony(1.0, 0.1, "direct", 0.1)),
    (TypeError, "gain", lambda: cf.Mahony(1.0, gain=1.0)),
    (TypeError, "kp", cf.Mahony),
    (TypeError, "^design must be a linear filter", lambda: cf.Mahony.from_design(1.0)),
    (
        ValueError,
        "^design must be a chain of order 1 or 2",
        lambda: cf.Mahony.from_design(cf.ThirdOrder(1.0)),
    ),
    (ValueError, "^design must be a chain", lambda: cf.Mahony.from_design(cf.RateFilter(1.0))),
    (ValueError, "^design must be a chain", lambda: cf.Mahony.from_design(cf.Butterworth(1.0, 3))),
    (ValueError, "^design must be a chain", lambda: cf.Mahony.from_design(cf.Butterworth(1.0, split=1))),
    (ValueError, "^design must be a chain", lambda: cf.Mahony.from_design(cf.SecondOrderInertial(1.0))),
    (ValueError, '^form must be .*got ""', lambda: cf.Mahony.from_design(cf.FirstOrder(1.0), "")),
    (ValueError, WHOLE.format("order"), lambda: cf.GravityFilter(order=0)),
    (ValueError, WHOLE.format("order"), lambda: cf.GravityFilter(order=7)),
    (ValueError, WHOLE.format("order"), lambda: cf.GravityFilter(order=-1)),
    (ValueError, WHOLE.format("split"), lambda: cf.GravityFilter(split=0)),
    (ValueError, WHOLE.format("split"), lambda: cf.GravityFilter(split=3)),
    (ValueError, WHOLE.format("split"), lambda: cf.GravityFilter(split=-2)),
    (TypeError, "'order'", lambda: cf.GravityFilter(order=2.0)),
    (TypeError, "'split'", lambda: cf.GravityFilter(split=None)),
    (ValueError, "^zeta goes with order=2", lambda: cf.GravityFilter(order=3, zeta=0.5)),
    (ValueError, "^gyro_delay must be finite", lambda: cf.GravityFilter(gyro_delay=math.nan)),
    (ValueError, "^gyro_delay must be finite", lambda: cf.GravityFilter(gyro_delay=-math.inf)),
    (ValueError, "^advance must be finite", lambda: cf.GravityFilter(advance=math.nan)),
    (ValueError, "^advance must be finite", lambda: cf.GravityFilter(advance=math.inf)),
    (TypeError, "positional", lambda: cf.GravityFilter(3.0, 2)),
    (ValueError, "^tau must", lambda: cf.GravityFilter(1e-320)),
    (ValueError, "^tau must", lambda: cf.GravityFilter(1e300, order=6)),
]


@pytest.mark.parametrize(("kind", "pattern", "make"), BAD_FILTERS)
def test_filters_that_cannot_be(kind, pattern, make):
    check_refused(kind, pattern, make)


SIX = noise(6)
T6 = np.arange(6) / FS
ANY_INITIAL = "^initial must be a quaternion, four finite numbers that are not all zero, or a State"
BAD_KEYWORDS = [
    ("^fs must be positive and finite", {"fs": 0.0}),
    ("^fs must be positive and finite", {"fs": -FS}),
    ("^fs must be positive and finite", {"fs": math.nan}),
    ("^fs must be positive and finite", {"fs": math.inf}),
    ("^give fs in Hz or t in seconds, one of them", {}),
    ("^give fs in Hz or t in seconds, one of them", {"fs": FS, "t": T6}),
    ("^t must not run backwards: row 1 is", {"t": T6[::-1]}),
    ("^t must be finite: row 0 is NaN", {"t": [math.nan, 1, 2, 3, 4, 5]}),
    (r"^t must have the shape \(6,\).*got \[5\]", {"t": T6[:5]}),
    (r"^t must have the shape \(6,\).*got \[6, 1\]: time is axis 0", {"t": T6[:, None]}),
    ('^missing must be "coast" or "raise", got "skip"', {"fs": FS, "missing": "skip"}),
    ('^backwards must be "raise" or "restart", got "sort"', {"fs": FS, "backwards": "sort"}),
    ("^hold must be finite and not negative", {"fs": FS, "hold": -0.1}),
    ("^hold must be finite and not negative", {"fs": FS, "hold": math.nan}),
    ("^hold must be finite and not negative", {"fs": FS, "hold": math.inf}),
    (ANY_INITIAL, {"fs": FS, "initial": [1.0, 0.0, 0.0]}),
    (ANY_INITIAL, {"fs": FS, "initial": np.zeros(4)}),
    (ANY_INITIAL, {"fs": FS, "initial": np.ones((1, 4))}),
    (ANY_INITIAL, {"fs": FS, "initial": 1.0}),
    (ANY_INITIAL, {"fs": FS, "initial": []}),
    (ANY_INITIAL, {"fs": FS, "initial": [1.0, math.nan, 0.0, 0.0]}),
    (ANY_INITIAL, {"fs": FS, "initial": [1.0, math.inf, 0.0, 0.0]}),
]


def calls(design, arrays, **keywords):
    """The two ways to run a filter on arrays."""
    yield lambda: design.estimate(**arrays, **keywords)
    clock = {key: keywords.pop(key) for key in ("t",) if key in keywords}
    yield lambda: design.stream(**keywords).process(**arrays, **clock)


@both
@pytest.mark.parametrize(("pattern", "keywords"), BAD_KEYWORDS)
def test_keywords_that_cannot_work(design, pattern, keywords):
    for call in calls(design, SIX, **keywords):
        check_refused(ValueError, pattern, call)


@both
@pytest.mark.parametrize("name", ["fs", "hold", "missing", "backwards"])
def test_keywords_must_have_their_type(design, name):
    for call in calls(design, SIX, **{"fs": FS, name: [1]}):
        check_refused(TypeError, f"'{name}'", call)


@both
def test_signals_come_first_and_all_else_by_name(design):
    check_refused(TypeError, "positional", design.estimate, SIX["gyr"], SIX["acc"], FS)
    check_refused(TypeError, "rate", design.estimate, SIX["gyr"], SIX["acc"], rate=FS)
    check_refused(TypeError, "acc", design.estimate, SIX["gyr"], fs=FS)


SHAPES = [
    (r"^{name} must have the shape \(samples, 3\), got \[6\]", (6,)),
    (r"^{name} must have the shape \(samples, 3\), got \[6, 2\]", (6, 2)),
    (
        r"^{name} must have the shape \(samples, 3\), got \[3, 6\]: it looks transposed, time is axis 0",
        (3, 6),
    ),
    (r"^{name} must have the shape \(samples, 3\), got \[6, 3, 1\]", (6, 3, 1)),
    (r"^{name} must have the shape \(samples, 3\), got \[\]", ()),
]


@both
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("pattern", "shape"), SHAPES)
def test_shapes_that_cannot_work(design, name, pattern, shape):
    for call in calls(design, {**SIX, name: np.zeros(shape)}, fs=FS):
        check_refused(ValueError, pattern.format(name=name), call)


@both
@pytest.mark.parametrize("name", ["acc", "mag"])
def test_signals_must_be_of_one_length(design, name):
    pattern = f"^gyr and {name} must have the same number of samples, got 6 and 5"
    for call in calls(design, {**SIX, name: SIX[name][:5]}, fs=FS):
        check_refused(ValueError, pattern, call)


@both
@not_real
def test_arrays_of_anything_else_are_refused_by_name(design, bad):
    for name in NAMES:
        if bad is None and name == "mag":
            continue
        for call in calls(design, {**SIX, name: bad}, fs=FS):
            check_refused(TypeError, f"^{name} must", call)
    if bad is not None:
        check_refused(TypeError, "^t must", design.estimate, **SIX, t=bad)
        check_refused(TypeError, "^initial must", design.estimate, **SIX, fs=FS, initial=bad)


@both
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_missing_raise_names_signal_and_row(design, name, bad):
    holed = {**SIX, name: SIX[name].copy()}
    holed[name][4, 1] = bad
    pattern = f'^{name} has a missing sample .*row 4, column 1, and missing is "raise"'
    for call in calls(design, holed, fs=FS, missing="raise"):
        check_refused(ValueError, pattern, call)
    stream = design.stream(fs=FS, missing="raise")
    stream.process(**SIX)
    before = stream.state
    check_refused(ValueError, f"^{name} is missing", stream.update, **cut(holed, 4))
    check_refused(ValueError, f"^{name} has a missing sample", stream.process, **holed)
    assert stream.state == before


@both
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("bad", [1.0, [1.0], [1.0, 2.0], [1.0, 2.0, 3.0, 4.0], [[1.0, 2.0, 3.0]]])
def test_samples_are_three_numbers(design, name, bad):
    stream = design.stream(fs=FS, initial=[1.0, 0.0, 0.0, 0.0])
    before = stream.state
    sample = {**cut(SIX, 0), name: bad}
    check_refused(ValueError, f"^{name} must be three numbers, got the shape", stream.update, **sample)
    assert stream.state == before


@both
def test_the_clock_of_a_stream(design):
    stream = design.stream(initial=[1.0, 0.0, 0.0, 0.0])
    before = stream.state
    sample = cut(SIX, 0)
    check_refused(ValueError, "^give dt in seconds: this stream has no fs", stream.update, **sample)
    check_refused(ValueError, "^give fs in Hz or t in seconds", stream.process, **SIX)
    check_refused(ValueError, "^give fs in Hz or t in seconds", design.stream(fs=FS).process, **SIX, t=T6)
    for bad in (-0.01, -math.inf, math.nan, math.inf):
        for each in (stream, design.stream(fs=FS)):
            check_refused(ValueError, "^dt must be finite and not negative", each.update, **sample, dt=bad)
    assert stream.state == before


@both
@pytest.mark.parametrize(
    ("pattern", "dtype"),
    [
        ("^dtype must be float32 or float64, got float16", "f2"),
        ("^dtype must be float32 or float64, got int64", np.int64),
        ("'nonsense'", "nonsense"),
    ],
)
def test_streams_that_cannot_work(design, pattern, dtype):
    check_refused(TypeError, pattern, design.stream, fs=FS, dtype=dtype)


def foreign(design):
    """States of other filters and what is wrong with them."""
    kind = "^the state belongs to another kind of filter"
    for other in EVERY.values():
        if other.stream().state.kind != design.stream().state.kind:
            yield kind, other.stream(initial=[1.0, 0.0, 0.0, 0.0])
    yield "^the state is of order 2 .* order 4", cf.PiForm(1.0, 1.0).stream(initial=0.0)
    yield "^the state is of dtype float32, the filter of dtype float64", design.stream(dtype="f4")


@every
def test_foreign_states_are_refused_and_change_nothing(design):
    for pattern, other in foreign(design):
        check_refused(ValueError, pattern, design.estimate, **SIX, fs=FS, initial=other.state)
        stream = design.stream(initial=[0.0, 1.0, 0.0, 0.0])
        before = stream.state
        check_refused(ValueError, pattern, stream.reset, other.state)
        check_refused(ValueError, pattern, setattr, stream, "state", other.state)
        assert stream.state == before
    check_refused(TypeError, "State", setattr, stream, "state", [1.0, 0.0, 0.0, 0.0])
    # A state with its numbers cut off is none of this filter, whatever it says.
    make, (order, dtype, time, kind, numbers) = before.__reduce__()
    short = make(order, dtype, time, kind, [numbers[0][:-1]])
    check_refused(ValueError, "^the state belongs to another kind", setattr, stream, "state", short)
    assert stream.state == before


@both
@pytest.mark.parametrize("bad", [[1.0, 2.0], [0.0, 0.0, 0.0, 0.0], [math.nan, 0.0, 0.0, 1.0]])
def test_reset_that_is_refused_changes_nothing(design, bad):
    stream = design.stream(fs=FS)
    stream.process(**SIX)
    before = stream.state
    check_refused(ValueError, ANY_INITIAL, stream.reset, bad)
    assert stream.state == before


@both
def test_attributes_are_read_only(design):
    estimate = design.estimate(**SIX, fs=FS)
    for thing, name in (
        *((design, name) for name in ("bias_limit", "acc_range", "cutoff")),
        *((estimate, name) for name in (*RESULTS, "state", "counts")),
        (design.stream(), "fs"),
    ):
        with pytest.raises(AttributeError):
            setattr(thing, name, 1.0)


def test_parameters_that_vanish_in_single_precision_are_refused_when_it_is_used():
    for design, name in ((cf.Mahony(1e-50), "kp|coefficients|fs"), (cf.GravityFilter(1e50), "tau|fs")):
        assert design.estimate(**SIX, fs=FS).quaternion.dtype == float
        single = {key: array.astype("f4") for key, array in SIX.items()}
        check_refused(ValueError, f"^({name}) must", design.estimate, **single, fs=FS)
        check_refused(ValueError, f"^({name}) must", design.stream, fs=FS, dtype="f4")
