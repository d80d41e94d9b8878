"""A slow reference for every filter, written from the continuous equations and not from the library's recurrence.

A design is the closed loop of an observer on a chain of integrators,

    x' = F x + B u + kappa (y - C x),     C x = level 0,     A = F - kappa C,

and nothing below uses the gains' recurrence of the library: backward Euler solves (I - T A) x = x_prev + T (B u + kappa y)
as a full system at every sample, the matched rule takes matrix exponentials and places poles, and the tilt formulas are
replaced by rotation matrices.

Conventions
-----------
* The state is the one *before* the first sample; the first step lasts ``dt[0]``.
* ``levels`` has the shape (order, samples), as the library's ``Estimate.levels``.
* A NaN in ``y`` is a predicted sample. With split = order the correction after it places the poles for the time since the last
  correction. With a split below the order the levels decay by themselves, and all predictions since the last correction
  count as one long backward Euler step of that time (see ``Loop``).
* Trapezoidal input at the first sample: the derivative before it is taken as equal to the first one.
* A delayed measurement is compared with level 0 a ``delay`` ago, read off the polyline through the start, every past
  estimate (after its correction) and the present prediction; before the start it has the start's value.
* ``period`` wraps the innovation, never the state.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import linalg, signal

# ---------------------------------------------------------------------------------------------------------- designs


@dataclass(frozen=True)
class Design:
    """The continuous closed loop: B(s) = s^N + k_1 s^(N-1) + ... + k_N, the input's derivative order, the split."""

    coefficients: tuple[float, ...]
    derivative_order: int = 1
    split: int = 0  # 0 stands for the order

    @property
    def order(self) -> int:
        return len(self.coefficients)

    @property
    def degree(self) -> int:
        """The split m: the low-pass has the terms of degree < m."""
        return self.split or self.order

    @property
    def after_gap(self) -> str:
        """How several predictions without a correction are taken, and what corrects after them (see ``Loop``)."""
        return "long_step" if self.derivative_order <= 2 else "placed"

    @property
    def polynomial(self) -> np.ndarray:
        """B(s), highest power first."""
        return np.array([1.0, *self.coefficients])

    @property
    def ascending(self) -> np.ndarray:
        """a_i of B(s) = sum a_i s^i."""
        return self.polynomial[::-1]

    @property
    def poles(self) -> np.ndarray:
        return np.roots(self.polynomial).astype(complex)


def first_order(tau):
    """B = s + 1/tau."""
    return Design((1.0 / tau,))


def pi_form(kp, ki):
    """B = s^2 + kp s + ki."""
    return Design((kp, ki))


def butterworth(omega0, order=2, q=1.0, split=0):
    """The analogue Butterworth polynomial; for order 2 the middle coefficient is divided by q."""
    _, denominator = signal.butter(order, omega0, analog=True)
    coefficients = [float(a) for a in np.atleast_1d(denominator)[1:]]
    if q != 1.0:
        if order != 2:
            raise ValueError("q belongs to order 2")
        coefficients[0] /= q
    return Design(tuple(coefficients), 1, split)


def third_order(tau):
    """Triple pole at -1/tau, acceleration in."""
    return Design(tuple(float(a) for a in np.poly([-1.0 / tau] * 3)[1:]), 2)


def third_order_butterworth(omega0):
    """Butterworth poles of order 3, acceleration in."""
    return Design(butterworth(omega0, 3).coefficients, 2)


def second_order_inertial(tau):
    """Double pole at -1/tau, acceleration in, no bias level."""
    return Design(tuple(float(a) for a in np.poly([-1.0 / tau] * 2)[1:]), 2)


def second_order_inertial_butterworth(omega0):
    """Butterworth poles of order 2, acceleration in, no bias level."""
    return Design(butterworth(omega0, 2).coefficients, 2)


def chain(coefficients, derivative_order=1, split=0):
    """Any coefficients k_1 ... k_N."""
    return Design(tuple(float(k) for k in coefficients), derivative_order, split)


# --------------------------------------------------------------------------------------------- continuous state space


def matrices(design):
    """F, B, kappa of x' = F x + B u + kappa e, e = y - x_0."""
    order, m, a = design.order, design.degree, design.ascending
    if m < order and design.derivative_order != 1:
        raise ValueError("a split needs derivative order 1")
    F = np.diag(np.ones(order - 1), 1)
    B = np.zeros(order)
    B[design.derivative_order - 1] = 1.0
    kappa = np.zeros(order)
    for i in range(order):
        power = order - 1 - i  # the coefficient that enters level i
        if i == 0:
            kappa[i] = a[power] if m == order else 0.0
        else:
            kappa[i] = a[power] if power < m else 0.0
            F[i, 1] -= a[power + 1] if power + 1 >= m else 0.0
    return F, B, kappa


def output_row(order):
    """C, which reads level 0."""
    C = np.zeros(order)
    C[0] = 1.0
    return C


def closed_loop(design):
    """A = F - kappa C."""
    F, _, kappa = matrices(design)
    return F - np.outer(kappa, output_row(design.order))


# ---------------------------------------------------------------------------------------------------------- one step


def transition(design, dt, rule):
    """Phi and the two columns that take u_(n-1) and u_n through one step of length dt, for a constant input and for a linear one."""
    F, B, _ = matrices(design)
    order = design.order
    if rule == "backward_euler":
        inverse = np.linalg.inv(np.eye(order) - dt * F)
        column = inverse @ (dt * B)
        return inverse, (np.zeros(order), column), (column / 2, column / 2)
    if rule == "matched":
        if design.degree != order:
            raise ValueError("the matched rule needs split = order")
        # [x, u, u'] with u linear in between: one exponential holds the transition, the constant part and the ramp.
        block = np.zeros((order + 2, order + 2))
        block[:order, :order] = F
        block[:order, order] = B
        block[order, order + 1] = 1.0
        exponential = linalg.expm(block * dt)
        phi, hold, ramp = (
            exponential[:order, :order],
            exponential[:order, order],
            exponential[:order, order + 1],
        )
        slope = ramp / dt if dt > 0 else np.zeros(order)
        return phi, (np.zeros(order), hold), (hold - slope, slope)
    raise ValueError(rule)


def discrete_poles(design, tau_g, rule):
    """Where the continuous poles belong after a step of tau_g."""
    poles = design.poles
    return 1.0 / (1.0 - poles * tau_g) if rule == "backward_euler" else np.exp(poles * tau_g)


def one_minus_discrete_poles(design, tau_g, rule):
    """1 - z without cancellation for short steps."""
    scaled = design.poles * tau_g
    return -scaled / (1.0 - scaled) if rule == "backward_euler" else -np.expm1(scaled)


def place(phi, one_minus_z, scale):
    """Gain L with eig((I - L C) phi) = z by Ackermann's formula on (phi, C phi), in time units of `scale`."""
    order = len(phi)
    units = np.array([scale**i for i in range(order)])
    phi = units[:, None] * phi / units[None, :]
    row = output_row(order) @ phi
    observability = np.array([row @ np.linalg.matrix_power(phi, i) for i in range(order)])
    polynomial = np.eye(order, dtype=complex)
    for w in one_minus_z:
        polynomial = polynomial @ (phi - np.eye(order) + w * np.eye(order))
    last = np.zeros(order)
    last[-1] = 1.0
    return (polynomial.real @ np.linalg.solve(observability, last)) / units


def gap_gain(design, phi, tau_g, rule="backward_euler", gap_cap=math.inf):
    """Gain after the accumulated transition phi: poles as after one step of min(tau_g, gap_cap)."""
    if tau_g == 0:
        return np.zeros(design.order)
    return place(phi, one_minus_discrete_poles(design, min(tau_g, gap_cap), rule), tau_g)


def step_gain(design, dt, rule="backward_euler"):
    """Gain of one ordinary step: what the closed loop answers to y alone, or the placed poles."""
    if rule == "backward_euler":
        _, _, kappa = matrices(design)
        return np.linalg.solve(np.eye(design.order) - dt * closed_loop(design), dt * kappa)
    return gap_gain(design, transition(design, dt, rule)[0], dt, rule)


def wrap(innovation, period):
    """The innovation in [-period/2, period/2]."""
    return innovation if period is None else innovation - period * np.round(innovation / period)


# ------------------------------------------------------------------------------------------------------- whole filters


def start_state(design, y, initial):
    """The state before the first sample and the index of the first sample that is filtered."""
    state = np.zeros(design.order)
    if initial is None:
        finite = np.flatnonzero(np.isfinite(y))
        first = int(finite[0]) if len(finite) else len(y)
        if len(finite):
            state[0] = y[first]
        return state, first
    if np.ndim(initial) == 0:
        state[0] = initial
    else:
        state[:] = initial
    return state, 0


class Loop:
    """The filter sample by sample: a prediction, and a correction wherever there is a measurement.

    The design's ``after_gap`` says what a gap is. "placed": the state moves on step by step, and the correction puts the poles
    of the time since the last one onto the accumulated transition. "long_step": the state is at every moment the one of a
    single step of the whole time tau_g since the last correction, begun at the levels after that correction, with what the
    input has added to the levels since; the correction has the gains of one step of tau_g. With a cap below tau_g a chain's poles are
    those of the cap, placed on that one step; a split takes the gains of a step of the cap.
    """

    def __init__(
        self,
        design: Design,
        state: np.ndarray,
        *,
        rule: str = "backward_euler",
        trapezoid: bool = False,
        period: float | None = None,
        delay: float = 0.0,
        gap_cap: float = math.inf,
    ) -> None:
        self.design, self.state = design, np.array(state, dtype=float)
        self.rule, self.trapezoid, self.period, self.delay = rule, trapezoid, period, delay
        self.gap_cap = gap_cap
        self.A, (_, self.B, self.kappa) = closed_loop(design), matrices(design)
        self.identity = np.eye(design.order)
        self.u_before: float | None = None
        self.past_times, self.past_levels = [0.0], [float(self.state[0])]
        self._corrected()

    @property
    def _is_placed(self):
        return self.rule == "matched" or self.design.after_gap == "placed"

    def _corrected(self):
        self.accumulated, self.tau_g, self.predictions = self.identity, 0.0, 0
        self.corrected, self.driven = self.state, np.zeros(self.design.order)

    def _input(self, u):
        """u_(n-1), u_n."""
        before = u if self.u_before is None else self.u_before
        self.u_before = u
        return before, u

    def _innovation(self, y, predicted, now):
        compared = np.interp(now - self.delay, [*self.past_times, now], [*self.past_levels, predicted])
        return wrap(y - compared, self.period)

    def step(self, y, u, dt):
        """One sample; y may be NaN."""
        before, u = self._input(u)
        predicted = self._predict(before, u, dt)
        now = self.past_times[-1] + dt
        if np.isnan(y):
            self.state = predicted
        else:
            innovation = self._innovation(y, predicted[0], now)
            self.state = self._correct(predicted, innovation, before, u, dt)
            self._corrected()
        self.past_times.append(now)
        self.past_levels.append(float(self.state[0]))
        return self.state

    def _predict(self, before, u, dt):
        phi, constant, linear = transition(self.design, dt, self.rule)
        columns = linear if self.trapezoid else constant
        self.accumulated = phi @ self.accumulated
        self.tau_g += dt
        self.predictions += 1
        if self._is_placed:
            return phi @ self.state + columns[0] * before + columns[1] * u
        self.driven = phi @ self.driven + columns[0] * before + columns[1] * u
        whole, _, _ = transition(self.design, self.tau_g, self.rule)
        return whole @ self.corrected + self.driven

    def _correct(self, predicted, innovation, before, u, dt):
        ordinary = self.predictions == 1 and self.tau_g <= self.gap_cap
        if ordinary and self.rule == "backward_euler":
            held = (before + u) / 2 if self.trapezoid else u
            y = predicted[0] + innovation  # y itself, but for wrapping and delay
            right = self.state + dt * (self.B * held + self.kappa * y)
            return np.linalg.solve(self.identity - dt * self.A, right)
        if not self._is_placed and (self.tau_g <= self.gap_cap or self.design.degree < self.design.order):
            gain = step_gain(self.design, min(self.tau_g, self.gap_cap), self.rule)
        elif not self._is_placed:
            one_step, _, _ = transition(self.design, self.tau_g, self.rule)
            gain = gap_gain(self.design, one_step, self.tau_g, self.rule, self.gap_cap)
        else:
            gain = gap_gain(self.design, self.accumulated, self.tau_g, self.rule, self.gap_cap)
        return predicted + gain * innovation


def run(design, y, u, dt, *, initial=0.0, rule="backward_euler", input_="sample", **options):
    """Levels (order, samples) of a recording; dt is one number or one a sample."""
    y, u = np.asarray(y, dtype=float), np.asarray(u, dtype=float)
    dt = np.broadcast_to(np.asarray(dt, dtype=float), y.shape)
    state, first = start_state(design, y, initial)
    loop = Loop(design, state, rule=rule, trapezoid=input_ == "trapezoid", **options)
    levels = np.full((design.order, len(y)), np.nan)
    for n in range(first, len(y)):
        levels[:, n] = loop.step(y[n], u[n], dt[n])
    return levels


def rate_filter(tau, gyro, angular_acceleration, dt, *, initial=0.0, gyro_before=None):
    """S0 (30): the gyro's rate with the angular acceleration's open-loop integral.

    omega_n = alpha (omega_(n-1) + gamma_n - gamma_(n-1)) + (1 - alpha) (a_(n-1) + T alphadot_n), a_n = a_(n-1) + T alphadot_n.
    """
    dt = np.broadcast_to(np.asarray(dt, dtype=float), np.shape(gyro))
    rate, integral = float(initial), float(initial)
    before = gyro[0] if gyro_before is None else gyro_before
    rates = np.empty(len(gyro))
    for n, (now, acceleration, step) in enumerate(zip(gyro, angular_acceleration, dt, strict=True)):
        alpha = tau / (tau + step)
        integral += step * acceleration
        rate = alpha * (rate + now - before) + (1 - alpha) * integral
        rates[n], before = rate, now
    return rates


# ---------------------------------------------------------------------------------------------------------------- tilt


def cross_matrix(v):
    """[v]x with [v]x w = v x w."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def turn(axis, angle):
    """Rotation about a coordinate axis (0, 1, 2) from the exponential of its generator."""
    generator = cross_matrix(np.eye(3)[axis])
    return np.eye(3) + math.sin(angle) * generator + (1 - math.cos(angle)) * generator @ generator


# The order of the turns (body -> world) with the two tilt angles last, and the world direction of the specific force at rest.
AXES = {
    "flu": ((2, 1, 0), np.array([0.0, 0.0, 1.0])),  # yaw, pitch, roll; z up
    "frd": ((2, 1, 0), np.array([0.0, 0.0, -1.0])),  # yaw, pitch, roll; z down
    "cube": ((0, 1, 2), np.array([-1.0, 0.0, 0.0])),  # phi1 about the vertical, phi2, phi3; x down
}


def turns_of(angles, axes, heading=0.0):
    """The three turns as (axis, angle), from the world to the body; the library's angle pair is (roll, pitch) or (phi2, phi3)."""
    order, _ = AXES[axes]
    middle, last = angles if axes == "cube" else angles[::-1]
    return tuple(zip(order, (heading, middle, last), strict=True))


def attitude(angles, axes, heading=0.0):
    """R, body -> world."""
    first, middle, last = (turn(*pair) for pair in turns_of(angles, axes, heading))
    return first @ middle @ last


def specific_force(angles, axes, g=9.81):
    """What an accelerometer at rest reads in this attitude."""
    return attitude(angles, axes).T @ (g * AXES[axes][1])


def tilt(force, axes):
    """The angle pair whose attitude turns the specific force onto its world direction: undo the last turn, then the middle one.

    The last turn alone must leave the force without a component along the middle turn's axis, on the side of its world direction.
    """
    (_, middle_axis, last_axis), up = AXES[axes]
    force = np.asarray(force, dtype=float)
    last = angle_onto(force, up, last_axis)
    middle = angle_onto(turn(last_axis, last) @ force, up, middle_axis)
    return np.array([middle, last] if axes == "cube" else [last, middle])


def angle_onto(force, target, axis):
    """Angle of the turn about `axis` that brings the force's part across the axis to the target's direction."""
    aside = cross_matrix(np.eye(3)[axis]) @ target
    return -math.atan2(float(aside @ force), float(target @ force))


def rate_matrix(angles, axes):
    """J with body rates = J @ (rates of the three turns in their order): columns vee(R' dR/dangle), each from its generator."""
    turns = turns_of(angles, axes)
    R = attitude(angles, axes)
    columns = []
    for moved in range(3):
        derivative = np.eye(3)
        for index, (axis, angle) in enumerate(turns):
            derivative = derivative @ turn(axis, angle)
            if index == moved:
                derivative = derivative @ cross_matrix(np.eye(3)[axis])
        body = R.T @ derivative
        columns.append([body[2, 1], body[0, 2], body[1, 0]])
    return np.array(columns).T


def angle_rates(angles, body_rates, axes):
    """Rates of the angle pair: solve J for the rates of all three angles and drop the heading's."""
    _, middle, last = np.linalg.solve(rate_matrix(angles, axes), body_rates)
    return np.array([middle, last] if axes == "cube" else [last, middle])


def angle_rates_by_difference(angles, body_rates, axes, h=1e-3):
    """The same from the motion itself: turn the attitude on by +-h, +-2h and difference the angles (fourth order)."""

    def moved(time):
        R = attitude(angles, axes) @ linalg.expm(cross_matrix(np.asarray(body_rates)) * time)
        return tilt(R.T @ AXES[axes][1], axes)

    return (8 * (moved(h) - moved(-h)) - (moved(2 * h) - moved(-2 * h))) / (12 * h)


def tilt_filter(design, gyro, acc, dt, *, axes="flu", rates="output", at=None, initial=(0.0, 0.0), **options):
    """Two linear filters, one an angle; their derivative is the body rate converted at the output of the step before."""
    dt = np.broadcast_to(np.asarray(dt, dtype=float), (len(acc),))
    period = 2 * math.pi
    loops = []
    for angle in initial:
        state = np.zeros(design.order)
        state[0] = angle
        loops.append(Loop(design, state, period=period, **options))
    output = np.array(initial, dtype=float)
    angles = np.empty((len(acc), 2))
    for n in range(len(acc)):
        point = output if rates == "output" else at
        derivative = angle_rates(point, gyro[n], axes)
        measured = tilt(acc[n], axes)
        output = np.array([loop.step(measured[i], derivative[i], dt[n])[0] for i, loop in enumerate(loops)])
        angles[n] = output
    return angles


# ---------------------------------------------------------------------------------------------------- transfer functions


def transfer_polynomials(design):
    """Numerators over B(s), highest power first: LP(s) and HP(s)/s^M, and HP(s)."""
    a, m = design.ascending, design.degree
    low = a[:m][::-1]
    high = np.concatenate([a[m:][::-1], np.zeros(m)])
    return low, high[: len(high) - design.derivative_order], high


def continuous_response(design, omega):
    """(low, high) at omega [rad/s]."""
    s = 1j * np.asarray(omega, dtype=float)
    low, _, high = transfer_polynomials(design)
    bottom = np.polyval(design.polynomial, s)
    return np.polyval(low, s) / bottom, np.polyval(high, s) / bottom


def discrete_response(design, omega, dt, *, rule="backward_euler", input_="sample"):
    """(low, high) at omega: what the filter makes of y, and of the open-loop integral of u (omega != 0)."""
    phi, constant, linear = transition(design, dt, rule)
    before, now = linear if input_ == "trapezoid" else constant
    gain = step_gain(design, dt, rule)
    C, identity = output_row(design.order), np.eye(design.order)
    keep = identity - np.outer(gain, C)
    # The open loop that high refers to: M integrators with the same rule and no filter at all.
    integrators = Design((0.0,) * design.derivative_order, design.derivative_order)
    phi_open, constant_open, linear_open = transition(integrators, dt, rule)
    before_open, now_open = linear_open if input_ == "trapezoid" else constant_open
    C_open, identity_open = output_row(integrators.order), np.eye(integrators.order)
    low, high = [], []
    for w in np.atleast_1d(omega):
        back = np.exp(-1j * w * dt)
        loop = identity - keep @ phi * back
        low.append(C @ np.linalg.solve(loop, gain))
        integral = C_open @ np.linalg.solve(identity_open - phi_open * back, now_open + before_open * back)
        high.append(C @ np.linalg.solve(loop, keep @ (now + before * back)) / integral)
    return np.array(low), np.array(high)
