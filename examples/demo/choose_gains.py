"""How the gains of the two recipes were chosen: the least RMS roll error over other drives than the bundled one.

    python examples/demo/choose_gains.py

Each drive has another seat motion and another sensor. The bundled log is seed 0, so it is not among them.
"""

import itertools

import numpy as np
import numpy.typing as npt

import compfilt as cf
from compfilt.motion import GRAVITY
from compfilt.simulate import child_seat

SEEDS = range(1, 9)

TAUS = (0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
OMEGAS = (0.05, 0.07, 0.1, 0.14, 0.2, 0.28, 0.4)
DAMPINGS = (0.5, 0.7, 1.0, 1.4, 2.0)

Array = npt.NDArray[np.float64]


def main() -> None:
    """Try the grid and print the best."""
    drives = [signals(seed) for seed in SEEDS]
    taus = {tau: error(cf.FirstOrder(tau), drives) for tau in TAUS}
    # k_P = 2 ζ ω0, k_I = ω0²
    pairs = {
        (omega0, damping): error(cf.PiForm(2.0 * damping * omega0, omega0**2), drives)
        for omega0, damping in itertools.product(OMEGAS, DAMPINGS)
    }
    print("first order\n     tau / s   RMS / deg")
    for tau, rms in taus.items():
        print(f"{tau:>12}{rms:>12.2f}")
    print("PI, RMS / deg\n   omega0 / (rad/s), damping:" + "".join(f"{damping:>8}" for damping in DAMPINGS))
    for omega0 in OMEGAS:
        print(f"{omega0:>28}" + "".join(f"{pairs[omega0, damping]:>8.2f}" for damping in DAMPINGS))
    tau = min(taus, key=taus.__getitem__)
    omega0, damping = min(pairs, key=pairs.__getitem__)
    print(f"best: tau = {tau} s; kp = {2.0 * damping * omega0:.3g} 1/s, ki = {omega0**2:.3g} 1/s^2")


def signals(seed: int) -> tuple[Array, Array, Array, Array]:
    """Return time in s, the gyro in rad/s, the accelerometer in m/s² and the true roll in deg of one drive."""
    log = child_seat(seed=seed)
    gyr = np.radians(np.column_stack([log[name] for name in ("gx", "gy", "gz")]))
    acc = GRAVITY * np.column_stack([log[name] for name in ("ax", "ay", "az")])
    return log["t"], gyr, acc, log["true_roll"]


def error(design: object, drives: list[tuple[Array, Array, Array, Array]]) -> float:
    """Return the RMS roll error over all drives, static tests included, in deg."""
    tilt = cf.TiltFilter(design, axes="flu")
    squares = [
        np.mean((np.degrees(tilt.stream().process(gyr, acc, t)[:, 0]) - roll) ** 2)
        for t, gyr, acc, roll in drives
    ]
    return float(np.sqrt(np.mean(squares)))


if __name__ == "__main__":
    main()
