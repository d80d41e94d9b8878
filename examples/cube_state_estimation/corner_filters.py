"""§1.3: complementary filters of both angles."""

import numpy as np

import compfilt as cf
from corner_cube import ARRAY, OPERATING_POINT
from corner_gravity import angle_errors, forces
from corner_motion import DURATION, FS, Swing, T, motion, stand, swing
from corner_sensors import BIASED, PERFECT, VIBRATING, Errors, Readings, read
from corner_tables import Array, Table, rms

TAU = 0.5
PI = cf.PiForm(kp=2.0, ki=1.0)


def estimate(design: cf.LinearFilter, rate_matrix: str, readings: Readings) -> cf.CubeEstimate:
    """Run the cube's pipeline with (1.31) at the filter's own "output" or "frozen" at the operating point."""
    at = OPERATING_POINT if rate_matrix == "frozen" else None
    return cf.Cube(ARRAY, design, rates=rate_matrix, at=at).estimate(*readings, fs=FS)


def gyros_alone(true: Swing, readings: Readings) -> Array:
    """Integrate (1.31) from the true angles on: a time constant of thirty years leaves nothing of the accelerometers."""
    cube = cf.Cube(ARRAY, cf.FirstOrder(1e9))
    return cube.estimate(*readings, fs=FS, initial=true.angles[0]).angles


def answers(true: Swing, readings: Readings) -> dict[str, Array]:
    """Return both angles by every way, (n, 2) in rad."""
    force, body_rate = forces(readings), ARRAY.body_rate(readings.gyr)
    plain = cf.TiltFilter(cf.FirstOrder(TAU), axes="cube")
    unextracted = {
        f"first order, {way}": plain.estimate(body_rate, force[way], fs=FS).angles
        for way in ("one sensor, 202 mm from the pivot", "mean of the four channels")
    }
    return {
        "accelerometers alone": cf.tilt(force["array, rate unknown"], axes="cube"),
        "gyros alone": gyros_alone(true, readings),
        **unextracted,
        **filtered(readings),
    }


def filtered(readings: Readings) -> dict[str, Array]:
    """Return both angles by both designs and both matrices, (n, 2) in rad."""
    return {
        f"{name}, {rate_matrix}": estimate(design, rate_matrix, readings).angles
        for name, design in {"first order": cf.FirstOrder(TAU), "PI": PI}.items()
        for rate_matrix in ("frozen", "output")
    }


def filters(near: Swing, far: Swing) -> Table:
    """Return the RMS errors of both angles near the operating point and far from it, in deg."""
    table: Table = {}
    for name, true in {"near": near, "far": far}.items():
        for way, angles in answers(true, read(true, VIBRATING)).items():
            table.setdefault(way, {}).update(angle_errors(name, angles, true))
        biased = estimate(PI, "output", read(true, BIASED)).angles
        table.setdefault("PI, output, acc. bias left in", {}).update(angle_errors(name, biased, true))
    return table


def operating_point() -> Table:
    """Return what the linearisation costs over the size of the swing, with perfect sensors, in deg."""
    table: Table = {}
    for degrees in (2.5, 5.0, 10.0, 20.0, 30.0):
        true = swing(np.radians(degrees))
        readings = read(true, PERFECT)
        row = table[f"swing of {degrees:g}°"] = {}
        for rate_matrix in ("frozen", "output"):
            row |= angle_errors(rate_matrix, estimate(cf.FirstOrder(TAU), rate_matrix, readings).angles, true)
    return table


TURN_RATE, TURN_OFFSET = np.radians(60.0), np.radians(-20.0)


def turn() -> Table:
    """Return the errors in a steady turn about the vertical beside the operating point, perfect sensors, in deg."""
    t = np.arange(round(DURATION * FS)) * T
    nothing = np.zeros((t.size, 2))
    angles = nothing + OPERATING_POINT + TURN_OFFSET
    true = motion(t, angles, nothing, nothing, (nothing[:, 0] + TURN_RATE, nothing[:, 0]))
    phi2, phi3 = angles[0]
    apart, tan = OPERATING_POINT[1] - phi3, np.tan(OPERATING_POINT[0])
    frozen = (
        np.cos(phi2) * np.sin(apart),
        np.sin(phi2) - tan * np.cos(phi2) * np.cos(apart),
    )  # rates over φ̇1
    found = {name: each[-1] - angles[0] for name, each in filtered(read(true, PERFECT)).items()}
    return {
        name: dict(zip(("φ2 / deg", "φ3 / deg"), np.degrees(off).tolist(), strict=True))
        for name, off in {
            "first order, frozen, closed form": TAU * TURN_RATE * np.array(frozen),
            **found,
        }.items()
    }


def rectified() -> Table:
    """Return by how much vibration shifts the mean of φ2 at rest, in deg: no linear filter of the angle removes that."""
    still = stand()
    table: Table = {}
    for times in (0.5, 1.0, 2.0):
        force = ARRAY.gravity(read(still, Errors(noise=1.0, vibration=times)).acc)
        angles = np.degrees(cf.tilt(force, axes="cube") - still.angles)
        mean = cf.tilt(force.mean(axis=0, keepdims=True), axes="cube") - still.angles[:1]
        table[f"vibration times {times:g}"] = {
            "φ3: RMS / deg": rms(angles[:, 1]),
            "φ2: RMS / deg": rms(angles[:, 0]),
            "φ2: mean error / deg": float(np.mean(angles[:, 0])),
            "φ2 of the mean force: error / deg": float(np.degrees(mean[0, 0])),
        }
    return table
