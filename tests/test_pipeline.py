"""The pipeline: the same bits however the log is cut, and every policy does what it says."""

import itertools
import pickle
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import compfilt as cf
from compfilt.logs.errors import LogError, RecipeError
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.recipe import load_recipe, parse_recipe

EXAMPLES = Path(__file__).parents[1] / "examples"

TILT = """
version = 1
[log]
time = { column = "t", unit = "ms" }
gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }
accelerometer = { columns = ["ax", "ay", "az"], unit = "g" }
axes = "flu"
[filter]
kind = "tilt"
design = { kind = "pi", kp = 2.0, ki = 0.5 }
[policy]
gap = { longer_than = "1 s", do = "reset" }
[output]
columns = ["roll", "pitch", "bias", "flags"]
unit = "deg"
keep = ["t", "note"]
"""

TWO = """
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
gap = { longer_than = 0.5, do = "coast" }
[output]
columns = ["estimate", "bias", "level1", "flags"]
"""

DEGREE = np.pi / 180.0


def tilt_log(n=400, seed=0):
    """A log with missing fields, a gap, and a repeated time."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(5.0, 15.0, n))
    t[n // 2 :] += 5000.0
    t[n // 4] = t[n // 4 - 1]
    columns = {name: rng.normal(0.0, 20.0, n) for name in ("gx", "gy", "gz")}
    columns |= {name: rng.normal(mean, 0.1, n) for name, mean in (("ax", 0.1), ("ay", 0.2), ("az", 1.0))}
    for name in ("gx", "ay", "az"):
        columns[name][rng.integers(0, n, 10)] = np.nan
    columns["ax"][n // 2 : n // 2 + 3] = np.nan  # also right after the gap
    return pa.RecordBatch.from_pydict({"t": t, "note": [f"row {i}" for i in range(n)], **columns})


def two_log(n=200, **columns):
    t = 0.01 * np.arange(n)
    return pa.RecordBatch.from_pydict(
        {"t": t, "angle": np.sin(t) / DEGREE, "rate": np.cos(t) / DEGREE} | columns
    )


def cut(batch, at):
    bounds = sorted({0, batch.num_rows, *at})
    return [batch.slice(i, j - i) for i, j in itertools.pairwise(bounds)]


def run(recipe, pieces, schema=None):
    pipeline = Pipeline(parse_recipe(recipe), schema)
    return pa.Table.from_batches([pipeline.process(piece) for piece in pieces]), pipeline


def bits(table):
    """Every value's bytes, so that NaN equals NaN and 0 is not -0."""
    return {
        name: table.column(name).to_numpy().tobytes() if name != "note" else table.column(name).to_pylist()
        for name in table.column_names
    }


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 400), max_size=6))
def test_pieces_give_the_bits_of_the_whole(at):
    log = tilt_log()
    whole, _ = run(TILT, [log])
    pieces, _ = run(TILT, cut(log, at))
    assert bits(pieces) == bits(whole)


@pytest.mark.parametrize("at", [1, 100, 200, 201, 399])
def test_pickled_in_the_middle(at):
    log = tilt_log()
    whole, straight = run(TILT, [log])
    first, second = cut(log, [at])
    pipeline = Pipeline(parse_recipe(TILT))
    head = pipeline.process(first)
    resumed = pickle.loads(pickle.dumps(pipeline))
    tail = resumed.process(second)
    assert bits(pa.Table.from_batches([head, tail])) == bits(whole)
    assert (resumed.rows, resumed.gaps, resumed.counts) == (straight.rows, straight.gaps, straight.counts)


def test_the_pieces_counts_are_those_of_the_whole():
    log = tilt_log()
    _, whole = run(TILT, [log])
    _, pieces = run(TILT, cut(log, range(0, 400, 7)))
    assert (whole.rows, whole.gaps) == (400, 1)
    assert pieces.counts == whole.counts
    assert sum(whole.counts.values()) > 0


def test_an_empty_batch_changes_nothing():
    log = tilt_log()
    whole, _ = run(TILT, [log])
    empty, _ = run(TILT, [log.slice(0, 0), log.slice(0, 50), log.slice(50, 0), log.slice(50)])
    assert bits(empty) == bits(whole)


def test_two_signals_are_those_of_the_library():
    log = two_log()
    out, _ = run(TWO, [log])
    t, angle, rate = (log.column(name).to_numpy() for name in ("t", "angle", "rate"))
    expected = cf.PiForm(kp=2.0, ki=1.0).stream().estimate(angle * DEGREE, rate * DEGREE, t)
    np.testing.assert_array_equal(out.column("estimate").to_numpy(), expected.levels[0] / DEGREE)
    np.testing.assert_array_equal(out.column("level1").to_numpy(), expected.levels[1] / DEGREE)
    np.testing.assert_array_equal(out.column("bias").to_numpy(), expected.bias / DEGREE)
    np.testing.assert_array_equal(out.column("flags").to_numpy(), expected.flags)
    assert out.schema.field("flags").type == pa.uint8()


def test_tilt_is_that_of_the_library():
    log = tilt_log().slice(0, 200)  # before the gap
    out, _ = run(TILT, [log])
    gyr = np.column_stack([log.column(name).to_numpy() for name in ("gx", "gy", "gz")]) * DEGREE
    acc = np.column_stack([log.column(name).to_numpy() for name in ("ax", "ay", "az")]) * 9.80665
    stream = cf.TiltFilter(cf.PiForm(kp=2.0, ki=0.5), axes="flu").stream()
    expected = stream.estimate(gyr, acc, log.column("t").to_numpy() * 1e-3)
    np.testing.assert_array_equal(out.column("roll").to_numpy(), expected.angles[:, 0] / DEGREE)
    np.testing.assert_array_equal(out.column("pitch").to_numpy(), expected.angles[:, 1] / DEGREE)
    np.testing.assert_array_equal(out.column("pitch_bias").to_numpy(), expected.bias[:, 1] / DEGREE)
    np.testing.assert_array_equal(out.column("flags").to_numpy(), expected.flags)


def test_columns_and_their_units():
    log = tilt_log()
    out, _ = run(TILT, [log])
    assert out.column_names == ["t", "note", "roll", "pitch", "roll_bias", "pitch_bias", "flags"]
    units = [(out.schema.field(name).metadata or {}).get(b"unit") for name in out.column_names]
    assert units == [b"ms", None, b"deg", b"deg", b"deg/s", b"deg/s", None]
    assert out.column("note").to_pylist() == log.column("note").to_pylist()


def test_angles_with_the_cubes_axes_have_its_names():
    recipe = TILT.replace('"flu"', '"cube"').replace(
        '["roll", "pitch", "bias", "flags"]', '["phi2", "phi3", "bias"]'
    )
    log = tilt_log().slice(0, 200)
    out, _ = run(recipe, [log])
    assert out.column_names == ["t", "note", "phi2", "phi3", "phi2_bias", "phi3_bias"]
    gyr = np.column_stack([log.column(name).to_numpy() for name in ("gx", "gy", "gz")]) * DEGREE
    acc = np.column_stack([log.column(name).to_numpy() for name in ("ax", "ay", "az")]) * 9.80665
    stream = cf.TiltFilter(cf.PiForm(kp=2.0, ki=0.5), axes="cube").stream()
    expected = stream.process(gyr, acc, log.column("t").to_numpy() * 1e-3)
    np.testing.assert_array_equal(out.column("phi2").to_numpy(), expected[:, 0] / DEGREE)
    np.testing.assert_array_equal(out.column("phi3").to_numpy(), expected[:, 1] / DEGREE)
    with pytest.raises(RecipeError, match='this filter has no "roll"; it has phi2, phi3'):
        Pipeline(parse_recipe(recipe.replace('"phi2"', '"roll"')))


def test_the_first_missing_sample_is_named_whatever_its_signal():
    angle, rate = (two_log().column(name).to_numpy().copy() for name in ("angle", "rate"))
    angle[90] = rate[77] = np.nan
    recipe = TWO.replace("[policy]", '[policy]\nmissing = "raise"')
    for at in ([], [85]):
        with pytest.raises(LogError, match=r'^row 78 has no number in column "rate" \(derivative\)$'):
            run(recipe, cut(two_log(angle=angle, rate=rate), at))


def test_unit_and_scale_of_the_input_and_unit_of_the_output():
    log = two_log()
    flipped = two_log(
        angle=-60.0 * log.column("angle").to_numpy(), rate=log.column("rate").to_numpy() * DEGREE
    )
    recipe = TWO.replace('"angle", unit = "deg"', '"angle", unit = "deg", scale = -0.016666666666666666')
    recipe = recipe.replace('unit = "deg/s"', 'unit = "rad/s"').replace("[output]", '[output]\nunit = "rad"')
    out, _ = run(recipe, [flipped])
    expected, _ = run(TWO, [log])
    for name in ("estimate", "bias"):
        np.testing.assert_allclose(
            out.column(name).to_numpy() / DEGREE, expected.column(name).to_numpy(), rtol=1e-12, atol=1e-12
        )


def test_position_velocity_and_bias():
    recipe = """
version = 1
[log]
rate = 100.0
measurement = { column = "height", unit = "cm" }
derivative = { column = "acceleration", unit = "m/s^2" }
[filter]
kind = "third_order"
tau = 0.5
[output]
columns = ["position", "velocity", "bias", "estimate"]
unit = "m"
"""
    t = 0.01 * np.arange(2000)
    log = pa.RecordBatch.from_pydict(
        {"height": 100.0 * (3.0 + 2.0 * t), "acceleration": np.full(t.size, 0.25)}
    )
    out, _ = run(recipe, [log])
    last = {name: out.column(name)[-1].as_py() for name in out.column_names}
    assert last["position"] == pytest.approx(3.0 + 2.0 * t[-1], abs=1e-6)
    assert last["estimate"] == last["position"]
    assert last["velocity"] == pytest.approx(2.0, abs=0.01)
    assert last["bias"] == pytest.approx(0.25, abs=1e-6)
    units = {name: out.schema.field(name).metadata[b"unit"] for name in out.column_names}
    assert units == {"position": b"m", "velocity": b"m/s", "bias": b"m/s^2", "estimate": b"m"}


def single(batch, names):
    columns = {name: batch.column(name) for name in batch.schema.names}
    columns |= {name: columns[name].cast(pa.float32()) for name in names}
    return pa.RecordBatch.from_pydict(columns)


def test_float32_stays_if_all_signals_are_float32():
    log = single(two_log(), ("angle", "rate"))
    out, _ = run(TWO, [log], log.schema)
    assert out.schema.field("estimate").type == pa.float32()
    y, u = (
        (log.column(name).to_numpy().astype(float) * DEGREE).astype(np.float32) for name in ("angle", "rate")
    )
    expected = cf.PiForm(kp=2.0, ki=1.0).stream(dtype=np.float32).process(y, u, log.column("t").to_numpy())
    assert expected.dtype == np.float32
    converted = (expected.astype(float) / DEGREE).astype(np.float32)
    np.testing.assert_array_equal(out.column("estimate").to_numpy(), converted)


def test_one_float64_signal_makes_float64():
    log = single(two_log(), ("angle",))
    out, _ = run(TWO, [log], log.schema)
    assert out.schema.field("estimate").type == pa.float64()


def test_whole_numbers_are_signals_too():
    log = two_log(angle=np.arange(200), rate=np.full(200, 100))
    out, _ = run(TWO, [log], log.schema)
    floats, _ = run(TWO, [two_log(angle=np.arange(200.0), rate=np.full(200, 100.0))])
    assert bits(out) == bits(floats)


def test_an_epoch_in_nanoseconds_loses_nothing():
    recipe = TWO.replace('column = "t", unit = "s"', 'column = "t", unit = "ns"')
    ticks = 10_000_001 * np.arange(200)
    late, _ = run(recipe, cut(two_log(t=1_700_000_000_123_456_789 + ticks), [17]))
    early, _ = run(recipe, [two_log(t=ticks)])
    assert bits(late) == bits(early)


def test_time_running_backwards_names_the_row():
    t = 0.01 * np.arange(200)
    t[123] = t[120]
    with pytest.raises(
        LogError,
        match=r"^row 124: time runs backwards by 0\.02 s; backwards = .coast. in \[policy\] passes over such rows$",
    ):
        run(TWO, cut(two_log(t=t), [50, 123]))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_row_without_time(value):
    t = 0.01 * np.arange(200)
    t[60] = value
    with pytest.raises(LogError, match=r'^row 61 has no time in column "t"$'):
        run(TWO, cut(two_log(t=t), [50]))


def test_a_gap_can_fail():
    t = 0.01 * np.arange(200)
    t[100:] += 2.0
    with pytest.raises(LogError, match=r"^row 101 comes 2\.01 s after the one before: a gap$"):
        run(TWO.replace('"coast"', '"fail"'), cut(two_log(t=t), [100]))
    t = 0.01 * np.arange(200)
    out, _ = run(TWO.replace('"coast"', '"fail"'), [two_log(t=t)])
    assert out.num_rows == 200


def test_a_gap_can_start_anew():
    t = 0.01 * np.arange(200)
    t[100:] += 2.0
    log = two_log(t=t)
    out, pipeline = run(TWO.replace('"coast"', '"reset"'), [log])
    assert pipeline.gaps == 1
    assert pipeline.counts["restarted"] == 1
    assert np.flatnonzero(out.column("flags").to_numpy() & cf.Flags.RESTARTED).tolist() == [100]
    alone, _ = run(TWO, [log.slice(100)])
    np.testing.assert_array_equal(
        out.column("estimate").to_numpy()[100:], alone.column("estimate").to_numpy()
    )
    coasting, pipeline = run(TWO, [log])
    assert pipeline.gaps == 1
    assert not np.array_equal(
        coasting.column("estimate").to_numpy()[100:], alone.column("estimate").to_numpy()
    )


def test_a_gap_can_be_coasted_over():
    t = 0.01 * np.arange(200)
    t[100:] += 2.0
    log = two_log(t=t)
    out, _ = run(TWO, [log])
    y, u = (log.column(name).to_numpy() * DEGREE for name in ("angle", "rate"))
    expected = cf.PiForm(kp=2.0, ki=1.0).stream().process(y, u, t)
    np.testing.assert_array_equal(out.column("estimate").to_numpy(), expected / DEGREE)


def test_missing_samples_are_finite_flagged_and_counted():
    angle = two_log().column("angle").to_numpy().copy()
    angle[50:60] = np.nan
    log = two_log(angle=angle)
    out, pipeline = run(TWO, [log])
    assert np.isfinite(out.column("estimate").to_numpy()).all()
    flagged = out.column("flags").to_numpy() != 0
    assert flagged[50:60].all()
    assert sum(pipeline.counts.values()) >= 10


def test_null_is_missing():
    angle = two_log().column("angle").to_numpy().copy()
    angle[50:60] = np.nan
    nulls = pa.array([None if np.isnan(value) else value for value in angle])
    assert bits(run(TWO, [two_log(angle=nulls)])[0]) == bits(run(TWO, [two_log(angle=angle)])[0])


def test_missing_samples_can_be_refused():
    rate = two_log().column("rate").to_numpy().copy()
    rate[77] = np.nan
    recipe = TWO.replace("[policy]", '[policy]\nmissing = "raise"')
    with pytest.raises(LogError, match=r'^row 78 has no number in column "rate" \(derivative\)$'):
        run(recipe, cut(two_log(rate=rate), [50]))
    assert run(recipe, [two_log()])[0].num_rows == 200


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ("kp = 2.0", "kp = -2.0", r"^seat\.toml: \[filter\] .*kp"),
        (
            '"estimate", "bias"',
            '"estimates", "bias"',
            r'no "estimates" \(did you mean "estimate"\?\); it has level0, ',
        ),
        (
            'columns = ["estimate", "bias"',
            'keep = ["bias"]\ncolumns = ["bias"',
            r'"bias" stands in both columns and keep',
        ),
        ("kp = 2.0", "kp = 2.0\ninitial = [1, 2, 3]", r"^seat\.toml: \[filter\] "),
        ('kind = "pi"\nkp = 2.0\nki = 1.0', 'kind = "first_order"\ntau = 1', r'this filter has no "bias"'),
    ],
)
def test_what_the_filter_cannot_do_is_an_error_of_the_recipe(right, wrong, message):
    assert right in TWO
    with pytest.raises(RecipeError, match=message) as error:
        Pipeline(parse_recipe(TWO.replace(right, wrong), "seat.toml"))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "path",
    sorted(path for path in EXAMPLES.rglob("*.toml") if path.name != "Cargo.toml"),
    ids=lambda path: path.name,
)
def test_the_examples_can_be_built(path):
    pipeline = Pipeline(load_recipe(path))
    assert len(pipeline.schema(pa.schema([(name, pa.float64()) for name in ("t", "time", "true_roll")]))) >= 3


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ('kind = "first_order"\ntau = 0.5\nrule = "matched"\ninput = "trapezoid"', ["level0"]),
        ('kind = "butterworth"\nomega0 = 2.0\norder = 3\nsplit = 1', ["level0", "level1", "level2"]),
        ('kind = "chain"\ncoefficients = [2.0, 2.0, 1.0]', ["level2", "bias"]),
        ('kind = "rate"\ntau = 0.5', ["estimate"]),
        ('kind = "pi"\nkp = 2.0\nki = 1.0\nperiod = "360 deg"\ninitial = ["3 deg", 0.0]', ["bias"]),
    ],
)
def test_every_kind_runs(kind, names):
    recipe = TWO.replace('kind = "pi"\nkp = 2.0\nki = 1.0', kind)
    recipe = recipe.replace('["estimate", "bias", "level1", "flags"]', str(names))
    out, _ = run(recipe, cut(two_log(), [33]))
    assert out.column_names == names
    assert all(np.isfinite(out.column(name).to_numpy()).all() for name in names)


def test_options_of_the_filter_arrive():
    log = two_log()
    t, angle, rate = (log.column(name).to_numpy() for name in ("t", "angle", "rate"))
    out, _ = run(TWO.replace("ki = 1.0", 'ki = 1.0\ninitial = "3 deg"\nrule = "matched"'), [log])
    stream = cf.PiForm(kp=2.0, ki=1.0).stream(initial=3.0 * DEGREE, rule="matched")
    expected = stream.process(angle * DEGREE, rate * DEGREE, t) / DEGREE
    np.testing.assert_array_equal(out.column("estimate").to_numpy(), expected)
    log = tilt_log().slice(0, 200)
    recipe = TILT.replace(
        'kind = "tilt"', 'kind = "tilt"\nrates = "frozen"\nat = ["10 deg", 0.2]\ninitial = [0.3, "5 deg"]'
    )
    out, _ = run(recipe, [log])
    gyr = np.column_stack([log.column(name).to_numpy() for name in ("gx", "gy", "gz")]) * DEGREE
    acc = np.column_stack([log.column(name).to_numpy() for name in ("ax", "ay", "az")]) * 9.80665
    frozen = cf.TiltFilter(cf.PiForm(kp=2.0, ki=0.5), rates="frozen", at=(10.0 * DEGREE, 0.2))
    expected = frozen.stream(initial=(0.3, 5.0 * DEGREE)).process(gyr, acc, log.column("t").to_numpy() * 1e-3)
    np.testing.assert_array_equal(out.column("roll").to_numpy(), expected[:, 0] / DEGREE)


def test_hold_arrives():
    rate = two_log().column("rate").to_numpy().copy()
    rate[50:150] = np.nan
    log = two_log(rate=rate)
    short, _ = run(TWO, [log])
    long, _ = run(TWO.replace("[policy]", '[policy]\nhold = "2 s"'), [log])
    held = [
        np.count_nonzero(out.column("flags").to_numpy() & cf.Flags.DERIVATIVE_HELD) for out in (short, long)
    ]
    assert held[0] < 15
    assert held[1] == 100


def test_velocity_is_offered_by_filters_of_accelerations_only():
    with pytest.raises(RecipeError, match='this filter has no "velocity"'):
        Pipeline(parse_recipe(TWO.replace('"bias"', '"velocity"')))
