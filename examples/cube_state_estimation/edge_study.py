"""Every estimator with every error, the weights of the observer, and how much noise is too much."""

import itertools
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from edge_cube import COULOMB, DRY, RATES, Array, changed, noise
from edge_designs import plain
from edge_estimators import Scheme, observed
from edge_loops import Cycle, Linear, first, harmonic_balance, linear_noise
from edge_simulation import Case, Swing, simulate, swing

SCENARIOS: dict[str, dict[str, Any]] = {
    "no error": {},
    "dry, noise / 10": {"cube": DRY, "noise": 0.1},
    "dry friction": {"cube": DRY},
    "dry, noise x 5": {"cube": DRY, "noise": 5.0},
    "K_m -20 %": {"cube": changed(torque_constant=0.8)},
    "m l +10 %": {"cube": changed(lever=1.1)},
    "J -20 %": {"cube": changed(inertia=0.8)},
    "bias 1 °/s": {"gyro_bias": np.radians(1.0)},
    "offset 1°": {"accelerometer_offset": np.radians(1.0)},
    "together": {
        "cube": replace(changed(torque_constant=0.9, lever=1.1, inertia=0.9), coulomb=COULOMB),
        "gyro_bias": np.radians(0.5),
        "accelerometer_offset": np.radians(0.5),
    },
}
"""What may be wrong: "dry" is dry friction, the bias the gyro's, the offset the accelerometer's."""

SEEDS = range(2)


class Sweep(NamedTuple):
    """One way to choose Q = q Q_0, over q."""

    q: Array
    poles: Array
    predicted: list[Cycle]
    simulated: list[Swing]
    noise: Array


class Results(NamedTuple):
    """Everything that is printed and drawn."""

    schemes: dict[str, Scheme]
    linear: dict[str, Linear]
    swings: dict[str, dict[str, Swing]]
    sweeps: dict[str, Sweep]
    fallen: dict[str, float]
    refusals: dict[str, str]


def compare(every: dict[str, Scheme]) -> dict[str, dict[str, Swing]]:
    """Simulate each scheme in each scenario; pool the seeds."""
    keys = list(itertools.product(every, SCENARIOS, SEEDS))
    runs = simulate([Case(every[name], seed=seed, **SCENARIOS[what]) for name, what, seed in keys])
    swings: dict[str, dict[str, Swing]] = {name: {} for name in every}
    for i in range(0, len(keys), len(SEEDS)):
        tilt, current, slip, frequency = np.array([swing(runs, i + j) for j in range(len(SEEDS))]).T
        swings[keys[i][0]][keys[i][1]] = Swing(
            float(np.sqrt(np.mean(tilt**2))),
            float(np.sqrt(np.mean(current**2))),
            float(np.mean(slip)),
            float(np.mean(frequency)),
        )
    return swings


def sweep(shape: Array, *, filtered: bool = True) -> Sweep:
    """Try Q = q times `shape` against the noise of the rates: poles, limit cycle, and what noise does."""
    model, R = plain(), noise()[np.ix_(RATES, RATES)]
    q = 10.0 ** np.arange(-11.0, 2.1, 0.5)
    every = [observed(model, one * shape, R, filtered=filtered) for one in q]
    runs = simulate([Case(scheme, DRY, noise=0.0) for scheme in every], 40.0)
    return Sweep(
        q,
        np.array([np.abs(scheme.poles) for scheme in every]),
        [harmonic_balance(scheme) for scheme in every],
        [swing(runs, i) for i in range(len(q))],
        np.array([linear_noise(scheme) for scheme in every]),
    )


def fall(every: dict[str, Scheme]) -> dict[str, float]:
    """Return the least of some multiples of the noise at which the cube falls within 20 s, without model error."""
    multiples = [5.0, 7.0, 10.0, 14.0, 20.0, 28.0, 40.0, 56.0, 80.0]
    keys = list(itertools.product(every, multiples))
    runs = simulate([Case(every[name], noise=multiple) for name, multiple in keys], 20.0)
    fell = np.isnan(runs.states[-1, 0]).reshape(len(every), len(multiples))
    return {name: first(row, np.array(multiples)) for name, row in zip(every, fell, strict=True)}
