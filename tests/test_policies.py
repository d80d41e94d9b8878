"""Bad samples and odd times: each policy against a plain loop over the samples, and the same in pieces as in one."""

import itertools
import json
import math

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import compfilt as cf
from compfilt.logs.clock import Timeline
from compfilt.logs.errors import LogError, RecipeError
from compfilt.logs.faults import Faults
from compfilt.logs.judge import Judge
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.policy import Clipped, Gap, Policy, SignalPolicy, Stuck
from compfilt.logs.recipe import parse_recipe
from compfilt.logs.signals import Signal
from compfilt.logs.units import TIME, parse_unit

ACTIONS = ("coast", "hold", "reset", "fail")
RECIPE = """
version = 1
[log]
time = { column = "t", unit = "s" }
measurement = { column = "angle", unit = "deg" }
derivative = { column = "rate", unit = "deg/s" }
[filter]
kind = "pi"
kp = 2.0
ki = 1.0
[policy]
POLICY
[output]
columns = ["estimate", "flags", "faults"]
"""


def recipe_of(policy=""):
    return parse_recipe(RECIPE.replace("POLICY", policy))


def log_of(n=100, **columns):
    t = 0.01 * np.arange(n)
    rng = np.random.default_rng(n)
    return pa.RecordBatch.from_pydict(
        {"t": t, "angle": rng.normal(0.0, 10.0, n), "rate": rng.normal(0.0, 10.0, n)} | columns
    )


def run(policy, *pieces):
    pipeline = Pipeline(recipe_of(policy))
    return pa.Table.from_batches([pipeline.process(piece) for piece in pieces]), pipeline


def rows_with(table, flag, column="faults"):
    return np.flatnonzero(table.column(column).to_numpy() & np.uint8(flag)).tolist()


def cut(batch, at):
    return [batch.slice(i, j - i) for i, j in itertools.pairwise(sorted({0, batch.num_rows, *at}))]


class Slow:
    """One channel, sample by sample, as the documentation says it."""

    def __init__(self, policy):
        self.policy = policy
        self.good = math.nan
        self.value, self.since, self.length = math.nan, 0.0, 0
        self.seen = []

    def sample(self, value, time):
        """Return the value for the filter, the faults, and whether the sample resets; None is a failure."""
        policy = self.policy
        if value == self.value:
            self.length += 1
        else:
            self.value, self.since, self.length = value, time, 1
        finite = math.isfinite(value)
        if finite:
            self.seen.append(value)
        does = {}
        if math.isnan(value):
            does[Faults.MISSING] = policy.missing
        elif not finite:
            does[Faults.INFINITE] = policy.infinite
        else:
            if policy.stuck and time - self.since > policy.stuck.longer_than:
                does[Faults.STUCK] = policy.stuck.do
            if policy.clipped and self.is_clipped(value):
                does[Faults.CLIPPED] = policy.clipped.do
        actions = set(does.values())
        result = value
        if actions & {"coast", "reset"}:
            result = math.nan
        elif "hold" in actions:
            result = self.good
        elif finite:
            self.good = value
        return result, sum(does), "reset" in actions, "fail" in actions

    def is_clipped(self, value):
        clipped = self.policy.clipped
        if clipped.high is not None and not clipped.low < value < clipped.high:
            return True
        low, high = min(self.seen), max(self.seen)
        return (
            clipped.samples is not None
            and self.length >= clipped.samples
            and value in (low, high)
            and low < high
        )


VALUES = st.lists(st.sampled_from([1.0, 1.0, 1.0, 1.0, 2.0, 3.0, -3.0, math.nan, math.inf]), max_size=40)
POLICIES = st.builds(
    SignalPolicy,
    st.sampled_from(ACTIONS),
    st.sampled_from(ACTIONS),
    st.none() | st.builds(Stuck, st.sampled_from([0.5, 1.0, 2.5]), st.sampled_from([*ACTIONS, "keep"])),
    st.none()
    | st.builds(
        lambda limit, samples, do: Clipped(-limit if limit else None, limit, samples, do),
        st.sampled_from([None, 2.5, 3.0]),
        st.sampled_from([None, 2, 3]),
        st.sampled_from([*ACTIONS, "keep"]),
    ),
)


# Row by row, or in a few pieces.
CUTS = st.just(range(1, 40)) | st.lists(st.integers(0, 40), max_size=5)


@settings(max_examples=400)
@given(VALUES, POLICIES, CUTS)
def test_samples_are_judged_as_a_plain_loop_does(values, policy, at):
    slow = Slow(policy)
    expected = [slow.sample(value, float(i)) for i, value in enumerate(values)]
    fails = [i for i, (*_, fail) in enumerate(expected) if fail]
    judge = judge_of(policy)
    results, faults, restarts, failure = [], [], [], None
    for i, j in itertools.pairwise(sorted({0, len(values), *(place for place in at if place < len(values))})):
        judge = copied(judge, policy)
        verdict = judge.process(np.array(values[i:j]), np.arange(i, j, dtype=float), i + 1)
        if verdict.failure is not None:
            failure = verdict.failure
            assert failure[0] + i == fails[0]
            assert failure[1].startswith(f"row {fails[0] + 1} ")
            break
        results += verdict.values.tolist()
        faults += [0] * (j - i) if verdict.faults is None else verdict.faults.tolist()
        restarts += [False] * (j - i) if verdict.restarts is None else verdict.restarts.tolist()
    assert (failure is not None) == bool(fails)
    if fails:
        return
    plain = [math.nan if math.isinf(value) and policy.infinite != "hold" else value for value, *_ in expected]
    np.testing.assert_array_equal([math.nan if math.isinf(v) else v for v in results], plain)
    assert faults == [fault for _, fault, *_ in expected]
    resets = [False, *(reset for _, _, reset, _ in expected)]
    assert restarts == [before and not now for before, now in itertools.pairwise(resets)]
    counts = {kind: sum(bool(fault & kind) for fault in faults) for kind in judge.counts["x"]}
    assert judge.counts["x"] == counts


def judge_of(policy):
    return Judge(Signal("x", ("x",), parse_unit("1"), (1.0,)), policy, np.float64)


def copied(judge, policy):
    """A new one that goes on from the state, by way of JSON, as after a crash."""
    copy = judge_of(policy)
    copy.state = json.loads(json.dumps(judge.state))
    return copy


TIMES = st.lists(st.sampled_from([0.0, 1.0, 1.0, 1.0, 1.25, 5.0, -1.0, -3.0]), min_size=1, max_size=40)
CLOCKS = st.builds(
    lambda duplicate, backwards, gap: Policy(duplicate=duplicate, backwards=backwards, gap=gap),
    st.sampled_from([*ACTIONS, "keep"]),
    st.sampled_from(ACTIONS),
    st.none() | st.builds(Gap, st.just(2.0), st.sampled_from(ACTIONS)),
)


def judge_times(times, policy, at):
    """Judge times in pieces, each by a timeline that goes on from the state of the one before."""
    timeline = Timeline("t", parse_unit("s"), policy)
    parts = []
    for i, j in itertools.pairwise(sorted({0, len(times), *(place for place in at if place < len(times))})):
        copy = Timeline("t", parse_unit("s"), policy)
        copy.state = json.loads(json.dumps(timeline.state))
        timeline = copy
        timing = timeline.judge(timeline.seconds(times[i:j]), i + 1)
        if timing.failure is not None:
            return timing.failure[1], None, None
        parts.append(timing)
    joined = [
        np.concatenate([getattr(part, name) for part in parts]).tolist()
        for name in ("seconds", "faults", "coasting", "holding", "restarts")
    ]
    return None, joined, timeline.state


@settings(max_examples=400)
@given(TIMES, CLOCKS, CUTS)
def test_times_are_judged_the_same_in_pieces(steps, policy, at):
    times = np.cumsum(steps)
    assert judge_times(times, policy, at) == judge_times(times, policy, [])


@given(TIMES, CLOCKS)
def test_times_are_judged_as_a_plain_loop_does(steps, policy):
    times = np.cumsum(steps)
    failure, judged, _ = judge_times(times, policy, [])
    seconds, faults, out_of_use, restarts = [], [], [], []
    clamps = policy.backwards in ("coast", "hold")
    left_out, latest, fails = 0.0, times[0], []
    for i, time in enumerate(times):
        before, fault, action = latest, 0, set()
        if i and time < before:
            fault, action = Faults.BACKWARDS, {policy.backwards}
        elif i and time == before:
            fault, action = Faults.DUPLICATE, {policy.duplicate}
        elif i and policy.gap and time - before > policy.gap.longer_than:
            fault, action = Faults.GAP, {policy.gap.do} & {"reset", "fail"}
            left_out += (time - before) * (policy.gap.do == "hold")
        latest = max(time, before) if clamps else time
        seconds.append(latest - left_out)
        faults.append(int(fault))
        out_of_use.append("coast" if "coast" in action else "hold" if "hold" in action else "")
        restarts.append("reset" in action)
        fails += [i] * ("fail" in action)
    assert (failure is not None) == bool(fails)
    if fails:
        assert failure.startswith(f"row {fails[0] + 1}")
        return
    assert judged[0] == seconds
    assert judged[1] == faults
    assert judged[2] == [use == "coast" for use in out_of_use]
    assert judged[3] == [use == "hold" for use in out_of_use]
    assert judged[4] == restarts


MESSY = """
missing = "hold"
duplicate = "coast"
backwards = "reset"
gap = { longer_than = "0.5 s", do = "hold" }
[policy.measurement]
stuck = { longer_than = "15 ms", do = "reset" }
clipped = { range = "12 deg", samples = 2, do = "coast" }
[policy.derivative]
infinite = "coast"
"""


def messy_log(n=300):
    rng = np.random.default_rng(8)
    angle, rate = (np.round(rng.normal(0.0, 5.0, n)) for _ in range(2))
    t = np.cumsum(
        rng.choice([0.0, 0.01, 0.01, 0.01, 0.01, 1.0, -0.05], n, p=[0.05, 0.3, 0.3, 0.2, 0.1, 0.03, 0.02])
    )
    angle[100:110] = 3.0
    for values in (angle, rate):
        values[rng.integers(0, n, 20)] = np.nan
        values[rng.integers(0, n, 10)] = np.inf
    return log_of(n, t=t, angle=angle, rate=rate)


@given(st.lists(st.integers(0, 300), max_size=6))
def test_a_log_with_everything_gives_the_same_bits_in_pieces(at):
    log = messy_log()
    whole, straight = run(MESSY, log)
    pieces, pipeline = run(MESSY, *cut(log, at))
    for name in whole.column_names:
        assert pieces.column(name).to_numpy().tobytes() == whole.column(name).to_numpy().tobytes()
    assert json.dumps(pipeline.state) == json.dumps(straight.state)
    found = np.bitwise_or.reduce(whole.column("faults").to_numpy())
    assert found == sum(Faults)  # or this test is weaker than it says


def test_hold_puts_the_last_good_sample_in_place():
    angle = log_of().column("angle").to_numpy().copy()
    held = angle.copy()
    angle[50:53], held[50:53] = np.nan, angle[49]
    out, _ = run('missing = "hold"', log_of(angle=angle))
    expected, _ = run("", log_of(angle=held))
    np.testing.assert_array_equal(out.column("estimate").to_numpy(), expected.column("estimate").to_numpy())
    assert rows_with(out, Faults.MISSING) == [50, 51, 52]


def test_reset_starts_anew_with_the_next_good_sample():
    log = log_of()
    angle = log.column("angle").to_numpy().copy()
    angle[50:53] = np.nan
    out, pipeline = run('missing = "reset"', log_of(angle=angle))
    alone, _ = run("", log.slice(53))
    estimate = out.column("estimate").to_numpy()
    np.testing.assert_array_equal(estimate[53:], alone.column("estimate").to_numpy())
    assert rows_with(out, cf.Flags.RESTARTED, "flags") == [53]
    assert pipeline.counts["restarted"] == 1


@pytest.mark.parametrize(
    ("policy", "column", "value", "message"),
    [
        ('missing = "fail"', "rate", np.nan, 'row 51 has no number in column "rate" (derivative)'),
        ('missing = "raise"', "rate", np.nan, 'row 51 has no number in column "rate" (derivative)'),
        (
            'infinite = "fail"',
            "angle",
            np.inf,
            'row 51 has an infinite number in column "angle" (measurement)',
        ),
        (
            '[policy.measurement]\nclipped = { range = "100 deg", do = "fail" }',
            "angle",
            -100.0,
            'row 51 is at the end of its range in column "angle" (measurement)',
        ),
    ],
)
def test_a_bad_sample_can_fail(policy, column, value, message):
    values = log_of().column(column).to_numpy().copy()
    values[50:] = value
    for at in ([], [50], [20, 70]):
        with pytest.raises(LogError) as error:
            run(policy, *cut(log_of(**{column: values}), at))
        assert str(error.value) == message


def test_the_first_row_of_all_is_named_whatever_is_wrong_with_it():
    angle, t = (log_of().column(name).to_numpy().copy() for name in ("angle", "t"))
    angle[40], t[60], t[30] = np.nan, np.nan, 0.0
    log = log_of(angle=angle, t=t)
    for at in ([], [35], [45], [61]):
        with pytest.raises(
            LogError, match=r"^row 31: time runs backwards by 0\.29 s; backwards = .coast. in \[policy\]"
        ):
            run('missing = "fail"', *cut(log, at))


def test_a_policy_of_one_signal_leaves_the_others_alone():
    angle, rate = (log_of().column(name).to_numpy().copy() for name in ("angle", "rate"))
    angle[50] = rate[60] = np.nan
    policy = 'missing = "fail"\n[policy.measurement]\nmissing = "coast"'
    with pytest.raises(LogError, match=r'^row 61 has no number in column "rate"'):
        run(policy, log_of(angle=angle, rate=rate))
    rate[60] = 0.0
    assert rows_with(run(policy, log_of(angle=angle, rate=rate))[0], Faults.MISSING) == [50]


def test_stuck_and_clipped_values_are_found_where_they_were_put():
    angle = log_of().column("angle").to_numpy().copy()
    angle[20:30] = angle[20]
    angle[60:66] = 90.0
    policy = '[policy.measurement]\nstuck = { longer_than = "45 ms", do = "keep" }\n'
    out, pipeline = run(policy + 'clipped = { samples = 3, do = "keep" }', log_of(angle=angle))
    assert rows_with(out, Faults.STUCK) == [25, 26, 27, 28, 29, 65]
    assert rows_with(out, Faults.CLIPPED) == [62, 63, 64, 65]
    counts = pipeline.judges[0].counts["angle"]
    assert (counts[Faults.STUCK], counts[Faults.CLIPPED]) == (6, 4)
    expected, _ = run("", log_of(angle=angle))
    assert out.column("estimate").equals(expected.column("estimate"))  # kept as they are


def test_a_range_holds_for_float32_and_whatever_the_units_rounding():
    recipe = parse_recipe(
        RECIPE.replace(
            "POLICY", '[policy.measurement]\nclipped = { range = "2000 deg", do = "keep" }'
        ).replace('angle", unit = "deg"', 'angle", unit = "deg", scale = 0.06103515625')
    )
    for kind in (pa.float32(), pa.float64()):
        raw = pa.array([32767.0, 32768.0, -32768.0, 0.0], kind)
        log = pa.RecordBatch.from_pydict(
            {"t": [0.0, 0.1, 0.2, 0.3], "angle": raw, "rate": pa.array([0.0] * 4, kind)}
        )
        pipeline = Pipeline(recipe, log.schema)
        assert pipeline.process(log).column("faults").to_pylist() == [0, 8, 8, 0]


def test_a_gap_that_is_held_over_does_not_exist_for_the_filter():
    t = 0.01 * np.arange(100.0)
    late = t + 7.0 * (np.arange(100) >= 50)
    out, pipeline = run('gap = { longer_than = "1 s", do = "hold" }', log_of(t=late))
    short = t - 0.01 * (np.arange(100) >= 50)
    expected, _ = run("", log_of(t=short))
    np.testing.assert_allclose(
        out.column("estimate").to_numpy(), expected.column("estimate").to_numpy(), rtol=1e-9, atol=1e-12
    )
    assert rows_with(out, Faults.GAP) == [50]
    assert pipeline.timeline.listed[0] == (51, t[49], pytest.approx(7.01))


def test_time_may_go_back_if_the_policy_says_so():
    t = 0.01 * np.arange(100)
    t[60:] -= 0.2
    log = log_of(t=t)
    anew, pipeline = run('backwards = "reset"', log)
    alone, _ = run("", log.slice(60))
    np.testing.assert_array_equal(
        anew.column("estimate").to_numpy()[60:], alone.column("estimate").to_numpy()
    )
    assert rows_with(anew, Faults.BACKWARDS) == [60]
    assert pipeline.counts["restarted"] == 1
    coasting, _ = run('backwards = "coast"', log)
    assert rows_with(coasting, Faults.BACKWARDS) == list(range(60, 79))
    assert rows_with(coasting, cf.Flags.MEASUREMENT_MISSING, "flags") == list(range(60, 79))


@pytest.mark.parametrize("kind", [np.int64, np.uint64, np.int32, np.uint32])
def test_whole_numbers_of_time_may_go_back_too(kind):
    t = (1000 + 10 * np.arange(100)).astype(kind)
    t[50] = 900
    recipe = parse_recipe(RECIPE.replace("POLICY", "").replace('"t", unit = "s"', '"t", unit = "ms"'))
    with pytest.raises(
        LogError, match=r"^row 51: time runs backwards by 0\.59 s; backwards = .coast. in \[policy\]"
    ):
        Pipeline(recipe).process(log_of(t=t))


@pytest.mark.parametrize("at", [(), (45,), (50,), (1, 49, 51)])
def test_a_whole_number_of_time_that_is_missing_is_named_however_the_log_is_cut(at):
    ticks = [10**18 + 10**7 * i for i in range(100)]
    ticks[50] = None
    recipe = parse_recipe(
        RECIPE.replace("POLICY", 'gap = { longer_than = "1 s", do = "fail" }').replace(
            '"t", unit = "s"', '"t", unit = "ns"'
        )
    )
    pipeline = Pipeline(recipe)
    pieces = cut(log_of(t=pa.array(ticks, pa.int64())), at)
    with pytest.raises(LogError, match=r'^row 51 has no time in column "t"$'):
        list(map(pipeline.process, pieces))


@pytest.mark.parametrize("kind", [np.uint8, np.int8, np.uint16, np.int16, np.uint32, np.int32])
def test_narrow_whole_numbers_of_time_run_over_their_whole_range(kind):
    ends = np.iinfo(kind)
    ticks = np.linspace(ends.min, ends.max, 40).astype(kind)
    for first in (0, 20):
        timeline = Timeline("t", parse_unit("us", TIME), Policy())
        timeline.seconds(ticks[first : first + 1])
        expected = 1e-6 * (ticks.astype(float) - float(ticks[first]))
        np.testing.assert_allclose(timeline.seconds(ticks), expected, rtol=1e-12)


def test_an_array_counts_the_channels_it_uses_only():
    judge = Judge(Signal("x", ("a", None), parse_unit("1"), (1.0, 1.0)), SignalPolicy("fail"), np.float64)
    verdict = judge.process(np.array([[1.0, np.nan], [2.0, np.nan]]), None, 1)
    assert verdict.failure is None
    assert verdict.faults is None
    assert (judge.smallest[0], judge.largest[0]) == (1.0, 2.0)


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        ('missing = "drop"', '[policy] missing has no choice "drop"'),
        ('stuck = { longer_than = "1 s" }', "[policy.stuck] do is missing"),
        ('stuck = { longer_than = 0, do = "keep" }', "[policy.stuck] longer_than must be positive"),
        ('clipped = { range = "2 deg" }', "[policy.clipped] range belongs to one signal"),
        ("clipped = { samples = 1 }", "[policy.clipped] samples must be at least 2"),
        ('clipped = { do = "keep" }', "[policy.clipped] needs range = "),
        ('[policy.measurement]\nclipped = { range = "2 m" }', "[policy.measurement.clipped] range is wrong"),
        ("[policy.measurement]\nclipped = { range = -2 }", "range must be positive, or two limits"),
        ("[policy.measurement]\nclipped = { range = [2, 1] }", "must hold two limits, the lower one first"),
        ("[policy.measurment]", '[policy] has no key "measurment" (did you mean "measurement"?)'),
        ("[policy.measurement]\nhold = 1", '[policy.measurement] has no key "hold"'),
        ('backwards = "keep"', '[policy] backwards has no choice "keep"'),
    ],
)
def test_wrong_policies_are_named(policy, message):
    with pytest.raises(RecipeError) as error:
        recipe_of(policy)
    assert message in str(error.value)


@pytest.mark.parametrize("key", ["duplicate", "backwards"])
def test_a_constant_rate_has_no_odd_times(key):
    text = RECIPE.replace('time = { column = "t", unit = "s" }', "rate = 100.0")
    with pytest.raises(RecipeError, match=rf"\[policy\] {key} needs \[log\] time"):
        parse_recipe(text.replace("POLICY", f'{key} = "reset"'))
    parse_recipe(text.replace("POLICY", 'stuck = { longer_than = 1, do = "coast" }'))
