"""The figures of the cube's filters."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from angle_and_rate_filters import left_of_bias, rate_answers, rate_sensors
from design_rule import TAUS, Rule
from rule_at_rest import rest_error
from rule_in_motion import motion_error
from rule_recordings import Recording, still
from swinging_cube import TAU, Swing
from unequal_time_constants import summed_response, unequal_error


def panels(layout: list[list[str]], height: float) -> tuple[Figure, dict[str, Axes]]:
    """Return a figure 1000 px wide and its named panels."""
    mpl.use("agg")
    figure, named = plt.subplot_mosaic(layout, figsize=(10.0, height), layout="constrained")
    for each in named.values():
        each.grid(color="0.9")
    return figure, named


def save(figure: Figure, path: Path) -> None:
    """Write the figure and forget it."""
    figure.savefig(path, dpi=100)
    plt.close(figure)


def draw_rule(recording: Recording, rules: dict[str, Rule], path: Path) -> None:
    """Draw what goes into the design rule, and what comes out beside what the filter does."""
    figure, named = panels([["spectra", "error"]], 4.6)
    calm, biased, shaken = (
        rules[name] for name in ("still, bias removed", "still, bias left in", "the same, offset removed")
    )
    gyro = calm.rate._replace(density=calm.rate.density / (2.0 * np.pi * calm.rate.frequency) ** 2)
    for label, error, slope, style in (
        ("accelerometer's angle, vibrating", shaken.angle, 0.0, {"color": "tab:red", "ls": "-"}),
        ("accelerometer's angle, still", calm.angle, 0.0, {"color": "0.45", "ls": "-"}),
        ("gyro, integrated", gyro, -1.0, {"color": "tab:blue", "ls": "--"}),
    ):
        density, lowest = np.degrees(np.sqrt(error.density)), error.frequency[0]
        named["spectra"].loglog(error.frequency, density, label=label, lw=1.2, **style)
        # The record is too short for lower frequencies; there the rule takes white noise.
        beyond = np.array([0.01, lowest])
        named["spectra"].loglog(
            beyond, density[0] * (beyond / lowest) ** slope, ":", color=style["color"], lw=1.6
        )
    named["spectra"].set(
        xlabel="frequency / Hz",
        ylabel="error density / (deg/√Hz)",
        title="what is recorded at rest",
        ylim=(3e-6, 3e2),
    )
    draw_errors(named["error"], recording, (calm, biased, shaken))
    for each in named.values():
        each.legend(fontsize=8.5, loc="upper left", frameon=False)
    save(figure, path)


def draw_errors(panel: Axes, recording: Recording, rules: tuple[Rule, Rule, Rule]) -> None:
    """Draw the error over tau: predicted, at rest, and in motion."""
    bias = still(recording).gyr.mean(axis=0)
    calm, biased, shaken = (np.degrees([rule.rms(tau) for tau in TAUS]) for rule in rules)
    rest = np.degrees([rest_error(still(recording), bias, tau) for tau in TAUS])
    later = np.degrees([rest_error(still(recording, after=True), bias, tau) for tau in TAUS])
    motion = np.array([motion_error(recording, bias, tau) for tau in TAUS])
    panel.loglog(TAUS, motion, "k-", lw=2.0, label="in motion")
    panel.loglog(TAUS, shaken, "-", color="tab:red", lw=1.2, label="rule: vibrating (offset removed)")
    panel.loglog(TAUS, biased, "-.", color="tab:blue", lw=1.2, label="rule: still, gyro bias left in")
    panel.loglog(TAUS, later, ":", color="tab:green", lw=1.6, label="at rest again, later")
    panel.loglog(TAUS, calm, "-", color="0.45", lw=1.2, label="rule: still, bias removed")
    panel.loglog(TAUS[::4], rest[::4], "ko", ms=4.0, mfc="white", label="the same rest, filtered")
    for curve in (motion, shaken, biased, later, calm):
        panel.loglog(TAUS[np.argmin(curve)], curve.min(), "kv", ms=7.0)
    panel.set(
        xlabel="tau / s", ylabel="RMS error / deg", title="what the filter does with it", ylim=(4e-3, 1e3)
    )


def draw_rates(swing: Swing, path: Path) -> None:
    """Draw the errors of the rate with all sensor errors."""
    figure, named = panels([["drift", "close"]], 4.2)
    answers = rate_answers(*rate_sensors(swing)["+ bias / (deg/s)"])
    styles = {
        "gyro alone": {"color": "0.75", "ls": "-", "lw": 0.7},
        "(30), cf.RateFilter": {"color": "tab:red", "ls": "-", "lw": 1.5},
        "drift-free, cf.FirstOrder": {"color": "tab:blue", "ls": "--", "lw": 1.3},
        "drift-free, cf.PiForm": {"color": "black", "ls": "-", "lw": 1.2},
    }
    for panel in named.values():
        for answer, style in styles.items():
            panel.plot(swing.t, np.degrees(answers[answer] - swing.rate), label=answer, **style)
        panel.set(xlabel="time / s", ylabel="error of the rate / (deg/s)")
    drift = np.degrees(left_of_bias(swing.t))
    named["drift"].plot(swing.t[::150], drift[::150], "k+", ms=7.0, label="β (t - τ + τ exp(-t/τ))")
    named["drift"].set_title("the integral drifts, the low-pass lets it pass")
    named["close"].set(ylim=(-2.0, 5.0), title="close up")
    named["drift"].legend(frameon=False, fontsize=8.5)
    save(figure, path)


def draw_unequal(swing: Swing, path: Path) -> None:
    """Draw LP + HP over frequency, and the error that it makes of a motion."""
    figure, named = panels([["magnitude", "error"], ["phase", "error"]], 4.6)
    omega = np.geomspace(0.02, 50.0, 300) / TAU
    styles = {0.25: ":", 0.5: "--", 1.0: "-", 2.0: "-.", 4.0: (0, (5, 1, 1, 1, 1, 1))}
    for (ratio, style), color in zip(styles.items(), ("C0", "C1", "k", "C2", "C3"), strict=True):
        response, label = summed_response(ratio, omega), f"tau2/tau1 = {ratio:g}"
        named["magnitude"].semilogx(omega, abs(response), ls=style, color=color)
        named["phase"].semilogx(omega, np.degrees(np.angle(response)), ls=style, color=color)
        error = np.degrees(unequal_error(swing, ratio))
        named["error"].plot(swing.t, error, ls=style, color=color, lw=1.2, label=label)
    named["magnitude"].set(ylabel="|LP + HP|", title="response to the motion itself")
    named["error"].legend(frameon=False, fontsize=9.0)
    named["phase"].set(xlabel="angular frequency / (rad/s)", ylabel="phase / deg")
    named["error"].set(xlabel="time / s", ylabel="error of the angle / deg", xlim=(0.0, 15.0))
    named["error"].set_title("perfect sensors on a cube that swings")
    save(figure, path)
