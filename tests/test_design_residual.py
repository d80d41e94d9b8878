"""The residual that noise explains, against Monte Carlo runs of the filter itself."""

from types import SimpleNamespace

import numpy as np
import pytest

import compfilt as cf
from compfilt.design import check_residual, residual_sigma
from designs import MATCHED, PLAIN

FS = 50.0
CASES = [case for case in PLAIN + MATCHED if not case.is_rate]
NOISE = {"fs": FS, "measurement": 0.02, "derivative": 0.1}


@pytest.fixture(scope="module")
def white():
    rng = np.random.default_rng(5)
    return [density * rng.normal(0.0, np.sqrt(FS), size=(1200, 150)) for density in (0.02, 0.1)]


def residual_of(case, y, u):
    return (y - case.design.filter(y, u, fs=FS, rule=case.rule, initial=np.zeros(y.shape[1])))[600:]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_it_is_that_of_a_monte_carlo(case, white):
    found = residual_of(case, *white)
    assert residual_sigma(case.design, rule=case.rule, **NOISE) == pytest.approx(found.std(), rel=0.03)
    assert check_residual(case.design, found, rule=case.rule, **NOISE) == ()


@pytest.mark.parametrize("case", CASES[::5], ids=lambda case: case.name)
def test_a_flat_spectrum_is_a_density(case):
    flat = SimpleNamespace(frequency=np.linspace(0.0, FS / 2, 2001), density=np.full(2001, 2 * 0.02**2))
    by_spectrum = residual_sigma(case.design, rule=case.rule, **NOISE | {"measurement": flat})
    assert by_spectrum == pytest.approx(residual_sigma(case.design, rule=case.rule, **NOISE), rel=0.01)


def test_motion_is_found_where_it_is(white):
    y, u = white
    design = cf.PiForm(1.0, 0.2)
    shaken = y + 0.5 * np.sin(2 * np.pi * 3.0 * np.arange(len(y)) / FS)[:, np.newaxis]
    residual = shaken - design.filter(shaken, u, fs=FS)
    residual[3] = np.nan
    (warning,) = check_residual(design, residual, **NOISE)
    assert "near 3 Hz" in warning


def test_a_residual_without_rows_is_an_error():
    with pytest.raises(ValueError, match="residual must have rows without NaN"):
        check_residual(cf.FirstOrder(1.0), [np.nan, np.nan], **NOISE)


@pytest.mark.parametrize(
    ("residual", "message"),
    [(1.0, r"residual must have the shape \(n,\)"), ([], "rows without NaN"), ([np.nan], "rows without NaN")],
)
def test_a_residual_has_rows(residual, message):
    with pytest.raises(ValueError, match=message):
        check_residual(cf.FirstOrder(1.0), residual, fs=100.0, measurement=0.1)
