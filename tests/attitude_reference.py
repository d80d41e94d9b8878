"""A slow reference for the attitude filters: rotation matrices, exact exponentials, linear systems that are solved in full.

Nothing below knows a quaternion, a series for an exponential, or a recurrence of the library: an attitude is a matrix, the gains
and the low-pass are the closed loops of ``reference.py`` by backward Euler.

Conventions
-----------
* R takes body vectors to the world: its rows are east, north and up as the body sees them.
* ``Samples`` holds (n, 3) arrays and the time step that ends at each sample. NaN, infinity and a vector of zeros are missing.
* The first step begins at the start attitude. Without one, the first specific force is the start, and nothing is predicted before it.
* A step of no time predicts nothing, and a correction after no time has no gain.
* A rate of 1e6 rad/s or more is missing, and so is a force of 1e6 m/s^2 or more where its size counts.
* Flags are the bits of docs/conventions.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

import reference as linear

EAST, NORTH, UP = np.eye(3)
G = 9.80665
FASTEST = STRONGEST = 1e6

ACC_MISSING, GYR_HELD, GYR_MISSING, NOT_STARTED, RESTARTED, MAG_MISSING, AMBIGUOUS = 1, 2, 4, 8, 16, 64, 128

# ------------------------------------------------------------------------------------------------------------ rotations


def exp(turn):
    """The rotation by a vector in rad, from the sine and the cosine of its length."""
    angle = math.sqrt(float(turn @ turn))
    if angle == 0:
        return np.eye(3)
    axis = linear.cross_matrix(turn / angle)
    return np.eye(3) + math.sin(angle) * axis + (1 - math.cos(angle)) * axis @ axis


def smallest_turn(start, end):
    """The rotation that takes a unit vector to another; None where they are opposite and there are many."""
    axis = np.cross(start, end)
    sine, cosine = math.sqrt(float(axis @ axis)), float(start @ end)
    if sine == 0:
        return np.eye(3) if cosine > 0 else None
    return exp(axis / sine * math.atan2(sine, cosine))


def half_turn_across(vector):
    """One of the half turns that take a unit vector to its opposite."""
    across = np.cross(vector, np.eye(3)[np.abs(vector).argmin()])
    return exp(math.pi * across / np.linalg.norm(across))


def vee(skew):
    """The vector v of [v]x."""
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0]])


def unit(vector):
    """The direction, or None."""
    if vector is None or not np.isfinite(vector).all() or not vector.any():
        return None
    scaled = vector / np.abs(vector).max()
    return scaled / np.linalg.norm(scaled)


def level_part(vector, up):
    """The direction of what is across `up`, or None where that is next to nothing."""
    across = vector - up * (vector @ up)
    return unit(across) if across @ across > 1e-6 else None


def standing(up):
    """The attitude after the smallest turn that brings `up` up; straight down it is a turn about x."""
    turn = smallest_turn(up, UP)
    return exp(math.pi * EAST) if turn is None else turn


def facing(north, up):
    """The attitude whose horizontal north and whose up are these."""
    return np.array([np.cross(north, up), north, up])


def quaternions(R):
    """Scalar first."""
    return Rotation.from_matrix(R).as_quat()[..., [3, 0, 1, 2]]


def matrices(q):
    """R of quaternions, scalar first; NaN stays NaN."""
    q = np.asarray(q, dtype=float)
    there = np.isfinite(q).all(axis=-1)
    R = np.full((*q.shape[:-1], 3, 3), np.nan)
    if there.any():
        R[there] = Rotation.from_quat(q[there][..., [1, 2, 3, 0]]).as_matrix()
    return R


def angles_between(a, b):
    """The angle in rad of the turn between attitudes (matrices), accurate for small ones."""
    turn = np.swapaxes(a, -1, -2) @ b
    skew = (turn - np.swapaxes(turn, -1, -2)) / 2
    sine = np.sqrt(skew[..., 2, 1] ** 2 + skew[..., 0, 2] ** 2 + skew[..., 1, 0] ** 2)
    return np.arctan2(sine, (np.trace(turn, axis1=-2, axis2=-1) - 1) / 2)


def angles_between_directions(a, b):
    """The angle in rad between vectors."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1))


# -------------------------------------------------------------------------------------------------------------- signals


@dataclass(frozen=True)
class Samples:
    """What the sensors say; dt in s is the step that ends at a sample."""

    gyr: np.ndarray
    acc: np.ndarray
    dt: np.ndarray
    mag: np.ndarray | None = None

    def __len__(self):
        return len(self.dt)

    @property
    def t(self):
        """The times of the samples, for steps that begin with 0."""
        return np.cumsum(self.dt)

    @property
    def arrays(self):
        return {"gyr": self.gyr, "acc": self.acc} | ({} if self.mag is None else {"mag": self.mag})

    def changed(self, **arrays):
        return Samples(**{"dt": self.dt, "mag": self.mag, **self.arrays, **arrays})

    def astype(self, dtype):
        return self.changed(**{name: array.astype(dtype) for name, array in self.arrays.items()})

    def rows(self):
        mag = [None] * len(self) if self.mag is None else np.asarray(self.mag, dtype=float)
        return zip(np.asarray(self.gyr, float), np.asarray(self.acc, float), mag, self.dt, strict=True)


@dataclass(frozen=True)
class Motion:
    """R before the first step and after every step, and the body rate, constant within a step."""

    R: np.ndarray
    gyr: np.ndarray
    dt: np.ndarray

    @property
    def start(self):
        """The quaternion before the first step."""
        return quaternions(self.R[0])

    def samples(self, acceleration=None, field=None, *, bias=(0.0, 0.0, 0.0)):
        """Sensors without noise: acceleration (m/s^2) and field in world axes, one or one a sample."""
        to_body = np.swapaxes(self.R[1:], 1, 2)
        force = G * UP + (0.0 if acceleration is None else np.asarray(acceleration))
        force = np.broadcast_to(force, (len(self.dt), 3))
        mag = None
        if field is not None:
            mag = (to_body @ np.broadcast_to(field, (len(self.dt), 3))[..., None])[..., 0]
        return Samples(self.gyr + bias, (to_body @ force[..., None])[..., 0], self.dt, mag)


def moved(gyr, dt, start=None):
    """The motion of these body rates."""
    gyr = np.asarray(gyr, dtype=float)
    dt = np.broadcast_to(np.asarray(dt, dtype=float), (len(gyr),))
    R = [np.eye(3) if start is None else start]
    for rate, step in zip(gyr, dt, strict=True):
        R.append(R[-1] @ exp(rate * step))
    return Motion(np.array(R), gyr, dt)


def at_rest(count, dt, R=None):
    """A body that does not move."""
    return moved(np.zeros((count, 3)), dt, R)


def waves(rng, t, size, slowest=0.3, fastest=3.0):
    """Three smooth signals of about this size: a few sines each, in rad/s."""
    omega, phase = rng.uniform(slowest, fastest, (4, 1, 3)), rng.uniform(0, 2 * math.pi, (4, 1, 3))
    return size * (rng.normal(size=(4, 1, 3)) * np.sin(omega * t[:, None] + phase)).sum(axis=0) / 2


def random_motion(rng, dt, rate=3.0):
    """Smooth, of any attitude; dt one a sample, in s."""
    dt = np.asarray(dt, dtype=float)
    return moved(waves(rng, np.cumsum(dt), rate), dt, random_attitude(rng))


def random_attitude(rng):
    return Rotation.random(random_state=rng).as_matrix()


def random_samples(rng, dt, *, field=None, rate=3.0, acceleration=4.0, noise=0.1):
    """A smooth motion, its accelerations, and noise on all sensors: all that a filter's branches can tell apart."""
    motion = random_motion(rng, dt, rate)
    clean = motion.samples(waves(rng, np.cumsum(motion.dt), acceleration, fastest=8.0), field)
    noisy = {name: array + noise * rng.normal(size=array.shape) for name, array in clean.arrays.items()}
    return motion, clean.changed(**noisy)


def with_gaps(rng, samples, dt):
    """Single missing samples, runs of them, infinities and zero vectors in every signal."""
    holed = {}
    for name, signal in samples.arrays.items():
        array = signal.copy()
        array[rng.random(len(array)) < 0.05, rng.integers(3)] = np.nan
        array[rng.random(len(array)) < 0.03] = 0.0 if name != "gyr" else np.inf
        for length in (0.05, 0.3):
            start, count = rng.integers(5, len(array)), round(length / dt)
            array[start : start + count] = np.nan
        holed[name] = array
    return samples.changed(**holed)


@dataclass(frozen=True)
class Result:
    """What a filter knows after each sample."""

    R: np.ndarray
    up: np.ndarray
    bias: np.ndarray
    at_rest: np.ndarray
    flags: np.ndarray

    @classmethod
    def of(cls, rows):
        return cls(*(np.array(column) for column in zip(*rows, strict=True)))


# -------------------------------------------------------------------------------------------------------- both filters


class HeldRate:
    """A missing rate is the last one for so many seconds, and then zero until there is one again."""

    def __init__(self, hold):
        self.hold, self.value, self.age = hold, np.zeros(3), 0.0

    def take(self, gyr, dt):
        """The rate and its flag."""
        if np.abs(gyr).max() < FASTEST:
            self.value, self.age = gyr, 0.0
            return gyr, 0
        self.age += dt
        if self.age <= self.hold:
            return self.value, GYR_HELD
        self.value = np.zeros(3)
        return self.value, GYR_MISSING


class Filter:
    """What runs samples; ``step`` takes one and returns its flags."""

    def __init__(self, hold):
        self.rate = HeldRate(hold)
        self.R, self.bias, self.started, self.resting = np.eye(3), np.zeros(3), False, False

    @property
    def up(self):
        return self.R[2]

    def run(self, samples, initial=None):
        """All samples from the start attitude (a quaternion), or from the first specific force."""
        if initial is not None:
            self.start_from(matrices(initial))
        return Result.of([self.row(self.step(*sample)) for sample in samples.rows()])

    def attitude(self):
        """R and up as they are given out."""
        return self.R, self.up

    def row(self, flags):
        if self.started:
            return *self.attitude(), self.bias, self.resting, flags
        return np.full((3, 3), np.nan), np.full(3, np.nan), np.zeros(3), False, flags


# -------------------------------------------------------------------------------------------------------------- Mahony


class Mahony(Filter):
    """Mahony, Hamel, Pflimlin 2008, predict and then correct.

    R- = R exp([(W - b) dt]x)  (direct: exp([R_y (W - b) dt]x) R);  R = R- exp([L_1 w]x);  b = b - L_2 w

    * L is the backward Euler gain of the linear filter for the time since the last correction, of the tilt and of the heading each;
      L_1 is at least what makes the estimate the mean of all measurements so far. The tilt is corrected first: by the part of w
      across the estimated vertical, where there is an accelerometer; then the heading, by the part along it.
    * w is v x v^ for the vertical, plus the same for the horizontal north across the estimated vertical (explicit), or
      vee(1/2 (R~ - R~')) with R~ = R-' R_y (passive, direct).
    * R_y has the measured vertical, and the measured north or, without one, the smallest turn from the attitude that the gyro predicts.
    * The first field sets the heading; before it, a field rebuilds nothing.
    """

    def __init__(self, kp, ki=0.0, form="explicit", *, bias_limit=0.1, acc_range=math.inf, hold=0.1):
        super().__init__(hold)
        self.design = linear.Design((kp, ki) if ki else (kp,))
        self.form, self.bias_limit, self.acc_range = form, bias_limit, acc_range
        self.age = self.since_tilt = self.since_heading = 0.0
        self.heading_known = False

    def start_from(self, R):
        self.R, self.started, self.heading_known, self.age = R, True, True, math.inf

    def step(self, gyr, acc, mag, dt):
        rate, flags = self.rate.take(gyr, dt)
        up = unit(acc) if np.abs(acc).max() < self.acc_range else None
        if up is None:
            flags |= ACC_MISSING
        north = unit(mag)
        if north is not None and level_part(north, self.up if up is None else up) is None:
            north = None
        if mag is not None and north is None:
            flags |= MAG_MISSING
        if not self.started:
            return flags | self.begin(up, north)
        moving = np.zeros(3) if flags & GYR_MISSING else rate - self.bias
        self.predict(moving * dt, up, north if self.heading_known else None)
        self.age += dt
        self.since_tilt += dt
        self.since_heading += dt
        if north is not None and not self.heading_known:
            self.face(north)
        innovation = self.innovation(up, north)
        yaw = self.up * (self.up @ innovation)
        if up is not None:
            self.correct(innovation - yaw, self.since_tilt, dt)
            self.since_tilt = 0.0
        if north is not None:
            self.correct(yaw, self.since_heading, dt)
            self.since_heading = 0.0
        return flags

    def begin(self, up, north):
        if up is None:
            return NOT_STARTED
        self.R, self.started = standing(up), True
        if north is not None:
            self.face(north)
        return 0

    def face(self, north):
        north = level_part(north, self.up)
        if north is not None:
            self.R, self.heading_known = facing(north, self.up), True

    def predict(self, turn, up, north):
        predicted = self.R @ exp(turn)
        if self.form == "direct":
            rebuilt = self.rebuilt(predicted, up, north)
            if rebuilt is not None:
                predicted = exp(rebuilt @ turn) @ self.R
        self.R = predicted

    @staticmethod
    def rebuilt(R, up, north):
        if up is None:
            return None
        north = None if north is None else level_part(north, up)
        if north is not None:
            return facing(north, up)
        turn = smallest_turn(up, R[2])
        return None if turn is None else R @ turn

    def innovation(self, up, north):
        rebuilt = None if self.form == "explicit" else self.rebuilt(self.R, up, north)
        if rebuilt is not None:
            turn = self.R.T @ rebuilt
            return vee(turn - turn.T) / 2
        innovation = np.zeros(3)
        if up is not None:
            innovation += np.cross(up, self.up)
        if north is not None and (level := level_part(north, self.up)) is not None:
            innovation += np.cross(level, self.R[1])
        return innovation

    def correct(self, innovation, since, dt):
        if since == 0:
            return
        gain = linear.step_gain(self.design, since)
        self.R = self.R @ exp(innovation * max(gain[0], since / (self.age + dt)))
        # Level 1 of the linear filter is minus the bias.
        if len(gain) > 1:
            self.bias = self.bias - gain[1] * innovation
            size = np.linalg.norm(self.bias)
            self.bias = self.bias * min(1.0, self.bias_limit / size) if size else self.bias


# ------------------------------------------------------------------------------------------------------ gravity filter


@dataclass(frozen=True)
class Rest:
    """When a body rests; the names are the library's."""

    rest_time: float = 1.5
    rest_rate: float = math.radians(2.0)
    rest_force: float = 0.5
    rest_drift: float = 0.1
    bias_limit: float = math.radians(2.0)
    memory: float = 0.5
    bias_memory: float = 2.0


class RestFinder:
    """Still is a sample near the low-passed gyro and accelerometer, with the former small and the latter where it was.

    A body that has been still for long enough rests, and its bias moves to the low-passed gyro: as a mean first, then with a memory.
    The time before the first sample counts for nothing, at the start and after a pause.
    """

    def __init__(self, rule):
        self.rule, self.bias, self.rested = rule, np.zeros(3), 0.0
        self.renew()

    def renew(self):
        """Keeps the bias, and for how long it has been averaged."""
        self.gyr = self.acc = self.anchor = None
        self.age = self.still = 0.0

    def disturb(self):
        self.still = 0.0

    def sees(self, gyr, acc, dt):
        """Whether the body rests."""
        if self.gyr is None:
            self.gyr, self.acc, self.anchor = gyr, acc, acc
            return False
        self.age = min(self.age + dt, self.rule.memory)
        weight = dt / (self.age + dt) if dt else 0.0
        self.gyr = self.gyr + weight * (gyr - self.gyr)
        self.acc = self.acc + weight * (acc - self.acc)
        if not self.is_still(gyr, acc):
            self.still, self.anchor = 0.0, self.acc
            return False
        self.still = min(self.still + dt, self.rule.rest_time)
        if self.still < self.rule.rest_time:
            return False
        self.rested = min(self.rested + dt, self.rule.bias_memory)
        if self.rested:
            self.bias = self.bias + dt / self.rested * (self.gyr - self.bias)
        return True

    def is_still(self, gyr, acc):
        rule = self.rule
        return (
            np.abs(self.gyr).max() <= rule.bias_limit
            and np.linalg.norm(gyr - self.gyr) < rule.rest_rate
            and np.linalg.norm(acc - self.acc) < rule.rest_force
            and np.linalg.norm(self.acc - self.anchor) < rule.rest_drift
        )


class GravityFilter(Filter):
    """The vertical as a low-pass of the specific force f in the frame that the gyro turns.

    x_i = exp(-[w dt]x) x_i, then one backward Euler step of the linear filter with y = f - gyro_delay w x f and no input.

    * The design has omega0 = sqrt(2)/tau: order 2 with a damping ratio, other orders by Butterworth.
    * At the start the filter is faster. With split 1, up to order 2, each coefficient is at least that of a filter with all poles at
      -2/t; otherwise x_0 is the mean of all so far, until 2/t is as slow as the slower of the poles' mean and their geometric mean.
    * A correction counts for its own step, after missing samples for no more than 0.1 s; after a step of more than 1 s the vertical
      starts anew.
    * The attitude is turned by the gyro, and then by the smallest turn that brings x_0 up.
    * The heading moves to north by a first-order filter on the sine of its error, which is 1 from a right angle on; after a first field a
      mean first, from a given heading not.
    * The result is turned on by the last rate for the time `advance`; the filter itself goes on from where it was.
    """

    gap, cap, start = 1.0, 0.1, 2.0

    def __init__(
        self,
        tau=3.0,
        *,
        order=2,
        split=1,
        zeta=0.5,
        gyro_delay=0.0,
        advance=0.0,
        heading_tau=10.0,
        acc_range=math.inf,
        hold=0.1,
        **rest,
    ):
        super().__init__(hold)
        omega0 = math.sqrt(2.0) / tau
        if order == 2:
            self.design = linear.Design((2 * zeta * omega0, omega0**2), 1, split)
        else:
            self.design = linear.butterworth(omega0, order, split=split)
        self.delay, self.advance = gyro_delay, advance
        self.heading_tau, self.acc_range = heading_tau, acc_range
        self.rest = RestFinder(Rest(**rest))
        self.levels, self.moving = np.zeros((order, 3)), False
        self.age = self.since = 0.0
        self.heading_known, self.heading_age, self.heading_since = False, 0.0, 0.0

    def start_from(self, R):
        self.R, self.started, self.age = R, True, math.inf
        self.heading_known, self.heading_age = True, math.inf
        self.levels[0] = G * R[2]

    @property
    def up(self):
        return unit(self.levels[0])

    def attitude(self):
        rate = self.rate.value - self.bias if self.moving else np.zeros(3)
        ahead = exp(rate * self.advance)
        return self.R @ ahead, self.up @ ahead

    def step(self, gyr, acc, mag, dt):
        held, flags = self.rate.take(gyr, dt)
        rate = held if flags & GYR_MISSING else held - self.bias
        self.moving = not flags & GYR_MISSING
        there = unit(acc) is not None and np.abs(acc).max() < min(self.acc_range, STRONGEST)
        if dt > self.gap and self.started:
            self.started, self.age, self.since = False, 0.0, 0.0
            self.rest.renew()
            flags |= RESTARTED
        turn = exp(rate * dt)
        self.R = self.R @ turn
        force = acc - self.delay * np.cross(rate, acc) if there else None
        flags |= (0 if there else ACC_MISSING) | self.follow(force, turn, dt)
        if there and not flags & (GYR_HELD | GYR_MISSING):
            self.resting = self.rest.sees(gyr, acc, dt)
        else:
            self.rest.disturb()
            self.resting = False
        self.bias = self.rest.bias
        if not self.started:
            return flags
        level = smallest_turn(self.up, self.R[2])
        self.R = self.R @ (half_turn_across(self.up) if level is None else level)
        return flags | self.turn_to_north(mag, dt)

    def follow(self, force, turn, dt):
        """The low-pass."""
        if not self.started:
            if force is None:
                return NOT_STARTED
            self.levels[:] = 0.0
            self.levels[0], self.started = force, True
            return 0
        self.levels = self.levels @ turn
        self.age += dt
        self.since += dt
        if force is None:
            return 0
        since, counted, self.since = self.since, max(dt, min(self.since, self.cap)), 0.0
        if counted and self.averages():
            self.levels[0] += (force - self.levels[0]) * since / (self.age + since)
        elif counted:
            design = self.quickened()
            A, kappa = linear.closed_loop(design), linear.matrices(design)[2]
            right = self.levels + counted * np.outer(kappa, force)
            self.levels = np.linalg.solve(np.eye(len(A)) - counted * A, right)
        return 0

    def averages(self):
        """Whether a filter of higher order or split is still at its start."""
        own = self.design.polynomial
        order = len(own) - 1
        return (order > 2 or self.design.split > 1) and self.age < self.start / min(
            own[1] / order, own[-1] ** (1.0 / order)
        )

    def quickened(self):
        """The design, or one that is as fast as the start asks for."""
        own, order = self.design.polynomial, self.design.order
        if order <= 2:
            own = np.maximum(own, np.poly([-self.start / self.age] * order))
        return linear.Design(tuple(own[1:]), 1, self.design.split)

    def turn_to_north(self, mag, dt):
        self.heading_since += dt
        if mag is None:
            return 0
        north = unit(mag)
        north = None if north is None else level_part(north, self.R[2])
        if north is None:
            return MAG_MISSING
        since, self.heading_since = self.heading_since, 0.0
        if not self.heading_known:
            self.R, self.heading_known = facing(north, self.R[2]), True
            return 0
        self.heading_age += since
        east, ahead, _ = self.R @ north
        sine = east if ahead >= 0 else math.copysign(1.0, east)
        weight = since / (min(self.heading_age, self.heading_tau) + since) if since else 0.0
        self.R = exp(weight * sine * UP) @ self.R
        return 0
