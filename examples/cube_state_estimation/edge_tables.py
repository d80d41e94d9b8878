"""The tables of the cube on its edge."""

import numpy as np

from edge_study import SCENARIOS, Results


def print_tables(results: Results) -> None:
    """Print what the linear analysis and the simulations say."""
    print(
        f"{'linear analysis':<28}{'eigenvalue':>11}{'all wrong by':>14}{'K_m':>14}{'m l':>7}{'inertia':>14}"
    )
    for name, one in results.linear.items():
        motor, inertia = (f"{low:.2f} - {high:.2f}" for low, high in (one.motor, one.inertia))
        print(
            f"{name:<28}{one.radius:>11.4f}{100.0 * one.common:>12.0f} %{motor:>14}{one.lever:>7.2f}{inertia:>14}"
        )
    print(
        f"\n{'dry friction':<28}{'rest / (rad/s)':>15}{'N m s':>10}{'Hz':>7}{'RMS / °':>9}{'falls at noise x':>18}"
    )
    for name, one in results.linear.items():
        cycle = one.cycle
        print(
            f"{name:<28}{round(one.resting_slip, 1) + 0.0:>15.1f}{cycle.friction:>10.5f}{cycle.frequency:>7.2f}"
            f"{np.degrees(cycle.tilt):>9.3f}{results.fallen[name]:>18.0f}"
        )
    for title, scale, pick, digits in (
        ("RMS tilt / °", np.degrees(1.0), 0, 3),
        ("RMS current / A", 1.0, 1, 3),
        ("mean slip / (rad/s)", 1.0, 2, 1),
    ):
        print(f"\n{title:<28}" + "".join(f"{what:>17}" for what in SCENARIOS))
        for name, swings in results.swings.items():
            print(
                f"{name:<28}" + "".join(f"{scale * swings[what][pick]:>17.{digits}f}" for what in SCENARIOS)
            )
    print("\none more state")
    for name, said in results.refusals.items():
        print(f"{name:<36}{said}")
