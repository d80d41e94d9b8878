"""The design rule on the sensor at rest, without and with vibration."""

import numpy as np

import compfilt as cf
from cube_filter_tables import Array, Table, rms
from design_rule import TAUS, Rule, centred, spectrum
from rule_recordings import Recording, Source, still, tilt_and_rates


def still_phases(source: Source) -> tuple[Table, dict[str, Rule]]:
    """Apply the rule to the sensor at rest, without and with vibration; return a table and the rules."""
    fs, before, after = source.recording.fs, still(source.recording), still(source.recording, after=True)
    shaken = source.recording.seconds(*source.vibrates)
    bias = before.gyr.mean(axis=0)
    angle, rate = tilt_and_rates(before)
    calm, gyro = spectrum(angle, fs, 4.0), spectrum(rate, fs, 4.0)
    vibrating = spectrum(cf.tilt(shaken.acc) - cf.tilt(after.acc).mean(axis=0), fs, 1.5)
    rules = {
        "still, bias removed": Rule(fs, centred(calm), centred(gyro)),
        "still, bias left in": Rule(fs, centred(calm), gyro),
        "vibrating, bias removed": Rule(fs, vibrating, centred(gyro)),
        "the same, offset removed": Rule(fs, centred(vibrating), centred(gyro)),
    }
    table = {name: rule_row(rule) for name, rule in rules.items()}
    for name, removed in (("still, bias removed", bias), ("still, bias left in", 0.0)):
        tau = table[name]["tau / s"]
        later = [rest_error(after, removed, each) for each in TAUS]
        table[name] |= {
            "same rest / deg": float(np.degrees(rest_error(before, removed, tau))),
            "later rest / deg": float(np.degrees(rest_error(after, removed, tau))),
            "best tau later / s": float(TAUS[np.argmin(later)]),
        }
    return table, rules


def rule_row(rule: Rule) -> dict[str, float]:
    """Return the means and densities that go in, the closed form for white noise and what the rule says."""
    r, q = (float(np.degrees(np.sqrt(np.mean(each.density)))) for each in (rule.angle, rule.rate))
    tau = rule.best_tau()
    return {
        "offset / deg": float(np.degrees(np.linalg.norm(rule.angle.mean))),
        "bias / (deg/s)": float(np.degrees(np.linalg.norm(rule.rate.mean))),
        "r / (deg/√Hz)": r,
        "q / (deg/s/√Hz)": q,
        "r/q / s": r / q,
        "tau / s": tau,
        "predicted / deg": float(np.degrees(rule.rms(tau))),
    }


def rest_error(rest: Recording, bias: Array | float, tau: float) -> float:
    """Return the RMS error of the first-order filter while the sensor lies still, in rad."""
    angle, rate = tilt_and_rates(rest, bias)
    truth = angle.mean(axis=0)
    return rms(cf.FirstOrder(tau).filter(angle, rate, fs=rest.fs, initial=truth) - truth)
