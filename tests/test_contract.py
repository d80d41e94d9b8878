"""What every linear filter promises, whatever its design, gains, scalar type, signals and clock."""

import copy
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import compfilt as cf
from designs import (
    all_cases,
    all_linear_cases,
    all_matched,
    all_plain,
    assert_same_bits,
    few_cases,
    pickled,
    precisions,
    random_signals,
    restored,
    same,
)

FS = 100.0

few = settings(max_examples=6)
some = settings(max_examples=10)

seeds = st.integers(0, 2**32 - 1)
speeds = st.floats(-2, 2).map(lambda exponent: 10**exponent)  # rad/s
# Around the number of rows that a channel's turn takes, and well below and above it.
row_counts = st.one_of(st.integers(1, 40), st.sampled_from([255, 256, 257, 520]))
values = st.one_of(
    st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -0.0]), st.floats(-1e6, 1e6, width=32)
)


@st.composite
def signals(draw, channels=None):
    """Noise with odd values and runs of missing samples strewn in."""
    rows = draw(row_counts)
    pair = np.array(random_signals(rows, channels, seed=draw(seeds)))
    flat = pair.reshape(2, rows, -1)
    places = st.tuples(st.integers(0, 1), st.integers(0, rows - 1), st.integers(0, flat.shape[2] - 1))
    for place, value in draw(st.lists(st.tuples(places, values), max_size=6)):
        flat[place] = value
    for (signal, row, channel), length in draw(st.lists(st.tuples(places, st.integers(1, 30)), max_size=2)):
        flat[signal, row : row + length, channel] = np.nan
    return pair


@st.composite
def time_steps(draw, count):
    """Jitter, repeated times, and pauses."""
    rng = np.random.default_rng(draw(seeds))
    steps = rng.uniform(0.002, 0.02, count)
    for row, step in draw(
        st.lists(st.tuples(st.integers(0, count - 1), st.sampled_from([0.0, 1e-9, 0.3, 5.0])), max_size=4)
    ):
        steps[row] = step
    return steps


options = st.sampled_from(
    [
        {},
        {},
        {"input": "trapezoid"},
        {"period": 2 * math.pi},
        {"delay": 0.025},
        {"gap_cap": 0.03},
        {"hold": 0.0},
        {"hold": 0.5, "period": 1.0, "delay": 0.01, "input": "trapezoid", "gap_cap": 1.0},
    ]
)
lengths = st.one_of(st.integers(0, 5), st.integers(0, 300))
ways = st.sampled_from(["process", "process", "estimate", "call", "update"])
pauses = st.sampled_from([same, pickled, copy.copy, copy.deepcopy, restored])
plans = st.lists(st.tuples(lengths, ways, pauses), max_size=8)


# ------------------------------------------------------------------------------------------------- consistent input


def integrated(u, steps, start):
    """y whose M-th backward difference is u, in float64."""
    levels, y = [float(x) for x in start], np.empty(len(u))
    for n, (above, dt) in enumerate(zip(u, steps, strict=True)):
        for i in reversed(range(len(levels))):
            levels[i] += dt * above
            above = levels[i]  # noqa: PLW2901
        y[n] = levels[0]
    return y


def integrated_exactly(u, dt, start):
    """y whose M-th derivative is u, constant between samples."""
    order = len(start)
    levels, y = np.array(start, dtype=float), np.empty(len(u))
    for n in range(len(u)):
        chain = np.append(levels, u[n])
        for i in range(order):
            levels[i] = sum(chain[i + j] * dt**j / math.factorial(j) for j in range(order - i + 1))
        y[n] = levels[0]
    return y


def initial_levels(design, start):
    levels = np.zeros(design.order)
    levels[: len(start)] = start
    return levels


def coasted(steps, gone):
    """The longest time without a measurement."""
    longest = since = 0.0
    for n, dt in enumerate(steps):
        since = since + dt if n in gone else 0.0
        longest = max(longest, since)
    return longest


def check_reproduced(got, y, dtype, growth=1.0):
    """To rounding, which grows where the upper levels coast."""
    bound = {np.float32: 2e-4, np.float64: 1e-10}[dtype] * max(1.0, growth)
    assert got.dtype == dtype
    np.testing.assert_allclose(got, y, rtol=0, atol=bound * max(1.0, np.abs(y).max()))


@all_plain
@precisions
@few
@given(seed=seeds, speed=speeds, steps=time_steps(120), gone=st.lists(st.integers(1, 119), max_size=20))
def test_consistent_input_is_reproduced(case, dtype, seed, speed, steps, gone):
    """Whatever the gains, the time steps and the missing measurements."""
    design = case.make(speed)
    rng = np.random.default_rng(seed)
    start, u = rng.normal(size=design.derivative_order), rng.normal(size=120).astype(dtype)
    t = np.cumsum(steps)
    y = integrated(u, np.diff(t, prepend=t[0]), start)
    seen = y.astype(dtype)
    seen[gone] = np.nan
    got = design.filter(seen, u, t=t, initial=initial_levels(design, start))
    if case.is_rate:  # a missing gyro sample is bridged, not predicted
        got, y = np.delete(got, gone), np.delete(y, gone)
    coasting = (speed * coasted(steps, gone)) ** (design.order - 1)
    # Over a long step a measurement takes away what rounding had left in the upper levels, but not what rounding that adds.
    long_step = np.finfo(dtype).eps * (speed * max(steps)) ** (design.order - 1)
    check_reproduced(got, y, dtype, max(coasting, long_step))


@all_matched
@precisions
@few
@given(seed=seeds, speed=st.floats(0.3, 30.0), gone=st.lists(st.integers(1, 119), max_size=20))
def test_consistent_input_is_reproduced_matched(case, dtype, seed, speed, gone):
    design = case.make(speed)
    rng = np.random.default_rng(seed)
    start, u = rng.normal(size=design.derivative_order), rng.normal(size=120).astype(dtype)
    y = integrated_exactly(u, 1 / FS, start)
    seen = y.astype(dtype)
    seen[gone] = np.nan
    got = design.filter(seen, u, fs=FS, initial=initial_levels(design, start), rule="matched")
    check_reproduced(got, y, dtype, (speed * coasted(np.full(120, 1 / FS), gone)) ** (design.order - 1))


# ------------------------------------------------------------------------------------------------ whole = any chunking


def pieces(plan, rows):
    """The plan's cuts of so many rows; the last piece takes what is left."""
    start = 0
    for length, way, pause in [*plan, (rows, "process", same)]:
        stop = min(start + length, rows)
        yield slice(start, stop), way, pause
        start = stop


def one_by_one(stream, y, u, steps):
    updated = [stream.update(*sample) for sample in zip(y, u, steps, strict=True)]
    return np.array(updated).reshape(y.shape).astype(y.dtype)


def run_piece(run, stream, way, part):
    """Level 0 of a piece. ``run`` is (design, y, u, t, steps, options)."""
    design, y, u, t, steps, keywords = run
    clock = {} if t is None else {"t": t[part]}
    if way == "update":
        return one_by_one(stream, y[part], u[part], steps[part])
    if way == "estimate":
        return stream.estimate(y[part], u[part], **clock).levels[0]
    if way == "call":
        clock = clock or {"fs": FS}
        estimate = design.estimate(y[part], u[part], initial=stream.state, **clock, **keywords)
        stream.state = estimate.state
        return estimate.levels[0]
    return stream.process(y[part], u[part], **clock)


def check_chunks(design, y, u, plan, *, t=None, **keywords):
    """All pieces together are the whole: outputs, and the state at the end."""
    clock = {"fs": FS} if t is None else {"t": t}
    whole = design.estimate(y, u, **clock, **keywords)
    channels = None if y.ndim == 1 else y.shape[1]
    stream = design.stream(fs=None if t is not None else FS, channels=channels, dtype=y.dtype, **keywords)
    run = design, y, u, t, [None] * len(y), keywords
    parts = []
    for part, way, pause in pieces(plan, len(y)):
        parts.append(run_piece(run, stream, way, part))
        stream = pause(stream)
    assert_same_bits(np.concatenate(parts), whole.levels[0])
    assert_same_bits(stream.state.levels, whole.state.levels)
    if "delay" not in keywords:  # see test_states_with_a_delay_compare
        assert stream.state == whole.state
    assert_same_bits(design.filter(y, u, **clock, **keywords), whole.levels[0])


@all_cases
@precisions
@some
@given(pair=signals(), plan=plans, keywords=options)
def test_whole_is_any_chunking(case, dtype, pair, plan, keywords):
    y, u = pair.astype(dtype)
    check_chunks(case.design, y, u, plan, rule=case.rule, **keywords)


@few_cases
@few
@given(pair=signals(channels=3), plan=plans, keywords=options)
def test_whole_is_any_chunking_of_channels(case, pair, plan, keywords):
    y, u = pair
    check_chunks(case.design, y, u, plan, rule=case.rule, **keywords)


@few_cases
@precisions
@some
@given(data=st.data(), pair=signals(), plan=plans, keywords=options, backwards=st.booleans())
def test_whole_is_any_chunking_with_times(case, dtype, data, pair, plan, keywords, backwards):
    y, u = pair.astype(dtype)
    t = 1.7e9 + np.cumsum(data.draw(time_steps(len(y))))
    policy = {}
    if backwards:
        t[len(t) // 2 :] -= 3.0
        policy = {"backwards": "restart"}
    plan = [(length, "process" if way == "update" else way, pause) for length, way, pause in plan]
    check_chunks(case.design, y, u, plan, t=t, rule=case.rule, **keywords, **policy)


@pytest.mark.parametrize("pause", [same, pickled, restored])
@pytest.mark.parametrize("cut", [0, 1, 3, 40])
def test_states_with_a_delay_compare(pause, cut):
    """What lies further back than the delay belongs to no state."""
    y, u = random_signals(60)
    keywords = {"fs": FS, "delay": 0.025}
    stream = cf.PiForm(2.0, 1.0).stream(**keywords)
    stream.process(y[:cut], u[:cut])
    stream = pause(stream)
    stream.process(y[cut:], u[cut:])
    assert stream.state == cf.PiForm(2.0, 1.0).estimate(y, u, **keywords).state


@few_cases
@precisions
def test_updates_with_the_steps_between_times_are_the_whole(case, dtype):
    y, u = random_signals(300, dtype=dtype)
    y[40:50], u[100:130] = np.nan, np.nan
    t = np.cumsum(np.random.default_rng(2).uniform(0.001, 0.05, 300))
    whole = case.design.filter(y, u, t=t, rule=case.rule)
    stream = case.design.stream(dtype=dtype, rule=case.rule)
    assert_same_bits(one_by_one(stream, y, u, np.diff(t, prepend=t[0])), whole)


@few_cases
def test_updates_between_blocks_with_times(case):
    """The time goes on with dt, so that the next block's first step is not too long. All times are exact in binary."""
    y, u = random_signals(60)
    t = np.cumsum(np.random.default_rng(3).integers(1, 64, 60)) / 1024
    whole = case.design.filter(y, u, t=t, rule=case.rule)
    stream = case.design.stream(rule=case.rule)
    first = stream.process(y[:20], u[:20], t[:20])
    middle = one_by_one(stream, y[20:40], u[20:40], np.diff(t)[19:39])
    last = stream.process(y[40:], u[40:], t[40:])
    assert_same_bits(np.concatenate([first, middle, last]), whole)


@all_cases
def test_cap_below_the_sample_period(case):
    """Then every sample is one after a gap, in a block as in a stream."""
    y, u = random_signals(50)
    keywords = {"fs": FS, "gap_cap": 0.4 / FS, "rule": case.rule, "initial": 0.0}
    whole = case.design.filter(y, u, **keywords)
    assert_same_bits(one_by_one(case.design.stream(**keywords), y, u, [None] * 50), whole)
    t = np.arange(1, 51) / FS
    stream = case.design.stream(**{**keywords, "fs": None})
    np.testing.assert_allclose(one_by_one(stream, y, u, np.diff(t, prepend=0.0)), whole, atol=1e-9)


@few_cases
def test_cap_shortens_the_only_step(case):
    """A cap below the sample period has the effect that it has after a longer gap: less weight for the measurement."""
    keywords = {"fs": 10.0, "initial": 0.0, "rule": case.rule}
    if case.is_rate:
        pytest.skip("the rate filter's measurement does not step")
    capped = case.design.stream(**keywords, gap_cap=0.01).update(1.0, 0.0)
    assert 0 < capped < 0.5 * case.design.stream(**keywords).update(1.0, 0.0)


# ------------------------------------------------------------------------------------------------------------ channels


@all_cases
@precisions
@few
@given(pair=signals(channels=4), keywords=options, workers=st.sampled_from([1, 2, 3, 9]))
def test_channels_do_not_know_each_other(case, dtype, pair, keywords, workers):
    y, u = pair.astype(dtype)
    together = case.design.estimate(y, u, fs=FS, rule=case.rule, workers=workers, **keywords)
    written = case.design.filter(y, u, fs=FS, rule=case.rule, workers=workers, **keywords)
    assert_same_bits(written, together.levels[0])
    for channel in range(4):
        alone = case.design.estimate(y[:, channel], u[:, channel], fs=FS, rule=case.rule, **keywords)
        assert_same_bits(together.levels[..., channel], alone.levels)
        assert_same_bits(together.flags[:, channel], alone.flags)


@few_cases
@few
@given(data=st.data(), pair=signals(channels=5), workers=st.integers(2, 7))
def test_workers_change_nothing_with_times(case, data, pair, workers):
    y, u = pair
    t = np.cumsum(data.draw(time_steps(len(y))))
    t[len(t) // 2 :] -= 0.5
    keywords = {"t": t, "rule": case.rule, "backwards": "restart"}
    alone = case.design.estimate(y, u, **keywords)
    shared = case.design.estimate(y, u, workers=workers, **keywords)
    assert_same_bits(shared.levels, alone.levels)
    assert_same_bits(shared.flags, alone.flags)
    assert shared.state == alone.state


# -------------------------------------------------------------------------------------------------------------- arrays


def unaligned(array):
    """A field of packed records: no element lies at a multiple of its size."""
    records = np.zeros(array.shape, dtype=[("tag", "u1"), ("value", array.dtype)])
    records["value"] = array
    assert not records["value"].flags.aligned
    return records["value"]


def read_only(array):
    array = array.copy()
    array.flags.writeable = False
    return array


def every_third(array):
    wide = np.full((3 * len(array), *array.shape[1:]), 7, array.dtype)
    wide[::3] = array
    return wide[::3]


def middle_columns(array):
    wide = np.full((len(array), 4, *array.shape[1:]), 7, array.dtype)
    wide[:, 2] = array
    return wide[:, 2]


LAYOUTS = {
    "F order": np.asfortranarray,
    "backwards in memory": lambda array: array[::-1].copy()[::-1],
    "backwards on all axes": lambda array: np.flip(np.flip(array).copy()),
    "every third row": every_third,
    "backwards with gaps": lambda array: every_third(array[::-1].copy())[::-1],
    "columns of something wider": middle_columns,
    "transposed twice": lambda array: np.ascontiguousarray(array.T).T,
    "unaligned": unaligned,
    "read-only": read_only,
    "big-endian": lambda array: array.astype(array.dtype.newbyteorder(">")),
    "unaligned and big-endian": lambda array: unaligned(array.astype(array.dtype.newbyteorder(">"))),
    "broadcast along time": lambda array: np.broadcast_to(array[:1], array.shape),
    "broadcast along all": lambda array: np.broadcast_to(array.flat[0], array.shape),
    "subclass": lambda array: array.view(np.recarray),
}
layouts = pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS.keys())
shapes = pytest.mark.parametrize("channels", [None, 1, 3])


@few_cases
@precisions
@layouts
@shapes
def test_layout_in_memory_does_not_matter(case, dtype, layout, channels):
    y, u = (layout(signal) for signal in random_signals(300, channels, dtype=dtype))
    keywords = {"fs": FS, "rule": case.rule}
    plain = [np.array(signal, dtype=dtype, order="C") for signal in (y, u)]
    expected = case.design.estimate(*plain, **keywords)
    for pair in ((y, u), (y, plain[1]), (plain[0], u)):
        assert_same_bits(case.design.filter(*pair, **keywords), expected.levels[0])
        got = case.design.estimate(*pair, **keywords)
        assert_same_bits(got.levels, expected.levels)
        assert_same_bits(got.flags, expected.flags)


@precisions
@layouts
def test_layout_of_one_sample_and_of_times_does_not_matter(dtype, layout):
    design = cf.PiForm(2.0, 1.0)
    y, u = random_signals(5, dtype=dtype)
    laid = layout(y), layout(u)
    plain = [np.array(signal) for signal in laid]
    streams = [design.stream(fs=FS, channels=5, dtype=dtype, initial=0.0) for _ in range(2)]
    assert_same_bits(streams[0].update(*laid), streams[1].update(*plain))
    t = layout(np.arange(5.0))
    assert_same_bits(design.filter(y, u, t=t), design.filter(y, u, t=np.array(t)))


def test_broadcast_across_channels():
    y, u = random_signals(300)
    wide = np.broadcast_to(y[:, None], (300, 4)), np.broadcast_to(u[:, None], (300, 4))
    got = cf.ThirdOrder(0.3).filter(*wide, fs=FS)
    for channel in range(4):
        assert_same_bits(got[:, channel], cf.ThirdOrder(0.3).filter(y, u, fs=FS))


OUTPUTS = {
    "C order": lambda shape, dtype: np.full(shape, 7, dtype),
    "F order": lambda shape, dtype: np.full(shape, 7, dtype, order="F"),
    "backwards": lambda shape, dtype: np.full(shape, 7, dtype)[::-1],
    "every second row": lambda shape, dtype: np.full((2 * shape[0], *shape[1:]), 7, dtype)[::2],
    "middle columns": lambda shape, dtype: np.full((shape[0], 3, *shape[1:]), 7, dtype)[:, 1],
}


@few_cases
@precisions
@shapes
@pytest.mark.parametrize("make", OUTPUTS.values(), ids=OUTPUTS.keys())
def test_out_takes_any_layout(case, dtype, channels, make):
    y, u = random_signals(300, channels, dtype=dtype)
    out = make(y.shape, y.dtype)
    got = case.design.filter(y, u, fs=FS, rule=case.rule, out=out)
    assert got is out
    assert_same_bits(np.array(out), case.design.filter(y, u, fs=FS, rule=case.rule))


def test_out_leaves_its_neighbours_alone():
    y, u = random_signals(50)
    wide = np.full((50, 3), 7.0)
    cf.FirstOrder(1.0).filter(y, u, fs=FS, out=wide[:, 1])
    np.testing.assert_array_equal(wide[:, [0, 2]], 7.0)


def overlapping(buffer):
    """Measurement, derivative and output that share memory."""
    rows = len(buffer) // 2
    y, u, other = buffer[:rows], buffer[rows:], buffer[::-1][:rows].copy()
    return {
        "in place of the measurement": (y, u, y),
        "in place of the derivative": (y, u, u),
        "one row on": (buffer[: rows - 1], other[1:], buffer[1:rows]),
        "one row back": (buffer[1:rows], other[1:], buffer[: rows - 1]),
        "backwards": (y, u, y[::-1]),
        "derivative one row on": (other[1:], buffer[: rows - 1], buffer[1:rows]),
        "both signals the same array": (y, y, y),
    }


@few_cases
@pytest.mark.parametrize("channels", [None, 3])
@pytest.mark.parametrize("name", overlapping(np.zeros(4)))
def test_out_may_share_memory(case, channels, name):
    y, u, out = overlapping(random_signals(600, channels)[0])[name]
    expected = case.design.filter(y.copy(), u.copy(), fs=FS, rule=case.rule)
    case.design.filter(y, u, fs=FS, rule=case.rule, out=out)
    assert_same_bits(np.array(out), expected)


@few_cases
@pytest.mark.parametrize("signal", [0, 1])
def test_inputs_stay_as_they_are(case, signal):
    pair = random_signals(100)
    before = pair[signal].copy()
    case.design.filter(*pair, fs=FS, rule=case.rule)
    np.testing.assert_array_equal(pair[signal], before)


# --------------------------------------------------------------------------------------------------------------- dtypes


@all_cases
def test_precision_is_kept(case):
    y, u = random_signals(20, dtype=np.float32)
    estimate = case.design.estimate(y, u, fs=FS, rule=case.rule)
    assert estimate.levels.dtype == np.float32
    assert estimate.state.dtype == "float32"
    assert case.design.filter(y, u, fs=FS, rule=case.rule).dtype == np.float32


@pytest.mark.parametrize(("first", "second"), [("f4", "f8"), ("f8", "f4"), ("f4", "i4"), ("i8", "f4")])
def test_mixed_dtypes_become_float64(first, second):
    y, u = (10 * signal for signal in random_signals(50))
    y, u = y.astype(first), u.astype(second)
    got = cf.PiForm(2.0, 1.0).filter(y, u, fs=FS)
    assert_same_bits(got, cf.PiForm(2.0, 1.0).filter(y.astype(float), u.astype(float), fs=FS))


@pytest.mark.parametrize("dtype", ["i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f2", "g", ">i4", ">f2"])
def test_other_real_numbers_become_float64(dtype):
    y, u = (np.abs(10 * signal).astype(dtype) for signal in random_signals(50))
    got = cf.PiForm(2.0, 1.0).filter(y, u, fs=FS)
    assert_same_bits(got, cf.PiForm(2.0, 1.0).filter(y.astype(float), u.astype(float), fs=FS))


@pytest.mark.parametrize("make", [list, tuple, memoryview, lambda a: [np.float64(x) for x in a]])
def test_sequences_become_arrays(make):
    y, u = random_signals(50)
    expected = cf.FirstOrder(1.0).filter(y, u, fs=FS)
    assert_same_bits(cf.FirstOrder(1.0).filter(make(y), make(u), fs=FS), expected)


NOT_REAL = {
    "bool": np.zeros(4, bool),
    "complex64": np.zeros(4, np.complex64),
    "complex128": np.zeros(4, complex),
    "str": np.zeros(4, "U3"),
    "bytes": np.zeros(4, "S3"),
    "object": np.array([1.0, None, 2.0, 3.0], object),
    "numbers as objects": np.array([1.0, 2.0, 3.0, 4.0], object),
    "datetime": np.zeros(4, "M8[s]"),
    "timedelta": np.zeros(4, "m8[s]"),
    "record": np.zeros(4, [("a", "f8")]),
    "list of str": ["1", "2", "3", "4"],
    "list of bool": [True, False, True, True],
    "None": None,
    "dict": {},
}
not_real = pytest.mark.parametrize("bad", NOT_REAL.values(), ids=NOT_REAL.keys())


@not_real
def test_arrays_of_anything_else_are_refused_by_name(bad):
    good, design = np.zeros(4), cf.FirstOrder(1.0)
    with pytest.raises(TypeError, match="measurement must"):
        design.filter(bad, good, fs=FS)
    with pytest.raises(TypeError, match="derivative must"):
        design.estimate(good, bad, fs=FS)
    with pytest.raises(TypeError, match=r"^y must"):
        design.stream(fs=FS).process(bad, good)
    with pytest.raises(TypeError, match=r"^u must"):
        design.stream(fs=FS, channels=4).update(good, bad)
    with pytest.raises(TypeError, match="omega must"):
        design.frequency_response(bad)
    if bad is not None:
        with pytest.raises(TypeError, match=r"^t must"):
            design.filter(good, good, t=bad)
        with pytest.raises(TypeError, match="initial must"):
            design.filter(good, good, fs=FS, initial=bad)


@pytest.mark.filterwarnings("ignore:Casting complex")
@pytest.mark.parametrize(
    "bad", [True, np.True_, 1j, np.complex128(1j), "1", b"1", None, [None], np.datetime64(1, "s")]
)
def test_samples_of_anything_else_are_refused_by_name(bad):
    """One sample is no less strict than an array."""
    stream = cf.FirstOrder(1.0).stream(fs=FS, initial=0.0)
    with pytest.raises(TypeError, match=r"^y must"):
        stream.update(bad, 0.0)
    with pytest.raises(TypeError, match=r"^u must"):
        stream.update(0.0, bad)
    with pytest.raises(TypeError, match=r"^u must"):
        stream.predict(bad)
    with pytest.raises(TypeError, match=r"^y must"):
        stream.correct(bad)


@pytest.mark.parametrize(
    "number", [1, 1.0, np.float32(1), np.float64(1), np.int8(1), np.uint64(1), np.array(1.0)]
)
def test_samples_may_be_any_real_number(number):
    stream = cf.FirstOrder(1.0).stream(fs=FS, initial=0.0)
    assert stream.update(number, number) == cf.FirstOrder(1.0).stream(fs=FS, initial=0.0).update(1.0, 1.0)


# ----------------------------------------------------------------------------------------------------------- arithmetic


def extreme(dtype):
    limit = float(np.finfo(dtype).max)
    width = np.finfo(dtype).bits
    return st.one_of(st.sampled_from([limit, -limit, 0.0]), st.floats(-limit, limit, width=width))


@all_cases
@precisions
@few
@given(data=st.data(), seed=seeds, period=st.sampled_from([None, 1.0]))
def test_finite_in_finite_out(case, dtype, data, seed, period):
    """Even where the levels overflow: then the filter starts anew from the measurement and says so."""
    palette = np.array(data.draw(st.lists(extreme(dtype), min_size=2, max_size=6)), dtype=dtype)
    y, u = np.random.default_rng(seed).choice(palette, size=(2, 300))
    estimate = case.design.estimate(y, u, fs=FS, rule=case.rule, period=period)
    assert np.isfinite(estimate.levels[0]).all()
    restarted = estimate.flags == cf.Flags.RESTARTED
    assert_same_bits(estimate.levels[0, restarted], y[restarted])
    stream = case.design.stream(fs=FS, dtype=dtype, rule=case.rule, period=period)
    assert_same_bits(one_by_one(stream, y, u, [None] * len(y)), estimate.levels[0])


@all_cases
@precisions
def test_overflow_starts_anew_in_every_row(case, dtype):
    """Long enough that blocks in which all samples are there follow each other."""
    limit = np.finfo(dtype).max
    y, u = np.random.default_rng(5).choice(np.array([limit, -limit], dtype), size=(2, 600))
    estimate = case.design.estimate(y, u, fs=0.1, rule=case.rule)
    assert np.isfinite(estimate.levels[0]).all()
    assert np.isfinite(case.design.filter(y, u, fs=0.1, rule=case.rule)).all()
    stream = case.design.stream(fs=0.1, dtype=dtype, rule=case.rule)
    assert_same_bits(one_by_one(stream, y, u, [None] * len(y)), estimate.levels[0])


@all_cases
@few
@given(seed=seeds)
def test_single_precision_is_near_double(case, seed):
    y, u = random_signals(1000, seed=seed, dtype=np.float32)
    if case.design.derivative_order > 2:
        y *= np.float32(0.1)  # the same bound for the faster growing levels
    single = case.design.filter(y, u, fs=FS, rule=case.rule, initial=0.5)
    double = case.design.filter(y.astype(float), u.astype(float), fs=FS, rule=case.rule, initial=0.5)
    np.testing.assert_allclose(single, double, rtol=0, atol=3e-5 * max(1.0, np.abs(double).max()))


@all_plain
@some
@given(speed=speeds, seed=seeds, samples=st.floats(2.0, 100.0))
def test_low_and_high_add_to_one(case, speed, seed, samples):
    design, fs = case.make(speed), speed * samples
    exponents = np.random.default_rng(seed).uniform(0, 1, 30)
    low, high = design.frequency_response(speed * 1e6 ** (exponents - 0.5))
    np.testing.assert_allclose(low + high, 1, rtol=0, atol=1e-12)
    omega = 0.8 * math.pi * fs * 1e3 ** (exponents - 1)
    for rule in ["backward_euler", "matched"] if case.can_match else ["backward_euler"]:
        low, high = design.frequency_response(omega, fs=fs, rule=rule)
        np.testing.assert_allclose(low + high, 1, rtol=0, atol=1e-7)


@all_linear_cases
@few
@given(seed=seeds, factor=st.sampled_from([-1.0, 0.5, 8.0]))
def test_filter_is_linear(case, seed, factor):
    y, u = random_signals(200, seed=seed)
    keywords = {"fs": FS, "rule": case.rule, "initial": 0.0}
    both = case.design.filter(y, u, **keywords)
    from_y = case.design.filter(y, np.zeros(200), **keywords)
    from_u = case.design.filter(np.zeros(200), u, **keywords)
    np.testing.assert_allclose(from_y + from_u, both, rtol=0, atol=1e-11 * max(1.0, np.abs(both).max()))
    # Powers of two change no bits of the mantissa.
    assert_same_bits(case.design.filter(factor * y, factor * u, **keywords), factor * both)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int64])
def test_masked_samples_are_missing(dtype):
    y = np.ma.array(np.arange(8), mask=np.arange(8) == 5, dtype=dtype)
    estimate = cf.FirstOrder(1.0).estimate(y, np.zeros(8, dtype), fs=FS)
    assert estimate.counts["measurement_missing"] == 1
    assert cf.Flags(estimate.flags[5]) == cf.Flags.MEASUREMENT_MISSING
    assert estimate.levels.dtype == (np.float32 if dtype == np.float32 else np.float64)
