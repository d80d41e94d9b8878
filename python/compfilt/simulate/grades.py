"""Typical sensors, with the numbers of data sheets."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from compfilt.motion import GRAVITY
from compfilt.simulate.errors import ImuErrors, TriadErrors, two_sided

__all__ = ["GRADES", "typical"]

DEGREE = math.pi / 180.0
HOUR = 3600.0
FLAT = math.sqrt(2.0 * math.log(2.0) / math.pi)
"""The lowest Allan deviation that B alone gives, 0.664 B: what data sheets call bias instability."""


@dataclass(frozen=True)
class Tolerance:
    """A sheet's numbers for one sensor, SI: a specimen's constants lie evenly within ± bias, scale and cross_axis."""

    random_walk: float
    bias_instability: float
    bias: float
    scale: float
    cross_axis: float
    full_scale: float
    resolution: float = 0.0

    def specimen(self, rng: np.random.Generator) -> TriadErrors:
        """Draw one sensor."""
        cross_axis = self.cross_axis * rng.uniform(-1.0, 1.0, (3, 3))
        np.fill_diagonal(cross_axis, 0.0)
        bias_x, bias_y, bias_z = (self.bias * rng.uniform(-1.0, 1.0, 3)).tolist()
        scale_x, scale_y, scale_z = (self.scale * rng.uniform(-1.0, 1.0, 3)).tolist()
        return TriadErrors(
            random_walk=self.random_walk,
            bias_instability=self.bias_instability,
            bias=(bias_x, bias_y, bias_z),
            scale=(scale_x, scale_y, scale_z),
            cross_axis=tuple(tuple(row) for row in cross_axis.tolist()),
            resolution=self.resolution,
            full_scale=self.full_scale,
        )


# Gyro and accelerometer. Sheets do not give a rate random walk.
GRADES: Mapping[str, tuple[Tolerance, Tolerance]] = MappingProxyType(
    {
        # InvenSense MPU-6050, PS-MPU-6000A-00 revision 3.4, sections 6.1 and 6.2, at ± 250 °/s and ± 2 g. It is silent on
        # instability; the gyro's is as one user measured it (0.0012 °/s; forum.pololu.com, topic 8721).
        "consumer": (
            Tolerance(
                random_walk=two_sided(0.005 * DEGREE),
                bias_instability=0.0012 * DEGREE / FLAT,
                bias=20.0 * DEGREE,
                scale=0.03,
                cross_axis=0.02,
                full_scale=250.0 * DEGREE,
                resolution=DEGREE / 131.0,
            ),
            Tolerance(
                random_walk=two_sided(400e-6 * GRAVITY),
                bias_instability=0.0,
                bias=0.05 * GRAVITY,
                scale=0.03,
                cross_axis=0.02,
                full_scale=2.0 * GRAVITY,
                resolution=GRAVITY / 16384.0,
            ),
        ),
        # Aceinna OpenIMU300ZA, the manufacturer's specification; its bias over temperature as the bias. It is silent on
        # cross axes.
        "industrial": (
            Tolerance(
                random_walk=0.3 * DEGREE / math.sqrt(HOUR),
                bias_instability=6.0 * DEGREE / HOUR / FLAT,
                bias=0.5 * DEGREE,
                scale=1e-3,
                cross_axis=0.0,
                full_scale=400.0 * DEGREE,
                resolution=0.02 * DEGREE,
            ),
            Tolerance(
                random_walk=0.05 / math.sqrt(HOUR),
                bias_instability=20e-6 * GRAVITY / FLAT,
                bias=5e-3 * GRAVITY,
                scale=1e-3,
                cross_axis=0.0,
                full_scale=8.0 * GRAVITY,
                resolution=0.5e-3 * GRAVITY,
            ),
        ),
        # Sensonor STIM300 with accelerometers of 10 g, revision 9 of the sheet as cited in NavToolkit's stim300_model.
        # Its 24 bits are finer than its noise.
        "tactical": (
            Tolerance(
                random_walk=0.15 * DEGREE / math.sqrt(HOUR),
                bias_instability=0.5 * DEGREE / HOUR / FLAT,
                bias=250.0 * DEGREE / HOUR,
                scale=500e-6,
                cross_axis=1e-3,
                full_scale=400.0 * DEGREE,
            ),
            Tolerance(
                random_walk=0.06 / math.sqrt(HOUR),
                bias_instability=0.05e-3 * GRAVITY / FLAT,
                bias=0.75e-3 * GRAVITY,
                scale=300e-6,
                cross_axis=1e-3,
                full_scale=10.0 * GRAVITY,
            ),
        ),
    }
)
"""For each grade the tolerances of the gyro and of the accelerometer."""


def typical(grade: str, *, seed: int = 0) -> ImuErrors:
    """Return the errors of one sensor of a grade, with the numbers of a data sheet.

    Noise, resolution and full scale are the sheet's; bias, scale and cross axes are drawn evenly from its tolerances.
    What the sheet does not state is 0.

    Parameters
    ----------
    grade
        ``"consumer"``: InvenSense MPU-6050. ``"industrial"``: Aceinna OpenIMU300ZA. ``"tactical"``: Sensonor STIM300.
    seed
        Another seed is another specimen.

    Raises
    ------
    ValueError
        There is no such grade.

    Examples
    --------
    >>> import math
    >>> errors = typical("tactical")
    >>> round(math.degrees(errors.gyro.random_walk[0]) * 60.0, 3)  # °/√h
    0.15
    """
    if grade not in GRADES:
        raise ValueError(f"grade must be one of {', '.join(GRADES)}, got {grade!r}")
    gyro, accelerometer = GRADES[grade]
    rng = np.random.default_rng(seed)
    return ImuErrors(gyro.specimen(rng), accelerometer.specimen(rng))
