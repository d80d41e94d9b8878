"""The simulated inertial sensor: each error against its closed form, the noises against their Allan curve."""

import math
from dataclasses import replace

import allantools
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyarrow import csv, parquet
from scipy import signal
from typer.testing import CliRunner

from compfilt import motion, noise, simulate
from compfilt.cli import app
from compfilt.simulate import ImuErrors, TriadErrors, flicker, imu, imu_log, random_walk, triad, white

NOISES = ("random_walk", "bias_instability", "rate_random_walk")
NUMBERS = st.floats(-1e3, 1e3)
TRIPLES = st.tuples(NUMBERS, NUMBERS, NUMBERS)
SIGNALS = st.lists(TRIPLES, min_size=1, max_size=20).map(np.array)


def still(samples):
    return np.zeros((samples, 3))


def deviation(column, fs, taus):
    return allantools.oadev(column, rate=fs, data_type="freq", taus=taus)[1]


# -------------------------------------------------------------------------------------------------------------- noises


@pytest.mark.parametrize("fs", [50.0, 400.0])
@pytest.mark.parametrize("name", NOISES)
def test_allan_curve_of_one_noise(name, fs):
    """One coefficient, the three axes with another each: its line, within six standard errors."""
    put_in, samples = np.array([0.01, 0.02, 0.04]), 1 << 17
    readings = triad(still(samples), fs=fs, errors=TriadErrors(**{name: tuple(put_in)}), seed=11)
    factors = np.array([4, 16, 64, 256, 1024])
    taus = factors / fs
    line = {
        "random_walk": 1.0 / np.sqrt(taus),
        "bias_instability": np.full(taus.size, math.sqrt(2.0 * math.log(2.0) / math.pi)),
        "rate_random_walk": np.sqrt(taus / 3.0),
    }[name]
    # The relative standard error of the deviation: so many independent averages there are.
    bound = 6.0 / np.sqrt(2.0 * samples / factors) + 0.03
    for axis, coefficient in enumerate(put_in):
        got = deviation(readings[:, axis], fs, taus) / (coefficient * line)
        assert (np.abs(got - 1.0) < bound).all(), (axis, got)


def test_the_noises_add_up():
    """σ² = N²/τ + (2 ln 2/π) B² + K² τ/3 over four decades."""
    fs, samples = 100.0, 1 << 19
    N, B, K = 1e-3, 1e-3, 2e-4
    errors = TriadErrors(random_walk=N, bias_instability=B, rate_random_walk=K)
    readings = triad(still(samples), fs=fs, errors=errors, seed=2)
    taus = np.array([0.1, 1.0, 10.0, 100.0])
    expected = np.sqrt(N**2 / taus + 2.0 * math.log(2.0) / math.pi * B**2 + K**2 * taus / 3.0)
    got = np.mean([deviation(column, fs, taus) for column in readings.T], axis=0)
    np.testing.assert_allclose(got, expected, rtol=0.08)


def test_the_density_is_two_sided():
    """Welch's one-sided density of white noise is twice N²; a data sheet's noise density is √2 N."""
    readings = triad(still(200_000), fs=250.0, errors=TriadErrors(random_walk=0.02))
    _, density = signal.welch(readings, 250.0, nperseg=256, axis=0)
    assert np.sqrt(density[2:-2].mean()) == pytest.approx(math.sqrt(2.0) * 0.02, rel=0.01)
    assert simulate.two_sided(math.sqrt(2.0) * 0.02) == pytest.approx(0.02)


def test_the_density_of_flicker():
    """B²/(2π f), two-sided, over more than a decade: half of what Welch gives."""
    rng = np.random.default_rng(3)
    drift = flicker(1 << 16, np.full(16, 0.3), rng)
    frequencies, density = signal.welch(drift, 100.0, nperseg=1 << 12, axis=0)
    band = (frequencies > 0.2) & (frequencies < 5.0)
    got = density.mean(axis=1)[band] / 2.0 / (0.3**2 / (2.0 * math.pi * frequencies[band]))
    assert got.mean() == pytest.approx(1.0, rel=0.02)
    slope, _ = np.polyfit(np.log(frequencies[band]), np.log(got), 1)
    assert abs(slope) < 0.02


class Impulse:
    """Random numbers that are 1, then 0: what comes out is the filter's response."""

    def standard_normal(self, shape):
        numbers = np.zeros(shape)
        numbers[0] = 1.0
        return numbers


@pytest.mark.parametrize("factor", [1, 2, 3, 8, 100])
def test_flicker_is_flat_from_one_sample_on(factor):
    """Its Allan variance without chance, from the response: half of the mean square of what two averages differ by."""
    samples = 1 << 14
    response = flicker(samples, np.ones(1), Impulse())[:, 0]
    sums = np.concatenate((np.zeros(2 * factor), np.cumsum(response)))
    differences = (sums[2 * factor :] - 2.0 * sums[factor:-factor] + sums[: -2 * factor]) / factor
    variance = (differences**2).sum() / 2.0
    assert variance == pytest.approx(2.0 * math.log(2.0) / math.pi, rel=1e-5)


@pytest.mark.parametrize("samples", [1, 2, 3, 100, 128])
def test_flicker_of_any_length(samples):
    """The convolution of its response with white noise, whatever the length of the transforms."""
    got = flicker(samples, np.ones(2), np.random.default_rng(0))
    response = flicker(samples, np.ones(1), Impulse())[:, 0]
    white_noise = np.random.default_rng(0).standard_normal((samples, 2))
    for axis in range(2):
        expected = np.convolve(response, white_noise[:, axis])[:samples]
        np.testing.assert_allclose(got[:, axis], expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("fs", [10.0, 1000.0])
def test_white_noise_and_random_walk(fs):
    readings = white(100_000, np.array([0.5]), fs, np.random.default_rng(1))
    assert readings.std() == pytest.approx(0.5 * math.sqrt(fs), rel=0.01)
    walk = random_walk(100_000, np.array([0.5]), fs, np.random.default_rng(1))
    assert np.diff(walk, axis=0).std() == pytest.approx(0.5 / math.sqrt(fs), rel=0.01)


def test_what_was_put_in_comes_back():
    """`compfilt.noise` finds N, B and K again: nine intervals of 95 %, one of which may miss."""
    fs = 50.0
    N, B, K = np.array([[1e-4, 2e-4, 1e-4], [3e-4, 1e-4, 1e-4], [2e-5, 2e-5, 5e-5]])
    errors = TriadErrors(random_walk=tuple(N), bias_instability=tuple(B), rate_random_walk=tuple(K))
    readings = triad(still(1 << 17), fs=fs, errors=errors, seed=4)
    misses = []
    for axis, column in enumerate(readings.T):
        fit = noise.fit_allan(noise.allan(column, fs=fs))
        assert fit.consistent
        for name in NOISES:
            put_in, found = errors.each(name)[axis], getattr(fit, name)
            if found is None:
                misses += [name] * bool(put_in > fit.upper[name])
                continue
            assert found.value == pytest.approx(put_in, rel={"random_walk": 0.01}.get(name, 0.6))
            misses += [name] * (not found.low <= put_in <= found.high)
    assert len(misses) <= 1, misses


def test_a_log_comes_back_from_the_report():
    """The whole way: a sensor of a grade, a log of it at rest, what the log tells about the sensor."""
    errors = simulate.typical("industrial", seed=5)
    log = imu_log(duration=900.0, rate=100.0, seed=5, errors=errors)
    gyro, acc = (np.column_stack([log[f"{kind}{axis}"] for axis in "xyz"]) for kind in "ga")
    report = noise.analyse(gyro, acc, fs=100.0)
    for channels, sensor in ((report.gyro, errors.gyro), (report.accelerometer, errors.accelerometer)):
        for channel, density in zip(channels, sensor.random_walk, strict=True):
            # Rounding adds its own noise, resolution²/12.
            rounding = sensor.resolution[0] / math.sqrt(12.0 * 100.0)
            assert channel.fit.random_walk.value == pytest.approx(math.hypot(density, rounding), rel=0.01)
    means = [channel.mean for channel in report.gyro]
    np.testing.assert_allclose(means, errors.gyro.bias, atol=2e-4)


# --------------------------------------------------------------------------------------------- what is the same always


@settings(deadline=None)
@given(truth=SIGNALS, bias=TRIPLES, scale=TRIPLES)
def test_scale_and_bias(truth, bias, scale):
    got = triad(truth, fs=10.0, errors=TriadErrors(bias=bias, scale=scale))
    np.testing.assert_allclose(got, truth * (1.0 + np.array(scale)) + bias, rtol=1e-9, atol=1e-6)


@given(axis=st.integers(0, 2), share=st.tuples(*[st.floats(-0.1, 0.1)] * 6))
def test_cross_axes(axis, share):
    """A unit on one axis shows on the others with their rows' share."""
    xy, xz, yx, yz, zx, zy = share
    errors = TriadErrors(cross_axis=((0.0, xy, xz), (yx, 0.0, yz), (zx, zy, 0.0)))
    unit = np.eye(3)[axis]
    expected = unit + np.array(errors.cross_axis)[:, axis]
    np.testing.assert_array_equal(triad([unit], fs=1.0, errors=errors), [expected])


@settings(deadline=None)
@given(truth=SIGNALS, resolution=st.floats(1e-2, 10.0), steps=st.integers(1, 1000), part=st.floats(0.0, 0.9))
def test_resolution_and_full_scale(truth, resolution, steps, part):
    """Every reading is a step, the nearest one unless the full scale cuts it."""
    full_scale = (steps + part) * resolution
    got = triad(truth, fs=10.0, errors=TriadErrors(resolution=resolution, full_scale=full_scale))
    counts = got / resolution
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert np.abs(got).max() <= full_scale * (1.0 + 1e-12)
    inside = np.abs(truth) <= steps * resolution
    assert (np.abs(got - truth)[inside] <= 0.5 * resolution * (1.0 + 1e-9)).all()
    np.testing.assert_allclose(
        got[~inside], np.sign(truth[~inside]) * steps * resolution, atol=0.5 * resolution * (1.0 + 1e-9)
    )


def test_full_scale_alone():
    got = triad([[5.0, -5.0, 0.5]], fs=1.0, errors=TriadErrors(full_scale=(1.0, 2.0, 3.0)))
    assert got.tolist() == [[1.0, -2.0, 0.5]]


def test_quantisation_noise():
    """Of a signal that moves over many steps: uniform, so that its standard deviation is the resolution/√12."""
    truth = np.column_stack([np.linspace(0.0, 100.0, 100_001)] * 3)
    got = triad(truth, fs=10.0, errors=TriadErrors(resolution=0.5))
    assert (got - truth).std() == pytest.approx(0.5 / math.sqrt(12.0), rel=0.01)


@given(coefficients=TRIPLES, delay=st.floats(0.0, 0.9), fs=st.floats(5.0, 200.0))
def test_delay_of_a_cubic(coefficients, delay, fs):
    """Exact for a polynomial of degree 3 where the samples around are there."""
    a, b, c = (x / 1e3 for x in coefficients)
    t = np.arange(-200, 10) / fs
    curve = np.polynomial.Polynomial([0.3, a, b, c])
    got = triad(np.column_stack([curve(t)] * 3), fs=fs, errors=TriadErrors(delay=delay))
    inside = slice(math.ceil(delay * fs) + 3, -1)
    expected = curve(t - delay)[inside]
    np.testing.assert_allclose(got[inside, 0], expected, atol=1e-9 * np.abs(curve(t)).max())


@pytest.mark.parametrize("samples", [0, 1, 7, 50, 80])
def test_delay_of_whole_samples(samples):
    """The samples themselves; before the first the sensor saw what it was there."""
    truth = np.random.default_rng(0).normal(size=(50, 3))
    got = triad(truth, fs=10.0, errors=TriadErrors(delay=samples / 10.0))
    expected = np.concatenate((np.repeat(truth[:1], samples, axis=0), truth))[:50]
    np.testing.assert_allclose(got, expected, atol=1e-13)


def test_order_of_the_effects():
    """Delay, then scale, then bias, then resolution, then full scale."""
    errors = TriadErrors(bias=0.26, scale=1.0, resolution=0.5, full_scale=4.0, delay=1.0)
    got = triad([[1.0] * 3, [2.0] * 3, [3.0] * 3], fs=1.0, errors=errors)
    assert got[:, 0].tolist() == [2.5, 2.5, 4.0]


def test_missing_stays_missing():
    truth = still(5)
    truth[2, 1] = math.nan
    got = triad(truth, fs=1.0, errors=TriadErrors(resolution=0.1, full_scale=1.0))
    assert np.isnan(got).sum() == 1
    assert np.isnan(got[2, 1])
    late = triad(truth, fs=1.0, errors=TriadErrors(delay=1.0))
    assert np.argwhere(np.isnan(late)).tolist() == [[3, 1]]


# --------------------------------------------------------------------------------------------------------------- seeds


EVERYTHING = TriadErrors(
    random_walk=0.1,
    bias_instability=0.2,
    rate_random_walk=0.3,
    bias=1.0,
    scale=0.1,
    cross_axis=((0.0, 0.1, 0.0), (0.0, 0.0, 0.1), (0.0, 0.0, 0.0)),
    resolution=1e-3,
    full_scale=5.0,
    delay=0.013,
)


def test_the_seed_decides():
    first, again, other = (triad(still(500), fs=50.0, errors=EVERYTHING, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("name", NOISES)
def test_each_noise_has_numbers_of_its_own(name):
    """Without one of them the others stay: the parts add up."""
    noises = TriadErrors(random_walk=0.1, bias_instability=0.2, rate_random_walk=0.3)
    alone = TriadErrors(**{name: getattr(noises, name)})
    rest = replace(noises, **{name: 0.0})
    parts = [triad(still(300), fs=50.0, errors=errors) for errors in (noises, alone, rest)]
    np.testing.assert_allclose(parts[0], parts[1] + parts[2], atol=1e-12)


def test_noises_are_independent():
    """Of the two sensors and of the axes."""
    errors = ImuErrors(TriadErrors(random_walk=1.0), TriadErrors(random_walk=1.0))
    readings = np.hstack(imu(still(20_000), still(20_000), fs=1.0, errors=errors))
    correlation = np.corrcoef(readings.T) - np.eye(6)
    assert np.abs(correlation).max() < 0.04


# ---------------------------------------------------------------------------------------------------------------- logs


def test_a_log_at_rest():
    log = imu_log(duration=20.0, rate=50.0)
    assert list(log) == ["t", "ax", "ay", "az", "gx", "gy", "gz", "true_roll", "true_pitch"]
    assert {values.shape for values in log.values()} == {(1000,)}
    assert {log["az"].min(), log["az"].max()} == {9.80665}
    assert not any(log[name].any() for name in ("ax", "ay", "gx", "gy", "gz", "true_roll"))


def test_a_log_of_a_motion_with_delays():
    """The motion at the time before, exactly."""
    drive = simulate.seat_motion(60.0, np.random.default_rng(3))
    errors = ImuErrors(TriadErrors(delay=0.013), TriadErrors(delay=0.004))
    log = imu_log(duration=60.0, rate=100.0, errors=errors, motion=drive)
    t = np.arange(6000) / 100.0
    acc = np.column_stack([log[name] for name in ("ax", "ay", "az")])
    gyro = np.column_stack([log[name] for name in ("gx", "gy", "gz")])
    np.testing.assert_array_equal(acc, motion.specific_force(drive, t - 0.004))
    np.testing.assert_allclose(gyro, motion.mean_rates(drive, t - 0.013, 100.0), atol=1e-15)
    np.testing.assert_array_equal(log["true_roll"], drive.roll.at(t)[0])


def test_delay_of_samples_is_that_of_the_motion():
    """The polynomial through samples of a smooth motion against the motion itself."""
    drive = motion.Motion()
    drive.roll.step(1.0, 3.0, 0.5)
    t = np.arange(500) / 100.0
    true_rates = motion.mean_rates(drive, t, 100.0)
    late, _ = imu(true_rates, still(500), fs=100.0, errors=ImuErrors(TriadErrors(delay=0.0237)))
    np.testing.assert_allclose(late, motion.mean_rates(drive, t - 0.0237, 100.0), atol=2e-6)


@pytest.mark.parametrize("grade", simulate.GRADES)
def test_typical_sensors(grade):
    """Inside their tolerances, another specimen for another seed."""
    one, other = simulate.typical(grade, seed=1), simulate.typical(grade, seed=2)
    assert one == simulate.typical(grade, seed=1) != other
    for sensor, tolerance in zip((one.gyro, one.accelerometer), simulate.GRADES[grade], strict=True):
        assert np.abs(sensor.bias).max() <= tolerance.bias
        assert np.abs(sensor.scale).max() <= tolerance.scale
        assert np.abs(sensor.cross_axis).max() <= tolerance.cross_axis


def test_better_from_grade_to_grade():
    order = ["consumer", "industrial", "tactical"]
    assert list(simulate.GRADES) == order
    for name in ("bias", "scale"):
        values = [getattr(gyro, name) for gyro, _ in simulate.GRADES.values()]
        assert values == sorted(values, reverse=True)


def test_consumer_noise_is_the_data_sheets():
    """Its total noise in 100 Hz is about 0.05 °/s on the sheet: 0.005 °/s/√Hz times √100 Hz."""
    gyro = simulate.typical("consumer").gyro
    readings = triad(still(20_000), fs=200.0, errors=TriadErrors(random_walk=gyro.random_walk))
    assert np.degrees(readings.std()) == pytest.approx(0.05, rel=0.02)


# -------------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize(
    ("wrong", "rule"),
    [
        ({"random_walk": -1.0}, "^random_walk must not be negative"),
        ({"bias_instability": (0.0, -1.0, 0.0)}, "^bias_instability must not be negative"),
        ({"bias": math.nan}, "^bias must be finite"),
        ({"scale": (1.0, 2.0)}, "^scale must be one number or three"),
        ({"resolution": math.inf}, "^resolution must be finite"),
        ({"full_scale": 0.0}, "^full_scale must be positive"),
        ({"full_scale": math.nan}, "^full_scale must be positive"),
        ({"delay": -0.1}, "^delay must be finite and not negative"),
        ({"cross_axis": ((1.0, 0.0, 0.0),) * 3}, "^cross_axis must be three rows"),
        ({"cross_axis": ((0.0, 0.0),) * 2}, "^cross_axis must be three rows"),
    ],
)
def test_errors_that_cannot_be(wrong, rule):
    with pytest.raises(ValueError, match=rule):
        TriadErrors(**wrong)


def test_signals_that_cannot_be():
    with pytest.raises(ValueError, match=r"^truth must have the shape \(n, 3\), got \(3,\)"):
        triad([0.0, 0.0, 0.0], fs=1.0, errors=TriadErrors())
    with pytest.raises(ValueError, match=r"^fs must be positive and finite"):
        triad(still(1), fs=0.0, errors=TriadErrors())
    with pytest.raises(ValueError, match=r"^gyro and accelerometer must have one shape"):
        imu(still(2), still(3), fs=1.0, errors=ImuErrors())
    with pytest.raises(ValueError, match=r"^gyro must have the shape"):
        imu([[]], [[]], fs=1.0, errors=ImuErrors())
    with pytest.raises(ValueError, match=r"^grade must be one of consumer, industrial, tactical, got 'toy'$"):
        simulate.typical("toy")
    with pytest.raises(ValueError, match="at least one sample"):
        imu_log(duration=0.001, rate=10.0)


def test_errors_hash_and_compare():
    assert hash(EVERYTHING) == hash(replace(EVERYTHING))
    assert TriadErrors(bias=0.5) == TriadErrors(bias=(0.5, 0.5, 0.5))


# -------------------------------------------------------------------------------------------------------- command line


def run(*arguments):
    return CliRunner().invoke(app, ["simulate", "imu", *map(str, arguments)])


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_command(tmp_path, ending):
    path = tmp_path / f"imu.{ending}"
    result = run("-o", path, "--duration", 5, "--rate", 50, "--seed", 3, "--grade", "tactical")
    assert result.exit_code == 0, result.output
    assert "250 samples" in result.stderr
    table = csv.read_csv(path) if ending == "csv" else parquet.read_table(path)
    log = imu_log(duration=5.0, rate=50.0, seed=3, errors=simulate.typical("tactical", seed=3))
    for name, values in log.items():
        np.testing.assert_array_equal(table.column(name).to_numpy(), values)
    if ending == "parquet":
        assert table.schema.field("gx").metadata[b"unit"] == b"rad/s"


def test_command_with_motion(tmp_path):
    path = tmp_path / "imu.parquet"
    assert run("-o", path, "--duration", 30, "--motion").exit_code == 0
    assert np.ptp(parquet.read_table(path).column("true_roll").to_numpy()) > 0.3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--duration", "inf", "--motion"], "duration must be positive and finite"),
        (["--rate", "0"], "rate must be positive and finite"),
        (["--duration", "1e300", "--rate", "1e300"], "rate must lie between 1e-12 and 1e+12 Hz, not 1e+300"),
        (["--duration", "1e-298", "--rate", "1e300", "--motion"], "rate must lie between 1e-12 and 1e+12 Hz"),
        (["--duration", "1e15"], "duration times rate must be at least one sample and"),
        (["--grade", "toy"], "'toy' is not one of"),
    ],
)
def test_command_refuses(tmp_path, arguments, message):
    result = run("-o", tmp_path / "imu.csv", *arguments)
    assert result.exit_code == 2
    assert message in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_command_keeps_what_is_there(tmp_path):
    path = tmp_path / "imu.csv"
    path.write_text("mine")
    assert run("-o", path, "--duration", 1).exit_code == 2
    assert path.read_text() == "mine"
    assert run("-o", path, "--duration", 1, "--force").exit_code == 0
