"""The design rule against the errors in motion, whose truth is known."""

import numpy as np

import compfilt as cf
from cube_filter_tables import Array, Table, rms_degrees
from design_rule import TAUS, Rule, centred, spectrum
from rule_recordings import Recording, still, tilt_and_rates, up_of


def in_motion(trials: list[Recording]) -> Table:
    """Return for every trial the tau by the rule at rest, by the rule in hindsight, and the best one in motion."""
    table: Table = {}
    for trial in trials:
        rest = still(trial)
        bias = rest.gyr.mean(axis=0)
        angle, rate = tilt_and_rates(rest, bias)
        at_rest = Rule(trial.fs, *(centred(spectrum(each, trial.fs, 4.0)) for each in (angle, rate)))
        moving = (spectrum(each, trial.fs, 60.0) for each in errors_in_motion(trial, bias))
        hindsight = Rule(trial.fs, *moving)
        best = float(min(TAUS, key=lambda tau: motion_error(trial, bias, tau)))
        row = {"accelerometer / deg": inclination_error(trial, cf.tilt(trial.acc))}
        for name, tau in (("rest", at_rest.best_tau()), ("hindsight", hindsight.best_tau()), ("best", best)):
            row |= {f"tau {name} / s": tau, f"error {name} / deg": motion_error(trial, bias, tau)}
        table[trial.name] = row
    return table


def errors_in_motion(trial: Recording, bias: Array) -> tuple[Array, Array]:
    """Return what S0 cannot record: the error of the accelerometer's angles and of the gyro's rates in motion."""
    x, y, z = fill(trial.up).T
    truth = np.column_stack((np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))))
    angle = np.angle(np.exp(1j * (cf.tilt(trial.acc) - truth)))
    change = np.diff(truth, axis=0, prepend=truth[:1]) * trial.fs
    rate = cf.angle_rates(truth, trial.gyr - bias) - change
    return angle[trial.moves], rate[trial.moves]


def fill(columns: Array) -> Array:
    """Bridge the moments that the optical reference has not seen."""
    n = np.arange(columns.shape[0])
    seen = np.isfinite(columns).all(axis=1)
    return np.column_stack([np.interp(n, n[seen], column[seen]) for column in columns.T])


def motion_error(trial: Recording, bias: Array, tau: float) -> float:
    """Return the RMS inclination error of the first-order filter in motion, in deg."""
    tilt = cf.TiltFilter(cf.FirstOrder(tau))
    return inclination_error(trial, tilt.estimate(trial.gyr - bias, trial.acc, fs=trial.fs).angles)


def inclination_error(trial: Recording, angles: Array) -> float:
    """Return the RMS angle between estimated and true up in motion, in deg."""
    counts = trial.moves & np.isfinite(trial.up).all(axis=1)
    a, b = up_of(angles)[counts], trial.up[counts]
    return rms_degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1)))
