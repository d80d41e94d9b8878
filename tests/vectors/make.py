"""Makes the reference vectors beside this file: ``python tests/vectors/make.py``.

Where the samples are evenly spaced and the rule is backward Euler, nothing here knows a state space: s = (1 - 1/z)/T goes into
the transfer functions LP(s) from y and HP(s)/s^M from u, and the two difference equations are added up, with exact
coefficients and 60 digits in the recursion. The other levels follow from level 0 by the differential equations themselves.
Everything else (matched poles, uneven steps, missing or delayed measurements, tilt) is the slow filter in ``reference.py``.

Format: lines ``# key = value``, a line of column names, rows of numbers with up to 17 significant digits (exact), ``nan`` for a missing
measurement. The state before the first sample is zero in every level, and the first step lasts the first row's ``dt``. A result agrees
with a column c when |result - c| <= tolerance * max(1, max |c|) for all its rows. ``dt`` among the keys is the sample
period, or ``variable``.

The inputs are rounded to 6 decimals, so that they do not depend on the platform's sine. Where a convention for the sample
before the first would matter (trapezoidal input, delay, rate filter), the signals start at zero.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, field
from decimal import Decimal, localcontext
from fractions import Fraction
from pathlib import Path

import numpy as np
import scipy
from scipy import signal

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import reference  # noqa: E402

SAMPLES = 240
GENERATOR = f"tests/vectors/make.py, numpy {np.__version__}, scipy {scipy.__version__}"

# ------------------------------------------------------------------------------------------------------------- signals


def noise(seed, count):
    """Uniform in (-1, 1), zero mean, from a linear congruential generator: the same on every platform."""
    state = 2 * seed + 1
    values = []
    for _ in range(count):
        state = (6364136223846793005 * state + 1442695040888963407) % 2**64
        values.append((state >> 32) / 2**31 - 1.0)
    return np.array(values)


def rounded(values):
    """Six decimals, and no minus zero."""
    return np.round(values, 6) + 0.0


def motion(t, derivative=0):
    """Two sines, or a derivative of them."""
    turn = derivative * math.pi / 2
    return 0.8 * 0.9**derivative * np.sin(0.9 * t + turn) + 0.2 * 5.1**derivative * np.sin(5.1 * t + turn)


def even(dt):
    """The same step throughout."""
    return np.full(SAMPLES, dt)


def uneven(dt, seed=5):
    """Steps between 0.2 dt and 3 dt and now and then one of 20 dt."""
    steps = dt * (1.6 + 1.4 * noise(seed, SAMPLES))
    steps[40::60] = 20 * dt
    return rounded(steps)


def signals(dt, derivative_order, seed):
    """Noisy y of the motion; u, its derivative, with noise and a bias."""
    t = np.cumsum(dt)
    y = motion(t) + 0.05 * noise(seed, len(t))
    u = motion(t, derivative_order) + 0.02 + 0.03 * noise(seed + 1000, len(t))
    return rounded(y), rounded(u)


def with_gaps(y):
    """A single dropout, runs of 3 and of 12, then one measurement in 5."""
    n = np.arange(len(y))
    gone = (n == 17) | ((n >= 30) & (n < 33)) | ((n >= 60) & (n < 72)) | ((n >= 120) & (n % 5 != 0))
    return np.where(gone, np.nan, y)


# ------------------------------------------------------------------------- backward Euler as difference equations


def add(*polynomials):
    """Sum of polynomials in s, lowest power first."""
    total = [Fraction(0)] * max(len(p) for p in polynomials)
    for polynomial in polynomials:
        for i, value in enumerate(polynomial):
            total[i] += value
    return total


def times(factor, polynomial):
    return [Fraction(factor) * value for value in polynomial]


def derived(polynomial):
    """s times the polynomial."""
    return [Fraction(0), *polynomial]


def level_numerators(design):
    """Numerators over B(s) of every level, from y and from u, lowest power first, exact for the given coefficients.

    Level 0 is LP(s) and HP(s)/s^M. The others are what the differential equations ask for: level i+1 is the derivative of level i
    less what feeds level i.
    """
    order, m = design.order, design.degree
    a = [Fraction(float(value)) for value in design.ascending]
    pairs = []
    for from_y in (True, False):
        levels = [a[:m] if from_y else ([Fraction(0)] * m + a[m:])[design.derivative_order :]]
        innovation = add(a if from_y else [Fraction(0)], times(-1, levels[0]))
        for i in range(order - 1):
            up = derived(levels[i])
            if i == design.derivative_order - 1 and not from_y:
                up = add(up, times(-1, a))
            power = order - 1 - i
            gain = (a[power] if m == order else 0) if i == 0 else (a[power] if power < m else 0)
            damping = a[power + 1] if i > 0 and power + 1 >= m else 0
            up = add(up, times(-gain, innovation))
            if damping:
                up = add(up, times(damping, levels[1]))
            levels.append(up)
        pairs.append(levels)
    return a, *pairs


def substituted(polynomial, order, dt):
    """T^N p((1 - q)/T) as a polynomial in q = 1/z, lowest power first."""
    step = Fraction(dt)
    total = [Fraction(0)] * (order + 1)
    for i, value in enumerate(polynomial):
        if value == 0:
            continue
        if i > order:
            raise ValueError("improper transfer function")
        for j in range(i + 1):
            total[j] += value * step ** (order - i) * math.comb(i, j) * (-1) ** j
    return total


def lfilter(numerator, denominator, x):
    """scipy.signal.lfilter, in 60 digits and with exact coefficients."""
    with localcontext() as context:
        context.prec = 60
        b = [Decimal(v.numerator) / Decimal(v.denominator) for v in (w / denominator[0] for w in numerator)]
        a = [Decimal(v.numerator) / Decimal(v.denominator) for v in (w / denominator[0] for w in denominator)]
        signal_in = [Decimal(float(v)) for v in x]
        out: list[Decimal] = []
        for n in range(len(signal_in)):
            value = sum((b[j] * signal_in[n - j] for j in range(min(n + 1, len(b)))), Decimal(0))
            value -= sum((a[j] * out[n - j] for j in range(1, min(n + 1, len(a)))), Decimal(0))
            out.append(value)
        return np.array(out, dtype=object)


def backward_euler(design, y, u, dt):
    """All levels from transfer functions."""
    denominator, from_y, from_u = level_numerators(design)
    bottom = substituted(denominator, design.order, dt)
    levels = []
    for top_y, top_u in zip(from_y, from_u, strict=True):
        part_y = lfilter(substituted(top_y, design.order, dt), bottom, y)
        part_u = lfilter(substituted(top_u, design.order, dt), bottom, u)
        levels.append([float(v) for v in part_y + part_u])
    return np.array(levels)


# --------------------------------------------------------------------------------------------------------------- cases


@dataclass(frozen=True)
class Case:
    """One file: a design with its parameters, how it is run, and the signals' seed."""

    name: str
    kind: str
    parameters: dict
    dt: object = 0.01
    rule: str = "backward_euler"
    input_: str = "sample"
    gaps: bool = False
    options: dict = field(default_factory=dict)
    zeros: int = 0  # samples at the start where y and u are zero
    tolerance: float = 1e-12

    @property
    def design(self):
        return getattr(reference, self.kind)(**self.parameters)

    @property
    def even(self):
        return isinstance(self.dt, float)

    @property
    def steps(self):
        return even(self.dt) if self.even else self.dt

    @property
    def by_transfer_function(self):
        """Whether no state space is needed."""
        return self.rule == "backward_euler" and self.even and not self.gaps and not self.options

    def inputs(self):
        """y and u."""
        y, u = signals(self.steps, self.design.derivative_order, sum(self.name.encode()))
        y[: self.zeros], u[: self.zeros] = 0.0, 0.0
        if "period" in self.options:
            y = rounded(np.remainder(y * 4.0 + math.pi, self.options["period"]) - math.pi)
            u = rounded(u * 4.0)
        return with_gaps(y) if self.gaps else y, u

    def levels(self):
        """What the filter makes of them."""
        y, u = self.inputs()
        if self.by_transfer_function:
            if self.input_ == "trapezoid":
                u = (u + np.concatenate([u[:1], u[:-1]])) / 2
            return backward_euler(self.design, y, u, self.dt)
        return reference.run(
            self.design, y, u, self.steps, rule=self.rule, input_=self.input_, **self.options
        )

    def header(self):
        design = self.design
        return {
            "generator": GENERATOR,
            "design": self.kind,
            **self.parameters,
            "coefficients": ", ".join(number(k) for k in design.coefficients),
            "order": design.order,
            "derivative_order": design.derivative_order,
            "split": design.degree,
            "rule": self.rule,
            "input": self.input_,
            "dt": number(self.dt) if self.even else "variable",
            "initial": "zeros",
            "missing": "coast" if self.gaps else "none",
            **({"after_gap": "placed" if self.rule == "matched" else design.after_gap} if self.gaps else {}),
            **self.options,
            "tolerance": self.tolerance,
        }

    def columns(self):
        y, u = self.inputs()
        levels = self.levels()
        names = ["dt", "y", "u", *(f"level{i}" for i in range(len(levels)))]
        return dict(zip(names, [self.steps, y, u, *levels], strict=True))


def uneven_from_zero(dt):
    """Uneven steps, the first of no length: as with time stamps."""
    steps = uneven(dt)
    steps[0] = 0.0
    return steps


def cases():
    """Every file of a linear filter."""
    yield Case("first_order", "first_order", {"tau": 0.5})
    yield Case("first_order_fast", "first_order", {"tau": 1e-4})
    yield Case("first_order_slow", "first_order", {"tau": 10.0}, dt=0.001)
    yield Case("pi", "pi_form", {"kp": 2.0, "ki": 1.5})
    for order in range(1, 7):
        yield Case(f"butterworth_{order}", "butterworth", {"omega0": 4.0, "order": order}, tolerance=1e-11)
    for q in (0.1, 0.625):
        yield Case(f"butterworth_q_{q}", "butterworth", {"omega0": 10.0, "order": 2, "q": q}, dt=0.005)
    for order, split in ((2, 1), (3, 1), (4, 1), (3, 2), (4, 2)):
        parameters = {"omega0": 3.0, "order": order, "split": split}
        yield Case(f"split_{order}_{split}", "butterworth", parameters, tolerance=1e-11)
    yield Case("third_order", "third_order", {"tau": 0.4})
    yield Case("third_order_butterworth", "third_order_butterworth", {"omega0": 3.0})
    yield Case("second_order_inertial", "second_order_inertial", {"tau": 0.4})
    yield Case("second_order_inertial_butterworth", "second_order_inertial_butterworth", {"omega0": 3.0})
    general = {"coefficients": (6.0, 13.0, 12.0, 4.0), "derivative_order": 3}
    yield Case("chain_4_3", "chain", general, dt=0.02)
    yield from matched_cases()
    yield from uneven_cases()
    yield from missing_cases()
    yield Case("delay_first_order", "first_order", {"tau": 0.5}, options={"delay": 0.035}, zeros=10)
    yield Case(
        "delay_butterworth_2", "butterworth", {"omega0": 2.0, "order": 2}, options={"delay": 0.05}, zeros=10
    )
    for name, kind, parameters in (
        ("first_order", "first_order", {"tau": 0.5}),
        ("third_order", "third_order", {"tau": 0.8}),
    ):
        yield Case(
            f"delay_uneven_{name}",
            kind,
            parameters,
            dt=uneven(0.01),
            options={"delay": 0.05},
            zeros=10,
            tolerance=1e-11,
        )
    yield Case("period_pi", "pi_form", {"kp": 2.0, "ki": 1.5}, options={"period": 2 * math.pi}, dt=0.02)


def matched_cases():
    """Matched poles and trapezoidal input."""
    matched = {
        "first_order": ("first_order", {"tau": 0.5}),
        "butterworth_2": ("butterworth", {"omega0": 4.0, "order": 2}),
        "butterworth_3": ("butterworth", {"omega0": 4.0, "order": 3}),
        "second_order_inertial": ("second_order_inertial", {"tau": 0.4}),
        "third_order": ("third_order", {"tau": 0.4}),
    }
    for name, (kind, parameters) in matched.items():
        yield Case(f"matched_{name}", kind, parameters, rule="matched", dt=0.02)
    trapezoid = {"input_": "trapezoid", "dt": 0.02, "zeros": 1}
    yield Case("trapezoid_pi", "pi_form", {"kp": 2.0, "ki": 1.5}, **trapezoid)
    yield Case("trapezoid_matched_pi", "pi_form", {"kp": 2.0, "ki": 1.5}, rule="matched", **trapezoid)
    yield Case("trapezoid_third_order", "third_order", {"tau": 0.4}, **trapezoid)
    yield Case("trapezoid_matched_third_order", "third_order", {"tau": 0.4}, rule="matched", **trapezoid)


def uneven_cases():
    """Steps that vary."""
    steps = uneven(0.01)
    yield Case("uneven_first_order", "first_order", {"tau": 0.5}, dt=steps)
    yield Case("uneven_butterworth_2", "butterworth", {"omega0": 2.0, "order": 2}, dt=uneven_from_zero(0.01))
    yield Case("uneven_third_order", "third_order", {"tau": 0.4}, dt=steps)
    yield Case("uneven_split_2_1", "butterworth", {"omega0": 2.0, "order": 2, "split": 1}, dt=steps)
    yield Case("uneven_matched_pi", "pi_form", {"kp": 2.0, "ki": 1.5}, dt=steps, rule="matched")


def missing_cases():
    """Measurements that are not there, with even and with uneven steps."""
    designs = {
        "first_order": ("first_order", {"tau": 0.5}),
        "pi": ("pi_form", {"kp": 2.0, "ki": 1.5}),
        "third_order": ("third_order", {"tau": 0.4}),
        "butterworth_4": ("butterworth", {"omega0": 3.0, "order": 4}),
    }
    for name, (kind, parameters) in designs.items():
        yield Case(f"missing_{name}", kind, parameters, gaps=True, tolerance=1e-11)
        yield Case(f"missing_uneven_{name}", kind, parameters, dt=uneven(0.01), gaps=True, tolerance=1e-11)
    # A split damps its inner levels by itself: a gap counts as one long step.
    for order, tolerance in ((2, 1e-12), (3, 1e-11)):
        name, split = f"split_{order}_1", {"omega0": 2.0, "order": order, "split": 1}
        yield Case(f"missing_{name}", "butterworth", split, gaps=True, tolerance=tolerance)
        yield Case(
            f"missing_uneven_{name}", "butterworth", split, dt=uneven(0.01), gaps=True, tolerance=tolerance
        )
    yield Case(
        "missing_cap_split_2_1",
        "butterworth",
        {"omega0": 2.0, "order": 2, "split": 1},
        gaps=True,
        options={"gap_cap": 0.02},
    )
    yield Case(
        "missing_cap_third_order",
        "third_order",
        {"tau": 0.4},
        gaps=True,
        options={"gap_cap": 0.02},
        tolerance=1e-11,
    )
    yield Case(
        "missing_matched_third_order", "third_order", {"tau": 0.4}, gaps=True, rule="matched", tolerance=1e-11
    )


# ------------------------------------------------------------------------------------------------- rate filter and tilt


def rate_file():
    """S0 (30) as three difference equations; y is the gyro's rate, u the angular acceleration."""
    tau, dt = 0.5, 0.01
    y, u = signals(even(dt), 1, 77)
    y[0], u[0] = 0.0, 0.0
    alpha = tau / (tau + dt)
    integral = signal.lfilter([dt], [1.0, -1.0], u)
    rate = signal.lfilter([alpha, -alpha], [1.0, -alpha], y) + signal.lfilter(
        [1 - alpha], [1.0, -alpha], integral
    )
    header = {
        "generator": GENERATOR,
        "design": "rate_filter",
        "tau": tau,
        "dt": dt,
        "order": 1,
        "derivative_order": 1,
        "initial": "zeros",
        "tolerance": 1e-12,
    }
    return header, {"dt": even(dt), "y": y, "u": u, "level0": rate}


def tilt_file(kind, parameters, seed):
    """Roll and pitch of a body that turns about all three axes, flu."""
    steps, axes = even(0.01), "flu"
    t = np.cumsum(steps)
    roll, pitch = 0.7 * np.sin(1.1 * t), 0.9 * np.sin(0.8 * t + 0.3)
    roll_rate, pitch_rate, heading_rate = (
        0.77 * np.cos(1.1 * t),
        0.72 * np.cos(0.8 * t + 0.3),
        0.8 + 0.5 * np.sin(0.4 * t),
    )
    gyro, acc = np.empty((len(t), 3)), np.empty((len(t), 3))
    for n in range(len(t)):
        angles = (roll[n], pitch[n])
        gyro[n] = reference.rate_matrix(angles, axes) @ (heading_rate[n], pitch_rate[n], roll_rate[n])
        acc[n] = reference.specific_force(angles, axes)
    gyro = rounded(gyro + 0.02 + 0.03 * noise(seed, gyro.size).reshape(gyro.shape))
    acc = rounded(acc + 0.3 * noise(seed + 1, acc.size).reshape(acc.shape))
    design = getattr(reference, kind)(**parameters)
    angles = reference.tilt_filter(design, gyro, acc, steps, axes=axes)
    header = {
        "generator": GENERATOR,
        "design": kind,
        **parameters,
        "coefficients": ", ".join(number(k) for k in design.coefficients),
        "order": design.order,
        "derivative_order": 1,
        "split": design.degree,
        "rule": "backward_euler",
        "input": "sample",
        "axes": axes,
        "rates": "output",
        "dt": "0.01",
        "initial": "zeros",
        "tolerance": 1e-12,
    }
    columns = {"dt": steps}
    columns.update(zip(("gx", "gy", "gz"), gyro.T, strict=True))
    columns.update(zip(("ax", "ay", "az"), acc.T, strict=True))
    columns.update(zip(("roll", "pitch"), angles.T, strict=True))
    return header, columns


# --------------------------------------------------------------------------------------------------------------- files


def files():
    """Every file: name -> (header, columns)."""
    made = {f"{case.name}.csv": (case.header(), case.columns()) for case in cases()}
    made["rate_filter.csv"] = rate_file()
    made["tilt_first_order.csv"] = tilt_file("first_order", {"tau": 0.5}, 31)
    made["tilt_pi.csv"] = tilt_file("pi_form", {"kp": 2.0, "ki": 0.5}, 37)
    return made


def number(value):
    """The shortest text with the same float64: at most 17 significant digits."""
    return repr(float(value))


def entry(value):
    """A header's value as text."""
    if isinstance(value, tuple):
        return ", ".join(entry(v) for v in value)
    return number(value) if isinstance(value, float) else str(value)


def text(header, columns):
    """One file's content."""
    lines = [f"# {key} = {entry(value)}" for key, value in header.items()]
    lines.append(",".join(columns))
    lines += [",".join(number(v) for v in row) for row in zip(*columns.values(), strict=True)]
    return "\n".join(lines) + "\n"


def read(path):
    """Header and columns of a file."""
    header, rows, names = {}, [], None
    for line in Path(path).read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            key, _, value = line[1:].partition("=")
            header[key.strip()] = value.strip()
        elif names is None:
            names = line.split(",")
        else:
            rows.append([float(v) for v in line.split(",")])
    return header, dict(zip(names, np.array(rows).T, strict=True))


def main():
    for name, (header, columns) in files().items():
        (HERE / name).write_text(text(header, columns), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
