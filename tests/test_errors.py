"""Every refusal, with the argument and the rule in its message."""

import math
import re

import numpy as np
import pytest

import compfilt as cf
from designs import MATCHED, PLAIN, assert_same_bits, random_signals

FS = 100.0
Y, U = random_signals(6)
T = np.arange(6) / FS
FIRST = cf.FirstOrder(0.5)
PI = cf.PiForm(2.0, 1.0)
SPLIT = cf.Butterworth(2.0, 2, split=1)
RATE = cf.RateFilter(1.0)


def message(error):
    """The message; where the interpreter has notes, the argument's name stands there."""
    return " ".join([str(error), *getattr(error, "__notes__", [])])


def check_refused(kind, pattern, call, *arguments, **keywords):
    with pytest.raises(kind) as caught:
        call(*arguments, **keywords)
    assert re.search(pattern, message(caught.value)), message(caught.value)


# ----------------------------------------------------------------------------------------------------------- parameters

MAKERS = {
    "FirstOrder": (cf.FirstOrder, {"tau": 1.0}),
    "PiForm": (cf.PiForm, {"kp": 2.0, "ki": 1.0}),
    "Butterworth": (cf.Butterworth, {"omega0": 1.0, "q": 1.0}),
    "Butterworth 6": (lambda omega0: cf.Butterworth(omega0, 6), {"omega0": 1.0}),
    "ThirdOrder": (cf.ThirdOrder, {"tau": 1.0}),
    "ThirdOrder.from_gains": (cf.ThirdOrder.from_gains, {"k1": 3.0, "k2": 3.0, "k3": 1.0}),
    "ThirdOrder.butterworth": (cf.ThirdOrder.butterworth, {"omega0": 1.0}),
    "SecondOrderInertial": (cf.SecondOrderInertial, {"tau": 1.0}),
    "SecondOrderInertial.butterworth": (cf.SecondOrderInertial.butterworth, {"omega0": 1.0}),
    "RateFilter": (cf.RateFilter, {"tau": 1.0}),
    "alpha_to_tau": (cf.alpha_to_tau, {"alpha": 0.5, "fs": 1.0}),
    "tau_to_alpha": (cf.tau_to_alpha, {"tau": 0.5, "fs": 1.0}),
}
NUMBERS = [(maker, name) for maker, (_, parameters) in MAKERS.items() for name in parameters]


@pytest.mark.parametrize(("maker", "name"), NUMBERS)
@pytest.mark.parametrize("bad", [0.0, -0.0, -1.0, math.nan, math.inf, -math.inf])
def test_parameters_must_be_positive_and_finite(maker, name, bad):
    make, parameters = MAKERS[maker]
    rule = "lie between 0 and 1, both excluded" if name == "alpha" else "be positive and finite"
    check_refused(ValueError, f"^{name} must {rule}", make, **{**parameters, name: bad})


@pytest.mark.parametrize(("maker", "name"), NUMBERS)
@pytest.mark.parametrize("bad", ["1", None, [1.0], 1j])
def test_parameters_must_be_numbers(maker, name, bad):
    make, parameters = MAKERS[maker]
    check_refused(TypeError, f"'{name}'", make, **{**parameters, name: bad})


@pytest.mark.parametrize("bad", [1.0, 1.5, np.nextafter(1.0, 2.0)])
def test_alpha_must_be_below_one(bad):
    check_refused(ValueError, "^alpha must lie between 0 and 1", cf.alpha_to_tau, bad, 1.0)


REFUSED_DESIGNS = [
    # Gains that vanish or overflow.
    ("^tau must give coefficients and gains that are finite", cf.FirstOrder, (1e-320,), {}),
    ("^omega0 must give coefficients and gains that are finite", cf.Butterworth, (1e200, 3), {}),
    ("^omega0 must give coefficients and gains that are finite", cf.Butterworth, (1e-200, 3), {}),
    # Orders and splits.
    ("^order must lie between 1 and 6, got 0", cf.Butterworth, (1.0, 0), {}),
    ("^order must lie between 1 and 6, got 7", cf.Butterworth, (1.0, 7), {}),
    ("^order must", cf.Butterworth, (1.0, -1), {}),
    ("^q must be 1 unless order is 2", cf.Butterworth, (1.0, 3), {"q": 0.5}),
    ("^q must be 1 unless order is 2", cf.Butterworth, (1.0, 1), {"q": math.nan}),
    ("^split must lie between 1 and", cf.Butterworth, (1.0, 3), {"split": 0}),
    ("^split must lie between 1 and", cf.Butterworth, (1.0, 3), {"split": 4}),
    ("^split must", cf.Butterworth, (1.0, 3), {"split": -1}),
    # Chains.
    ("^coefficients must be 1 to 6 numbers, got 0", cf.Chain, ([],), {}),
    ("^coefficients must be 1 to 6 numbers, got 7", cf.Chain, ([1.0] * 7,), {}),
    ("^coefficients must be positive and finite", cf.Chain, ([1.0, 0.0],), {}),
    ("^coefficients must be positive and finite", cf.Chain, ([1.0, math.nan],), {}),
    ("^coefficients must be positive and finite", cf.Chain, ([math.inf],), {}),
    ("^coefficients must be positive and finite", cf.Chain, ([-1.0],), {}),
    ("^coefficients must belong to a stable filter", cf.Chain, ([1.0, 1.0, 1.0],), {}),
    ("^coefficients must belong to a stable filter", cf.Chain, ([1.0, 1.0, 2.0],), {}),
    ("^coefficients must belong to a stable filter", cf.Chain, ([1.0, 3.0, 1.0, 3.0],), {}),
    ("stable filter", cf.ThirdOrder.from_gains, (1.0, 1.0, 1.0), {}),
    ("^derivative_order must", cf.Chain, ([1.0, 2.0],), {"derivative_order": 0}),
    ("^derivative_order must", cf.Chain, ([1.0, 2.0],), {"derivative_order": 3}),
    ("^derivative_order must", cf.Chain, ([1.0, 2.0],), {"derivative_order": -1}),
    ("^split must be the order unless derivative_order is 1", cf.Chain, ([1.0, 2.0], 2, 1), {}),
    ("^split must", cf.Chain, ([1.0, 2.0],), {"split": 3}),
    ("^split must", cf.Chain, ([1.0, 2.0],), {"split": 0}),
]


@pytest.mark.parametrize(("pattern", "make", "arguments", "keywords"), REFUSED_DESIGNS)
def test_designs_that_cannot_work(pattern, make, arguments, keywords):
    check_refused(ValueError, pattern, make, *arguments, **keywords)


@pytest.mark.parametrize("bad", [2.5, "2", None])
def test_orders_must_be_whole_numbers(bad):
    check_refused(TypeError, "'order'", cf.Butterworth, 1.0, order=bad)
    check_refused(TypeError, "'derivative_order'", cf.Chain, [1.0], derivative_order=bad)


@pytest.mark.parametrize("bad", [1.0, "12", None, ["1"]])
def test_coefficients_must_be_a_sequence_of_numbers(bad):
    check_refused(TypeError, "'coefficients'", cf.Chain, bad)


def test_parameters_that_vanish_in_single_precision_are_refused_when_it_is_used():
    design = cf.FirstOrder(1e-50)
    assert design.filter(Y, U, fs=FS).dtype == float
    check_refused(ValueError, "^tau must", design.filter, Y.astype("f4"), U.astype("f4"), fs=FS)
    check_refused(ValueError, "^tau must", design.stream, fs=FS, dtype="f4")


# --------------------------------------------------------------------------------------------------------------- calls


def calls(design, y, u, **keywords):
    """The three ways to run a filter."""
    yield lambda: design.filter(y, u, **keywords)
    yield lambda: design.estimate(y, u, **keywords)
    clock = {key: keywords.pop(key) for key in ("t",) if key in keywords}
    yield lambda: design.stream(**keywords).process(y, u, **clock)


BAD_KEYWORDS = [
    ("^fs must be positive and finite", {"fs": 0.0}),
    ("^fs must be positive and finite", {"fs": -FS}),
    ("^fs must be positive and finite", {"fs": math.nan}),
    ("^fs must be positive and finite", {"fs": math.inf}),
    ("^give fs in Hz or t in seconds, one of them", {}),
    ("^give fs in Hz or t in seconds, one of them", {"fs": FS, "t": T}),
    ("^t must not run backwards: row 1 is", {"t": T[::-1]}),
    ("^t must not run backwards: row 3 is", {"t": [0.0, 1.0, 2.0, 1.5, 3.0, 4.0]}),
    ("^t must be finite: row 0 is NaN", {"t": [math.nan, 1, 2, 3, 4, 5]}),
    ("^t must be finite: row 4 is inf", {"t": [0, 1, 2, 3, math.inf, 5]}),
    (r"^t must have the shape \(6,\).*got \[5\]", {"t": T[:5]}),
    (r"^t must have the shape \(6,\).*got \[6, 1\]: time is axis 0", {"t": T[:, None]}),
    (r"^t must have the shape \(6,\).*got \[\]", {"t": 1.0}),
    ('^rule must be "backward_euler" or "matched", got "euler"', {"fs": FS, "rule": "euler"}),
    ('^input must be "sample" or "trapezoid", got "mean"', {"fs": FS, "input": "mean"}),
    ('^missing must be "coast" or "raise", got "skip"', {"fs": FS, "missing": "skip"}),
    ('^backwards must be "raise" or "restart", got "sort"', {"fs": FS, "backwards": "sort"}),
    ("^period must be positive and finite", {"fs": FS, "period": 0.0}),
    ("^period must be positive and finite", {"fs": FS, "period": -1.0}),
    ("^period must be positive and finite", {"fs": FS, "period": math.nan}),
    ("^period must be positive and finite", {"fs": FS, "period": math.inf}),
    ("^hold must be finite and not negative", {"fs": FS, "hold": -0.1}),
    ("^hold must be finite and not negative", {"fs": FS, "hold": math.nan}),
    ("^gap_cap must be positive and finite", {"fs": FS, "gap_cap": 0.0}),
    ("^gap_cap must be positive and finite", {"fs": FS, "gap_cap": math.nan}),
    ("^delay must be finite and not negative", {"fs": FS, "delay": -0.01}),
    ("^delay must be finite and not negative", {"fs": FS, "delay": math.nan}),
    ("^delay must be finite and not negative", {"fs": FS, "delay": math.inf}),
    ("^delay must be shorter than 0.785398 s, .* unstable, got 0.8 s", {"fs": FS, "delay": 0.8}),
    ("^workers must be 1 or more", {"fs": FS, "workers": 0}),
    ("^workers must be 1 or more", {"fs": FS, "workers": -2}),
    (r"^initial must be .*got the shape \[3\]", {"fs": FS, "initial": [1.0, 2.0, 3.0]}),
    (r"^initial must be .*got the shape \[2, 2\]", {"fs": FS, "initial": np.zeros((2, 2))}),
    (r"^initial must be .*got the shape \[0\]", {"fs": FS, "initial": []}),
    ("^initial must be finite, got NaN", {"fs": FS, "initial": math.nan}),
    ("^initial must be finite, got inf", {"fs": FS, "initial": [math.inf]}),
]


@pytest.mark.parametrize(("pattern", "keywords"), BAD_KEYWORDS)
def test_keywords_that_cannot_work(pattern, keywords):
    for call in calls(FIRST, Y, U, **keywords):
        check_refused(ValueError, pattern, call)


@pytest.mark.parametrize("name", ["fs", "period", "delay", "hold", "gap_cap", "workers"])
def test_keywords_must_be_numbers(name):
    for call in calls(FIRST, Y, U, **{"fs": FS, name: "1"}):
        check_refused(TypeError, f"'{name}'", call)


def test_signals_come_first_and_all_else_by_name():
    check_refused(TypeError, "positional", FIRST.filter, Y, U, FS)
    check_refused(TypeError, "cutoff", FIRST.filter, Y, U, cutoff=1.0)
    check_refused(TypeError, "derivative", FIRST.filter, Y, fs=FS)


def test_single_precision_checks_the_rate_in_single_precision():
    y, u = Y.astype("f4"), U.astype("f4")
    for fs in (1e-46, 1e39):
        check_refused(ValueError, "^fs must be positive and finite", FIRST.filter, y, u, fs=fs)


@pytest.mark.parametrize("design", [SPLIT, cf.Chain([3.0, 3.0, 1.0], split=2), RATE])
def test_matched_needs_split_equal_to_order(design):
    for call in calls(design, Y, U, fs=FS, rule="matched"):
        check_refused(ValueError, '^rule must be "backward_euler" for a split', call)
    check_refused(ValueError, "^rule must", design.frequency_response, [1.0], fs=FS, rule="matched")


@pytest.mark.parametrize("case", [case for case in PLAIN if not case.is_rate], ids=lambda case: case.name)
def test_delay_is_refused_where_the_loop_becomes_unstable(case):
    """Just below the limit in the message the loop is stable, just above it grows; all in small steps."""
    with pytest.raises(ValueError, match=r"^delay must be shorter than") as caught:
        case.design.filter(Y, U, fs=FS, delay=1e9)
    limit = float(re.search(r"than ([0-9.e-]+) s", str(caught.value))[1])
    fs, count = 100 / limit, 6000
    impulse = np.zeros(count)
    impulse[:3] = 1.0
    answer = np.abs(case.design.filter(impulse, np.zeros(count), fs=fs, delay=0.9 * limit, initial=0.0))
    assert answer[-500:].max() < answer.max()
    check_refused(ValueError, "^delay", case.design.filter, Y, U, fs=FS, delay=1.01 * limit)


# -------------------------------------------------------------------------------------------------------------- shapes


SHAPES = [
    ("must have the same shape, got \\[6\\] and \\[5\\]$", (6,), (5,)),
    ("must have the same shape, got \\[6\\] and \\[6, 1\\]$", (6,), (6, 1)),
    ("must have the same shape, got \\[6, 2\\] and \\[6, 3\\]$", (6, 2), (6, 3)),
    ("same shape, .*: derivative looks transposed, time is axis 0", (6, 3), (3, 6)),
    (r"^measurement has the shape \(3, 100\) and looks transposed.*Pass measurement.T", (3, 100), (3, 100)),
    (r"^measurement must have the shape \(samples,\) or \(samples, channels\), got \[\]", (), ()),
    (r"^measurement must have the shape .*got \[2, 3, 4\]", (2, 3, 4), (2, 3, 4)),
]


@pytest.mark.parametrize(("pattern", "first", "second"), SHAPES)
def test_shapes_that_cannot_work(pattern, first, second):
    y, u = np.zeros(first), np.zeros(second)
    for call in (FIRST.filter, FIRST.estimate):
        check_refused(ValueError, pattern, call, y, u, fs=FS)


def test_few_samples_of_many_channels_go_through_a_stream():
    """As the message about transposed arrays says."""
    block = np.ones((3, 100))
    got = FIRST.stream(fs=FS, channels=100).process(block, block)
    for channel in (0, 99):
        assert_same_bits(got[:, channel], FIRST.filter(block[:, channel], block[:, channel], fs=FS))


@pytest.mark.parametrize("shape", [(17, 200), (16, 16), (3, 30), (1, 10), (1, 16)])
def test_ordinary_shapes_are_not_called_transposed(shape):
    assert FIRST.filter(np.zeros(shape), np.zeros(shape), fs=FS).shape == shape


@pytest.mark.parametrize("case", PLAIN + MATCHED, ids=lambda case: case.name)
@pytest.mark.parametrize("shape", [(0,), (0, 3), (5, 0), (0, 0)])
def test_nothing_in_nothing_out(case, shape):
    empty = np.zeros(shape)
    order = case.design.order
    for keywords in ({"fs": FS}, {"t": np.arange(float(shape[0]))}, {"fs": FS, "workers": 3}):
        assert case.design.filter(empty, empty, rule=case.rule, **keywords).shape == shape
        estimate = case.design.estimate(empty, empty, rule=case.rule, **keywords)
        assert estimate.levels.shape == (order, *shape)
        assert estimate.flags.shape == shape
        assert set(estimate.counts.values()) == {0}
    assert case.design.filter([], [], fs=FS, rule=case.rule).shape == (0,)


@pytest.mark.parametrize("case", PLAIN + MATCHED, ids=lambda case: case.name)
def test_one_sample(case):
    """With times the only step lasts no time: nothing moves. Without a start it is the measurement itself."""
    keywords = {"rule": case.rule}
    assert case.design.filter([0.5], [0.0], fs=FS, **keywords) == [0.5]
    assert case.design.filter([0.5], [7.0], t=[3.0], **keywords) == [0.5]
    if not case.is_rate:
        assert case.design.filter([0.5], [7.0], t=[3.0], initial=0.25, **keywords) == [0.25]
    assert case.design.filter([[0.5, 1.0]], [[0.0, 0.0]], fs=FS, **keywords).tolist() == [[0.5, 1.0]]
    np.testing.assert_array_equal(case.design.filter([math.nan], [0.0], fs=FS, **keywords), [math.nan])


# -------------------------------------------------------------------------------------------------------------- missing


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("clock", [{"fs": FS}, {"t": T}])
def test_missing_raise_names_signal_and_row(bad, clock):
    holed = Y.copy()
    holed[4] = bad
    keywords = {"missing": "raise", **clock}
    pattern = "^{} has a missing sample .*row 4, column 0.*missing is"
    for call in (FIRST.filter, FIRST.estimate):
        check_refused(ValueError, pattern.format("measurement"), call, holed, U, **keywords)
        check_refused(ValueError, pattern.format("derivative"), call, Y, holed, **keywords)
    wide = np.zeros((6, 3))
    wide[2, 1] = bad
    pattern = "^measurement has .*row 2, column 1"
    check_refused(ValueError, pattern, FIRST.filter, wide, np.zeros((6, 3)), **keywords)


def test_missing_raise_in_a_stream_names_its_own_arguments_and_keeps_the_state():
    stream = FIRST.stream(fs=FS, missing="raise", initial=0.5)
    before = stream.state
    bad = np.array([0.0, math.nan])
    check_refused(ValueError, "^y has a missing sample", stream.process, bad, np.zeros(2))
    check_refused(ValueError, "^u has a missing sample", stream.estimate, np.zeros(2), bad)
    check_refused(ValueError, "is missing", stream.update, math.nan, 0.0)
    check_refused(ValueError, "is missing", stream.update, 0.0, math.inf)
    check_refused(ValueError, "is missing", stream.predict, math.nan)
    check_refused(ValueError, "is missing", stream.correct, math.nan)
    assert stream.state == before


# ------------------------------------------------------------------------------------------------------------------ out


def frozen(array):
    array.flags.writeable = False
    return array


def unaligned(count):
    return np.zeros(count, dtype=[("tag", "u1"), ("value", "f8")])["value"]


BAD_OUTPUTS = [
    (TypeError, "^out must be a numpy array of dtype float64", np.zeros(6, "f4")),
    (TypeError, "^out must be a numpy array of dtype float64", np.zeros(6, ">f8")),
    (TypeError, "^out must be a numpy array of dtype float64", np.zeros(6, int)),
    (TypeError, "^out must be a numpy array of dtype float64", [0.0] * 6),
    (ValueError, r"^out must have the shape \[6\].*got \[5\]", np.zeros(5)),
    (ValueError, r"^out must have the shape \[6\].*got \[6, 1\]", np.zeros((6, 1))),
    (ValueError, "^out must be writable", frozen(np.zeros(6))),
    (ValueError, "^out must be writable", np.broadcast_to(np.zeros(1), (6,))),
    (ValueError, "^out must be aligned", unaligned(6)),
]


@pytest.mark.parametrize(("kind", "pattern", "out"), BAD_OUTPUTS)
def test_out_must_fit(kind, pattern, out):
    check_refused(kind, pattern, FIRST.filter, Y, U, fs=FS, out=out)


def test_out_must_have_the_precision_of_the_result():
    y, u = Y.astype("f4"), U.astype("f4")
    check_refused(TypeError, "^out must .*float32", FIRST.filter, y, u, fs=FS, out=np.zeros(6))


def test_out_keeps_its_numbers_where_the_call_is_refused():
    out = np.full(6, 7.0)
    holed = np.where(np.arange(6) == 3, math.nan, Y)
    check_refused(ValueError, "missing", FIRST.filter, holed, U, fs=FS, missing="raise", out=out)
    check_refused(ValueError, "backwards", FIRST.filter, Y, U, t=T[::-1], out=out)
    np.testing.assert_array_equal(out, 7.0)


# --------------------------------------------------------------------------------------------------------------- states

FOREIGN = [
    ("^the state is of order 2 .* order 1", PI.stream(initial=0.0)),
    ("^the state is of order 1 with 2 channels", FIRST.stream(channels=2, initial=0.0)),
    ("^the state is of dtype float32, the filter of dtype float64", FIRST.stream(dtype="f4", initial=0.0)),
    ("^the state belongs to another kind of filter", RATE.stream(initial=0.0)),
    ("^the state belongs to another kind of filter", FIRST.stream(delay=0.1, initial=0.0)),
]


@pytest.mark.parametrize(("pattern", "other"), FOREIGN)
def test_foreign_states_are_refused_and_change_nothing(pattern, other):
    check_refused(ValueError, pattern, FIRST.filter, Y, U, fs=FS, initial=other.state)
    stream = FIRST.stream(initial=5.0)
    before = stream.state
    check_refused(ValueError, pattern, stream.reset, other.state)
    check_refused(ValueError, pattern, setattr, stream, "state", other.state)
    assert stream.state == before
    stream = other
    before = stream.state
    check_refused(ValueError, "state", setattr, stream, "state", FIRST.stream(initial=5.0).state)
    assert stream.state == before


@pytest.mark.parametrize("bad", [math.nan, [1.0, 2.0, 3.0], [[1.0, 2.0]]])
def test_reset_that_is_refused_changes_nothing(bad):
    stream = PI.stream(fs=FS, initial=[1.0, 2.0])
    before = stream.state
    check_refused(ValueError, "^initial must", stream.reset, bad)
    assert stream.state == before


@pytest.mark.parametrize("bad", [None, 1.0, [1.0]])
def test_state_must_be_a_state(bad):
    stream = FIRST.stream(fs=FS)
    check_refused(TypeError, "State", setattr, stream, "state", bad)


def test_states_are_not_made_by_hand():
    kind = FIRST.stream(fs=FS).state.kind
    check_refused(ValueError, "^numbers must hold", cf.State, 2, "float64", None, kind, [[1.0]])
    check_refused(ValueError, "^order must", cf.State, 2**62, "float64", None, kind, [])
    check_refused(TypeError, "numbers", cf.State, 2, "float64", None, kind)
    short = cf.State(1, "float64", None, kind, [[1.0]])
    check_refused(ValueError, "^the state belongs to another kind", FIRST.filter, Y, U, fs=FS, initial=short)


# -------------------------------------------------------------------------------------------------------------- streams

BAD_STREAMS = [
    (ValueError, "^channels must be 1 or more", {"channels": 0}),
    (ValueError, "^channels must be 1 or more", {"channels": -1}),
    (TypeError, "^dtype must be float32 or float64, got float16", {"dtype": "f2"}),
    (TypeError, "^dtype must be float32 or float64, got int64", {"dtype": np.int64}),
    (TypeError, "^dtype must be float32 or float64, got bool", {"dtype": bool}),
    (TypeError, "'nonsense'", {"dtype": "nonsense"}),
    (ValueError, "^fs must be positive and finite", {"fs": 0.0}),
    (
        ValueError,
        r"^initial must be .*\(2, 3\).*got the shape \[3, 2\]",
        {"channels": 3, "initial": np.zeros((3, 2))},
    ),
]


@pytest.mark.parametrize(("kind", "pattern", "keywords"), BAD_STREAMS)
def test_streams_that_cannot_work(kind, pattern, keywords):
    check_refused(kind, pattern, PI.stream, **keywords)


@pytest.mark.parametrize("bad", [-0.01, -math.inf, math.nan, math.inf])
def test_dt_must_be_finite_and_not_negative(bad):
    for fs in (None, FS):
        stream = FIRST.stream(fs=fs, initial=0.5)
        before = stream.state
        check_refused(ValueError, "^dt must be finite and not negative", stream.update, 0.0, 0.0, bad)
        check_refused(ValueError, "^dt must be finite and not negative", stream.predict, 0.0, bad)
        assert stream.state == before


def test_dt_is_needed_without_a_rate():
    stream = FIRST.stream(initial=0.5)
    check_refused(ValueError, "^give dt in seconds: this stream has no fs", stream.update, 0.0, 0.0)
    check_refused(ValueError, "^give dt in seconds: this stream has no fs", stream.predict, 0.0)
    check_refused(ValueError, "^give fs in Hz or t in seconds", stream.process, Y, U)
    check_refused(ValueError, "^give fs in Hz or t in seconds", FIRST.stream(fs=FS).process, Y, U, T)


BAD_BLOCKS = [
    (None, (6, 2), r"^this stream has one channel: .*got \[6, 2\]; use stream\(channels=2\)"),
    (2, (6,), r"^this stream has 2 channels: .*\(samples, 2\), got \[6\]"),
    (2, (6, 3), r"^this stream has 2 channels: .*got \[6, 3\]"),
    (2, (2, 6), r"^this stream has 2 channels: .*got \[2, 6\]"),
]


@pytest.mark.parametrize(("channels", "shape", "pattern"), BAD_BLOCKS)
def test_blocks_must_have_the_streams_channels(channels, shape, pattern):
    stream = FIRST.stream(fs=FS, channels=channels)
    for call in (stream.process, stream.estimate):
        check_refused(ValueError, pattern, call, np.zeros(shape), np.zeros(shape))


def test_blocks_must_have_the_same_shape():
    stream = FIRST.stream(fs=FS, channels=2)
    pattern = r"^y and u must have the same shape, got \[6, 2\] and \[5, 2\]"
    check_refused(ValueError, pattern, stream.process, np.zeros((6, 2)), np.zeros((5, 2)))
    pattern = "u looks transposed, time is axis 0"
    check_refused(ValueError, pattern, stream.process, np.zeros((6, 2)), np.zeros((2, 6)))


@pytest.mark.parametrize("bad", [1.0, [1.0], [1.0, 2.0, 3.0], [[1.0, 2.0]]])
def test_samples_must_have_the_streams_channels(bad):
    stream = FIRST.stream(fs=FS, channels=2, initial=0.0)
    before = stream.state
    good = [1.0, 2.0]
    check_refused(ValueError, r"^y must have the shape \[2\], got", stream.update, bad, good)
    check_refused(ValueError, r"^u must have the shape \[2\], got", stream.update, good, bad)
    check_refused(ValueError, r"^u must have the shape \[2\], got", stream.predict, bad)
    check_refused(ValueError, r"^y must have the shape \[2\], got", stream.correct, bad)
    assert stream.state == before


@pytest.mark.parametrize("bad", [[1.0], [1.0, 2.0], [[1.0]]])
def test_samples_of_one_channel_are_numbers(bad):
    stream = FIRST.stream(fs=FS, initial=0.0)
    check_refused(ValueError, r"^y must have the shape \[\], got", stream.update, bad, 0.0)
    check_refused(ValueError, r"^u must have the shape \[\], got", stream.update, 0.0, bad)


def test_rate_filter_takes_both_signals_at_once():
    stream = RATE.stream(fs=FS)
    check_refused(ValueError, "^the rate filter takes both signals: use update", stream.predict, 1.0)
    check_refused(ValueError, "^the rate filter takes both signals: use update", stream.correct, 1.0)


# ----------------------------------------------------------------------------------------------- responses, attributes


def test_responses_that_cannot_work():
    check_refused(ValueError, "^omega must be finite, got NaN", FIRST.frequency_response, [1.0, math.nan])
    check_refused(ValueError, "^omega must be finite, got inf", FIRST.frequency_response, math.inf)
    for fs in (0.0, -1.0, math.nan, math.inf):
        check_refused(ValueError, "^fs must be positive", FIRST.frequency_response, [1.0], fs=fs)
    check_refused(ValueError, '^rule must .*got "x"', FIRST.frequency_response, [1.0], rule="x")


READ_ONLY = [
    (FIRST, "tau"),
    (FIRST, "order"),
    (FIRST, "coefficients"),
    (FIRST, "poles"),
    (PI, "kp"),
    (SPLIT, "split"),
    (FIRST.stream(initial=0.0).state, "levels"),
    (FIRST.stream(initial=0.0).state, "order"),
    (FIRST.estimate(Y, U, fs=FS), "levels"),
    (FIRST.estimate(Y, U, fs=FS), "state"),
    (FIRST, "cutoff"),
    (FIRST.stream(fs=FS), "fs"),
    (FIRST.stream(fs=FS), "period"),
]


@pytest.mark.parametrize(("thing", "name"), READ_ONLY)
def test_attributes_cannot_be_set(thing, name):
    check_refused(AttributeError, f"{name}|readonly", setattr, thing, name, 1.0)


def test_levels_that_a_filter_lacks():
    estimate = FIRST.estimate(Y, U, fs=FS)
    for name in ("position", "velocity", "rate"):
        check_refused(
            AttributeError, f"^this filter has no {name}; its levels are angle", getattr, estimate, name
        )
    check_refused(AttributeError, "^this filter does not estimate a bias", getattr, estimate, "bias")
    estimate = SPLIT.estimate(Y, U, fs=FS)
    check_refused(AttributeError, "^this filter does not estimate a bias", getattr, estimate, "bias")


# ------------------------------------------------------------------------------------------- found by reading the code


def test_states_of_another_family_are_refused():
    """The numbers would fit, but would mean something else."""
    state = PI.stream(fs=FS, initial=0.1).state
    for other in (cf.SecondOrderInertial(1.0), cf.Butterworth(1.0, split=1)):
        check_refused(
            ValueError, "^the state belongs to another kind", other.filter, Y, U, fs=FS, initial=state
        )
    check_refused(ValueError, "another kind", PI.filter, Y, U, fs=FS, initial=state, rule="matched")
    assert np.isfinite(cf.PiForm(3.0, 0.5).filter(Y, U, fs=FS, initial=state)).all()


def test_output_in_the_memory_of_an_input_under_another_name():
    """Two arrays of one buffer have nothing in common but the bytes."""
    buffer = bytearray(np.arange(600.0).tobytes())
    first, second = np.frombuffer(buffer), np.frombuffer(buffer)
    expected = FIRST.filter(first.copy(), np.zeros(600), fs=FS, initial=0.0)
    FIRST.filter(first, np.zeros(600), fs=FS, initial=0.0, out=second)
    assert np.array_equal(second, expected)


def test_a_step_that_overflows_is_refused():
    single = np.ones(3, np.float32)
    check_refused(
        ValueError, "^t must have steps that are finite", FIRST.filter, single, single, t=[0.0, 1.0, 1e39]
    )


def test_a_restart_is_flagged():
    ones = np.ones(3)
    estimate = FIRST.estimate(ones, ones, t=[0.0, 1.0, 0.5], backwards="restart")
    assert estimate.counts["restarted"] == 1
    acc = np.tile([0.0, 0.0, 9.81], (3, 1))
    tilt = cf.TiltFilter(FIRST).estimate(np.zeros((3, 3)), acc, t=[0.0, 1.0, 0.5], backwards="restart")
    assert tilt.counts["restarted"] == 1


def test_a_refused_block_leaves_a_tilt_stream_as_it_was():
    stream = cf.TiltFilter(PI).stream(missing="raise")
    acc = np.tile([0.0, 0.0, 9.81], (2, 1))
    stream.process(np.zeros((2, 3)), acc, [0.0, 1.0])
    before = stream.state
    check_refused(ValueError, "^gyr has a missing", stream.process, np.full((2, 3), np.nan), acc, [2.0, 3.0])
    check_refused(ValueError, "^acc has a missing", stream.process, np.zeros((2, 3)), 0 * acc, [2.0, 3.0])
    check_refused(ValueError, "zero force", stream.update, np.zeros(3), np.zeros(3), 0.1)
    assert stream.state == before


def test_the_third_level_has_a_name():
    estimate = cf.Chain([3.0, 3.0, 1.0], derivative_order=3).estimate(Y, U, fs=FS)
    assert np.array_equal(estimate.acceleration, estimate.levels[2])
