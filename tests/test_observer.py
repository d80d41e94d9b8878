"""The observer of a linear system against a plain loop, its own error dynamics, and itself in pieces."""

import copy
import math
import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import linalg, signal

import compfilt as cf
import rigid_body as rb
from designs import assert_same_bits, pickled, precisions, same
from test_array import refused

some = settings(max_examples=25)
seeds = st.integers(0, 2**32 - 1)


def random_system(rng, n, m, p, radius=0.95):
    """A plant and a gain for which plant and observer are both stable."""
    A = rng.normal(size=(n, n))
    A *= radius / max(np.abs(np.linalg.eigvals(A)).max(), 1e-3)
    B, C = rng.normal(size=(n, m)), rng.normal(size=(p, n))
    P = linalg.solve_discrete_are(A.T, C.T, np.eye(n), np.eye(p))
    return A, B, C, A @ P @ C.T @ np.linalg.inv(C @ P @ C.T + np.eye(p))


@st.composite
def systems(draw, max_order=5):
    rng = np.random.default_rng(draw(seeds))
    n = draw(st.integers(1, max_order))
    return random_system(rng, n, draw(st.integers(1, 3)), draw(st.integers(1, n)))


def noise(system, rows, seed=1, dtype=float, gaps=False):
    """y and u of unit size."""
    _, B, C, _ = system
    rng = np.random.default_rng(seed)
    y, u = rng.normal(size=(rows, len(C))), rng.normal(size=(rows, B.shape[1]))
    if gaps:
        for one in (y, u):
            one[rng.random(one.shape) < 0.2] = np.nan
    return y.astype(dtype), u.astype(dtype)


def simulated(system, u, start):
    """x of the plant itself, (samples, n)."""
    A, B, _, _ = system
    x, rows = np.array(start, dtype=float), []
    for driven in u:
        rows.append(x)
        x = A @ x + B @ driven
    return np.array(rows)


def close(got, expected, dtype=float, slack=1.0):
    """To rounding, of the size of the largest."""
    finite = np.abs(expected[np.isfinite(expected)])
    size = max(1.0, finite.max(initial=0.0))
    assert got.dtype == dtype
    np.testing.assert_allclose(got, expected, rtol=0, atol=slack * 500 * np.finfo(dtype).eps * size)


def gain_size(system):
    """What a correction through M = A^-1 L may add to rounding."""
    A, _, _, L = system
    return max(1.0, np.linalg.cond(A)) * max(1.0, np.abs(np.linalg.solve(A, L)).max())


SYSTEM = random_system(np.random.default_rng(3), 4, 2, 3)
OBSERVER = cf.Observer(*SYSTEM)


# ------------------------------------------------------------------------------------------------- against a plain loop


@precisions
@some
@given(system=systems(), seed=seeds, gaps=st.booleans(), begun=st.booleans())
def test_run_is_the_loop(dtype, system, seed, gaps, begun):
    """Predicted and filtered, with components of both signals missing."""
    assume(gain_size(system) < 1e3)
    y, u = noise(system, 60, seed, dtype, gaps)
    initial = np.random.default_rng(seed).normal(size=len(system[0])).astype(dtype) if begun else None
    predicted, filtered = cf.Observer(*system).run(y, u, initial=initial)
    expected = rb.observe(*system, y.astype(float), u.astype(float), initial)
    close(predicted, expected[0], dtype)
    close(filtered, expected[1], dtype, slack=gain_size(system))


@some
@given(system=systems())
def test_poles_are_those_of_the_error(system):
    A, _, C, L = system
    got = np.asarray(cf.Observer(*system).poles)
    assert got.shape == (len(A),)
    # As polynomials: the order of the poles is nobody's business, and pairs may lie close to each other.
    np.testing.assert_allclose(np.poly(got), np.poly(A - L @ C), rtol=0, atol=1e-9)


def test_poles_of_a_pair():
    """A rotation by 60 degrees that shrinks: the poles are complex."""
    turn = 0.5 * np.array([[0.5, -math.sqrt(0.75)], [math.sqrt(0.75), 0.5]])
    poles = np.asarray(cf.Observer(turn, np.zeros((2, 1)), [[1.0, 0.0]], np.zeros((2, 1))).poles)
    np.testing.assert_allclose(
        sorted(poles, key=np.imag), 0.5 * np.exp([-1j * math.pi / 3, 1j * math.pi / 3])
    )


# --------------------------------------------------------------------------------------------------------- the error


@some
@given(system=systems(), seed=seeds)
def test_error_obeys_its_own_equation(system, seed):
    """e(k+1) = (A - L C) e(k), whatever drives the plant: S1 (1.33)."""
    assume(gain_size(system) < 1e3)
    A, _, C, L = system
    rng = np.random.default_rng(seed)
    _, u = noise(system, 40, seed)
    x = simulated(system, u, rng.normal(size=len(A)))
    predicted, filtered = cf.Observer(*system).run(x @ C.T, u, initial=rng.normal(size=len(A)))
    errors = x - predicted
    close(errors[1:], errors[:-1] @ (A - L @ C).T, slack=np.abs(x).max() + 1)
    # The filtered error is what becomes the next one by A alone.
    close((x - filtered)[:-1] @ A.T, errors[1:], slack=(np.abs(x).max() + 1) * gain_size(system))


@some
@given(system=systems(), seed=seeds)
def test_right_start_stays_right(system, seed):
    """No innovation, no error: whatever the gain, and whatever is missing."""
    A, _, C, _ = system
    _, u = noise(system, 40, seed)
    start = np.random.default_rng(seed).normal(size=len(A))
    x = simulated(system, u, start)
    y = x @ C.T
    y[np.random.default_rng(seed).random(y.shape) < 0.3] = np.nan
    predicted, _ = cf.Observer(*system).run(y, u, initial=start)
    close(predicted, x, slack=np.abs(system[3]).max() + 1)


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_deadbeat_converges_in_as_many_steps_as_states(n):
    rng = np.random.default_rng(n)
    # An observable pair in companion form under a mild change of coordinates; Ackermann's formula puts all poles at 0.
    companion = np.diag(np.ones(n - 1), -1)
    companion[:, -1] = rng.uniform(-0.5, 0.5, n)
    turn = np.linalg.qr(rng.normal(size=(n, n)))[0]
    A, C = turn @ companion @ turn.T, (turn @ np.eye(n)[-1])[None]
    observability = np.array([C[0] @ np.linalg.matrix_power(A, i) for i in range(n)])
    L = np.linalg.matrix_power(A, n) @ np.linalg.solve(observability, np.eye(n)[:, -1:])
    system = A, rng.normal(size=(n, 2)), C, L
    _, u = noise(system, 12)
    x = simulated(system, u, 10 * rng.normal(size=n))
    predicted, _ = cf.Observer(*system).run(x @ C.T, u)
    errors = np.abs(x - predicted).max(axis=1)
    assert (errors[n:] < 1e-11).all()
    assert (errors[:n] > 1e-3).all()


def cubli(dt=0.01):
    """The one-dimensional cube on an edge, S1 (1.32): [phi, u_K, u_R], rates measured, a motor between cube and wheel."""
    continuous = np.array([[0.0, 1.0, 0.0], [90.0, -0.5, 0.05], [-90.0, 0.5, -0.3]])
    A, B, _, _, _ = signal.cont2discrete(
        (continuous, np.array([[0.0], [-60.0], [900.0]]), np.eye(3), np.zeros((3, 1))), dt
    )
    C = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    P = linalg.solve_discrete_are(A.T, C.T, np.diag([1e-6, 1e-3, 1e-2]), np.diag([1e-3, 1e-2]))
    return A, B, C, A @ P @ C.T @ np.linalg.inv(C @ P @ C.T + np.diag([1e-3, 1e-2]))


def test_angle_of_the_cube_from_its_rates():
    """S1 section 1.4: the angle is not measured, and the observer finds it, on an unstable plant held by a controller."""
    system = A, B, C, _ = cubli()
    observer = cf.Observer(*system)
    assert np.abs(np.linalg.eigvals(A)).max() > 1
    assert np.abs(observer.poles).max() < 1
    cost = linalg.solve_discrete_are(A, B, np.diag([10.0, 0.1, 1e-4]), np.eye(1))
    K = np.linalg.solve(np.eye(1) + B.T @ cost @ B, B.T @ cost @ A)
    x, rows, driven = np.array([0.05, 0.0, 0.0]), [], []
    for _ in range(500):
        rows.append(x)
        driven.append(-K @ x)
        x = A @ x + B @ driven[-1]
    x = np.array(rows)
    predicted, filtered = observer.run(x @ C.T, np.array(driven))
    assert abs(predicted[0, 0] - x[0, 0]) == pytest.approx(0.05)
    for estimate in (predicted, filtered):
        assert np.abs(estimate[-50:] - x[-50:]).max() < 1e-6


# -------------------------------------------------------------------------------------------------------------- singular


def test_singular_plant_without_a_filtered_estimate():
    """A M = L has no solution: the prediction works all the same."""
    system = [[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.5], [0.25]]
    y, u = np.random.default_rng(4).normal(size=(2, 20))
    predicted, filtered = cf.Observer(*system).run(y, u)
    expected, nothing = rb.observe(*system, y[:, None], u[:, None])
    assert np.isnan(nothing).all()
    close(predicted, expected)
    assert np.isnan(filtered).all()
    stream = cf.Observer(*system).stream()
    assert np.isnan(stream.update(y[0], u[0])).all()
    close(stream.predict(0.0), np.asarray(system[0]) @ expected[1])


@some
@given(seed=seeds)
def test_singular_plant_with_a_filtered_estimate(seed):
    """L in the range of A: the filtered estimate leads to the next one by A alone."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(4, 2)) @ rng.normal(size=(2, 4))
    A *= 0.9 / np.linalg.norm(A, 2)
    B, C = rng.normal(size=(4, 1)), rng.normal(size=(2, 4))
    L = A @ rng.normal(size=(4, 2))
    L *= 0.1 / np.linalg.norm(L, 2)
    y, u = rng.normal(size=(30, 2)), rng.normal(size=(30, 1))
    predicted, filtered = cf.Observer(A, B, C, L).run(y, u)
    close(predicted, rb.observe(A, B, C, L, y, u)[0])
    assert np.isfinite(filtered).all()
    size = np.abs(filtered).max()
    np.testing.assert_allclose((filtered @ A.T + u @ B.T)[:-1], predicted[1:], rtol=0, atol=1e-10 * size)


def test_zero_plant():
    """A memoryless system: the prediction is B u + L (y - C x)."""
    observer = cf.Observer([[0.0]], [[2.0]], [[1.0]], [[0.5]])
    predicted, filtered = observer.run([1.0, 2.0, 3.0], [1.0, 1.0, 1.0])
    np.testing.assert_allclose(predicted[:, 0], [0.0, 2.5, 1.75])
    assert np.isnan(filtered).all()


# ------------------------------------------------------------------------------------------------------------- in pieces

lengths = st.integers(0, 40)
ways = st.sampled_from(["process", "update", "in turn"])


def run_piece(stream, way, y, u):
    """(predicted, filtered) of a piece, by one of the ways to run it."""
    if way == "process":
        return stream.process(y, u)
    predicted, filtered = [], []
    for measured, driven in zip(y, u, strict=True):
        if way == "update":
            filtered.append(stream.update(measured, driven))
        else:
            filtered.append(stream.correct(measured))
            predicted.append(stream.predict(driven))
    # The prediction that comes out belongs to the next sample.
    return predicted, filtered


@precisions
@some
@given(
    system=systems(),
    plan=st.lists(
        st.tuples(lengths, ways, st.sampled_from(["go on", "store", "copy", "restore"])), max_size=6
    ),
    seed=seeds,
    begun=st.booleans(),
)
def test_whole_is_any_chunking(dtype, system, plan, seed, begun):
    """Bit for bit, with components missing and streams stored and taken up again in between."""
    y, u = noise(system, 80, seed, dtype, gaps=True)
    initial = np.random.default_rng(seed).normal(size=len(system[0])) if begun else None
    observer = cf.Observer(*system)
    whole = observer.run(y, u, initial=initial)
    stream = observer.stream(initial=initial, dtype=dtype)

    def restored(stream):
        other = observer.stream(dtype=dtype)
        other.state = stream.state
        return other

    pauses = {"go on": same, "store": pickled, "copy": copy.deepcopy, "restore": restored}
    start = 0
    for length, way, pause in [*plan, (80, "process", "go on")]:
        stop = min(start + length, 80)
        predicted, filtered = run_piece(stream, way, y[start:stop], u[start:stop])
        shift = start + 1 if way == "in turn" else start
        count = len(predicted) - (shift + len(predicted) > 80)
        if count > 0:
            assert_same_bits(np.array(predicted[:count]), whole[0][shift : shift + count])
        if len(filtered):
            assert_same_bits(np.array(filtered), whole[1][start:stop])
        stream = pauses[pause](stream)
        start = stop


@precisions
def test_stored_between_correction_and_prediction(dtype):
    """The correction that is not yet in the prediction belongs to the state."""
    y, u = noise(SYSTEM, 30, dtype=dtype)
    stream = OBSERVER.stream(dtype=dtype)
    stream.process(y[:20], u[:20])
    stream.correct(y[20])
    for other in (pickled(stream), copy.deepcopy(stream)):
        assert other == stream
        assert_same_bits(other.predict(u[20]), pickled(stream).predict(u[20]))
    other = OBSERVER.stream(dtype=dtype)
    other.state = stream.state
    assert_same_bits(other.predict(u[20]), stream.predict(u[20]))
    assert other.state == stream.state


def test_held_input_belongs_to_the_state():
    y, u = noise(SYSTEM, 10)
    u[5:] = np.nan
    stream = OBSERVER.stream()
    stream.process(y[:5], u[:5])
    other = OBSERVER.stream()
    other.state = stream.state
    assert_same_bits(other.process(y[5:], u[5:])[0], OBSERVER.run(y, u)[0][5:])


def test_state_is_a_snapshot():
    y, u = noise(SYSTEM, 10)
    stream = OBSERVER.stream()
    stream.process(y, u)
    state = stream.state
    expected = stream.process(y, u)
    stream.state = state
    for got, wanted in zip(stream.process(y, u), expected, strict=True):
        assert_same_bits(got, wanted)
    assert stream.state != state


# ------------------------------------------------------------------------------------------------------- missing samples


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_missing_component_does_not_correct(bad):
    """The other components do, through their own columns of L."""
    A, B, C, L = SYSTEM
    y, u = noise(SYSTEM, 40)
    y[::2, 1] = bad
    alone = cf.Observer(A, B, C[[0, 2]], L[:, [0, 2]])
    stream, other = OBSERVER.stream(), alone.stream()
    for row in range(40):
        got = stream.update(y[row], u[row])
        expected = other.update(y[row, [0, 2]], u[row])
        if row % 2 == 0:
            close(got, expected)
            close(np.asarray(stream.predict(u[row])), np.asarray(other.predict(u[row])))
        stream = OBSERVER.stream(initial=np.ones(4) * row)
        other = alone.stream(initial=np.ones(4) * row)


def test_nothing_measured_is_a_prediction():
    _, u = noise(SYSTEM, 20)
    start = np.arange(1.0, 5.0)
    predicted, filtered = OBSERVER.run(np.full((20, 3), np.nan), u, initial=start)
    close(predicted, simulated(SYSTEM, u, start))
    assert_same_bits(filtered, predicted)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_missing_input_is_held(bad):
    """Each component by itself, 0 before its first."""
    y, u = noise(SYSTEM, 12)
    holed = u.copy()
    holed[:3, 0] = bad
    holed[5:9, 1] = bad
    filled = u.copy()
    filled[:3, 0] = 0.0
    filled[5:9, 1] = u[4, 1]
    for got, expected in zip(OBSERVER.run(y, holed), OBSERVER.run(y, filled), strict=True):
        assert_same_bits(got, expected)


@pytest.mark.parametrize("name", ["y", "u"])
def test_missing_raise(name):
    y, u = noise(SYSTEM, 12)
    OBSERVER.run(y, u, missing="raise")
    signals = {"y": y.copy(), "u": u.copy()}
    signals[name][7, 1] = np.nan
    message = refused(OBSERVER.run, signals["y"], signals["u"], missing="raise")
    assert re.search(rf"\b{name}\b.*missing", message), message
    assert re.search(r"\bmissing\b", refused(OBSERVER.run, y, u, missing="x"))


# ---------------------------------------------------------------------------------------------------------------- arrays


def single():
    """One output and one input."""
    return cf.Observer(*random_system(np.random.default_rng(5), 3, 1, 1))


@precisions
def test_one_output_and_one_input_may_be_flat(dtype):
    y, u = np.random.default_rng(6).normal(size=(2, 25)).astype(dtype)
    wide = single().run(y[:, None], u[:, None])
    for pair in ((y, u), (y[:, None], u), (y, u[:, None])):
        for got, expected in zip(single().run(*pair), wide, strict=True):
            assert_same_bits(got, expected)
    one, other = single().stream(dtype=dtype), single().stream(dtype=dtype)
    for measured, driven in zip(y, u, strict=True):
        assert_same_bits(one.update(measured, driven), other.update([measured], [driven]))
    for got, expected in zip(single().stream(dtype=dtype).process(y, u), wide, strict=True):
        assert_same_bits(got, expected)


@precisions
def test_shapes_and_dtypes(dtype):
    y, u = noise(SYSTEM, 9, dtype=dtype)
    for part in OBSERVER.run(y, u):
        assert part.shape == (9, 4)
        assert part.dtype == dtype
    stream = OBSERVER.stream(dtype=dtype)
    for part in (stream.correct(y[0]), stream.predict(u[0]), stream.update(y[1], u[1])):
        assert part.shape == (4,)
        assert part.dtype == dtype
    for part in (*OBSERVER.run(y[:0], u[:0]), *stream.process(y[:0], u[:0])):
        assert part.shape == (0, 4)
        assert part.dtype == dtype


@pytest.mark.parametrize(
    ("first", "second"), [("f4", "f8"), ("f8", "f4"), ("f4", "i4"), ("i8", "f4"), ("u1", "f2")]
)
def test_other_dtypes_become_float64(first, second):
    y, u = (np.abs(10 * one) for one in noise(SYSTEM, 20))
    y, u = y.astype(first), u.astype(second)
    for got, expected in zip(OBSERVER.run(y, u), OBSERVER.run(y.astype(float), u.astype(float)), strict=True):
        assert_same_bits(got, expected)


@precisions
def test_layout_in_memory_does_not_matter(dtype):
    y, u = noise(SYSTEM, 20, dtype=dtype, gaps=True)
    expected = OBSERVER.run(y, u)
    for lay_out in (
        np.asfortranarray,
        lambda one: one[::-1].copy()[::-1],
        lambda one: np.repeat(one, 3, axis=0)[::3],
        lambda one: np.hstack([one, one])[:, : one.shape[1]],
        lambda one: one.astype(one.dtype.newbyteorder(">")),
    ):
        for got, wanted in zip(OBSERVER.run(lay_out(y), lay_out(u)), expected, strict=True):
            assert_same_bits(got, wanted)
    laid = cf.Observer(*(np.asfortranarray(matrix) for matrix in SYSTEM))
    assert laid == OBSERVER
    assert laid == cf.Observer(*(matrix.tolist() for matrix in SYSTEM))
    assert_same_bits(laid.run(y, u)[0], expected[0])
    y, u = noise(SYSTEM, 20)
    assert_same_bits(OBSERVER.run(y.tolist(), u.tolist())[1], OBSERVER.run(y, u)[1])


def test_inputs_stay_as_they_are():
    matrices = [matrix.copy() for matrix in SYSTEM]
    y, u = noise(SYSTEM, 20, gaps=True)
    start = np.ones(4)
    before = [one.copy() for one in (*matrices, y, u, start)]
    observer = cf.Observer(*matrices)
    expected = observer.run(y, u, initial=start)
    observer.stream(initial=start).process(y, u)
    for now, then in zip((*matrices, y, u, start), before, strict=True):
        np.testing.assert_array_equal(now, then)
    for matrix in matrices:
        matrix[:] = 7.0
    assert observer == OBSERVER
    assert_same_bits(observer.run(y, u, initial=start)[0], expected[0])


def test_results_are_not_the_state():
    y, u = noise(SYSTEM, 4)
    stream = OBSERVER.stream()
    for result in (stream.correct(y[0]), stream.predict(u[0]), *stream.process(y[:1], u[:1])):
        result[:] = 1e9
    expected = OBSERVER.stream()
    expected.update(y[0], u[0])
    expected.process(y[:1], u[:1])
    assert stream.state == expected.state


# --------------------------------------------------------------------------------------------------------------- objects


@pytest.mark.parametrize("duplicate", [pickled, copy.copy, copy.deepcopy])
@precisions
def test_observers_and_streams_are_copied_and_compared(duplicate, dtype):
    other = duplicate(OBSERVER)
    y, u = noise(SYSTEM, 10, dtype=dtype)
    assert other == OBSERVER
    assert repr(other) == repr(OBSERVER)
    assert_same_bits(other.run(y, u)[1], OBSERVER.run(y, u)[1])
    stream = OBSERVER.stream(dtype=dtype)
    stream.process(y, u)
    twin = duplicate(stream)
    assert twin == stream
    assert twin.state == stream.state
    assert_same_bits(twin.process(y, u)[0], pickled(stream).process(y, u)[0])
    assert twin != stream
    assert stream != 1.0


def test_observers_differ():
    A, B, C, L = SYSTEM
    observers = [
        cf.Observer(A, B, C, L),
        cf.Observer(0.5 * A, B, C, L),
        cf.Observer(A, 2 * B, C, L),
        cf.Observer(A, B, -C, L),
        cf.Observer(A, B, C, 0.5 * L),
    ]
    for i, first in enumerate(observers):
        for j, second in enumerate(observers):
            assert (first == second) == (i == j)
    assert observers[0] != 1.0
    assert repr(observers[0]).startswith("Observer(")


@pytest.mark.parametrize("filtered", [True, False])
def test_singular_observers_are_equal_to_themselves(filtered):
    """NaN in the filtered gain does not make them differ."""
    L = [[0.5], [0.0]] if filtered else [[0.5], [0.25]]
    system = [[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], L
    assert cf.Observer(*system) == cf.Observer(*system) == pickled(cf.Observer(*system))


# ---------------------------------------------------------------------------------------------------------------- errors

GOOD = dict(zip("ABCL", SYSTEM, strict=True))
BAD_MATRICES = [
    ("A", np.zeros((4, 3))),
    ("A", np.zeros(4)),
    ("A", np.zeros((0, 0))),
    ("A", np.full((4, 4), math.nan)),
    ("A", np.full((4, 4), math.inf)),
    ("B", np.zeros((3, 2))),
    ("B", np.full((4, 2), math.nan)),
    ("C", np.zeros((3, 3))),
    ("C", np.full((3, 4), math.inf)),
    ("L", np.zeros((3, 4))),
    ("L", np.zeros((4, 2))),
    ("L", np.full((4, 3), math.nan)),
]


@pytest.mark.parametrize(("name", "bad"), BAD_MATRICES)
def test_matrices_must_fit(name, bad):
    message = refused(cf.Observer, **{**GOOD, name: bad})
    assert re.search(rf"\b{name}\b", message), message


@pytest.mark.parametrize("name", list("ABCL"))
@pytest.mark.parametrize("bad", ["1", None, [["1"]], np.zeros((4, 4), complex), {}])
def test_matrices_must_be_real_numbers(name, bad):
    message = refused(cf.Observer, kind=TypeError, **{**GOOD, name: bad})
    assert re.search(rf"\b{name}\b", message), message


BAD_SIGNALS = [
    ("y", np.zeros((9, 2)), np.zeros((9, 2))),
    ("y", np.zeros(9), np.zeros((9, 2))),
    ("y", np.zeros((3, 9)), np.zeros((9, 2))),
    ("y", np.zeros((9, 3, 1)), np.zeros((9, 2))),
    ("u", np.zeros((9, 3)), np.zeros((9, 1))),
    ("u", np.zeros((9, 3)), np.zeros(9)),
    ("u", np.zeros((9, 3)), np.zeros((8, 2))),
]


@pytest.mark.parametrize(("name", "y", "u"), BAD_SIGNALS)
def test_signals_must_fit(name, y, u):
    stream = OBSERVER.stream()
    before = stream.state
    for call in (OBSERVER.run, stream.process):
        assert re.search(rf"\b{name}\b", refused(call, y, u))
    assert stream.state == before


@pytest.mark.parametrize("bad", [1.0, [1.0], [1.0] * 5, [[1.0, 2.0, 3.0]]])
def test_samples_must_fit(bad):
    stream = OBSERVER.stream(initial=np.ones(4))
    before = stream.state
    assert re.search(r"\by\b", refused(stream.correct, bad))
    assert re.search(r"\bu\b", refused(stream.predict, bad))
    assert re.search(r"\by\b", refused(stream.update, bad, [0.0, 0.0]))
    assert re.search(r"\bu\b", refused(stream.update, [0.0, 0.0, 0.0], bad))
    assert stream.state == before


@pytest.mark.parametrize("bad", [np.ones(3), np.ones((4, 1)), [1.0, 1.0, 1.0, math.nan]])
def test_initial_must_fit(bad):
    y, u = noise(SYSTEM, 5)
    assert re.search(r"\binitial\b", refused(OBSERVER.run, y, u, initial=bad))
    assert re.search(r"\binitial\b", refused(OBSERVER.stream, initial=bad))


def test_signals_must_be_real_numbers():
    y, u = noise(SYSTEM, 5)
    assert re.search(r"\by\b", refused(OBSERVER.run, y > 0, u, kind=TypeError))
    assert re.search(r"\bu\b", refused(OBSERVER.run, y, u + 1j, kind=TypeError))
    stream = OBSERVER.stream()
    assert re.search(r"\by\b", refused(stream.correct, [True, False, True], kind=TypeError))
    assert re.search(r"\bu\b", refused(stream.predict, "12", kind=TypeError))


@pytest.mark.parametrize("dtype", ["f2", int, bool, "nonsense"])
def test_streams_are_of_float64_or_float32(dtype):
    with pytest.raises(TypeError):
        OBSERVER.stream(dtype=dtype)


def test_state_of_another_observer_is_refused():
    for other in (single().stream(), OBSERVER.stream(dtype="float32")):
        stream = OBSERVER.stream(initial=np.ones(4))
        before = stream.state
        with pytest.raises((ValueError, TypeError)):
            stream.state = other.state
        assert stream.state == before
