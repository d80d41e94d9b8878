"""Observer gains against closed forms, a Kalman filter's own recursion, and the equation that they solve."""

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import linalg

import compfilt as cf
from compfilt.design import luenberger, observer_poles

SEEDS = st.integers(0, 2**32 - 1)


def random_covariance(rng, n, rank=None):
    root = rng.normal(size=(n, n if rank is None else rank))
    return root @ root.T


def hautus_margin(A, C):
    """The least singular value of [A - λI; C] over the eigenvalues of A."""
    return min(
        np.linalg.svd(np.vstack((A - mode * np.eye(len(A)), C)), compute_uv=False)[-1]
        for mode in np.linalg.eigvals(A)
    )


def observable_system(seed, *, rank=None):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    A, C = rng.normal(size=(n, n)), rng.normal(size=(int(rng.integers(1, n + 1)), n))
    assume(hautus_margin(A, C) > 1e-2)
    Q, R = random_covariance(rng, n, rank), random_covariance(rng, len(C)) + 0.1 * np.eye(len(C))
    return A, C, Q, R


def turned(rng, A, C):
    """The same system in other states."""
    T = linalg.qr(rng.normal(size=A.shape))[0] * rng.uniform(0.3, 3.0, size=len(A))
    return T @ A @ np.linalg.inv(T), C @ np.linalg.inv(T)


# ------------------------------------------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("a", [0.5, 1.0, -1.3])
@pytest.mark.parametrize("c", [1.0, -4.0])
@pytest.mark.parametrize("q", [1e-8, 0.3, 1e6])
@pytest.mark.parametrize("r", [1e-6, 2.0])
def test_scalar(a, c, q, r):
    """The positive root of c² P² + (r (1 - a²) - c² q) P - q r = 0."""
    half = (c**2 * q - r * (1.0 - a**2)) / 2.0
    root = math.hypot(half, c * math.sqrt(q * r))
    P = (half + root) / c**2 if half > 0.0 else q * r / (root - half)
    (got,) = luenberger([[a]], [[c]], [[q]], [[r]]).ravel()
    assert got == pytest.approx(a * P * c / (c**2 * P + r), rel=1e-9)


@pytest.mark.parametrize("index", 10.0 ** np.arange(-8, 3))
@pytest.mark.parametrize("T", [1e-4, 0.1, 10.0])
def test_alpha_beta_tracker(index, T):
    """Kalata's gains for the tracking index σ_w T²/σ_v, from position with noise σ_v and acceleration noise σ_w."""
    deviation = 0.7
    push = index * deviation / T**2 * np.array([[T**2 / 2.0], [T]])
    A = np.array([[1.0, T], [0.0, 1.0]])
    L = luenberger(A, [[1.0, 0.0]], push @ push.T, [[deviation**2]])
    root = index * math.sqrt(1.0 + 8.0 / index)
    beta = (index**2 + 4.0 * index - index * root) / 4.0
    alpha = -(index**2 + 8.0 * index - (index + 4.0) * root) / 8.0
    np.testing.assert_allclose(np.linalg.solve(A, L).ravel() * [1.0, T], [alpha, beta], rtol=1e-8)


def chain_noise(order, T):
    """The covariance that white noise of density 1 at the last of `order` integrators makes in the time T."""
    i = order - 1 - np.arange(order)
    factorials = np.array([math.factorial(k) for k in i], dtype=float)
    powers = i[:, np.newaxis] + i + 1
    return T**powers / powers / np.outer(factorials, factorials)


@pytest.mark.parametrize("order", range(1, 7))
def test_butterworth_is_the_steady_state_kalman_filter(order):
    """In the limit of a small period: ω0 = (q/r)^(1/N), and the error is of first order in ω0 T."""
    r, omega0 = 0.02, 3.0
    wanted = np.array(cf.Butterworth(omega0, order).coefficients)
    errors = []
    for T in (2e-3, 1e-3):
        A = linalg.expm(T * np.eye(order, k=1))
        q = r * omega0**order
        L = luenberger(A, np.eye(1, order), q**2 * chain_noise(order, T), [[r**2 / T]])
        errors.append(np.abs(L.ravel() / T / wanted - 1.0).max())
    assert errors[1] < 2.0 * order * omega0 * 1e-3
    assert errors[1] == pytest.approx(errors[0] / 2.0, rel=0.05)


def test_pi_form_from_noise_densities():
    r, q1, q2, T = 2e-3, 1e-3, 4e-4, 1e-5
    A = [[1.0, T], [0.0, 1.0]]
    L = luenberger(A, [[1.0, 0.0]], np.diag([q1**2 * T, q2**2 * T]), [[r**2 / T]]).ravel() / T
    np.testing.assert_allclose(L, [math.sqrt((q1 / r) ** 2 + 2.0 * q2 / r), q2 / r], rtol=1e-4)


# ----------------------------------------------------------------------------------------------------- any observable pair


@given(SEEDS)
def test_poles_lie_inside_the_circle(seed):
    A, C, Q, R = observable_system(seed)
    poles = observer_poles(A, C, luenberger(A, C, Q, R))
    assert np.abs(poles).max() < 1.0


@given(SEEDS)
def test_the_gain_solves_the_riccati_equation(seed):
    """P is what noise makes of the error x - x̂ under the gain, and the gain is the best one for that P."""
    A, C, Q, R = observable_system(seed)
    L = luenberger(A, C, Q, R)
    P = linalg.solve_discrete_lyapunov(A - L @ C, Q + L @ R @ L.T)
    best = A @ P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
    np.testing.assert_allclose(L, best, atol=1e-5 * np.abs(L).max())


@given(SEEDS)
def test_the_kalman_filter_converges_to_it(seed):
    A, C, Q, R = observable_system(seed)
    L = luenberger(A, C, Q, R)
    assume(np.abs(observer_poles(A, C, L)).max() < 0.97)
    P = np.eye(len(A))
    for _ in range(1000):
        gain = P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
        corrected = (np.eye(len(A)) - gain @ C) @ P
        P = A @ corrected @ A.T + Q
        P = (P + P.T) / 2.0
    np.testing.assert_allclose(L, A @ gain, atol=1e-6 * np.abs(L).max())


@given(SEEDS, st.floats(-6.0, 6.0), st.floats(-6.0, 6.0))
def test_units_change_nothing(seed, state_unit, output_unit):
    A, C, Q, R = observable_system(seed)
    S, s = np.diag(10.0 ** (state_unit * np.linspace(0.0, 1.0, len(A)))), 10.0**output_unit
    there = luenberger(S @ A @ np.linalg.inv(S), s * C @ np.linalg.inv(S), S @ Q @ S, s**2 * R)
    L = luenberger(A, C, Q, R)
    np.testing.assert_allclose(np.linalg.inv(S) @ there * s, L, atol=1e-5 * np.abs(L).max())


@given(SEEDS)
def test_only_the_ratio_counts(seed):
    A, C, Q, R = observable_system(seed)
    np.testing.assert_allclose(
        luenberger(A, C, Q, R), luenberger(A, C, 7.0 * Q, 7.0 * R), rtol=1e-6, atol=1e-8
    )


def test_no_weight_mirrors_the_modes():
    """With Q = 0 stable modes stay and unstable ones move to 1/λ."""
    A = linalg.block_diag(0.5, 1.25, 2.0)
    L = luenberger(A, [[1.0, 1.0, 1.0]], np.zeros((3, 3)), [[0.3]])
    np.testing.assert_allclose(observer_poles(A, [[1.0, 1.0, 1.0]], L), [0.8, 0.5, 0.5], atol=1e-6)


def test_poles_are_sorted_and_complex():
    A = linalg.block_diag(0.1, [[0.0, -0.5], [0.5, 0.0]], -0.9)
    poles = observer_poles(A, np.ones((1, 4)), np.zeros((4, 1)))
    assert poles.dtype == complex
    np.testing.assert_allclose(poles, [-0.9, 0.5j, -0.5j, 0.1], atol=1e-15)


def test_float32_and_lists_count_as_double():
    A, C = np.float32([[1.0, 0.5], [0.0, 1.0]]), [[1, 0]]
    assert luenberger(A, C, np.eye(2, dtype=int), [[1]]).dtype == np.float64


# --------------------------------------------------------------------------------------------- what C does not see


def with_unseen(rng, seen, unseen):
    """A system with the block `seen` before C and the block `unseen` behind its back, in mixed states."""
    n, k = len(seen), len(unseen)
    A = np.block([[seen, np.zeros((n, k))], [rng.normal(size=(k, n)), unseen]])
    return turned(rng, A, np.hstack((rng.normal(size=(max(1, n - 1), n)), np.zeros((max(1, n - 1), k)))))


def rotation(size, angle):
    return size * np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


UNSEEN_BLOCKS = {
    "a lasting mode": ([[1.0]], "the mode 1", True),
    "a growing mode": ([[-1.5]], "the mode -1.5", True),
    "a decaying mode": ([[0.25]], "the mode 0.25", False),
    "a decaying swing": (rotation(0.5, math.pi / 3.0), "the mode 0.25 ± 0.433013j", False),
    "a lasting swing": (rotation(1.0, math.pi / 2.0), "the mode 0 ± 1j", True),
    "a double integrator": ([[1.0, 0.1], [0.0, 1.0]], "the mode 1", True),
    "two of them": (np.diag([2.0, 0.5]), "the modes", True),
}


@pytest.mark.parametrize("case", UNSEEN_BLOCKS.values(), ids=UNSEEN_BLOCKS)
@pytest.mark.parametrize("seed", range(5))
def test_unseen_modes_are_named(case, seed):
    unseen, named, lasting = case
    rng = np.random.default_rng(seed)
    A, C = with_unseen(rng, rng.normal(size=(3, 3)), np.array(unseen))
    Q, R = np.eye(len(A)), np.eye(len(C))
    with pytest.raises(ValueError, match=r"^\(A, C\) must be observable: C does not see ") as error:
        luenberger(A, C, Q, R)
    assert named in str(error.value)
    if lasting:
        with pytest.raises(ValueError, match=r"^\(A, C\) must be detectable: C does not see "):
            luenberger(A, C, Q, R, require="detectable")
    else:
        left = observer_poles(A, C, luenberger(A, C, Q, R, require="detectable"))
        for mode in np.linalg.eigvals(unseen):
            assert np.abs(left - mode).min() < 1e-9


def test_both_unseen_modes_are_named_but_only_the_lasting_one_is_refused():
    A, C = np.diag([0.9, 2.0, 0.5]), [[1.0, 0.0, 0.0]]
    with pytest.raises(ValueError, match=r"see the modes (2, 0\.5|0\.5, 2)$"):
        luenberger(A, C, np.eye(3), [[1.0]])
    with pytest.raises(ValueError, match=r"see the mode 2, which does not decay by itself$"):
        luenberger(A, C, np.eye(3), [[1.0]], require="detectable")


@pytest.mark.parametrize("seed", range(5))
def test_an_unseen_integrator_behind_seen_ones(seed):
    """Position is unseen where velocity is measured: one defective eigenvalue for the seen and the unseen."""
    rng = np.random.default_rng(seed)
    T = 1e-3
    A, C = turned(rng, np.array([[1.0, T, T**2 / 2.0], [0.0, 1.0, T], [0.0, 0.0, 1.0]]), np.eye(1, 3, 1))
    with pytest.raises(ValueError, match=r"see the mode 1$"):
        luenberger(A, C, np.eye(3), [[1.0]])


@pytest.mark.parametrize("order", range(1, 7))
@pytest.mark.parametrize("T", [1e-4, 1.0])
def test_a_chain_is_seen_from_its_end_alone(order, T):
    A = linalg.expm(T * np.eye(order, k=1))
    noise = chain_noise(order, T)
    assert luenberger(A, np.eye(1, order), noise, [[1.0 / T]]).shape == (order, 1)
    for level in range(1, order):
        with pytest.raises(ValueError, match=r"see the mode 1$"):
            luenberger(A, np.eye(1, order, level), noise, [[1.0]])


def test_nothing_seen_at_all():
    with pytest.raises(ValueError, match=r"does not see the modes 0\.5, 1$"):
        luenberger(np.diag([0.5, 1.0]), [[0.0, 0.0]], np.eye(2), [[1.0]])


@pytest.mark.parametrize("mode", [1.0, -1.0])
def test_what_the_weight_must_excite(mode):
    A, C = np.array([[0.5, 0.2], [0.0, mode]]), [[1.0, 1.0]]
    with pytest.raises(ValueError, match=rf"^Q must excite .*: it does not excite the mode {mode:.0f}$"):
        luenberger(A, C, np.diag([1.0, 0.0]), [[1.0]])
    assert np.abs(observer_poles(A, C, luenberger(A, C, np.diag([0.0, 1e-6]), [[1.0]]))).max() < 1.0


def test_a_swing_that_the_weight_does_not_excite():
    A = rotation(1.0, 0.3)
    with pytest.raises(ValueError, match=r"does not excite the mode 0\.955336 ± 0\.29552j$"):
        luenberger(A, [[1.0, 0.0]], np.zeros((2, 2)), [[1.0]])


def test_weights_too_far_apart():
    with pytest.raises(ValueError, match=r"^Q (and R must differ less|must be larger)"):
        luenberger([[1.0]], [[1.0]], [[1e-40]], [[1.0]])


# ------------------------------------------------------------------------------------------------------ bad arguments

GOOD = {"A": np.eye(2) / 2.0, "C": [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], "Q": np.eye(2), "R": np.eye(3)}

BAD = {
    "A not square": ({"A": np.ones((2, 3))}, r"^A must be square, not of shape \(2, 3\)$"),
    "A a vector": ({"A": [1.0, 2.0]}, r"^A must be a matrix, not of shape \(2,\)$"),
    "A empty": ({"A": np.empty((0, 0))}, r"^A must be a matrix, not of shape \(0, 0\)$"),
    "C too wide": ({"C": np.ones((3, 3))}, r"^C must be of as many columns as A, not of shape \(3, 3\)$"),
    "Q too small": ({"Q": [[1.0]]}, r"^Q must be of the shape of A, not of shape \(1, 1\)$"),
    "R too small": ({"R": np.eye(2)}, r"^R must be square with as many rows as C, not of shape \(2, 2\)$"),
    "A not finite": ({"A": [[1.0, np.nan], [0.0, 1.0]]}, r"^A must be finite$"),
    "R not finite": ({"R": np.diag([1.0, 1.0, np.inf])}, r"^R must be finite$"),
    "Q askew": (
        {"Q": [[1.0, 0.5], [0.4, 1.0]]},
        r"^Q must be symmetric positive semidefinite: it is not symmetric$",
    ),
    "Q negative": ({"Q": np.diag([1.0, -1e-9])}, r"^Q must be symmetric positive semidefinite: .* below 0$"),
    "Q indefinite": (
        {"Q": [[1.0, 2.0], [2.0, 1.0]]},
        r"^Q must be symmetric positive semidefinite: .* below 0$",
    ),
    "R askew": (
        {"R": np.eye(3) + np.eye(3, k=1)},
        r"^R must be symmetric positive definite: it is not symmetric$",
    ),
    "R singular": ({"R": np.ones((3, 3))}, r"^R must be symmetric positive definite: .* of 0 or below 0$"),
    "R zero": ({"R": np.zeros((3, 3))}, r"^R must be symmetric positive definite: .* of 0 or below 0$"),
    "no such rule": ({"require": "stable"}, r"^require must be 'observable' or 'detectable', not 'stable'$"),
}


@pytest.mark.parametrize(("changed", "message"), BAD.values(), ids=BAD)
def test_bad_arguments(changed, message):
    with pytest.raises(ValueError, match=message):
        luenberger(**{**GOOD, **changed})


@pytest.mark.parametrize("value", [np.eye(2, dtype=complex), np.eye(2, dtype=bool), [["a", "b"], ["c", "d"]]])
def test_bad_types(value):
    with pytest.raises(TypeError, match=r"^A must be an array of real numbers, not of "):
        luenberger(**{**GOOD, "A": value})


def test_poles_check_the_shapes():
    with pytest.raises(
        ValueError, match=r"^L must be of one row per state and one column per output, not of shape"
    ):
        observer_poles(np.eye(2), [[1.0, 0.0]], [[1.0, 0.0]])


def test_the_arguments_are_left_alone():
    kept = {name: np.array(value) for name, value in GOOD.items()}
    luenberger(**kept)
    for name, value in GOOD.items():
        np.testing.assert_array_equal(kept[name], value)


# --------------------------------------------------------------------------------------------------------- the module


def test_without_scipy():
    code = "import sys; sys.modules['scipy'] = None; import compfilt.design"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert result.stderr.splitlines()[-1] == (
        "ModuleNotFoundError: compfilt.design needs the extra \"design\": pip install 'compfilt[design]'"
    )
