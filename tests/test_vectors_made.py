"""The committed vectors are what their script makes."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

VECTORS = Path(__file__).resolve().parent / "vectors"


def load_script():
    spec = importlib.util.spec_from_file_location("make_vectors", VECTORS / "make.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up by its name
    spec.loader.exec_module(module)
    return module


make = load_script()
MADE = make.files()


def test_no_file_is_missing_or_left_over():
    assert {path.name for path in VECTORS.glob("*.csv")} == set(MADE)


@pytest.mark.parametrize("name", sorted(MADE))
def test_file_is_what_the_script_makes(name):
    header, columns = MADE[name]
    committed_header, committed = make.read(VECTORS / name)
    expected = {key: make.entry(value) for key, value in header.items()}
    # Versions of numpy and scipy may differ, and with them the last digit of a coefficient.
    for key in expected.keys() - {"generator", "coefficients"}:
        assert committed_header[key] == expected[key]
    assert committed_header.keys() == expected.keys()
    assert list(committed) == list(columns)
    for column, values in columns.items():
        scale = max(1.0, float(np.nanmax(np.abs(values))))
        np.testing.assert_allclose(committed[column], values, rtol=0, atol=1e-9 * scale)


def test_text_reads_back_exactly(tmp_path):
    header, columns = MADE["missing_pi.csv"]
    path = tmp_path / "file.csv"
    path.write_text(make.text(header, columns), encoding="utf-8")
    for column, values in make.read(path)[1].items():
        np.testing.assert_array_equal(values, columns[column])


@pytest.mark.parametrize("order", [1, 2, 3])
def test_difference_equation_is_scipys(order):
    design = make.reference.butterworth(4.0, order)
    denominator, from_y, _ = make.level_numerators(design)
    b, a = (np.array(make.substituted(p, order, 0.05), dtype=float) for p in (from_y[0], denominator))
    y = make.signals(make.even(0.05), 1, 3)[0]
    ours = make.lfilter(
        make.substituted(from_y[0], order, 0.05), make.substituted(denominator, order, 0.05), y
    )
    np.testing.assert_allclose(ours.astype(float), signal.lfilter(b, a, y), rtol=0, atol=1e-10)


@pytest.mark.parametrize("name", sorted(case.name for case in make.cases() if case.by_transfer_function))
def test_state_space_agrees_with_transfer_functions(name):
    """Two ways that share nothing: the closed loop solved sample by sample, and the difference equations."""
    case = next(case for case in make.cases() if case.name == name)
    y, u = case.inputs()
    levels = make.reference.run(
        case.design, y, u, case.steps, rule=case.rule, input_=case.input_, **case.options
    )
    for level, (column, expected) in zip(levels, list(MADE[f"{name}.csv"][1].items())[3:], strict=True):
        scale = max(1.0, float(np.max(np.abs(expected))))
        np.testing.assert_allclose(level, expected, rtol=0, atol=case.tolerance * scale / 5, err_msg=column)
