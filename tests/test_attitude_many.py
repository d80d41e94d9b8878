"""Many recordings in one call: each one's results are the bits of `estimate`, whatever stands beside it."""

import copy
import itertools
import math
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import compfilt as cf
from designs import assert_same_bits, pickled, precisions
from test_attitude_contract import RESULTS, check_refused, cut, noise, rows_of, signals
from test_contract import layouts, read_only, seeds, time_steps
from test_mahony import FS

few = settings(max_examples=3)

# ------------------------------------------------------------------------------------------------------------- designs

DESIGNS = {
    "proportional": cf.Mahony(2.0, acc_range=50.0),
    "explicit": cf.Mahony(1.0, 0.5, bias_limit=0.02),
    "passive": cf.Mahony(3.0, 0.2, form="passive"),
    "direct": cf.Mahony(1.0, form="direct"),
    "gravity 1": cf.GravityFilter(0.3, order=1, rest_time=0.05, acc_range=50.0),
    "gravity 2": cf.GravityFilter(2.0, rest_time=0.05),
    "gravity 2, all set": cf.GravityFilter(
        0.7, split=2, gyro_delay=0.004, advance=0.01, rest_time=0.02, heading_tau=0.5, acc_range=50.0
    ),
    "gravity 3": cf.GravityFilter(0.5, order=3, split=2, advance=0.01, rest_time=0.02),
    "self-calibrating": cf.GravityFilter(1.0, self_calibrating=True, advance=0.01, rest_time=0.05),
}
MAHONY, GRAVITY, CALIBRATING = (DESIGNS[name] for name in ("explicit", "gravity 2", "self-calibrating"))
every = pytest.mark.parametrize("design", DESIGNS.values(), ids=DESIGNS)
# One of every family that has recordings side by side.
families = pytest.mark.parametrize(
    "design", [MAHONY, GRAVITY, CALIBRATING], ids=["mahony", "gravity", "self-calibrating"]
)
# Where the call is tested and not the filter.
both = pytest.mark.parametrize("design", [MAHONY, GRAVITY], ids=["mahony", "gravity"])
workers_of = pytest.mark.parametrize("workers", [1, 2, 5])

# ---------------------------------------------------------------------------------------------------------- recordings

# From none at all up to eight in lanes and more that wait for one.
COUNTS = [0, 1, 2, 3, 7, 8, 9, 20]
# The empty, the shortest, and some that end long before the others.
LENGTHS = [40, 0, 90, 1, 33, 2, 90, 64, 5, 0, 71, 17]
# Rows are taken 512 at a time.
AROUND_512 = [512, 511, 513, 1024, 1, 600, 1023, 1025, 0, 512]


def disturb(arrays, rng):
    """Some samples that are missing, opposite, clipped or far too large, alone and in bursts; at the first row too."""
    rows = rows_of(arrays)
    values = [math.nan, math.nan, 0.0, math.inf, 1e7, 60.0, -1e-30]
    for name, array in arrays.items():
        for _ in range(rng.integers(0, 4)):
            row, axis = rng.integers(0, rows), rng.integers(0, 3)
            array[row : row + rng.integers(1, 25), axis:] = values[rng.integers(len(values))]
        if rng.integers(3) == 0:
            array[: rng.integers(1, 12)] = math.nan
        if name == "acc" and rng.integers(2):
            array[rng.integers(0, rows) :] *= -1.0
    arrays["gyr"][rng.integers(0, rows)] = rng.choice([1e3, -40.0])


def recording(seed, rows, *, magnetic=True, dtype=float):
    arrays = noise(rows, magnetic, seed, dtype)
    if rows:
        disturb(arrays, np.random.default_rng(seed))
    return arrays


def recordings_of(lengths, *, dtype=float, magnetic="some"):
    """One of each length, every one with events of its own; a third of them without a magnetometer."""
    has = {"all": lambda _: True, "none": lambda _: False, "some": lambda n: n % 3 != 1}[magnetic]
    return [recording(n, rows, magnetic=has(n), dtype=dtype) for n, rows in enumerate(lengths)]


def lengths_of(count):
    return list(itertools.islice(itertools.cycle(LENGTHS), count))


def times(seed, rows):
    """With jitter, repeated times, and gaps short and long."""
    rng = np.random.default_rng(seed)
    steps = rng.uniform(0.002, 0.02, rows)
    for step in [0.0, 0.0, 1e-9, 0.3, 2.0, 40.0]:
        steps[rng.integers(0, rows, min(rows, 1))] = step
    return 1.7e9 * (seed % 2) + np.cumsum(steps)


def with_times(recordings, shift=0.0):
    """Every second one, where there is a shift, runs backwards once by that much."""
    timed = []
    for n, arrays in enumerate(recordings):
        t = times(n, rows_of(arrays))
        if n % 2:
            t[len(t) // 2 :] -= shift
        timed.append({**arrays, "t": t})
    return timed


def columns(recordings, magnetic):
    """The arguments of `estimate_many`: one list a signal, None where a recording has none."""
    names = ["gyr", "acc", *(name for name in ("mag", "t", "initial") if any(name in r for r in recordings))]
    if magnetic:
        names = [*dict.fromkeys([*names, "mag"])]
    return {name: [arrays.get(name) for arrays in recordings] for name in names}


def many(design, recordings, *, magnetic=False, **keywords):
    arguments = columns(recordings, magnetic)
    if "fs" not in keywords:
        # Without a recording there is none that has times.
        arguments.setdefault("t", [])
    return design.estimate_many(**arguments, **keywords)


def alone(design, recordings, **keywords):
    return [design.estimate(**arrays, **keywords) for arrays in recordings]


def check_same_estimate(got, expected):
    for name in RESULTS:
        assert_same_bits(getattr(got, name), getattr(expected, name))
    assert (got.calibration is None) == (expected.calibration is None)
    if expected.calibration is not None:
        assert_same_bits(got.calibration, expected.calibration)
    # By their text: NaN is like NaN, and minus zero is not zero.
    assert repr(got.gyro_delay) == repr(expected.gyro_delay)
    assert got.state == expected.state
    assert got.state.dtype == expected.state.dtype
    assert got.state.time == expected.state.time
    assert got.counts == expected.counts


def check_same_estimates(got, expected):
    assert type(got) is list
    for one, other in zip(got, expected, strict=True):
        assert type(one) is cf.AttitudeEstimate
        check_same_estimate(one, other)


def check_as_alone(design, recordings, *, workers=1, **keywords):
    got = many(design, recordings, workers=workers, **keywords)
    check_same_estimates(got, alone(design, recordings, **keywords))
    return got


# ---------------------------------------------------------------------------------------------------- as many as there are


@every
@precisions
@pytest.mark.parametrize("count", COUNTS)
def test_any_number_of_recordings(design, dtype, count):
    """With and without a magnetometer: those that have the same signals go side by side."""
    for magnetic in ("some", "all", "none"):
        recordings = recordings_of(lengths_of(count), dtype=dtype, magnetic=magnetic)
        check_as_alone(design, recordings, fs=FS)
        if magnetic != "some":
            check_as_alone(design, with_times(recordings, shift=3.0), backwards="restart")


def test_the_recordings_meet_what_is_rare():
    """Otherwise the other tests say little."""
    recordings = with_times(recordings_of(lengths_of(20)), shift=3.0)
    estimates = {name: alone(design, recordings, backwards="restart") for name, design in DESIGNS.items()}
    for name, all_of_one in estimates.items():
        flags = np.bitwise_or.reduce(np.concatenate([estimate.flags for estimate in all_of_one]))
        expected = cf.Flags(255) & ~cf.Flags.SENSOR_MISSING
        assert cf.Flags(flags) | cf.Flags.AMBIGUOUS == expected, name
        at_rest = np.concatenate([estimate.at_rest for estimate in all_of_one])
        assert at_rest.any() == isinstance(DESIGNS[name], cf.GravityFilter), name
    learnt = [estimate.calibration for estimate in alone(CALIBRATING, recordings_of(AROUND_512), fs=FS)]
    assert sum(np.any(matrix != 0.0) for matrix in learnt) >= 3


@families
@precisions
@workers_of
def test_lengths_around_the_rows_that_are_taken_at_once(design, dtype, workers):
    recordings = recordings_of(AROUND_512, dtype=dtype)
    check_as_alone(design, recordings, fs=FS, workers=workers)
    check_as_alone(design, with_times(recordings, shift=3.0), backwards="restart", workers=workers)


@families
@pytest.mark.parametrize("rows", [0, 1, 512])
def test_recordings_of_one_length(design, rows):
    """All lanes are done at once."""
    check_as_alone(design, recordings_of(17 * [rows]), fs=FS)


@families
def test_the_longest_goes_on_alone(design):
    """Whatever the others do, and wherever it stands among them."""
    for place in range(9):
        lengths = 9 * [30]
        lengths[place] = 700
        check_as_alone(design, recordings_of(lengths, magnetic="none"), fs=FS)


@every
@few
@given(data=st.data(), dtypes=st.lists(st.sampled_from(["f4", "f8"]), max_size=12), workers=st.integers(1, 3))
def test_any_recordings(design, data, dtypes, workers):
    recordings = [data.draw(signals(dtype)) for dtype in dtypes]
    hold = data.draw(st.sampled_from([0.0, 0.025, 0.1, 1.0]))
    check_as_alone(design, recordings, fs=FS, hold=hold, workers=workers)


@every
@few
@given(data=st.data(), count=st.integers(3, 10), backwards=st.booleans())
def test_any_recordings_with_times(design, data, count, backwards):
    recordings = [data.draw(signals()) for _ in range(count)]
    for arrays in recordings:
        t = np.cumsum(data.draw(time_steps(rows_of(arrays))))
        if backwards and data.draw(st.booleans()):
            t[data.draw(st.integers(0, len(t) - 1)) :] -= 3.0
        arrays["t"] = t
    check_as_alone(design, recordings, backwards="restart")


@every
@few
@given(seed=seeds)
def test_the_order_and_the_neighbours_do_not_matter(design, seed):
    """Each one has the same bits among any others, in any place, and more than once."""
    rng = np.random.default_rng(seed)
    recordings = recordings_of(rng.integers(0, 120, 6))
    expected = alone(design, recordings, fs=FS)
    places = rng.integers(0, 6, 15)
    got = many(design, [recordings[n] for n in places], fs=FS)
    check_same_estimates(got, [expected[n] for n in places])


@families
def test_overflow_of_one_leaves_the_others_alone(design):
    """Steps so long that a turn is no number, in one of eight at a time."""
    recordings = recordings_of(8 * [50], magnetic="none")
    for n in range(8):
        timed = [{**arrays, "t": np.arange(50) / FS} for arrays in recordings]
        timed[n]["t"] = np.where(np.arange(50) < 20 + n, timed[n]["t"], 1e200 + timed[n]["t"])
        got = check_as_alone(design, timed)
        assert got[n].flags[20 + n] & cf.Flags.RESTARTED


# ------------------------------------------------------------------------------------------------------ what is given


@families
def test_every_recording_has_its_own_precision(design):
    """float32 only where all of its signals are, whatever the others are."""
    recordings = recordings_of(16 * [60])
    for n, arrays in enumerate(recordings):
        for i, name in enumerate(arrays):
            if n >> i & 1:
                arrays[name] = arrays[name].astype(np.float32)
    got = check_as_alone(design, recordings, fs=FS)
    single = [all(array.dtype == np.float32 for array in arrays.values()) for arrays in recordings]
    assert 2 <= sum(single) < len(single)
    for estimate, is_single in zip(got, single, strict=True):
        assert estimate.quaternion.dtype == (np.float32 if is_single else np.float64)


@both
def test_a_precision_that_no_recording_has_does_not_matter(design):
    """A design or a rate that cannot be in float32 filters float64, as in `estimate`."""
    check_as_alone(design, recordings_of([20, 30, 40]), fs=1e-42)
    tiny = cf.Mahony(1e-50) if design is MAHONY else cf.GravityFilter(1e50)
    check_as_alone(tiny, recordings_of([20, 30, 40]), fs=FS)
    single = recordings_of([20, 30, 40], dtype=np.float32)
    with pytest.raises(ValueError, match="must"):
        many(tiny, single, fs=FS)


@both
@precisions
@layouts
def test_layout_in_memory_does_not_matter(design, dtype, layout):
    """Also of more rows than are taken at once, and for some recordings only."""
    plain = recordings_of([600, 30, 513, 90], dtype=dtype)
    laid = [{name: layout(array) for name, array in arrays.items()} for arrays in plain]
    check_as_alone(design, laid, fs=FS)
    mixed = [laid[0], plain[1], {**plain[2], "acc": laid[2]["acc"]}, {**laid[3], "gyr": plain[3]["gyr"]}]
    check_as_alone(design, mixed, fs=FS)


@both
def test_times_at_any_stride(design):
    recordings = with_times(recordings_of([50, 60, 70]))
    for arrays in recordings:
        arrays["t"] = np.repeat(arrays["t"], 2)[::2]
    recordings[1]["t"] = recordings[1]["t"].tolist()
    recordings[2]["t"] = recordings[2]["t"][::-1].copy()[::-1]
    check_as_alone(design, recordings)


SEQUENCES = {
    "list": list,
    "tuple": tuple,
    "3-D array": np.array,
    "3-D array, Fortran order": lambda arrays: np.asfortranarray(np.array(arrays)),
    "3-D array, backwards in memory": lambda arrays: np.array(arrays[::-1])[::-1],
    "last axis first": lambda arrays: np.moveaxis(np.moveaxis(np.array(arrays), 2, 0).copy(), 0, 2),
    "lists of lists": lambda arrays: [array.tolist() for array in arrays],
    "read-only": lambda arrays: read_only(np.array(arrays)),
    "memoryviews": lambda arrays: [memoryview(array) for array in arrays],
}


@both
@pytest.mark.parametrize("make", SEQUENCES.values(), ids=SEQUENCES)
@pytest.mark.parametrize("count", [1, 5])
def test_sequences_of_any_kind(design, make, count):
    recordings = recordings_of(count * [40], magnetic="all")
    made = {name: make([arrays[name] for arrays in recordings]) for name in ("gyr", "acc", "mag")}
    expected = alone(design, recordings, fs=FS)
    check_same_estimates(design.estimate_many(**made, fs=FS), expected)
    t = np.sort(np.random.default_rng(3).uniform(0.0, 0.5, (count, 40)))
    timed = [{**arrays, "t": row} for arrays, row in zip(recordings, t, strict=True)]
    for all_times in (t, list(t), np.asfortranarray(t), t.tolist()):
        check_same_estimates(design.estimate_many(**made, t=all_times), alone(design, timed))


@both
def test_masked_samples_are_missing(design):
    recordings = recordings_of(5 * [30], magnetic="none")
    hidden = np.zeros((5, 30, 3), bool)
    hidden[1, 4:9], hidden[2, 0], hidden[4, 20, 1] = True, True, True
    stacked = {name: np.array([arrays[name] for arrays in recordings]) for name in ("gyr", "acc")}
    masked = {name: np.ma.array(array, mask=hidden) for name, array in stacked.items()}
    holed = [
        {name: np.where(hidden[n], math.nan, array[n]) for name, array in stacked.items()} for n in range(5)
    ]
    check_same_estimates(design.estimate_many(**masked, fs=FS), alone(design, holed, fs=FS))
    listed = {name: list(array) for name, array in masked.items()}
    check_same_estimates(design.estimate_many(**listed, fs=FS), alone(design, holed, fs=FS))


@both
def test_one_array_for_all(design):
    """The same object in every place: nobody writes into it."""
    arrays = recording(1, 80)
    before = copy.deepcopy(arrays)
    frozen = {name: read_only(array) for name, array in arrays.items()}
    check_as_alone(design, 9 * [arrays], fs=FS)
    check_as_alone(design, 9 * [frozen], fs=FS)
    for name, array in before.items():
        np.testing.assert_array_equal(arrays[name], array)


@both
def test_results_are_arrays_of_their_own(design):
    got = many(design, 9 * [recording(1, 80)], fs=FS)
    arrays = [getattr(estimate, name) for estimate in got for name in RESULTS]
    assert all(array.flags.writeable and array.flags.c_contiguous for array in arrays)
    for one, other in itertools.combinations(arrays, 2):
        assert not np.shares_memory(one, other)


@every
def test_a_magnetometer_of_some_or_of_none(design):
    """None for all is as if the argument were not there."""
    recordings = recordings_of(5 * [50], magnetic="none")
    expected = alone(design, recordings, fs=FS)
    check_same_estimates(many(design, recordings, fs=FS), expected)
    check_same_estimates(many(design, recordings, magnetic=True, fs=FS), expected)
    recordings[2] = recording(2, 50)
    check_as_alone(design, recordings, fs=FS)


@every
@precisions
@pytest.mark.parametrize("clock", ["fs", "t"])
def test_every_recording_has_its_own_start(design, dtype, clock):
    """A quaternion of any length and kind, a state, or nothing."""
    recordings = recordings_of(9 * [60], dtype=dtype)
    states = [estimate.state for estimate in alone(design, recordings, fs=FS)]
    starts = [[1.0, 0.0, 0.0, 0.0], None, states[3], np.array([0.5, -1.0, 3.0, 8.0]), (0, 1, 0, 0), states[0]]
    starts += [None, np.array([-0.6, 0.0, 0.8, 0.0], "f4"), states[8]]
    if clock == "t":
        recordings = with_times(recordings)
    for arrays, start in zip(recordings, starts, strict=True):
        if start is not None:
            arrays["initial"] = start
    check_as_alone(design, recordings, **({"fs": FS} if clock == "fs" else {}))
    untouched = [estimate.state for estimate in alone(design, recordings_of(9 * [60], dtype=dtype), fs=FS)]
    assert states == untouched


@both
def test_starts_as_one_array(design):
    recordings = recordings_of(4 * [50], magnetic="all")
    starts = np.random.default_rng(7).normal(size=(4, 4))
    started = [{**arrays, "initial": start} for arrays, start in zip(recordings, starts, strict=True)]
    arguments = {**columns(recordings, magnetic=True), "initial": starts}
    check_same_estimates(design.estimate_many(**arguments, fs=FS), alone(design, started, fs=FS))


@every
@workers_of
def test_workers_change_nothing(design, workers):
    recordings = recordings_of(lengths_of(20))
    check_as_alone(design, recordings, fs=FS, workers=workers)
    check_as_alone(design, with_times(recordings), workers=workers)
    for count in (0, 1, 2):
        check_as_alone(design, recordings[:count], fs=FS, workers=workers)


@both
def test_more_workers_than_there_is_work_or_cores(design):
    for count in (1, 20):
        check_as_alone(design, recordings_of(lengths_of(count)), fs=FS, workers=10**6)


@both
def test_calls_in_several_threads_at_once(design):
    recordings = recordings_of(12 * [300])
    expected = alone(design, recordings, fs=FS)
    results = [None] * 4

    def work(place):
        results[place] = many(design, recordings, fs=FS, workers=2)

    threads = [threading.Thread(target=work, args=(place,)) for place in range(len(results))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for got in results:
        check_same_estimates(got, expected)


# --------------------------------------------------------------------------------------------------------------- states


@every
@precisions
@pytest.mark.parametrize("clock", ["fs", "t"])
@pytest.mark.parametrize(
    "keep", [lambda state: state, pickled, copy.deepcopy], ids=["same", "pickled", "copied"]
)
def test_two_parts_are_the_whole(design, dtype, clock, keep):
    """Each recording cut somewhere else, the second part from the state of the first; also with nothing in a part."""
    recordings = recordings_of(lengths_of(11), dtype=dtype)
    keywords = {"fs": FS}
    if clock == "t":
        recordings, keywords = with_times(recordings), {}
    whole = many(design, recordings, **keywords)
    cuts = [(7 * n) % (rows_of(arrays) + 1) for n, arrays in enumerate(recordings)]
    first = many(design, [cut(r, slice(at)) for r, at in zip(recordings, cuts, strict=True)], **keywords)
    rest = [
        {**cut(arrays, slice(at, None)), "initial": keep(estimate.state)}
        for arrays, at, estimate in zip(recordings, cuts, first, strict=True)
    ]
    second = many(design, rest, **keywords)
    for all_of_it, one, other in zip(whole, first, second, strict=True):
        for name in RESULTS:
            parts = [getattr(one, name), getattr(other, name)]
            assert_same_bits(np.concatenate(parts), getattr(all_of_it, name))
        assert other.state == all_of_it.state
        assert repr(other.gyro_delay) == repr(all_of_it.gyro_delay)


@families
def test_a_stream_goes_on_from_a_state_of_many(design):
    recordings = recordings_of(9 * [60])
    heads = many(design, [cut(arrays, slice(35)) for arrays in recordings], fs=FS)
    whole = alone(design, recordings, fs=FS)
    for head, arrays, expected in zip(heads, recordings, whole, strict=True):
        stream = design.stream(fs=FS, initial=head.state)
        assert_same_bits(stream.process(**cut(arrays, slice(35, 60))), expected.quaternion[35:])
        assert stream.state == expected.state


# --------------------------------------------------------------------------------------------------------------- errors

GOOD = recordings_of(6 * [20], magnetic="all")
T = np.arange(20) / FS


def check_refused_like_alone(design, recordings, number, **keywords):
    """The error of the recording alone, with its number before it; and what follows is as ever."""
    before = copy.deepcopy(recordings)
    with pytest.raises((ValueError, TypeError)) as expected:
        design.estimate(**recordings[number], **keywords)
    for workers in (1, 3):
        with pytest.raises((ValueError, TypeError)) as caught:
            many(design, recordings, workers=workers, **keywords)
        assert type(caught.value) is type(expected.value)
        assert str(caught.value) == f"recording {number}: {expected.value}"
    for arrays, old in zip(recordings, before, strict=True):
        for name, value in old.items():
            if isinstance(value, np.ndarray) and value.dtype.kind == "f":
                np.testing.assert_array_equal(arrays[name], value)
    check_same_estimates(many(design, GOOD, fs=FS), alone(design, GOOD, fs=FS))


def changed(number=3, timed=False, **entries):
    """The good recordings, one of them with other entries."""
    recordings = [{**arrays, "t": T} if timed else dict(arrays) for arrays in GOOD]
    recordings[number] |= entries
    return recordings


BAD_ENTRIES = {
    "transposed": {"gyr": np.zeros((3, 20))},
    "too few columns": {"acc": np.zeros((20, 2))},
    "one axis": {"mag": np.zeros(20)},
    "one axis too many": {"acc": np.zeros((1, 20, 3))},
    "a number": {"gyr": 1.0},
    "nothing": {"gyr": []},
    "acc too short": {"acc": np.zeros((19, 3))},
    "mag too short": {"mag": np.zeros((5, 3))},
    "text": {"acc": "text"},
    "complex": {"acc": np.zeros((20, 3), complex)},
    "bool": {"gyr": np.zeros((20, 3), bool)},
    "no gyr": {"gyr": None},
    "three numbers": {"initial": [1.0, 0.0, 0.0]},
    "zero": {"initial": [0.0, 0.0, 0.0, 0.0]},
    "a word": {"initial": "up"},
    "foreign state": {"initial": cf.PiForm(1.0, 1.0).stream(initial=0.0).state},
}


@both
@pytest.mark.parametrize("entries", BAD_ENTRIES.values(), ids=BAD_ENTRIES)
def test_an_error_names_its_recording(design, entries):
    check_refused_like_alone(design, changed(**entries), 3, fs=FS)
    check_refused_like_alone(design, changed(number=0, **entries), 0, fs=FS)


BAD_TIMES = {
    "backwards": T[::-1],
    "not a number": np.where(np.arange(20) == 7, math.nan, T),
    "infinite": np.where(np.arange(20) == 19, math.inf, T),
    "too short": T[:19],
    "a column": T[:, None],
    "a word": "now",
}


@both
@pytest.mark.parametrize("t", BAD_TIMES.values(), ids=BAD_TIMES)
def test_a_bad_time_names_its_recording(design, t):
    check_refused_like_alone(design, changed(timed=True, t=t), 3)


@both
def test_time_may_not_run_backwards_from_a_state(design):
    state = design.estimate(**GOOD[0], t=T + 50.0).state
    check_refused_like_alone(design, changed(timed=True, initial=state), 3)


@both
@pytest.mark.parametrize("name", ["gyr", "acc", "mag"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_missing_raise_names_recording_signal_and_row(design, name, bad):
    clean = [noise(20, seed=n) for n in range(6)]
    check_as_alone(design, clean, fs=FS, missing="raise")
    holed = clean[4][name].copy()
    holed[11, 2] = bad
    clean[4] |= {name: holed}
    pattern = f"^recording 4: {name} has a missing sample .*row 11, column 2"
    check_refused(ValueError, pattern, lambda: many(design, clean, fs=FS, missing="raise"))
    check_refused_like_alone(design, clean, 4, fs=FS, missing="raise")


@both
def test_the_first_bad_recording_is_the_one_that_is_named(design):
    recordings = changed(acc=np.zeros((20, 2)))
    recordings[1] |= {"acc": np.zeros((20, 2))}
    check_refused_like_alone(design, recordings, 1, fs=FS)


@both
def test_a_state_of_the_other_precision_names_its_recording(design):
    state = design.stream(dtype="f4").state
    check_refused_like_alone(design, changed(initial=state), 3, fs=FS)
    single = {name: array.astype("f4") for name, array in GOOD[3].items()}
    recordings = [*GOOD[:3], {**single, "initial": design.stream().state}, *GOOD[4:]]
    check_refused_like_alone(design, recordings, 3, fs=FS)


@both
def test_an_accelerometer_is_needed(design):
    call = columns(changed(acc=None), magnetic=True)
    check_refused(ValueError, "^recording 3: acc must", lambda: design.estimate_many(**call, fs=FS))
    for bad in (None, 1.0):
        call = {**columns(GOOD, magnetic=True), "acc": bad}
        check_refused(
            ValueError, "^acc must be a sequence", lambda call=call: design.estimate_many(**call, fs=FS)
        )


@both
@pytest.mark.parametrize("name", ["gyr", "acc", "mag", "initial"])
@pytest.mark.parametrize("bad", [1.0, 7, np.float64(3.0), np.array(2.0)], ids=repr)
def test_what_is_no_sequence(design, name, bad):
    call = {**columns(GOOD, magnetic=True), name: bad}
    check_refused(ValueError, f"^{name} must be a sequence", lambda: design.estimate_many(**call, fs=FS))


@both
def test_a_time_that_is_no_sequence(design):
    call = columns(GOOD, magnetic=True)
    check_refused(ValueError, "^t must be a sequence", lambda: design.estimate_many(**call, t=1.0))


@both
def test_one_recording_that_stands_in_no_sequence(design):
    pattern = r"^recording 0: gyr must have the shape \(samples, 3\), got \[3\]"
    check_refused(ValueError, pattern, lambda: design.estimate_many(**GOOD[0], fs=FS))


@both
@pytest.mark.parametrize("name", ["acc", "mag", "t", "initial"])
@pytest.mark.parametrize("count", [0, 1, 5, 7])
def test_one_entry_a_recording(design, name, count):
    start = [1.0, 0.0, 0.0, 0.0]
    call = columns([{**arrays, "t": T, "initial": start} for arrays in GOOD], magnetic=True)
    call[name] = (2 * call[name])[:count]
    pattern = f"^gyr and {name} must have one entry a recording, got 6 and {count}"
    check_refused(ValueError, pattern, lambda: design.estimate_many(**call))


@both
@pytest.mark.parametrize("count", [0, 6])
def test_one_clock(design, count):
    call = columns(GOOD[:count], magnetic=True)
    pattern = "^give fs in Hz or t in seconds, one of them"
    check_refused(ValueError, pattern, lambda: design.estimate_many(**call))
    check_refused(ValueError, pattern, lambda: design.estimate_many(**call, fs=FS, t=count * [T]))


@both
def test_a_recording_without_times_among_others(design):
    check_refused_like_alone(design, changed(timed=True, t=None), 3)


BAD_KEYWORDS = [
    ("^fs must be positive and finite", {"fs": 0.0}),
    ("^fs must be positive and finite", {"fs": math.nan}),
    ('^missing must be "coast" or "raise", got "skip"', {"fs": FS, "missing": "skip"}),
    ('^backwards must be "raise" or "restart", got "sort"', {"fs": FS, "backwards": "sort"}),
    ("^hold must be finite and not negative", {"fs": FS, "hold": -0.1}),
    ("^workers must be 1 or more, got 0", {"fs": FS, "workers": 0}),
    ("^workers must be 1 or more, got -2", {"fs": FS, "workers": -2}),
]


@both
@pytest.mark.parametrize(("pattern", "keywords"), BAD_KEYWORDS)
def test_keywords_that_cannot_work(design, pattern, keywords):
    """They are of all recordings: none is named, and it does not matter whether there is one."""
    for recordings in (GOOD, []):
        check_refused(ValueError, pattern, lambda recordings=recordings: many(design, recordings, **keywords))


@both
@pytest.mark.parametrize("bad", [1.5, "2", None, [1]], ids=repr)
def test_workers_are_a_whole_number(design, bad):
    check_refused(TypeError, "'workers'", lambda: many(design, GOOD, fs=FS, workers=bad))


@both
def test_signals_come_first_and_all_else_by_name(design):
    gyr, acc = columns(GOOD, magnetic=False)["gyr"], columns(GOOD, magnetic=False)["acc"]
    check_refused(TypeError, "positional", lambda: design.estimate_many(gyr, acc, FS))
    check_refused(TypeError, "acc", lambda: design.estimate_many(gyr, fs=FS))


@both
def test_an_entry_whose_sequence_fails(design):
    """What its iteration raises comes through as it is."""

    def failing():
        yield GOOD[0]["gyr"]
        raise KeyError("gone")

    call = columns(GOOD, magnetic=True) | {"gyr": failing()}
    with pytest.raises(KeyError, match="gone"):
        design.estimate_many(**call, fs=FS)
