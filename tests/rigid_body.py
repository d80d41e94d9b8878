"""Rigid bodies that turn about a fixed pivot, what their sensors read, and slow ways back.

Nothing here knows the library: an oracle for accelerometer arrays, the balancing cube's pipeline and observers. S1 is the thesis
chapter on the cube's state estimation, see docs/derivations.md.

Conventions
-----------
* Vectors are in body axes, time is axis 0, ``positions`` are from the pivot in m.
* ``gravity`` is the specific force at the pivot, +g along up; M = [alpha]x + [omega]x^2 takes a position to its acceleration.
* A sensor reads S (M r + gravity) and S omega, with S from the body's axes to its own.
* The 12 unknowns of the extraction are M row by row and gravity; the 6 with a known rate are alpha and gravity.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

AXES = "xyz"
QUANTITIES = ("gravity", "angular_acceleration")

# --------------------------------------------------------------------------------------------------------------- layouts


@dataclass(frozen=True)
class Layout:
    """Sensors on a body: positions (s, 3), rotations (s, 3, 3), channels in use (s, 3), their noise (s, 3)."""

    positions: np.ndarray
    rotations: np.ndarray
    channels: np.ndarray
    sigma: np.ndarray

    @property
    def arguments(self):
        """What describes it to a library."""
        return self.positions, self.rotations, self.channels, self.sigma

    @property
    def count(self):
        return len(self.positions)

    @property
    def used(self):
        """(sensor, channel) of the channels in use, in memory order."""
        return np.argwhere(self.channels)

    @property
    def size(self):
        """The length that makes positions comparable with 1."""
        return float(np.abs(self.positions).max()) or 1.0

    def turned(self, rotation):
        """The same sensors for a body whose axes are turned: v_new = rotation v_old."""
        return Layout(self.positions @ rotation.T, self.rotations @ rotation.T, self.channels, self.sigma)


def layout(positions, rotations=None, channels=None, sigma=1.0):
    positions = np.array(positions, dtype=float)
    count = len(positions)
    rotations = np.tile(np.eye(3), (count, 1, 1)) if rotations is None else np.array(rotations, dtype=float)
    channels = np.ones((count, 3), bool) if channels is None else np.array(channels, dtype=bool)
    sigma = np.array(sigma, dtype=float)
    sigma = np.broadcast_to(sigma[:, None] if sigma.ndim == 1 else sigma, (count, 3)).copy()
    return Layout(positions, rotations, channels, sigma)


def random_rotation(rng, reflections=False):
    """Uniform over the rotations, or over all orthogonal matrices."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if reflections else q * np.linalg.det(q)


def signed_permutations():
    """The 48 ways to mount a sensor along the body's axes, reflections included."""
    orders = [(0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)]
    signs = [(a, b, c) for a in (1, -1) for b in (1, -1) for c in (1, -1)]
    return np.array([np.diag(sign) @ np.eye(3)[list(order)] for order in orders for sign in signs])


EDGE = 0.15  # m, of the thesis's cube
# Up from the corner on which the cube stands, in its own axes, and phi2, phi3 there: S1 (1.7).
UP = np.ones(3) / math.sqrt(3)
BALANCED = (-math.asin(1 / math.sqrt(3)), math.radians(135))
# S1 (1.15)-(1.20): the body axes of a sensor's x and y; its z, which is not used, completes a right-handed system.
X_AND_Y = [(1, 0), (1, 0), (2, 1), (2, 1), (0, 2), (0, 2)]
FACES = (2, 0, 1)  # normals of the faces of sensors 1 and 2, 3 and 4, 5 and 6


def thesis_sensors(positions, sigma=1.0):
    """Six sensors of two channels as S1 mounts them."""
    rotations = []
    for x, y in X_AND_Y:
        first, second = np.eye(3)[x], np.eye(3)[y]
        rotations.append([first, second, np.cross(first, second)])
    return layout(positions, rotations, np.tile([True, True, False], (6, 1)), sigma)


def thesis_cube(sigma=1.0):
    """The six sensors on the six faces, the pivot at the corner where three of them meet.

    S1 gives no positions. The axis that a sensor does not use is its face's normal. Those on the three faces at the pivot sit
    near it, which keeps the noise low; a place on a face's diagonal would make the four that see an axis lie in a plane.
    """
    near, far = (0.0, 0.2, 0.4), (1.0, 0.4, 0.8)
    places = [EDGE * np.roll(across, normal) for normal in FACES for across in (near, far)]
    return thesis_sensors(places, sigma)


def face_centres(sigma=1.0):
    """The same sensors in the middle of the faces: each axis is seen by two pairs that are symmetric about the cube's middle."""
    places = [EDGE * np.roll((depth, 0.5, 0.5), normal) for normal in FACES for depth in (0.0, 1.0)]
    return thesis_sensors(places, sigma)


# ---------------------------------------------------------------------------------------------------------------- motion


@dataclass(frozen=True)
class Motion:
    """Rate, angular acceleration and gravity in body axes, each (n, 3); the three turns (n, 3) where there are any."""

    omega: np.ndarray
    alpha: np.ndarray
    gravity: np.ndarray
    angles: np.ndarray | None = None

    def __len__(self):
        return len(self.omega)


def random_motion(rng, count, rate=3.0, acceleration=20.0, g=9.81):
    """Moments that have nothing to do with each other: any attitude, rate and angular acceleration."""
    up = rng.normal(size=(count, 3))
    up *= g / np.linalg.norm(up, axis=1, keepdims=True)
    return Motion(rate * rng.normal(size=(count, 3)), acceleration * rng.normal(size=(count, 3)), up)


def cross_matrix(v):
    """[v]x over the leading axes."""
    v = np.asarray(v, dtype=float)
    x, y, z = np.moveaxis(v, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def motion_matrix(omega, alpha):
    """M of S1 (1.21): the acceleration of a point r is M r."""
    spin = cross_matrix(omega)
    return cross_matrix(alpha) + spin @ spin


def turned_back(axis, angle, v):
    """R(axis, angle)' v: the components of v after the axes have turned."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out = v.copy()
    out[:, i], out[:, j] = c * v[:, i] + s * v[:, j], c * v[:, j] - s * v[:, i]
    return out


def cube_motion(angles, rates, accelerations, g=9.81):
    """The cube's three turns x, y, z one after the other (body to world Rx Ry Rz), world axis 1 down.

    Each turn changes the components of what came before and adds its own rate; the derivative of a turned vector has the part
    from the turning axes.
    """
    count = len(angles)
    omega, alpha = np.zeros((count, 3)), np.zeros((count, 3))
    up = np.tile([-g, 0.0, 0.0], (count, 1))
    for axis in range(3):
        angle, unit = angles[:, axis], np.eye(3)[axis]
        own_rate = rates[:, axis, None] * unit
        omega = turned_back(axis, angle, omega)
        alpha = turned_back(axis, angle, alpha) - np.cross(own_rate, omega)
        omega, alpha = omega + own_rate, alpha + accelerations[:, axis, None] * unit
        up = turned_back(axis, angle, up)
    return Motion(omega, alpha, up, angles)


def swing(t, centre, amplitudes, frequencies, phases=(0.0, 1.0, 2.0), g=9.81):
    """The three turns as sines about a centre (rad, rad/s), with exact kinematics."""
    amplitudes, w = np.asarray(amplitudes, dtype=float), np.asarray(frequencies, dtype=float)
    argument = np.outer(t, w) + np.asarray(phases)
    angles = np.asarray(centre) + amplitudes * np.sin(argument)
    rates, accelerations = amplitudes * w * np.cos(argument), -amplitudes * w**2 * np.sin(argument)
    return cube_motion(angles, rates, accelerations, g)


def cube_gravity(phi2, phi3, g=9.81):
    """S1 (1.7)."""
    c2, s2, c3, s3 = np.cos(phi2), np.sin(phi2), np.cos(phi3), np.sin(phi3)
    return g * np.stack([-c2 * c3, c2 * s3, -s2], axis=-1)


def accelerations_read(sensors, motion):
    """(n, s, 3) in the sensors' axes; the channels that are not in use are read too."""
    M = motion_matrix(motion.omega, motion.alpha)
    body = np.einsum("nij,sj->nsi", M, sensors.positions) + motion.gravity[:, None]
    return np.einsum("sij,nsj->nsi", sensors.rotations, body)


def rates_read(sensors, motion):
    """(n, s, 3) in the sensors' axes."""
    return np.einsum("sij,nj->nsi", sensors.rotations, motion.omega)


def mean_rate(sensors, gyr):
    """The mean over the sensors whose three rates are there; NaN where there is none."""
    out = np.full((len(gyr), 3), np.nan)
    for n, row in enumerate(gyr):
        turned = [S.T @ w for S, w in zip(sensors.rotations, row, strict=True) if np.isfinite(w).all()]
        if turned:
            out[n] = sum(turned) / len(turned)
    return out


# ---------------------------------------------------------------------------------------------- the general extraction


def equations(sensors, known_rate=False):
    """One row per channel in use: what it reads of the unknowns."""
    rows = []
    for sensor, channel in sensors.used:
        direction, r = sensors.rotations[sensor, channel], sensors.positions[sensor]
        # direction . (M r) = sum of direction_i M_ij r_j;  direction . (alpha x r) = alpha . (r x direction)
        of_motion = np.cross(r, direction) if known_rate else np.outer(direction, r).ravel()
        rows.append(np.concatenate([of_motion, direction]))
    return np.array(rows)


def functionals(quantity, known_rate=False):
    """(3, unknowns): gravity, or the angular acceleration (the skew part of M), from the unknowns."""
    count = 6 if known_rate else 12
    if quantity == "gravity":
        return np.eye(count)[-3:]
    if known_rate:
        return np.eye(count)[:3]
    rows = np.zeros((3, count))
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        rows[axis, 3 * j + i], rows[axis, 3 * i + j] = 0.5, -0.5
    return rows


def in_unit_lengths(sensors):
    """The same layout with positions of the size of 1; M and alpha are then in m/s^2."""
    return Layout(sensors.positions / sensors.size, sensors.rotations, sensors.channels, sensors.sigma)


def to_quantity(sensors, quantity):
    """From the unit length back: only the motion's unknowns carry it."""
    return 1.0 if quantity == "gravity" else 1 / sensors.size


def weights(sensors, quantity="gravity", known_rate=False):
    """(3, s, 3): the linear map from the readings, by weighted least squares."""
    H = equations(in_unit_lengths(sensors), known_rate)
    sigma = sensors.sigma[sensors.channels]
    whitened = np.linalg.pinv(H / sigma[:, None], rcond=1e-9) / sigma
    out = np.zeros((3, *sensors.channels.shape))
    out[:, sensors.channels] = to_quantity(sensors, quantity) * functionals(quantity, known_rate) @ whitened
    return out


def centripetal(sensors, omega):
    """(n, s, 3): S [omega]x^2 r, which a known rate takes out of the readings."""
    spin = cross_matrix(omega)
    return np.einsum("sij,njk,sk->nsi", sensors.rotations, spin @ spin, sensors.positions)


def extract(sensors, acc, omega=None):
    """(gravity, angular acceleration), each (n, 3), row by row by numpy's least squares."""
    known = omega is not None
    if known:
        acc = acc - centripetal(sensors, omega)
    H = equations(in_unit_lengths(sensors), known)
    sigma = sensors.sigma[sensors.channels]
    unknowns = np.array(
        [np.linalg.lstsq(H / sigma[:, None], row[sensors.channels] / sigma, rcond=1e-9)[0] for row in acc]
    ).reshape(len(acc), H.shape[1])
    return tuple(
        to_quantity(sensors, quantity) * unknowns @ functionals(quantity, known).T for quantity in QUANTITIES
    )


def noise_gain(sensors, map_):
    """The standard deviation of every output of a linear map (3, s, 3) for independent noise."""
    return np.sqrt(((map_ * sensors.sigma) ** 2).sum(axis=(1, 2)))


# ------------------------------------------------------------------------------------------------- what can be solved


def singular_values(sensors, known_rate=False):
    """Of the equations in unit lengths."""
    return np.linalg.svd(equations(in_unit_lengths(sensors), known_rate), compute_uv=False)


def condition(sensors, known_rate=False):
    """The largest singular value over the smallest that is not zero."""
    values = singular_values(sensors, known_rate)
    return values[0] / values[values > 1e-9 * values[0]].min()


def open_components(sensors, quantity="gravity", known_rate=False):
    """(3,): how far the unknowns may move along each output without any channel noticing."""
    _, values, rows = np.linalg.svd(equations(in_unit_lengths(sensors), known_rate))
    rank = int((values > 1e-9 * values[0]).sum())
    return np.linalg.norm(functionals(quantity, known_rate) @ rows[rank:].T, axis=1)


def solvable(sensors, quantity="gravity", known_rate=False):
    """(3,) bool: every null vector is zero there."""
    return open_components(sensors, quantity, known_rate) < 1e-7


def is_clear_cut(sensors):
    """Whether rank and null space are beyond doubt: nothing lies between rounding and a thousandth."""
    for known in (False, True):
        values = singular_values(sensors, known)
        if (((values > 1e-11 * values[0]) & (values < 1e-3 * values[0])).any()) or values[0] == 0:
            return False
        for quantity in QUANTITIES:
            components = open_components(sensors, quantity, known)
            if ((components > 1e-9) & (components < 1e-3)).any():
                return False
    return True


def echelon(rows):
    """Integer rows by elimination in fractions: (column of the first number, row), in the order found."""
    found = []
    for row in rows:
        rest = without(found, row)
        column = next((i for i, value in enumerate(rest) if value), None)
        if column is not None:
            found.append((column, rest))
    return found


def without(found, row):
    """What is left of a row after elimination."""
    rest = [Fraction(int(value)) for value in row]
    for column, other in found:
        if rest[column]:
            factor = rest[column] / other[column]
            rest = [a - factor * b if b else a for a, b in zip(rest, other, strict=True)]
    return rest


def solvable_exactly(sensors, unit):
    """{(quantity, known_rate): (3,) bool} for sensors along the axes at whole multiples of ``unit``, without rounding.

    An output can be solved where its row adds nothing to the span of the equations.
    """
    whole = Layout(np.rint(sensors.positions / unit), sensors.rotations, sensors.channels, sensors.sigma)
    solved = {}
    for known in (False, True):
        found = echelon(np.rint(equations(whole, known)))
        for quantity in QUANTITIES:
            rows = np.rint(2 * functionals(quantity, known))
            solved[quantity, known] = np.array([not any(without(found, row)) for row in rows])
    return solved


# -------------------------------------------------------------------------------------------------- the aligned form


def aligned_weights(sensors, quantity="gravity"):
    """(3, s, 3) for sensors along the body's axes: S1 (1.22)-(1.27), of all weights those with the least noise.

    A channel along body axis k reads sign * (m_k . r + s_k) with the row m_k of M. The weights b of the channels along k are
    unbiased for s_k when sum b r = 0 and sum b = 1, and for M_kj when sum b r = e_j and sum b = 0.
    """
    if quantity == "gravity":
        return np.array([row_weights(sensors, axis, np.array([0.0, 0.0, 0.0, 1.0])) for axis in range(3)])
    out = []
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        lower, upper = (row_weights(sensors, row, np.eye(4)[column]) for row, column in ((j, i), (i, j)))
        out.append((lower - upper) / 2)
    return np.array(out)


def row_weights(sensors, axis, wanted):
    """min sum (b sigma)^2 with sum b (r, 1) = wanted: any solution, less its part along the solutions of sum b (r, 1) = 0."""
    places = [(s, c) for s, c in sensors.used if abs(sensors.rotations[s, c, axis]) > 0.5]
    out = np.zeros(sensors.channels.shape)
    if not places:
        return np.full(sensors.channels.shape, np.nan)
    signs = np.array([np.sign(sensors.rotations[s, c, axis]) for s, c in places])
    sigma = np.array([sensors.sigma[s, c] for s, c in places])
    columns = np.array([[*sensors.positions[s] / sensors.size, 1.0] for s, c in places]).T
    wanted = wanted if wanted[3] else wanted / sensors.size
    some = np.linalg.lstsq(columns, wanted, rcond=1e-9)[0]
    if np.abs(columns @ some - wanted).max() > 1e-7 * np.abs(wanted).max():
        return np.full(sensors.channels.shape, np.nan)
    _, values, rows = np.linalg.svd(columns)
    free = rows[int((values > 1e-9 * values[0]).sum()) :].T
    along = np.linalg.lstsq(sigma[:, None] * free, sigma * some, rcond=None)[0]
    for (s, c), weight in zip(places, signs * (some - free @ along), strict=True):
        out[s, c] = weight
    return out


# -------------------------------------------------------------------------------------------------------------- observer


def correction(A, L):
    """M with A M = L, or None."""
    M = np.linalg.lstsq(A, L, rcond=1e-12)[0]
    return M if np.allclose(A @ M, L, rtol=0, atol=1e-9 * max(1.0, np.abs(L).max())) else None


def observe(A, B, C, L, y, u, initial=None):
    """(predicted, filtered), each (samples, n): x(k+1) = A x + B u + L (y - C x), sample by sample.

    A missing component of y does not correct; a missing component of u is the last one, 0 before the first.
    """
    A, B, C, L = (np.asarray(matrix, dtype=float) for matrix in (A, B, C, L))
    x = np.zeros(len(A)) if initial is None else np.array(initial, dtype=float)
    M, held = correction(A, L), np.zeros(B.shape[1])
    predicted, filtered = [], []
    for measured, driven in zip(y, u, strict=True):
        error = np.where(np.isfinite(measured), measured - C @ x, 0.0)
        held = np.where(np.isfinite(driven), driven, held)
        predicted.append(x)
        filtered.append(np.full(len(A), np.nan) if M is None else x + M @ error)
        x = A @ x + B @ held + L @ error
    shape = (len(predicted), len(A))
    return np.reshape(predicted, shape), np.reshape(filtered, shape)
