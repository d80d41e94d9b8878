"""Sensors and logs whose truth is known. Needs NumPy only; writing a log needs the extra ``logs``."""

from compfilt.simulate.errors import ImuErrors, TriadErrors, two_sided
from compfilt.simulate.files import write
from compfilt.simulate.grades import GRADES, typical
from compfilt.simulate.inertial import LOG_UNITS, imu, imu_log, triad
from compfilt.simulate.length import samples_in
from compfilt.simulate.noise import flicker, random_walk, white
from compfilt.simulate.seat import SensorErrors, child_seat, measure, seat_motion, static_length

__all__ = [
    "GRADES",
    "LOG_UNITS",
    "ImuErrors",
    "SensorErrors",
    "TriadErrors",
    "child_seat",
    "flicker",
    "imu",
    "imu_log",
    "measure",
    "random_walk",
    "samples_in",
    "seat_motion",
    "static_length",
    "triad",
    "two_sided",
    "typical",
    "white",
    "write",
]
