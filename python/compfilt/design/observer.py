"""Observer gains from weights or from noise covariances."""

from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.linalg import matrix_balance, null_space, solve_discrete_are  # type: ignore[import-untyped]

__all__ = ["luenberger", "observer_poles"]

Matrix = npt.NDArray[np.float64]
Poles = npt.NDArray[np.complex128]

UNSEEN = 1e-10
"""An entry below this share of the scaled matrices counts as zero: rounding, not a connection."""

CIRCLE = 1e-7
"""A mode nearer to the unit circle than this counts as on it."""


SINGULAR = 1e-14
"""A covariance scaled to variances of one, with an eigenvalue below this, counts as singular."""


def luenberger(
    A: npt.ArrayLike,
    C: npt.ArrayLike,
    Q: npt.ArrayLike,
    R: npt.ArrayLike,
    *,
    require: Literal["observable", "detectable"] = "observable",
) -> Matrix:
    """Return the gain of an observer in discrete time, by the Riccati equation of the dual control problem.

    The observer is x̂(k+1) = A x̂(k) + B u(k) + L (y(k) - C x̂(k)), as in `compfilt.Observer`, and its error runs with
    A - L C. P is the stabilising solution of the discrete algebraic Riccati equation of (Aᵀ, Cᵀ, Q, R)::

        P = A P Aᵀ - A P Cᵀ (C P Cᵀ + R)⁻¹ C P Aᵀ + Q
        L = A P Cᵀ (C P Cᵀ + R)⁻¹

    Two readings of the same equation: Q and R are weights, chosen by trial; or Q is the covariance of the noise that
    drives the state in one step and R that of y, and then L is the steady-state gain of the Kalman filter in
    predictor form, and P the covariance of x - x̂ before the correction. Only the ratio of Q to R enters L: a small Q
    gives a small L, which lets little noise through and leaves the poles where the model has them, or mirrors them
    into the unit circle.

    Parameters
    ----------
    A
        Transition matrix, (n, n).
    C
        Output matrix, (p, n).
    Q
        Weight of the state or covariance of its noise per step, (n, n): symmetric positive semidefinite.
    R
        Weight of the output or covariance of its noise, (p, p): symmetric positive definite.
    require
        ``"observable"``: C has to see every mode of A. ``"detectable"``: modes that it does not see may be there if
        they decay by themselves; the observer leaves their poles in place.

    Returns
    -------
    ndarray
        L, (n, p).

    Raises
    ------
    ValueError
        If a shape is wrong, a number is not finite, Q or R is not as above, C does not see a mode (its eigenvalue is
        named), Q does not excite a mode on the unit circle (it is named too: no gain is best then), or the equation
        has no solution in double precision.
    TypeError
        If an argument is not an array of real numbers.

    Notes
    -----
    A mode λ is unseen if A v = λ v and C v = 0 for some v (Hautus). The largest subspace of such vectors is found with
    orthogonal steps, so that repeated and defective eigenvalues do not blur the test, on a balanced A and rows of C of
    length one, so that units matter little.

    References
    ----------
    Anderson, Moore, Optimal Filtering, 1979, chapter 4.

    Examples
    --------
    An angle and the bias of its gyro, from noise densities. The result is the complementary filter in PI form:
    k_I = q_2/r and k_P = √(q_1²/r² + 2 q_2/r), times the sample period.

    >>> import numpy as np
    >>> from compfilt.design import luenberger, observer_poles
    >>> T = 0.001
    >>> r, q1, q2 = 1e-3, 2e-3, 1e-3  # angle in rad/√Hz, gyro in rad/s/√Hz, walk of its bias in rad/s²/√Hz
    >>> A, C = [[1.0, T], [0.0, 1.0]], [[1.0, 0.0]]
    >>> L = luenberger(A, C, np.diag([q1**2 * T, q2**2 * T]), [[r**2 / T]])
    >>> (L[:, 0] / T).round(2).tolist()
    [2.45, 1.0]
    >>> np.abs(observer_poles(A, C, L)).round(4).tolist()
    [0.9995, 0.9981]

    A rate that is measured does not tell the angle:

    >>> luenberger(A, [[0.0, 1.0]], np.eye(2), [[1.0]])
    Traceback (most recent call last):
        ...
    ValueError: (A, C) must be observable: C does not see the mode 1
    """
    A, C = _system(A, C)
    p, n = C.shape
    Q = _symmetric("Q", _matrix("Q", Q, (n, n), "of the shape of A"), definite=False)
    R = _symmetric("R", _matrix("R", R, (p, p), "square with as many rows as C"), definite=True)
    if require not in {"observable", "detectable"}:
        raise ValueError(f"require must be 'observable' or 'detectable', not {require!r}")
    unseen = _unseen_modes(A, C)
    if require == "observable" and unseen.size:
        raise ValueError(f"(A, C) must be observable: C does not see {_named(unseen)}")
    lasting = unseen[np.abs(unseen) >= 1.0 - CIRCLE]
    if lasting.size:
        raise ValueError(
            f"(A, C) must be detectable: C does not see {_named(lasting)}, which does not decay by itself"
        )
    unmoved = _unseen_modes(A.T, _root(Q))
    unmoved = unmoved[np.abs(np.abs(unmoved) - 1.0) <= CIRCLE]
    if unmoved.size:
        raise ValueError(f"Q must excite every mode on the unit circle: it does not excite {_named(unmoved)}")
    return _gain(A, C, Q, R)


def observer_poles(A: npt.ArrayLike, C: npt.ArrayLike, L: npt.ArrayLike) -> Poles:
    """Return the poles of an observer: the eigenvalues of A - L C, the slowest first.

    The error of the estimate decays with the time constant -T / log |pole|.

    Parameters
    ----------
    A
        Transition matrix, (n, n).
    C
        Output matrix, (p, n).
    L
        Gain, (n, p).

    Returns
    -------
    ndarray
        (n,), complex, by falling size.

    Raises
    ------
    ValueError
        If a shape is wrong or a number is not finite.

    Examples
    --------
    >>> from compfilt.design import observer_poles
    >>> observer_poles([[1.0, 0.1], [0.0, 1.0]], [[1.0, 0.0]], [[0.75], [1.25]]).real.round(6).tolist()
    [0.75, 0.5]
    """
    A, C = _system(A, C)
    L = _matrix("L", L, C.T.shape, "of one row per state and one column per output")
    poles = np.linalg.eigvals(A - L @ C).astype(complex)
    return poles[np.argsort(-np.abs(poles), kind="stable")]


def _gain(A: Matrix, C: Matrix, Q: Matrix, R: Matrix) -> Matrix:
    scale, R = _unit_diagonal(R)
    C = C / scale[:, np.newaxis]
    try:
        P = solve_discrete_are(A.T, C.T, Q, R)
        L: Matrix = np.linalg.solve(C @ P @ C.T + R, C @ P @ A.T).T
    except np.linalg.LinAlgError as error:
        raise ValueError(
            "Q and R must differ less in size: the Riccati equation has no solution in double precision"
        ) from error
    largest = np.abs(np.linalg.eigvals(A - L @ C)).max()
    if not largest < 1.0:
        raise ValueError(
            f"Q must be larger against R: in double precision the slowest pole has the size {largest:.9g}"
        )
    return L / scale


def _unseen_modes(A: Matrix, C: Matrix) -> Poles:
    """Return the eigenvalues of A on the largest subspace that C does not see and A does not leave."""
    A, C = _scaled(A, C)
    size = max(1.0, float(np.linalg.norm(A, 2)))
    basis = _null_space(C)
    while basis.shape[1]:
        moved = A @ basis
        leaving = moved - basis @ (basis.T @ moved)
        kept = _null_space(leaving / size)
        if kept.shape[1] == basis.shape[1]:
            break
        basis = basis @ kept
    return np.linalg.eigvals(basis.T @ A @ basis).astype(complex)


def _scaled(A: Matrix, C: Matrix) -> tuple[Matrix, Matrix]:
    """Return the pair with balanced states and with every row of C of length one."""
    balanced, (scale, _) = matrix_balance(A, permute=False, separate=True)
    C = C * scale
    length = np.linalg.norm(C, axis=1, keepdims=True)
    return balanced, C / np.where(length > 0.0, length, 1.0)


def _null_space(M: Matrix) -> Matrix:
    """Return an orthonormal basis, (columns of M, k), of what M takes to less than `UNSEEN`."""
    largest = np.linalg.norm(M, 2)
    if largest <= UNSEEN:
        return np.eye(M.shape[1])
    basis: Matrix = null_space(M, rcond=UNSEEN / largest)
    return basis


def _root(Q: Matrix) -> Matrix:
    """Return G with Gᵀ G = Q, its rows of the sizes that the diagonal of Q has."""
    scale, unit = _unit_diagonal(Q)
    sizes, directions = np.linalg.eigh(unit)
    root: Matrix = (np.sqrt(np.where(sizes > UNSEEN, sizes, 0.0)) * directions).T * scale
    return root


def _unit_diagonal(M: Matrix) -> tuple[Matrix, Matrix]:
    diagonal = np.abs(np.diag(M))
    scale = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    return scale, M / np.outer(scale, scale)


def _named(modes: Poles) -> str:
    """Write eigenvalues for a message: each once, a pair as one."""
    rounded = modes.round(6) + 0.0
    names = dict.fromkeys(
        f"{mode.real:.7g} ± {mode.imag:.7g}j" if mode.imag else f"{mode.real:.7g}"
        for mode in rounded[rounded.imag >= 0.0]
    )
    return ("the mode " if len(names) == 1 else "the modes ") + ", ".join(names)


def _system(A: npt.ArrayLike, C: npt.ArrayLike) -> tuple[Matrix, Matrix]:
    A = _matrix("A", A)
    n = A.shape[0]
    return _matrix("A", A, (n, n), "square"), _matrix("C", C, (None, n), "of as many columns as A")


def _matrix(
    name: str, value: npt.ArrayLike, shape: tuple[int | None, ...] = (None, None), rule: str = ""
) -> Matrix:
    array = np.asarray(value)
    if array.dtype.kind not in "iuf":
        raise TypeError(f"{name} must be an array of real numbers, not of {array.dtype}")
    if array.ndim != 2 or not array.size:
        raise ValueError(f"{name} must be a matrix, not of shape {array.shape}")
    if any(wanted not in {None, got} for wanted, got in zip(shape, array.shape, strict=True)):
        raise ValueError(f"{name} must be {rule}, not of shape {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite")
    return array.astype(np.float64)


def _symmetric(name: str, M: Matrix, *, definite: bool) -> Matrix:
    rule = "symmetric positive " + ("definite" if definite else "semidefinite")
    _, unit = _unit_diagonal(M)
    if not np.allclose(unit, unit.T, rtol=0.0, atol=UNSEEN):
        raise ValueError(f"{name} must be {rule}: it is not symmetric")
    if np.linalg.eigvalsh(unit)[0] < (SINGULAR if definite else -UNSEEN):
        raise ValueError(
            f"{name} must be {rule}: it has an eigenvalue {'of 0 or ' if definite else ''}below 0"
        )
    return (M + M.T) / 2.0
