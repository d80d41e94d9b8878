"""examples/third_order against SciPy, closed forms and plain loops of the source's equations."""

import csv

import numpy as np
import pytest
from scipy import linalg, signal

import compfilt as cf
import figure_of_eight
import position_filters
import sign_of_the_figure

pytest.importorskip("matplotlib")

T, TAU, DELAY = 0.01, 4.0, 0.2
K = np.array([3 / TAU, 3 / TAU**2, 1 / TAU**3])
AMPLITUDES = np.array([40.0, 2.0, 20.0, 3.0])
OMEGAS = 2 * np.pi / np.array([40.0, 9.0, 20.0, 7.0])


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("third_order")


@pytest.fixture(scope="module")
def tables(load_example, out):
    return load_example("third_order").reproduce(out)


@pytest.fixture(scope="module")
def drive():
    return figure_of_eight.drive_an_eight()


def low_pass(omega, k=K):
    _, response = signal.freqs(k, [1.0, *k], omega)
    return response


def test_figures_and_tables_are_there(tables, out):
    for name in ("third_order", "orders", "slips"):
        content = (out / f"{name}.png").read_bytes()
        assert content.startswith(b"\x89PNG")
        assert 20_000 < len(content) <= 150_000
    for name, table in tables.items():
        with (out / f"{name}.csv").open(encoding="utf-8", newline="") as file:
            rows = {row.pop("case"): row for row in csv.DictReader(file)}
        assert rows.keys() == table.keys()
        for case, cells in table.items():
            assert {column: float(text) for column, text in rows[case].items() if text} == cells


# Orders one to three


@pytest.mark.parametrize("order", [1, 2, 3])
def test_orders(tables, order):
    row = list(tables["orders"].values())[order - 1]
    for column in ("LP, off C/(C + s)", "HP, off s/(C + s)", "LP + HP, off 1"):
        assert row[column] < 1e-14
    # Butterworth poles by SciPy; the low-pass has all terms of the denominator but the first.
    _, denominator = signal.butter(order, 1.0, analog=True)
    omega = np.geomspace(1e-4, 1e2, 600_001)
    magnitude = abs(low_pass(omega, denominator[1:]))
    assert row["LP peak / dB"] == pytest.approx(20 * np.log10(magnitude.max()), abs=1e-4)
    corner = omega[np.flatnonzero(magnitude > np.sqrt(0.5))[-1]]
    assert row["LP at -3 dB / omega0"] == pytest.approx(corner, rel=3e-3)
    assert row["HP at 0.1 omega0 / dB"] == pytest.approx(-20 * order, abs=0.05)


def test_same_coefficients_are_the_same_filter(tables):
    assert len(tables["gains"]) == 4
    assert all(row == {"samples": 12000, "that differ": 0} for row in tables["gains"].values())


def test_the_pi_form_is_flow_chart_3(drive):
    """att' = gyro + C(s) (acc - att) with C = K_P + K_I/s, by backward Euler and a plain loop."""
    k_p, k_i = 0.8, 0.3
    measured, gyro = drive.position[:, 0], drive.velocity[:, 0] + 0.2
    angle, integral, expected = measured[0], 0.0, []
    for y, u in zip(measured, gyro, strict=True):
        # angle' = u + k_p (y - angle') ..., integral' = integral + k_i T (y - angle'), solved for the new angle
        angle = (angle + T * (u + integral + (k_p + k_i * T) * y)) / (1 + T * (k_p + k_i * T))
        integral += T * k_i * (y - angle)
        expected.append(angle)
    found = cf.PiForm(k_p, k_i).filter(measured, gyro, fs=1 / T, initial=measured[0])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


def test_the_pi_controller_as_printed_is_no_low_pass(tables):
    for row, omega in zip(tables["pi_controller"].values(), (0.01, 0.1, 1.0, 10.0, 100.0), strict=True):
        c = np.sqrt(2) + 1 / (1j * omega)
        assert row["|C/(C + s)|, LP"] == pytest.approx(abs(c / (c + 1j * omega)))
        assert row["|C/(C + 1)|, as printed"] == pytest.approx(abs(c / (c + 1)))
    assert row["|C/(C + 1)|, as printed"] == pytest.approx(np.sqrt(2) / (1 + np.sqrt(2)), rel=1e-3)


# Position


def noise_free(drive, *, every=1, delay=DELAY):
    gps = np.full(drive.position.shape, np.nan)
    late = round(delay / T)
    fixes = np.arange(late, drive.t.size, every)
    gps[fixes] = drive.position[fixes - late]
    return gps


def late_rms(drive, error):
    return np.sqrt(np.mean(np.sum(error[drive.t >= 40] ** 2, axis=1)))


def test_the_motion_is_consistent(drive):
    velocity = drive.velocity[0] + T * np.cumsum(drive.acceleration[1:], axis=0)
    np.testing.assert_allclose(velocity, drive.velocity[1:], atol=1e-10)
    np.testing.assert_allclose(np.gradient(drive.position, T, axis=0)[1:-1], drive.velocity[1:-1], atol=2e-3)
    np.testing.assert_array_equal(drive.velocity[0], 0.0)


def test_integration_and_held_fixes_by_hand(tables, drive):
    late = drive.t >= 40
    drift = np.linalg.norm(figure_of_eight.BIAS) / 2 * drive.t[late] ** 2
    assert tables["position"]["integrated twice"]["position / m"] == pytest.approx(
        np.sqrt(np.mean(drift**2)), rel=0.01
    )
    # A fix of σ on each axis, which is DELAY old when it comes and held for up to another period.
    n = np.flatnonzero(late)
    lag = np.linalg.norm(drive.position[n] - drive.position[n // 20 * 20 - 20], axis=1)
    expected = np.sqrt(np.mean(lag**2) + 2.0)
    assert tables["position"]["GPS held"]["position / m"] == pytest.approx(expected, rel=0.05)


def test_with_the_delay_told_the_motion_passes_unchanged(drive):
    gps, start = noise_free(drive, every=20), [[0.0] * 2, [0.0] * 2, [0.0] * 2]
    found = cf.ThirdOrder(TAU).filter(gps, drive.acceleration, fs=1 / T, delay=DELAY, initial=start)
    assert late_rms(drive, found - drive.position) < 0.05


def test_without_it_the_motion_passes_as_the_closed_form_says(tables, drive):
    """LP e^(-sD) + HP = 1 + LP (e^(-sD) - 1), over the sines that the motion is made of."""
    left = AMPLITUDES * abs(low_pass(OMEGAS) * (np.exp(-1j * OMEGAS * DELAY) - 1))
    expected = np.sqrt(np.sum(left**2) / 2)
    found = cf.ThirdOrder(TAU).filter(noise_free(drive), drive.acceleration, fs=1 / T)
    assert late_rms(drive, found - drive.position) == pytest.approx(expected, rel=0.03)
    row = tables["position"]
    noise = row["third order"]["position / m"]
    assert row["third order, delay not told"]["position / m"] == pytest.approx(
        np.hypot(expected, noise), rel=0.1
    )


def test_the_noise_that_passes_is_that_of_the_lyapunov_equation(tables, drive):
    """F P + P Fᵀ + k r² kᵀ + b q² bᵀ = 0 with the densities r = 1 m √0.2 s and q = 0.05 m/s² √0.01 s."""
    f = np.diag([1.0, 1.0], 1)
    f[:, 0] -= K
    r2, q2 = 1.0**2 * 0.2, 0.05**2 * 0.01
    p = linalg.solve_continuous_lyapunov(f, -(r2 * np.outer(K, K) + q2 * np.diag([0.0, 1.0, 0.0])))
    expected = np.sqrt(2 * np.diag(p))
    rows = []
    for seed in range(8):
        gps, acceleration = figure_of_eight.sensors(drive, seed)
        answer = position_filters.answer(cf.ThirdOrder(TAU), gps, acceleration, DELAY)
        rows.append(list(position_filters.errors(drive, answer).values())[:3])
    found = np.sqrt(np.mean(np.square(rows), axis=0))
    np.testing.assert_allclose(found, expected, rtol=0.2)
    np.testing.assert_allclose(list(tables["position"]["third order"].values())[:3], rows[0], rtol=1e-12)


def test_the_bias(tables):
    t, rise = signal.step(([1.0], np.poly1d([TAU, 1.0]) ** 3), T=np.linspace(0, 10 * TAU, 4001))
    for row, x in zip(tables["bias"].values(), (1, 2, 4, 6, 8), strict=True):
        assert row["closed form"] == pytest.approx(np.interp(x * TAU, t, rise), abs=1e-6)
        assert row["share found"] == pytest.approx(row["closed form"], abs=1e-3)
    assert tables["position"]["third order"]["bias within 20 % from / s"] < 8 * TAU


def test_without_the_bias_the_second_order_is_off(tables):
    """By b tau² in the continuous filter, and somewhat more with fixes that are few and late."""
    left = np.linalg.norm(figure_of_eight.BIAS) * TAU**2
    assert left < tables["position"]["second order"]["position / m"] < 1.3 * left
    rows = tables["taus"].values()
    assert min(row["third order / m"] for row in rows) < 0.7 * min(row["second order / m"] for row in rows)


# The last figure


def test_the_sign_as_drawn_is_unstable(tables):
    drawn, mended = tables["sign"].values()
    # x³ - 3 x² - 3 x - 1 = 0 has the root 1 + ∛2 + ∛4
    root = (1 + 2 ** (1 / 3) + 4 ** (1 / 3)) / TAU
    assert drawn["largest Re s / (1/s)"] == pytest.approx(root)
    assert drawn["growth, last 4 s / (1/s)"] == pytest.approx(np.log1p(root * T) / T, rel=1e-3)
    assert mended["largest Re s / (1/s)"] == pytest.approx(-1 / TAU, rel=1e-4)
    assert mended["0.01 m after 12 s / m"] < 0.001


def test_the_loop_with_the_mended_sign_is_the_library():
    """Its forward Euler against the library's backward Euler: both near the continuous answer."""
    t = T * np.arange(1, 1201)
    f = np.diag([1.0, 1.0], 1)
    f[:, 0] -= K
    exact = np.array([linalg.expm(f * each)[0, 0] for each in t]) * 0.01
    library = cf.ThirdOrder(TAU).filter(np.zeros(1200), np.zeros(1200), fs=1 / T, initial=0.01)
    np.testing.assert_allclose(sign_of_the_figure.as_drawn(-1.0), exact, atol=5e-5)
    np.testing.assert_allclose(library, exact, atol=5e-5)


def test_the_library_refuses_the_sign_as_drawn():
    with pytest.raises(ValueError, match="coefficients"):
        cf.Chain(-K, derivative_order=2)
