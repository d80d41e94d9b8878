"""The firmware's check: what it makes of outputs and costs. The check itself is `make firmware`."""

import struct

import numpy as np
import pytest

from firmware import build, costs, expected, report


def test_outputs_with_the_same_bits_do_not_differ():
    outputs = np.array([[1.0, np.nan], [-0.0, np.inf]], dtype=np.float32)
    assert report.first_difference("pi", outputs, outputs.copy()) is None


def test_the_first_other_bit_is_named_with_filter_sample_and_bits():
    wanted = np.ones((5, 2), dtype=np.float32)
    got = wanted.copy()
    got[3, 1] = np.nextafter(np.float32(1.0), np.float32(2.0))
    got[4, 0] = 7.0
    message = report.first_difference("pi", got, wanted)
    assert message is not None
    assert message.startswith("pi: sample 3, output 1 is 1.0000001 (0x3f800001), in Python 1.0 (0x3f800000)")
    assert "2 of 10" in message


def test_zeros_of_both_signs_are_other_bits():
    zero = np.zeros((1, 1), dtype=np.float32)
    assert report.first_difference("pi", -zero, zero) is not None


def test_a_report_is_read_as_it_is_written(tmp_path):
    path = tmp_path / "report"
    outputs = np.arange(6, dtype="<f4").reshape(3, 2)
    head = b"pi".ljust(32, b"\0") + struct.pack("<5I", 2, 8, 12, 30, 19 * report.SETTLED)
    path.write_bytes(head + outputs.tobytes() + head + outputs.tobytes())
    measured = report.read(path, samples=3)["pi"]
    assert np.array_equal(measured.outputs, outputs)
    assert (measured.state, measured.stack, measured.most, measured.mean) == (8, 12, 30, 19.0)


def test_the_page_has_a_row_for_every_filter():
    budgets = costs.read()
    assert list(budgets) == list(expected.Expected().outputs())
    assert costs.complaints(budgets, budgets) == []


def test_a_cost_above_its_budget_is_named_and_one_below_is_not():
    budgets = {"pi": (100,) * len(costs.COLUMNS)}
    above = {"pi": (*(100,) * (len(costs.COLUMNS) - 1), 119)}
    below = {"pi": (118,) * len(costs.COLUMNS)}
    assert costs.complaints(budgets, above) == ["pi, M0 code: 119 where the page has 100"]
    assert costs.complaints(budgets, below) == []


def test_filters_that_are_new_or_gone_are_named():
    row = (1,) * len(costs.COLUMNS)
    assert costs.complaints({"old": row}, {"new": row}) == [
        "new is not on the page",
        "old is on the page and was not measured",
    ]


@pytest.mark.parametrize(
    ("symbol", "pattern", "found"),
    [
        ("_RNvNtCsj_4core9panicking18panic_bounds_check", build.PANIC_OR_ALLOCATION, True),
        ("__rust_alloc", build.PANIC_OR_ALLOCATION, True),
        ("probe_pi", build.PANIC_OR_ALLOCATION, False),
        ("__aeabi_dmul", build.SOFT_DOUBLE, True),
        ("__aeabi_f2d", build.SOFT_DOUBLE, True),
        ("__aeabi_fmul", build.SOFT_DOUBLE, False),
        ("   8004:\tbf30      \twfi", build.WAITING, True),
        ("   8004:\t4770      \tbx\tlr", build.WAITING, False),
    ],
)
def test_what_counts_as_a_way_to_fail(symbol, pattern, found):
    assert bool(pattern.search(symbol)) is found


def test_steps_are_found_in_their_source():
    names = build.names_of_steps()
    assert len(names) >= 34
    assert {"probe_gravity", "probe_correct", "probe_predict"} <= set(names)
