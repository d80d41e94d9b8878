"""Roll, pitch and yaw against SciPy and against the angles of gravity."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import compfilt as cf
from compfilt.angles import angles_to_quaternion, quaternion_to_angles


def rotations(n=500):
    return Rotation.random(n, rng=np.random.default_rng(3))


def test_angles_are_scipys():
    expected = rotations().as_euler("ZYX")[:, ::-1]
    np.testing.assert_allclose(
        quaternion_to_angles(rotations().as_quat(scalar_first=True)), expected, atol=1e-12
    )


@pytest.mark.parametrize("axes", ["flu", "frd"])
def test_roll_and_pitch_are_those_of_gravity(axes):
    """With z up gravity's force points along the world's z, with z down against it."""
    z = rotations().inv().apply([0.0, 0.0, 1.0])
    expected = cf.tilt(z if axes == "flu" else -z, axes=axes)
    got = quaternion_to_angles(rotations().as_quat(scalar_first=True))
    np.testing.assert_allclose(got[:, :2], expected, atol=1e-12)


@given(st.tuples(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1)))
def test_there_and_back(given_angles):
    quaternion = angles_to_quaternion(*given_angles)
    np.testing.assert_allclose(np.linalg.norm(quaternion), 1.0, rtol=1e-15)
    np.testing.assert_allclose(quaternion_to_angles([quaternion])[0], given_angles, atol=1e-12)


def test_near_straight_up_the_pitch_is_exact():
    """Where the arcsine of a rounded number would be off by 1e-8, or not a number."""
    pitch = np.pi / 2 - np.array([0.0, 1e-9, 1e-7, 1e-5])
    quaternions = [angles_to_quaternion(0.0, angle, 0.0) for angle in pitch]
    np.testing.assert_allclose(quaternion_to_angles(quaternions)[:, 1], pitch, rtol=0, atol=1e-15)


def test_what_is_not_known_is_nan_and_level_is_zero():
    got = quaternion_to_angles([[np.nan] * 4, [1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0]])
    assert np.isnan(got[0]).all()
    assert got[1:].tobytes() == np.zeros((2, 3)).tobytes()
    assert quaternion_to_angles(np.empty((0, 4), np.float32)).shape == (0, 3)


def test_float32_goes_in_and_float64_comes_out():
    quaternions = rotations().as_quat(scalar_first=True).astype(np.float32)
    got = quaternion_to_angles(quaternions)
    assert got.dtype == np.float64
    np.testing.assert_array_equal(got, quaternion_to_angles(quaternions.astype(np.float64)))
