"""The regulator, the observers' models and weights, and what is compared."""

from functools import cache

import numpy as np
from scipy import linalg

import compfilt as cf
from compfilt.design import luenberger, observer_poles
from compfilt.motion import GRAVITY
from edge_cube import (
    ACCELEROMETER_NOISE,
    BIAS_WALK,
    COULOMB,
    GYRO_NOISE,
    MODEL,
    PUSHLESS,
    RATES,
    Array,
    T,
    discrete,
    noise,
    readings,
)
from edge_estimators import Model, Scheme, fused, known, observed


@cache
def regulator() -> Array:
    """Return the gain K of u = -K x: deviations of 3°, 60 °/s and 100 rad/s of the wheel weigh as much as 1 A."""
    (A,), (B,) = discrete([MODEL])
    Q, R = np.diag([1.0 / np.radians(3.0) ** 2, 1.0 / np.radians(60.0) ** 2, 1e-4]), np.eye(1)
    P = linalg.solve_discrete_are(A, B, Q, R)
    gain: Array = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
    return gain


@cache
def plain() -> Model:
    """Return the source's model: φ, u_K, u_R seen through the two rates."""
    (A,), (B,) = discrete([MODEL])
    return Model(A, B, np.eye(3)[1:], RATES, regulator())


def with_tilt(model: Model) -> Model:
    """Add the accelerometer's tilt as a third output, with what it feels of the motion."""
    row = np.zeros((1, len(model.A)))
    row[:, :3] = readings(MODEL)[PUSHLESS, :3]
    return model._replace(C=np.vstack((model.C, row)), rows=[*model.rows, PUSHLESS])


def with_constant(model: Model, push: Array, seen: Array, gain: float = 0.0) -> Model:
    """Add a state that stays as it is: `push` is what it does to the others, `seen` what it does to the outputs."""
    n = len(model.A)
    return model._replace(
        A=np.block([[model.A, push.reshape(n, 1)], [np.zeros((1, n)), np.eye(1)]]),
        B=np.vstack((model.B, np.zeros((1, 1)))),
        C=np.hstack((model.C, seen.reshape(-1, 1))),
        gain=np.hstack((model.gain, [[gain]])),
    )


def with_bias(model: Model) -> Model:
    """Add the gyro's bias, which is in both rates."""
    return with_constant(model, np.zeros(len(model.A)), np.isin(model.rows, RATES).astype(float))


def with_torque(model: Model) -> Model:
    """Add what the torque lacks, as a current; the regulator makes up for it."""
    return with_constant(model, model.B, np.zeros(len(model.C)), gain=1.0)


def with_lean(model: Model) -> Model:
    """Add a constant torque on the body, as of a centre of mass beside the middle, as a tilt."""
    return with_constant(model, (model.A - np.eye(len(model.A)))[:, 0], np.zeros(len(model.C)))


def pi_from_noise() -> cf.PiForm:
    """Return the complementary filter that is best for these densities of noise: a Kalman filter without a plant."""
    r, q1, q2 = ACCELEROMETER_NOISE / GRAVITY * T**0.5, GYRO_NOISE * T**0.5, BIAS_WALK / T**0.5
    return cf.PiForm(kp=((q1 / r) ** 2 + 2.0 * q2 / r) ** 0.5, ki=q2 / r)


def schemes() -> dict[str, Scheme]:
    """Return what is compared."""
    gain, y, model = regulator(), noise(), plain()
    R, R3 = y[np.ix_(RATES, RATES)], y[np.ix_([*RATES, PUSHLESS], [*RATES, PUSHLESS])]
    torque = model.B @ model.B.T * (COULOMB / MODEL.torque_constant) ** 2
    bias, current = BIAS_WALK**2, (0.2 * COULOMB / MODEL.torque_constant) ** 2
    return {
        "true tilt": known(gain),
        "complementary, first order": fused(gain, cf.FirstOrder(tau=2.0)),
        "complementary, PI": fused(gain, pi_from_noise()),
        "observer, small Q": observed(model, 1e-10 * np.eye(3), R),
        "observer, large Q": observed(model, 1e-2 * np.eye(3), R),
        "Kalman": observed(model, torque, R),
        "Kalman, accelerometer": observed(with_tilt(model), torque, R3),
        "Kalman, bias": observed(with_bias(model), linalg.block_diag(torque, bias), R),
        "Kalman, bias, torque": observed(
            with_torque(with_bias(model)), linalg.block_diag(0.01 * torque, bias, current), R
        ),
    }


def refusals() -> dict[str, str]:
    """Return what the design says of models with one more state."""
    said = {}
    for name, model in {
        "gyro bias": with_bias(plain()),
        "motor torque": with_torque(plain()),
        "torque on the body": with_lean(plain()),
        "torque on the body, accelerometer": with_lean(with_tilt(plain())),
        "the same and gyro bias": with_bias(with_lean(with_tilt(plain()))),
    }.items():
        R = noise()[np.ix_(model.rows, model.rows)]
        try:
            L = luenberger(model.A, model.C, 1e-6 * np.eye(len(model.A)), R)
        except ValueError as error:
            said[name] = str(error)
        else:
            said[name] = f"accepted, slowest pole {abs(observer_poles(model.A, model.C, L)[0]):.4f}"
    return said
