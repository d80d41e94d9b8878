"""Accelerometer arrays: gravity and angular acceleration from sensors on a turning body, against plain least squares."""

import copy
import math
import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import compfilt as cf
import rigid_body as rb
from designs import assert_same_bits, pickled, precisions
from rigid_body import AXES, QUANTITIES, layout
from test_contract import LAYOUTS

some = settings(max_examples=15)
many = settings(max_examples=60)
seeds = st.integers(0, 2**32 - 1)
quantities = pytest.mark.parametrize("quantity", QUANTITIES)
rates_known = pytest.mark.parametrize("known", [False, True], ids=["rate unknown", "rate known"])
TETRAHEDRON = [[0.1, 0.1, 0.0], [0.1, 0.0, 0.1], [0.0, 0.1, 0.1], [0.12, 0.1, 0.11]]


def make(sensors, **keywords):
    return cf.AccelerometerArray(*sensors.arguments, **keywords)


def gain(array, quantity, known):
    """The noise gain under its name."""
    prefix = "" if quantity == "gravity" else "angular_acceleration_"
    return np.asarray(getattr(array, f"{prefix}noise_gain{'_with_gyro' * known}"))


def run(array, quantity, acc, gyr=None, **keywords):
    return getattr(array, quantity)(acc, gyr, **keywords)


def refused(call, *arguments, kind=ValueError, **keywords):
    """The message: one sentence."""
    with pytest.raises(kind) as caught:
        call(*arguments, **keywords)
    # Where the interpreter has notes, the argument's name stands there.
    message = " ".join([str(caught.value), *getattr(caught.value, "__notes__", [])])
    assert message.strip() == message != ""
    assert "\n" not in message
    assert not re.search(r"\.\s+[A-Z]|\.$", message), message
    return message


def check_names_an_open_axis(message, solved):
    """Only axes that cannot be solved, and at least one."""
    named = set(re.findall(r"\b[xyz]\b", message))
    assert named, message
    assert named <= {axis for axis, ok in zip(AXES, solved, strict=True) if not ok}, message


def rounding(sensors, quantity, known, acc, omega, dtype=float):
    """(n, 3): what rounding of the readings, the weights and their design may do."""
    sizes = np.abs(np.where(sensors.channels, acc, 0.0))
    if known:
        sizes = sizes + np.where(sensors.channels, np.abs(rb.centripetal(sensors, omega)), 0.0)
    largest = np.abs(rb.weights(sensors, quantity, known)).max(axis=(1, 2))
    unit = 16 * np.finfo(dtype).eps + 64 * np.finfo(float).eps * rb.condition(sensors, known)
    return unit * largest * sizes.sum(axis=(1, 2))[:, None]


def check_extraction(array, sensors, quantity, known, motion, dtype=float):
    """Exact to rounding for any motion."""
    acc, omega = rb.accelerations_read(sensors, motion), motion.omega
    got = run(array, quantity, acc.astype(dtype), omega.astype(dtype) if known else None)
    assert got.dtype == dtype
    assert got.shape == (len(motion), 3)
    truth = motion.gravity if quantity == "gravity" else motion.alpha
    bound = rounding(sensors, quantity, known, acc, omega, dtype)
    assert (np.abs(got - truth) <= bound).all(), np.abs((got - truth) / bound).max()


def linear_map(array, count, quantity, known):
    """(3, s, 3): what every channel contributes, from readings of one channel at a time."""
    acc = np.eye(3 * count).reshape(-1, count, 3)
    gyr = np.zeros((3 * count, 3)) if known else None
    return run(array, quantity, acc, gyr).T.reshape(3, count, 3)


# --------------------------------------------------------------------------------------------------- layouts at random


def masks(rng, count, share):
    return rng.random((count, 3)) < share


def places(rng, count, geometry):
    """Positions with or without a degeneracy, in any direction."""
    r = rng.uniform(-1, 1, (count, 3))
    if geometry == "in line with the pivot":
        r = np.outer(rng.uniform(-1, 1, count), r[0])
    elif geometry == "in line":
        r = r[0] + np.outer(rng.uniform(-1, 1, count), r[-1])
    elif geometry == "in a plane with the pivot":
        r = rng.uniform(-1, 1, (count, 2)) @ rng.uniform(-1, 1, (2, 3))
    elif geometry == "in a plane":
        r = rng.uniform(-1, 1, 3) + rng.uniform(-1, 1, (count, 2)) @ rng.uniform(-1, 1, (2, 3))
    elif geometry == "one at the pivot":
        r[rng.integers(count)] = 0.0
    elif geometry == "coinciding":
        r[-1] = r[0]
    elif geometry == "symmetric pairs":
        r[1::2] = 2 * rng.uniform(-1, 1, 3) - r[: count - 1 : 2][: len(r[1::2])]
    return r * 10 ** rng.uniform(-2, 1)


GEOMETRIES = [
    "generic",
    "in line with the pivot",
    "in line",
    "in a plane with the pivot",
    "in a plane",
    "one at the pivot",
    "coinciding",
    "symmetric pairs",
]


@st.composite
def layouts(draw, geometries=GEOMETRIES, fewest=1, shares=(1.0, 1.0, 0.8, 0.6), mountings=("aligned", "any")):
    """Any number of sensors, mounted along the axes or anyhow, with channels masked and noise of their own."""
    rng, count = np.random.default_rng(draw(seeds)), draw(st.integers(fewest, 8))
    if draw(st.sampled_from(mountings)) == "aligned":
        rotations = rb.signed_permutations()[rng.integers(48, size=count)]
    else:
        rotations = [rb.random_rotation(rng, reflections=True) for _ in range(count)]
    channels = masks(rng, count, draw(st.sampled_from(shares)))
    assume(channels.sum() >= 3)
    sigma = 10 ** rng.uniform(-1, 0.5, (count, 3)) if draw(st.booleans()) else 1.0
    sensors = layout(places(rng, count, draw(st.sampled_from(geometries))), rotations, channels, sigma)
    assume(rb.is_clear_cut(sensors))
    return sensors


def good_layouts(**keywords):
    """Gravity and the angular acceleration follow without a gyro."""
    any_of_them = layouts(geometries=["generic"], fewest=5, shares=(1.0, 1.0, 0.9, 0.75), **keywords)
    return any_of_them.filter(
        lambda sensors: all(rb.solvable(sensors, quantity).all() for quantity in QUANTITIES)
    )


UNIT = 0.05  # m


@st.composite
def lattices(draw):
    """A few sensors on a small lattice, mounted along the axes: most are degenerate, and fractions tell in which way."""
    count = draw(st.integers(1, 6))
    rng = np.random.default_rng(draw(seeds))
    steps = rng.integers(-2, 3, (count, 3)) if draw(st.booleans()) else rng.integers(0, 2, (count, 3))
    rotations = rb.signed_permutations()[rng.integers(48, size=count)]
    channels = masks(rng, count, draw(st.sampled_from([1.0, 0.85, 0.7, 0.5])))
    return layout(UNIT * steps, rotations, channels)


# ------------------------------------------------------------------------------------------------ the oracle by itself


def test_readings_are_those_of_points_on_a_moving_body():
    """The oracle's M r is the second derivative of the point's path, and its gravity S1 (1.7)."""
    t, h = np.linspace(0.0, 3.0, 7), 2e-3
    keywords = {"centre": (0.3, -0.4, 2.0), "amplitudes": (0.5, 0.4, 0.6), "frequencies": (5.0, 7.0, 4.0)}
    sensors = rb.thesis_cube()
    body_to_world = []
    for shift in (-2, -1, 0, 1, 2):
        angles = rb.swing(t + shift * h, **keywords).angles
        turns = []
        for one in angles:
            columns = [rb.turned_back(2, one[2:], np.eye(3)[i : i + 1]) for i in range(3)]
            matrix = np.concatenate(columns).T
            for axis in (1, 0):
                back = np.concatenate(
                    [rb.turned_back(axis, one[axis : axis + 1], e[None]) for e in np.eye(3)]
                ).T
                matrix = matrix @ back
            turns.append(matrix.T)
        body_to_world.append(np.array(turns))
    before2, before, now, after, after2 = body_to_world
    acceleration = (-before2 + 16 * before - 30 * now + 16 * after - after2) / (12 * h**2)
    rate = (before2 - 8 * before + 8 * after - after2) / (12 * h)
    motion = rb.swing(t, **keywords)
    spin = np.swapaxes(now, 1, 2) @ rate
    np.testing.assert_allclose(rb.cross_matrix(motion.omega), spin, atol=1e-6)
    down = np.array([9.81, 0.0, 0.0])
    forces = np.einsum("nji,njs->nis", now, acceleration @ sensors.positions.T - down[:, None])
    expected = np.einsum("sij,njs->nsi", sensors.rotations, forces)
    np.testing.assert_allclose(rb.accelerations_read(sensors, motion), expected, atol=2e-4)
    np.testing.assert_allclose(motion.gravity, rb.cube_gravity(*motion.angles[:, 1:].T), atol=1e-12)


def test_balanced_cube_stands_on_its_corner():
    np.testing.assert_allclose(rb.cube_gravity(*rb.BALANCED, g=1.0), rb.UP, atol=1e-15)


@many
@given(sensors=lattices())
def test_null_space_agrees_with_exact_elimination(sensors):
    assume(sensors.channels.any())
    for output, expected in rb.solvable_exactly(sensors, UNIT).items():
        np.testing.assert_array_equal(rb.solvable(sensors, *output), expected)


@some
@given(sensors=good_layouts(), seed=seeds)
def test_the_oracles_two_forms_agree(sensors, seed):
    motion = rb.random_motion(np.random.default_rng(seed), 4)
    acc = rb.accelerations_read(sensors, motion)
    along_axes = (np.abs(np.abs(sensors.rotations) - 0.5) == 0.5).all()
    for quantity, extracted in zip(QUANTITIES, rb.extract(sensors, acc), strict=True):
        weights = rb.weights(sensors, quantity)
        by_weights = np.einsum("ksc,nsc->nk", weights, acc)
        np.testing.assert_allclose(by_weights, extracted, rtol=1e-8, atol=1e-8 * np.abs(weights).max())
        if along_axes:
            aligned = rb.aligned_weights(sensors, quantity)
            np.testing.assert_allclose(aligned, weights, atol=1e-9 * np.abs(weights).max())


# ------------------------------------------------------------------------------------------------------- any geometry


def check_whole_array(sensors, form, solved):
    """Every output of an array whose solvable axes are known: ``solved[quantity, known]`` is (3,) bool."""
    if not solved["gravity", True].all():
        message = refused(make, sensors, form=form)
        check_names_an_open_axis(message, solved["gravity", True])
        return
    array = make(sensors, form=form)
    motion = rb.random_motion(np.random.default_rng(1), 4)
    acc = rb.accelerations_read(sensors, motion)
    for (quantity, known), ok in solved.items():
        np.testing.assert_array_equal(np.isfinite(gain(array, quantity, known)), ok)
        np.testing.assert_array_equal(np.isposinf(gain(array, quantity, known)), ~ok)
        expected = rb.noise_gain(sensors, rb.weights(sensors, quantity, known))
        np.testing.assert_allclose(gain(array, quantity, known)[ok], expected[ok], rtol=1e-8)
        gyr = motion.omega if known else None
        if ok.all():
            check_extraction(array, sensors, quantity, known, motion)
        else:
            check_names_an_open_axis(refused(run, array, quantity, acc, gyr), ok)
        if quantity == "angular_acceleration":
            check_single_axes(
                array, acc, gyr, ok, motion.alpha, rounding(sensors, quantity, known, acc, motion.omega)
            )


def check_single_axes(array, acc, gyr, ok, truth, bound):
    """An axis that can be solved does not suffer from one that cannot."""
    for axis, name in enumerate(AXES):
        if ok[axis]:
            got = array.angular_acceleration(acc, gyr, axes=name)
            assert got.shape == (len(acc), 1)
            assert (np.abs(got[:, 0] - truth[:, axis]) <= bound[:, axis]).all()
        else:
            message = refused(array.angular_acceleration, acc, gyr, axes=name)
            check_names_an_open_axis(message, ok)


@many
@given(sensors=layouts())
def test_any_layout_is_exact_or_refused(sensors):
    outputs = [(quantity, known) for quantity in QUANTITIES for known in (False, True)]
    check_whole_array(sensors, "general", {output: rb.solvable(sensors, *output) for output in outputs})


@pytest.mark.parametrize("form", ["aligned", "general", None])
@many
@given(sensors=lattices())
def test_any_lattice_is_exact_or_refused(sensors, form):
    """Degenerate in every way that a small lattice can be; the rank comes from fractions."""
    if sensors.channels.sum() < 3:
        assert re.search(r"\bchannels\b|\b[xyz]\b", refused(make, sensors, form=form))
        return
    check_whole_array(sensors, form, rb.solvable_exactly(sensors, UNIT))


@precisions
@quantities
@rates_known
@some
@given(sensors=good_layouts(), seed=seeds, speed=st.floats(-3, 3).map(lambda exponent: 10**exponent))
def test_any_motion_is_exact(dtype, quantity, known, sensors, seed, speed):
    """From a slow sway to a rate at which gravity is a millionth of the reading."""
    motion = rb.random_motion(np.random.default_rng(seed), 6, rate=speed, acceleration=speed**2)
    check_extraction(make(sensors), sensors, quantity, known, motion, dtype)


@rates_known
@some
@given(sensors=good_layouts(), seed=seeds)
def test_least_squares_on_noisy_readings(known, sensors, seed):
    """Where the readings fit no motion at all, the weights decide."""
    rng = np.random.default_rng(seed)
    acc, omega = rng.normal(size=(5, sensors.count, 3)), rng.normal(size=(5, 3))
    array = make(sensors)
    expected = rb.extract(sensors, acc, omega if known else None)
    for quantity, wanted in zip(QUANTITIES, expected, strict=True):
        got = run(array, quantity, acc, omega if known else None)
        bound = rounding(sensors, quantity, known, acc, omega) + 1e-12 * np.abs(wanted).max()
        assert (np.abs(got - wanted) <= 4 * bound).all()


@quantities
@rates_known
@some
@given(sensors=good_layouts(), seed=seeds)
def test_turned_body_axes_turn_the_result(quantity, known, sensors, seed):
    """General mountings are nothing but another choice of body axes."""
    rng = np.random.default_rng(seed)
    turn = rb.random_rotation(rng)
    turned = sensors.turned(turn)
    motion = rb.random_motion(rng, 5)
    acc = rb.accelerations_read(sensors, motion)
    got = run(make(sensors), quantity, acc, motion.omega if known else None)
    other = run(make(turned), quantity, acc, motion.omega @ turn.T if known else None)
    bound = rounding(sensors, quantity, known, acc, motion.omega).max()
    np.testing.assert_allclose(other, got @ turn.T, rtol=0, atol=4 * bound)


@rates_known
@pytest.mark.parametrize("power", [-10, -4, 4, 10])
@some
@given(sensors=good_layouts())
def test_size_of_the_body_does_not_matter(known, power, sensors):
    """Gravity's noise gain has no length in it; the angular acceleration's is one over a length."""
    scaled = layout(2.0**power * sensors.positions, *sensors.arguments[1:])
    small, large = make(sensors), make(scaled)
    np.testing.assert_allclose(gain(large, "gravity", known), gain(small, "gravity", known), rtol=1e-9)
    expected = gain(small, "angular_acceleration", known) / 2.0**power
    np.testing.assert_allclose(gain(large, "angular_acceleration", known), expected, rtol=1e-9)


# ------------------------------------------------------------------------------------------------------------- two forms


@quantities
@some
@given(sensors=good_layouts(mountings=["aligned"]))
def test_aligned_form_equals_the_general_form(quantity, sensors):
    """S1 (1.22)-(1.27) with the weights of the least noise is weighted least squares."""
    aligned, general = make(sensors, form="aligned"), make(sensors, form="general")
    assert (aligned.form, general.form, make(sensors).form) == ("aligned", "general", "aligned")
    expected = rb.aligned_weights(sensors, quantity)
    for array in (aligned, general):
        got = linear_map(array, sensors.count, quantity, known=False)
        np.testing.assert_allclose(got, expected, atol=1e-9 * np.abs(expected).max())
    for known in (False, True):
        np.testing.assert_allclose(gain(aligned, quantity, known), gain(general, quantity, known), rtol=1e-9)
    with_rate = [linear_map(array, sensors.count, quantity, known=True) for array in (aligned, general)]
    np.testing.assert_allclose(*with_rate, atol=1e-9 * np.abs(with_rate[1]).max())


def test_form_is_aligned_where_every_used_channel_lies_along_an_axis():
    """What the unused channels do plays no part."""
    turn = rb.random_rotation(np.random.default_rng(3))
    straight = np.eye(3)
    aside = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.0, -0.8, 0.6]])  # only its x lies along an axis
    rotations = [straight] * 4 + [aside]
    positions = [*TETRAHEDRON, [0.0, 0.0, 0.05]]
    channels = np.ones((5, 3), bool)
    channels[4, 1:] = False
    assert cf.AccelerometerArray(positions, rotations, channels).form == "aligned"
    assert cf.AccelerometerArray(positions, rotations, channels, form="aligned").form == "aligned"
    assert cf.AccelerometerArray(positions, rotations).form == "general"
    assert cf.AccelerometerArray(TETRAHEDRON, [turn] * 4).form == "general"
    assert cf.AccelerometerArray(TETRAHEDRON).form == "aligned"
    assert cf.AccelerometerArray(TETRAHEDRON, -rb.signed_permutations()[[5, 17, 29, 47]]).form == "aligned"
    assert "form" in refused(cf.AccelerometerArray, positions, rotations, form="aligned")
    assert "form" in refused(cf.AccelerometerArray, TETRAHEDRON, [turn] * 4, form="aligned")


# ------------------------------------------------------------------------------------------------------ S1's six sensors


def test_four_channels_see_each_axis():
    """S1 (1.22), as (sensor, channel) counted from 1."""
    sensors = rb.thesis_cube()
    seen = [[] for _ in AXES]
    for sensor, channel in sensors.used:
        seen[int(np.argmax(np.abs(sensors.rotations[sensor, channel])))].append(
            f"s{sensor + 1}{AXES[channel]}"
        )
    assert seen == [["s1y", "s2y", "s5x", "s6x"], ["s1x", "s2x", "s3y", "s4y"], ["s3x", "s4x", "s5y", "s6y"]]


@precisions
@pytest.mark.parametrize("form", ["aligned", "general"])
@quantities
@rates_known
def test_thesis_cube(dtype, form, quantity, known):
    sensors = rb.thesis_cube()
    array = make(sensors, form=form)
    check_extraction(array, sensors, quantity, known, rb.random_motion(np.random.default_rng(2), 50), dtype)
    expected = rb.noise_gain(sensors, rb.weights(sensors, quantity, known))
    np.testing.assert_allclose(gain(array, quantity, known), expected, rtol=1e-10)


def test_thesis_cube_by_its_own_equations():
    """Four channels, four unknowns: b from (1.25) and sum b = 1 alone, then (1.27)."""
    sensors = rb.thesis_cube()
    motion = rb.random_motion(np.random.default_rng(4), 20)
    acc = rb.accelerations_read(sensors, motion)
    s = {f"s{i + 1}{AXES[c]}": acc[:, i, c] for i in range(6) for c in range(3)}
    rows = [["s1y", "s2y", "s5x", "s6x"], ["s1x", "s2x", "s3y", "s4y"], ["s3x", "s4x", "s5y", "s6y"]]
    expected = np.empty((20, 3))
    for axis, names in enumerate(rows):
        r = np.array([sensors.positions[int(name[1]) - 1] for name in names])
        b = np.linalg.solve(np.vstack([r.T, np.ones(4)]), [0.0, 0.0, 0.0, 1.0])
        expected[:, axis] = sum(weight * s[name] for weight, name in zip(b, names, strict=True))
    np.testing.assert_allclose(make(sensors).gravity(acc), expected, atol=1e-10)
    np.testing.assert_allclose(expected, motion.gravity, atol=1e-10)


def test_sensors_in_the_middle_of_the_faces_need_the_gyro():
    """The obvious mounting fails: every axis is seen by two pairs that are symmetric about the cube's middle."""
    sensors = rb.face_centres()
    array = make(sensors)
    motion = rb.random_motion(np.random.default_rng(5), 10)
    acc = rb.accelerations_read(sensors, motion)
    assert re.search(r"\b[xyz]\b", refused(array.gravity, acc))
    assert np.isposinf(array.noise_gain).all()
    check_extraction(array, sensors, "gravity", True, motion)
    check_extraction(array, sensors, "angular_acceleration", False, motion)


# ------------------------------------------------------------------------------------------------- geometries with a name

CORNER = np.array([0.03, -0.05, 0.08])
# positions, whether acc alone gives gravity; with the gyro all of these do
NAMED = {
    "two in line with the pivot": ([CORNER, -2.3 * CORNER], True),
    "three in line with the pivot": ([CORNER, 0.7 * CORNER, 2.1 * CORNER], True),
    "three in a plane with the pivot": ([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.17, 0.0]], True),
    "three": ([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]], False),
    "four": (TETRAHEDRON, True),
    "one at the pivot": ([[0.0, 0.0, 0.0]], True),
    "one at the pivot, one beside it": ([[0.0, 0.0, 0.0], CORNER], True),
    "one at the pivot, three others": ([[0.0, 0.0, 0.0], *TETRAHEDRON[:3]], True),
    "two coinciding among four": ([*TETRAHEDRON[:3], TETRAHEDRON[0]], False),
    "two coinciding among five": ([*TETRAHEDRON, TETRAHEDRON[0]], True),
    "two pairs symmetric about the pivot": ([CORNER, -CORNER, TETRAHEDRON[0], [-0.1, -0.1, 0.0]], True),
    "two pairs symmetric about a point off the pivot": (
        [[0.1, 0.0, 0.1], [-0.1, 0.0, 0.1], [0.0, 0.1, 0.1], [0.0, -0.1, 0.1]],
        False,
    ),
    "four in a plane off the pivot": (
        [[0.1, 0.0, 0.1], [-0.1, 0.02, 0.1], [0.0, 0.1, 0.1], [0.03, -0.1, 0.1]],
        False,
    ),
}
named = pytest.mark.parametrize(("positions", "alone"), NAMED.values(), ids=NAMED.keys())


@named
@pytest.mark.parametrize("form", ["aligned", "general"])
def test_named_geometries(positions, alone, form):
    sensors = layout(positions)
    array = make(sensors, form=form)
    motion = rb.random_motion(np.random.default_rng(6), 10)
    check_extraction(array, sensors, "gravity", True, motion)
    assert np.isfinite(array.noise_gain_with_gyro).all()
    if alone:
        assert np.isfinite(array.noise_gain).all()
        check_extraction(array, sensors, "gravity", False, motion)
    else:
        assert np.isposinf(array.noise_gain).all()
        message = refused(array.gravity, rb.accelerations_read(sensors, motion))
        check_names_an_open_axis(message, [False] * 3)


@named
@some
@given(seed=seeds)
def test_named_geometries_turned(positions, alone, seed):
    """Rounding moves the sensors a little out of their line or plane, and nothing comes of it."""
    rng = np.random.default_rng(seed)
    rotations = [rb.random_rotation(rng, reflections=True) for _ in positions]
    sensors = layout(positions, rotations).turned(rb.random_rotation(rng))
    array = make(sensors)
    motion = rb.random_motion(rng, 5)
    check_extraction(array, sensors, "gravity", True, motion)
    if alone:
        check_extraction(array, sensors, "gravity", False, motion)
    else:
        assert np.isposinf(array.noise_gain).all()
        refused(array.gravity, rb.accelerations_read(sensors, motion))


def test_one_sensor_at_the_pivot_is_gravity_itself():
    acc = np.random.default_rng(7).normal(size=(5, 1, 3))
    array = cf.AccelerometerArray([[0.0, 0.0, 0.0]])
    np.testing.assert_allclose(array.gravity(acc), acc[:, 0], rtol=1e-15)
    np.testing.assert_allclose(array.noise_gain, 1.0)
    np.testing.assert_allclose(array.noise_gain_with_gyro, 1.0)
    assert np.isposinf(array.angular_acceleration_noise_gain_with_gyro).all()


# positions that not even the gyro helps, and the axis that stays open
OPEN = {
    "two not in line with the pivot": ([[0.1, 0.05, 0.0], [-0.03, 0.1, 0.0]], "z"),
    "two not in line with the pivot, in the plane x": ([[0.0, 0.05, 0.1], [0.0, 0.1, -0.02]], "x"),
    "three in line off the pivot": ([[0.1, 0.05, 0.0], [0.05, 0.15, 0.0], [0.15, -0.05, 0.0]], "z"),
    "three in line, in the plane y": ([[0.1, 0.0, 0.05], [0.05, 0.0, 0.15], [0.15, 0.0, -0.05]], "y"),
    "one off the pivot, on the axis x": ([[0.1, 0.0, 0.0]], "yz"),
    "one off the pivot": ([[0.1, 0.05, 0.2]], "xyz"),
    "two at the same place": ([[0.1, 0.05, 0.2], [0.1, 0.05, 0.2]], "xyz"),
}


@pytest.mark.parametrize(("positions", "axes"), OPEN.values(), ids=OPEN.keys())
@pytest.mark.parametrize("form", ["aligned", "general", None])
def test_geometries_that_are_refused(positions, axes, form):
    """Two sensors leave gravity open along r1 x r2, three in line along what is square to the plane with the pivot."""
    message = refused(cf.AccelerometerArray, positions, form=form)
    check_names_an_open_axis(message, [axis not in axes for axis in AXES])


@pytest.mark.parametrize("axis", range(3))
def test_axis_that_no_channel_sees_is_refused(axis):
    channels = np.ones((4, 3), bool)
    channels[:, axis] = False
    message = refused(cf.AccelerometerArray, TETRAHEDRON, None, channels)
    check_names_an_open_axis(message, [i != axis for i in range(3)])


@pytest.mark.parametrize("distance", [1e-4, 1e-3, 1e-2])
def test_nearly_a_plane_is_noisy(distance):
    """A fourth sensor close to the others' plane, off the pivot: the noise gain says so, and nothing is refused."""
    positions = np.array(
        [[0.1, 0.0, 0.1], [-0.1, 0.02, 0.1], [0.0, 0.1, 0.1], [0.03, -0.1, 0.1 * (1 + distance)]]
    )
    sensors = layout(positions)
    array = make(sensors)
    expected = rb.noise_gain(sensors, rb.weights(sensors))
    assert (expected > 0.5 / distance).all()
    np.testing.assert_allclose(array.noise_gain, expected, rtol=1e-7)
    check_extraction(array, sensors, "gravity", False, rb.random_motion(np.random.default_rng(8), 5))


@pytest.mark.parametrize("distance", [1e-8, 1e-12, 0.0])
def test_too_close_to_a_plane_cannot_be_solved(distance):
    """The condition is above 1e6."""
    positions = np.array(
        [[0.1, 0.0, 0.1], [-0.1, 0.02, 0.1], [0.0, 0.1, 0.1], [0.03, -0.1, 0.1 * (1 + distance)]]
    )
    sensors = layout(positions)
    array = make(sensors)
    assert np.isposinf(array.noise_gain).all()
    motion = rb.random_motion(np.random.default_rng(8), 5)
    check_names_an_open_axis(refused(array.gravity, rb.accelerations_read(sensors, motion)), [False] * 3)
    check_extraction(array, layout(positions), "gravity", True, motion)


@pytest.mark.parametrize(("distance", "works"), [(1e-3, True), (1e-4, True), (1e-8, False), (1e-12, False)])
def test_nearly_a_line(distance, works):
    """Three sensors off the pivot, the gyro known: below the limit they work, above it the open axis is named."""
    positions = [[0.1, 0.05, 0.0], [0.05, 0.15, 0.0], [0.15, -0.05, distance]]
    if works:
        sensors = layout(positions)
        array = make(sensors)
        expected = rb.noise_gain(sensors, rb.weights(sensors, "gravity", True))
        np.testing.assert_allclose(array.noise_gain_with_gyro, expected, rtol=1e-7)
        assert array.noise_gain_with_gyro[2] > 0.01 / distance
    else:
        check_names_an_open_axis(refused(cf.AccelerometerArray, positions), [True, True, False])


def test_angular_acceleration_about_chosen_axes():
    """Two sensors on the axis z, in line with the pivot: nothing tells a turn about it, the gyro tells the others."""
    sensors = layout([[0.0, 0.0, 0.1], [0.0, 0.0, -0.07]])
    array = make(sensors)
    motion = rb.random_motion(np.random.default_rng(9), 5)
    acc = rb.accelerations_read(sensors, motion)
    for axes in ("xy", "yx", "x", "y"):
        columns = [AXES.index(axis) for axis in axes]
        got = array.angular_acceleration(acc, motion.omega, axes=axes)
        np.testing.assert_allclose(got, motion.alpha[:, columns], atol=1e-10)
    for axes in ("z", "xz", "xyz"):
        message = refused(array.angular_acceleration, acc, motion.omega, axes=axes)
        check_names_an_open_axis(message, [True, True, False])
    assert np.isposinf(array.angular_acceleration_noise_gain).all()
    np.testing.assert_array_equal(
        np.isposinf(array.angular_acceleration_noise_gain_with_gyro), [False, False, True]
    )


def test_axes_choose_columns():
    sensors = rb.thesis_cube()
    array, acc = make(sensors), np.random.default_rng(10).normal(size=(7, 6, 3))
    whole = array.angular_acceleration(acc)
    for axes in ("x", "y", "z", "xz", "zx", "zyx", "xyz"):
        assert_same_bits(
            array.angular_acceleration(acc, axes=axes), whole[:, [AXES.index(axis) for axis in axes]]
        )


# ----------------------------------------------------------------------------------------------------------------- noise

DRAWS = 20_000
FIVE_SIGMA = 5 / math.sqrt(2 * DRAWS)  # relative, of a standard deviation


@quantities
@rates_known
@pytest.mark.parametrize("mounting", ["thesis", "any"])
def test_noise_gain_is_that_of_noise(quantity, known, mounting):
    rng = np.random.default_rng(11)
    sigma = 10 ** rng.uniform(-1, 0.5, (6, 3))
    if mounting == "thesis":
        sensors = rb.thesis_cube(sigma)
    else:
        rotations = [rb.random_rotation(rng, reflections=True) for _ in range(6)]
        sensors = layout(rng.uniform(-0.1, 0.2, (6, 3)), rotations, sigma=sigma)
    array = make(sensors)
    acc = sigma * rng.normal(size=(DRAWS, 6, 3))
    got = run(array, quantity, acc, np.zeros((DRAWS, 3)) if known else None)
    np.testing.assert_allclose(np.sqrt((got**2).mean(axis=0)), gain(array, quantity, known), rtol=FIVE_SIGMA)


@quantities
@rates_known
@some
@given(sensors=good_layouts(), seed=seeds)
def test_no_other_unbiased_weights_have_less_noise(quantity, known, sensors, seed):
    """Gauss and Markov: whatever may be added without a bias adds noise."""
    array = make(sensors)
    got = linear_map(array, sensors.count, quantity, known)[:, sensors.channels]
    sigma = sensors.sigma[sensors.channels]
    H = rb.equations(sensors, known)
    size = np.abs(got).max()
    wanted = rb.functionals(quantity, known)
    np.testing.assert_allclose(got @ H, wanted, atol=1e-9 * size * np.abs(H).max())
    own = np.sqrt(((got * sigma) ** 2).sum(axis=1))
    np.testing.assert_allclose(gain(array, quantity, known), own, rtol=1e-9)
    left, values, _ = np.linalg.svd(H)
    free = left[:, int((values > 1e-9 * values[0]).sum()) :]
    covariance = (got * sigma**2) @ free
    np.testing.assert_allclose(covariance, 0.0, atol=1e-9 * size * sigma.max() ** 2)
    for step in np.random.default_rng(seed).normal(size=(5, 3, free.shape[1])):
        other = got + size * step @ free.T
        assert (np.sqrt(((other * sigma) ** 2).sum(axis=1)) >= own * (1 - 1e-12)).all()


@rates_known
@some
@given(sensors=good_layouts(), factor=st.floats(1e-4, 1e4))
def test_noise_scales_the_gains_and_not_the_weights(known, sensors, factor):
    one = make(sensors)
    other = cf.AccelerometerArray(*sensors.arguments[:3], factor * sensors.sigma)
    for quantity in QUANTITIES:
        np.testing.assert_allclose(
            gain(other, quantity, known), factor * gain(one, quantity, known), rtol=1e-9
        )
        weights = [linear_map(array, sensors.count, quantity, known) for array in (one, other)]
        np.testing.assert_allclose(*weights, atol=1e-9 * np.abs(weights[0]).max())


def test_noise_may_be_one_number_or_one_a_sensor():
    sensors = rb.thesis_cube()
    _, rotations, channels, _ = sensors.arguments
    acc = np.random.default_rng(12).normal(size=(5, 6, 3))

    def array(*noise):
        return cf.AccelerometerArray(sensors.positions, rotations, channels, *noise)

    each = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
    for noise, wide in (
        (0.25, np.full((6, 3), 0.25)),
        (each, np.tile(each, (3, 1)).T),
        (2, np.full((6, 3), 2.0)),
    ):
        one, other = array(noise), array(wide)
        assert_same_bits(one.gravity(acc), other.gravity(acc))
        assert_same_bits(np.asarray(one.noise_gain), np.asarray(other.noise_gain))
        # The unit of the gains without noise is the channels'.
        if np.ndim(noise) == 0:
            np.testing.assert_allclose(one.noise_gain, noise * np.asarray(array().noise_gain), rtol=1e-12)


@pytest.mark.parametrize("odd", [math.nan, math.inf, 0.0, -1.0])
def test_noise_of_an_unused_channel_is_ignored(odd):
    sensors = rb.thesis_cube(0.2)
    sigma = np.where(sensors.channels, sensors.sigma, odd)
    acc = np.random.default_rng(13).normal(size=(5, 6, 3))
    array = cf.AccelerometerArray(*sensors.arguments[:3], sigma)
    assert_same_bits(array.gravity(acc), make(sensors).gravity(acc))
    assert_same_bits(np.asarray(array.noise_gain), np.asarray(make(sensors).noise_gain))


def test_noisy_sensor_counts_little():
    """Five good sensors and one of a thousand times their noise are nearly the five."""
    rng = np.random.default_rng(14)
    positions = rng.uniform(-0.1, 0.2, (6, 3))
    sigma = [1.0] * 5 + [1000.0]
    noisy, without = cf.AccelerometerArray(positions, noise=sigma), cf.AccelerometerArray(positions[:5])
    np.testing.assert_allclose(noisy.noise_gain, without.noise_gain, rtol=1e-4)
    acc = rng.normal(size=(20, 6, 3))
    np.testing.assert_allclose(noisy.gravity(acc), without.gravity(acc[:, :5]), atol=1e-3)


# ------------------------------------------------------------------------------------------------------- missing samples

BAD = [math.nan, math.inf, -math.inf]


@precisions
@quantities
@rates_known
@pytest.mark.parametrize("form", ["aligned", "general"])
@pytest.mark.parametrize("bad", BAD)
def test_missing_reading_makes_its_row_missing(dtype, quantity, known, form, bad):
    sensors = rb.thesis_cube()
    array = make(sensors, form=form)
    rng = np.random.default_rng(15)
    acc, gyr = rng.normal(size=(36, 6, 3)).astype(dtype), rng.normal(size=(36, 3)).astype(dtype)
    gyr = gyr if known else None
    clean = run(array, quantity, acc, gyr)
    holed = acc.copy()
    for row, (sensor, channel) in enumerate(np.argwhere(np.ones((6, 3)))):
        holed[2 * row, sensor, channel] = bad
    got = run(array, quantity, holed, gyr)
    gone = np.zeros(36, bool)
    gone[::2] = sensors.channels.ravel()
    assert np.isnan(got[gone]).all()
    assert_same_bits(got[~gone], clean[~gone])


# Some channels count nothing for gravity here: all but the pivot's, all but those on the axis x.
WEIGHTLESS = [
    [[0.0, 0.0, 0.0], CORNER],
    [[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]],
]


@rates_known
@pytest.mark.parametrize("form", ["aligned", "general"])
@pytest.mark.parametrize("positions", WEIGHTLESS, ids=["pivot", "axes"])
def test_missing_reading_of_no_weight_makes_its_row_missing(known, form, positions):
    """A channel in use is one, whether its weight comes out as zero or as rounding: both forms agree on what is missing."""
    count = len(positions)
    acc = np.ones((3 * count, count, 3))
    acc[np.arange(3 * count), np.arange(3 * count) // 3, np.arange(3 * count) % 3] = np.nan
    array = cf.AccelerometerArray(positions, form=form)
    assert np.isnan(array.gravity(acc, np.zeros((3 * count, 3)) if known else None)).all()


@rates_known
@pytest.mark.parametrize("form", ["aligned", "general"])
@pytest.mark.parametrize("axes", ["x", "yz"])
def test_missing_reading_makes_chosen_axes_missing(known, form, axes):
    sensors = rb.thesis_cube()
    acc = np.ones((12, 6, 3))
    acc[(np.arange(12), *sensors.used.T)] = np.nan
    gyr = np.zeros((12, 3)) if known else None
    assert np.isnan(make(sensors, form=form).angular_acceleration(acc, gyr, axes=axes)).all()


@quantities
@pytest.mark.parametrize("bad", BAD)
def test_missing_rate_makes_its_row_missing(quantity, bad):
    rng = np.random.default_rng(16)
    acc, gyr = rng.normal(size=(9, 6, 3)), rng.normal(size=(9, 3))
    array = make(rb.thesis_cube())
    clean = run(array, quantity, acc, gyr)
    gyr[[1, 4, 7], [0, 1, 2]] = bad
    got = run(array, quantity, acc, gyr)
    assert np.isnan(got[1::3]).all()
    assert_same_bits(np.delete(got, slice(1, None, 3), axis=0), np.delete(clean, slice(1, None, 3), axis=0))


# ------------------------------------------------------------------------------------------------------------- body rate


@precisions
@some
@given(seed=seeds, count=st.integers(4, 9), gone=st.floats(0.0, 0.9))
def test_body_rate_is_the_mean_of_the_sensors_that_are_there(dtype, seed, count, gone):
    """A sensor with one rate missing is left out as a whole. The accelerometers' mask has no part in it."""
    rng = np.random.default_rng(seed)
    rotations = np.array([rb.random_rotation(rng, reflections=True) for _ in range(count)])
    positions = rng.uniform(-1, 1, (count, 3))
    channels = np.ones((count, 3), bool)
    channels[0] = False
    channels = channels if rb.is_clear_cut(layout(positions, rotations, channels)) and count > 4 else None
    array = cf.AccelerometerArray(positions, rotations, channels)
    gyr = rng.normal(size=(12, count, 3)).astype(dtype)
    gyr[rng.random((12, count)) < gone, rng.integers(3)] = np.nan
    gyr[0] = np.nan
    got = array.body_rate(gyr)
    assert got.dtype == dtype
    expected = rb.mean_rate(layout(positions, rotations), gyr.astype(float))
    np.testing.assert_array_equal(np.isnan(got), np.isnan(expected))
    np.testing.assert_allclose(got, expected, rtol=0, atol=16 * np.finfo(dtype).eps * 4)


def test_body_rate_of_a_body():
    sensors = rb.thesis_cube()
    motion = rb.random_motion(np.random.default_rng(17), 20)
    got = make(sensors).body_rate(rb.rates_read(sensors, motion))
    np.testing.assert_allclose(got, motion.omega, rtol=0, atol=1e-14)


# ---------------------------------------------------------------------------------------------------------------- arrays

# Of acc, gyr, and the rates of every sensor.
CALLS = {
    "gravity": lambda array, *signals: array.gravity(signals[0]),
    "gravity with gyro": lambda array, *signals: array.gravity(*signals[:2]),
    "angular acceleration": lambda array, *signals: array.angular_acceleration(signals[0]),
    "angular acceleration with gyro": lambda array, *signals: array.angular_acceleration(
        *signals[:2], axes="zx"
    ),
    "body rate": lambda array, *signals: array.body_rate(signals[2]),
}
all_calls = pytest.mark.parametrize("call", CALLS.values(), ids=CALLS.keys())


def readings(rows, dtype=float, seed=18, count=6):
    """acc, gyr, rates of every sensor."""
    rng = np.random.default_rng(seed)
    shapes = (rows, count, 3), (rows, 3), (rows, count, 3)
    return tuple(rng.normal(size=shape).astype(dtype) for shape in shapes)


@all_calls
@precisions
@pytest.mark.parametrize("lay_out", LAYOUTS.values(), ids=LAYOUTS.keys())
def test_layout_in_memory_does_not_matter(call, dtype, lay_out):
    array = make(rb.thesis_cube())
    laid = [lay_out(signal) for signal in readings(40, dtype)]
    plain = [np.array(signal, dtype=dtype, order="C") for signal in laid]
    assert_same_bits(call(array, *laid), call(array, *plain))


@pytest.mark.parametrize("lay_out", [one for name, one in LAYOUTS.items() if "broadcast" not in name])
def test_layout_of_the_description_does_not_matter(lay_out):
    sensors = rb.thesis_cube(0.1 + np.random.default_rng(19).random((6, 3)))
    positions, rotations, channels, sigma = sensors.arguments
    laid = cf.AccelerometerArray(
        lay_out(positions), lay_out(rotations), np.asfortranarray(channels), lay_out(sigma)
    )
    assert laid == make(sensors)


@all_calls
@precisions
def test_rows_do_not_know_each_other(call, dtype):
    array = make(rb.thesis_cube())
    signals = readings(23, dtype)
    whole = call(array, *signals)
    parts = [
        call(array, *(signal[cut] for signal in signals)) for cut in (slice(0, 1), slice(1, 8), slice(8, 23))
    ]
    assert_same_bits(np.concatenate(parts), whole)


@all_calls
@precisions
def test_precision_is_kept(call, dtype):
    array = make(rb.thesis_cube())
    double = call(array, *readings(9))
    got = call(array, *readings(9, dtype))
    assert got.dtype == dtype
    np.testing.assert_allclose(got, double, rtol=0, atol=100 * np.finfo(dtype).eps * np.abs(double).max())


@pytest.mark.parametrize(("first", "second"), [("f4", "f8"), ("f8", "f4"), ("f4", "i4"), ("i8", "f4")])
def test_mixed_dtypes_become_float64(first, second):
    acc, gyr, _ = (10 * signal for signal in readings(9))
    acc, gyr = acc.astype(first), gyr.astype(second)
    array = make(rb.thesis_cube())
    assert_same_bits(array.gravity(acc, gyr), array.gravity(acc.astype(float), gyr.astype(float)))


@all_calls
@pytest.mark.parametrize("dtype", ["i1", "i4", "u2", "u8", "f2", "g", ">i4"])
def test_other_real_numbers_become_float64(call, dtype):
    signals = [np.abs(10 * signal).astype(dtype) for signal in readings(9)]
    array = make(rb.thesis_cube())
    assert_same_bits(call(array, *signals), call(array, *(signal.astype(float) for signal in signals)))


@all_calls
def test_lists_become_arrays(call):
    sensors, signals = rb.thesis_cube(0.5), readings(9)
    array = cf.AccelerometerArray(*(part.tolist() for part in sensors.arguments))
    assert array == make(sensors)
    assert_same_bits(call(array, *(signal.tolist() for signal in signals)), call(array, *signals))


@all_calls
@precisions
def test_empty_arrays(call, dtype):
    array = make(rb.thesis_cube())
    got = call(array, *readings(0, dtype))
    assert got.shape == (0, call(array, *readings(1)).shape[1])
    assert got.dtype == dtype


@all_calls
def test_inputs_stay_as_they_are(call):
    sensors = rb.thesis_cube(0.5)
    described = copy.deepcopy(sensors.arguments)
    array, signals = make(sensors), readings(9)
    before = [signal.copy() for signal in signals]
    call(array, *signals)
    for now, then in zip((*signals, *sensors.arguments), (*before, *described), strict=True):
        np.testing.assert_array_equal(now, then)


def test_description_is_copied():
    """What becomes of the arrays on either side does not reach the array."""
    sensors, acc = rb.thesis_cube(0.5), readings(9)[0]
    array, other = make(sensors), make(sensors)
    expected = array.gravity(acc)
    for name, part in zip(("positions", "rotations", "channels", "noise"), sensors.arguments, strict=True):
        part[:] = False
        held = np.asarray(getattr(array, name))
        if held.flags.writeable:
            held[:] = False
    assert array == other
    assert_same_bits(array.gravity(acc), expected)


# --------------------------------------------------------------------------------------------------------------- objects


def test_attributes():
    sensors = rb.thesis_cube(0.3)
    array = make(sensors)
    assert_same_bits(np.asarray(array.positions), sensors.positions)
    assert_same_bits(np.asarray(array.rotations), sensors.rotations)
    np.testing.assert_array_equal(array.channels, sensors.channels)
    np.testing.assert_array_equal(np.asarray(array.noise)[sensors.channels], 0.3)
    plain = cf.AccelerometerArray(TETRAHEDRON)
    np.testing.assert_array_equal(plain.rotations, np.tile(np.eye(3), (4, 1, 1)))
    np.testing.assert_array_equal(plain.channels, np.ones((4, 3), bool))
    for quantity in QUANTITIES:
        for known in (False, True):
            assert gain(array, quantity, known).shape == (3,)


@pytest.mark.parametrize("name", ["positions", "rotations", "channels", "noise", "form", "noise_gain"])
def test_attributes_cannot_be_set(name):
    with pytest.raises(AttributeError):
        setattr(make(rb.thesis_cube()), name, 1.0)


@pytest.mark.parametrize("duplicate", [pickled, copy.copy, copy.deepcopy])
@pytest.mark.parametrize("form", ["aligned", "general", None])
def test_arrays_are_copied_and_compared(duplicate, form):
    sensors = rb.thesis_cube(0.1 + np.random.default_rng(20).random((6, 3)))
    for array in (make(sensors, form=form), cf.AccelerometerArray(TETRAHEDRON, form=form)):
        other = duplicate(array)
        assert type(other) is type(array)
        assert other == array
        assert repr(other) == repr(array)
        assert other.form == array.form
        acc, gyr, rates = readings(9, count=len(array.positions))
        assert_same_bits(other.gravity(acc), array.gravity(acc))
        assert_same_bits(other.gravity(acc, gyr), array.gravity(acc, gyr))
        assert_same_bits(other.body_rate(rates), array.body_rate(rates))


def test_arrays_differ():
    sensors = rb.thesis_cube()
    positions, rotations, channels, sigma = sensors.arguments
    more = channels.copy()
    more[0, 2] = True
    flipped = rotations.copy()
    flipped[2, 1] *= -1
    arrays = [
        cf.AccelerometerArray(positions, rotations, channels, sigma),
        cf.AccelerometerArray(positions, rotations, channels, sigma, form="general"),
        cf.AccelerometerArray(1.25 * positions, rotations, channels, sigma),
        cf.AccelerometerArray(positions, flipped, channels, sigma),
        cf.AccelerometerArray(positions, rotations, more, sigma),
        cf.AccelerometerArray(positions, rotations, channels, 2 * sigma),
    ]
    for i, first in enumerate(arrays):
        for j, second in enumerate(arrays):
            assert (first == second) == (i == j)
            assert (first != second) == (i != j)
    assert arrays[0] != 1.0
    assert repr(arrays[0]).startswith("AccelerometerArray(")


# ---------------------------------------------------------------------------------------------------------------- errors

GOOD = {"positions": TETRAHEDRON}
SKEW = np.tile(np.eye(3), (4, 1, 1))
SKEW[2, 0, 1] = 1e-3
LONG = np.tile(np.eye(3), (4, 1, 1))
LONG[1] *= 1.001
NOT_A_NUMBER = np.tile(np.eye(3), (4, 1, 1))
NOT_A_NUMBER[3, 0, 0] = math.nan
BAD_DESCRIPTIONS = [
    ("positions", np.zeros(3)),
    ("positions", np.zeros((4, 2))),
    ("positions", np.zeros((2, 4, 3))),
    ("positions", [[math.nan, 0.0, 0.0], *TETRAHEDRON[1:]]),
    ("positions", [[math.inf, 0.0, 0.0], *TETRAHEDRON[1:]]),
    ("rotations", np.eye(3)),
    ("rotations", np.tile(np.eye(3), (3, 1, 1))),
    ("rotations", np.tile(np.eye(3), (5, 1, 1))),
    ("rotations", np.ones((4, 3))),
    ("rotations", np.zeros((4, 3, 3))),
    ("rotations", SKEW),
    ("rotations", LONG),
    ("rotations", NOT_A_NUMBER),
    ("channels", np.ones((4, 2), bool)),
    ("channels", np.ones((3, 3), bool)),
    ("channels", np.ones(4, bool)),
    ("noise", 0.0),
    ("noise", -1.0),
    ("noise", math.nan),
    ("noise", math.inf),
    ("noise", [1.0, 1.0, 0.0, 1.0]),
    ("noise", [1.0, 1.0, 1.0]),
    ("noise", np.ones((4, 2))),
    ("noise", np.ones((3, 4))),
    ("noise", [[1.0, 1.0, 1.0], [1.0, math.nan, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0]]),
    ("form", "x"),
    ("form", ""),
    ("form", "Aligned"),
]


@pytest.mark.parametrize(("name", "bad"), BAD_DESCRIPTIONS)
def test_descriptions_that_cannot_work(name, bad):
    message = refused(cf.AccelerometerArray, **{**GOOD, name: bad})
    assert re.search(rf"\b{name}\b", message), message


@pytest.mark.parametrize("name", ["positions", "rotations", "noise"])
@pytest.mark.parametrize("bad", ["1", [["1"]], np.zeros((4, 3), complex), {}, [object()]])
def test_descriptions_must_be_real_numbers(name, bad):
    message = refused(cf.AccelerometerArray, kind=TypeError, **{**GOOD, name: bad})
    assert re.search(rf"\b{name}\b", message), message


def test_form_is_given_by_name():
    refused(cf.AccelerometerArray, TETRAHEDRON, None, None, None, "general", kind=TypeError)


@pytest.mark.parametrize("used", [0, 1, 2])
def test_too_few_channels(used):
    channels = np.zeros((4, 3), bool)
    channels.flat[:used] = True
    assert re.search(r"\bchannels\b", refused(cf.AccelerometerArray, TETRAHEDRON, None, channels))


def test_no_sensor():
    assert re.search(r"\b(positions|channels)\b", refused(cf.AccelerometerArray, np.zeros((0, 3))))


@pytest.mark.parametrize("error", [0.0, 1e-9, 1e-7])
def test_rotations_need_not_be_orthogonal_beyond_the_tolerance(error):
    turn = np.array([rb.random_rotation(np.random.default_rng(21)) for _ in range(4)])
    turn[1] *= 1 + error
    assert cf.AccelerometerArray(TETRAHEDRON, turn).form == "general"


BAD_READINGS = [
    ("acc", (np.zeros((5, 3, 3)),)),
    ("acc", (np.zeros((5, 5, 3)),)),
    ("acc", (np.zeros((5, 4, 2)),)),
    ("acc", (np.zeros((4, 3)),)),
    ("acc", (np.zeros((5, 12)),)),
    ("acc", (np.zeros(3),)),
    ("gyr", (np.zeros((5, 4, 3)), np.zeros((4, 3)))),
    ("gyr", (np.zeros((5, 4, 3)), np.zeros((6, 3)))),
    ("gyr", (np.zeros((5, 4, 3)), np.zeros((5, 2)))),
    ("gyr", (np.zeros((5, 4, 3)), np.zeros((5, 4, 3)))),
    ("gyr", (np.zeros((5, 4, 3)), np.zeros(3))),
]


@pytest.mark.parametrize(("name", "arguments"), BAD_READINGS)
@quantities
def test_readings_must_fit_the_array(quantity, name, arguments):
    array = cf.AccelerometerArray(TETRAHEDRON)
    message = refused(getattr(array, quantity), *arguments)
    assert re.search(rf"\b{name}\b", message), message


@pytest.mark.parametrize("shape", [(5, 3, 3), (5, 5, 3), (5, 3), (5, 4, 2), (3,)])
def test_rates_must_fit_the_array(shape):
    assert re.search(r"\bgyr\b", refused(cf.AccelerometerArray(TETRAHEDRON).body_rate, np.zeros(shape)))


@pytest.mark.parametrize("bad", [np.zeros((5, 4, 3), bool), np.zeros((5, 4, 3), complex), "1", None, {}])
def test_readings_must_be_real_numbers(bad):
    array = cf.AccelerometerArray(TETRAHEDRON)
    for call in (array.gravity, array.angular_acceleration):
        assert re.search(r"\bacc\b", refused(call, bad, kind=TypeError))
        if bad is not None:
            assert re.search(r"\bgyr\b", refused(call, np.zeros((5, 4, 3)), bad, kind=TypeError))
    assert re.search(r"\bgyr\b", refused(array.body_rate, bad, kind=TypeError))


@pytest.mark.parametrize("axes", ["w", "xw", "X", "x y", "1"])
def test_axes_must_be_letters(axes):
    message = refused(cf.AccelerometerArray(TETRAHEDRON).angular_acceleration, np.zeros((5, 4, 3)), axes=axes)
    assert re.search(r"\baxes\b", message), message
