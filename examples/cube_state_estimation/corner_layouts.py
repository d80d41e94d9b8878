"""§1.2: how many sensors, and where."""

import itertools

import numpy as np

import compfilt as cf
from corner_cube import CHANNELS, EDGE, POSITIONS, ROTATIONS, on_faces
from corner_tables import Array, Table

THREE_AXES: dict[str, list[list[float]]] = {
    "one, at the pivot": [[0.0, 0.0, 0.0]],
    "two in line with the pivot": [[0.05, 0.05, 0.05], [0.15, 0.15, 0.15]],
    "two at one place (linearly dependent)": [[0.1, 0.1, 0.1], [0.1, 0.1, 0.1]],
    "two not in line with the pivot": [[0.15, 0.0, 0.0], [0.0, 0.15, 0.0]],
    "three in one plane with the pivot": [[0.15, 0.0, 0.0], [0.0, 0.15, 0.0], [0.15, 0.15, 0.0]],
    "three in one line beside the pivot": [[0.15, 0.0, 0.0], [0.15, 0.075, 0.0], [0.15, 0.15, 0.0]],
    "three elsewhere": [[0.15, 0.0, 0.0], [0.0, 0.15, 0.0], [0.0, 0.0, 0.15]],
    "four in one plane without the pivot": [
        [0.15, 0.0, 0.0],
        [0.15, 0.15, 0.0],
        [0.15, 0.0, 0.15],
        [0.15, 0.15, 0.15],
    ],
    "four elsewhere": [[0.0, 0.15, 0.15], [0.15, 0.0, 0.15], [0.15, 0.15, 0.0], [0.15, 0.15, 0.15]],
}
"""Positions of sensors whose three channels are all used, in m."""


def layouts() -> Table:
    """Return what each layout gives without and with the body rate."""
    centre = (EDGE / 2.0, EDGE / 2.0)
    table = {name: layout(np.array(places)) for name, places in THREE_AXES.items()}
    table["six of two axes, centres of the faces"] = layout(on_faces(centre, centre), ROTATIONS, CHANNELS)
    table["six of two axes, as chosen here"] = layout(POSITIONS, ROTATIONS, CHANNELS)
    return table


def layout(positions: Array, *turned: Array) -> dict[str, float | str]:
    """Return the noise gain of the worst axis without and with the rate, and the library's message where there is none."""
    try:
        array = cf.AccelerometerArray(positions, *turned)
    except ValueError as refusal:
        return {"without rate": np.inf, "with rate": np.inf, "message": str(refusal)}
    gains = {
        "without rate": float(array.noise_gain.max()),
        "with rate": float(array.noise_gain_with_gyro.max()),
    }
    try:
        array.gravity(np.zeros((1, len(positions), 3)))
    except ValueError as refusal:
        return {**gains, "message": str(refusal)}
    return {**gains, "message": ""}


def placements() -> tuple[Array, Array]:
    """Return the noise gains without and with rate of many layouts of the six sensors; infinite where there is none."""
    grid = itertools.product((0.02, 0.04, 0.075, 0.11, 0.13), repeat=4)  # m from the edges of the faces
    arrays = [cf.AccelerometerArray(on_faces(x[:2], x[2:]), ROTATIONS, CHANNELS) for x in grid]
    gains = np.array([(array.noise_gain.max(), array.noise_gain_with_gyro.max()) for array in arrays])
    return gains[:, 0], gains[:, 1]


def positions() -> Table:
    """Return how the noise gain depends on where the six sensors sit."""
    without, known = placements()
    return {
        name: {
            "layouts": gains.size,
            "least": float(gains.min()),
            "median": float(np.median(gains)),
            "above 10": int(np.sum((gains > 10.0) & np.isfinite(gains))),
            "none": int(np.sum(np.isinf(gains))),
        }
        for name, gains in {"without rate": without, "with rate": known}.items()
    }
