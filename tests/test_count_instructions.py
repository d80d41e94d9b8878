"""How instruction counts are held against their budgets; the counting itself needs valgrind and is no test."""

import pytest

import count_instructions
from count_instructions import Row, compare, judge, read, table, write

MADE_WITH = {"rustc": "1.95.0", "target": "x86_64-unknown-linux-gnu", "settings": "lto = thin"}
PI, TILT = ("f32", "pi"), ("f64", "tilt, pi")


@pytest.mark.parametrize(
    ("budget", "count", "verdict"),
    [
        (100.0, 100.0, ""),
        (100.0, 103.0, ""),
        (100.0, 97.0, ""),
        (100.0, 103.1, "over its budget"),
        (100.0, 96.9, "below its budget"),
        (None, 100.0, "has no budget"),
        (100.0, None, "is no longer there"),
    ],
)
def test_a_count_may_be_three_percent_off_to_both_sides(budget, count, verdict):
    assert Row(PI, budget, count).verdict == verdict


def test_every_filter_with_a_budget_or_a_count_has_a_row():
    new, old = ("f32", "new"), ("f32", "old")
    rows = compare({old: 5.0, PI: 10.0}, {PI: 11.0, new: 7.0})
    assert rows == [Row(PI, 10.0, 11.0), Row(new, None, 7.0), Row(old, 5.0, None)]


@pytest.mark.parametrize("count", [89.0, 111.0])
def test_what_is_off_fails_and_names_the_command_that_updates(count):
    passes, why = judge(compare({PI: 100.0, TILT: 100.0}, {PI: count, TILT: 100.0}), MADE_WITH, MADE_WITH)
    assert not passes
    assert why.startswith("1 of 2 ")
    assert why.endswith("python scripts/count_instructions.py --update")


@pytest.mark.parametrize(("budgets", "counts"), [({}, {PI: 1.0}), ({PI: 1.0}, {})])
def test_a_filter_without_budget_and_a_budget_without_filter_fail(budgets, counts):
    assert not judge(compare(budgets, counts), MADE_WITH, MADE_WITH)[0]


def test_what_is_within_passes():
    assert judge(compare({PI: 100.0}, {PI: 101.0}), MADE_WITH, MADE_WITH)[0]


@pytest.mark.parametrize("other", [{"rustc": "1.96.0"}, {"target": "aarch64-apple-darwin"}])
def test_with_another_compiler_nothing_fails_and_that_is_said(other):
    passes, why = judge(compare({PI: 100.0}, {PI: 200.0}), MADE_WITH, MADE_WITH | other)
    assert passes
    assert "NOT CHECKED" in why
    assert next(iter(other.values())) in why


def test_other_settings_of_the_build_fail():
    assert not judge(compare({PI: 100.0}, {PI: 100.0}), MADE_WITH, MADE_WITH | {"settings": "lto = fat"})[0]


def test_what_is_written_is_read():
    counts = {PI: 23.0, ("f32", "observer, 3 states"): 230.5, TILT: 890.6}
    assert read(write(MADE_WITH, counts)) == (MADE_WITH, counts)


def test_the_table_has_budget_count_and_deviation():
    rows = table([Row(PI, 100.0, 110.0), Row(TILT, None, 7.0)]).splitlines()[2:]
    assert rows[0] == "| pi | f32 | 100.0 | 110.0 | +10.0% | over its budget |"
    assert rows[1] == "| tilt, pi | f64 |  | 7.0 |  | has no budget |"


@pytest.mark.parametrize(("ci", "status"), [("", 0), ("true", 1)])
def test_without_valgrind_it_is_left_out_but_not_in_ci(monkeypatch, capsys, ci, status):
    monkeypatch.setattr(count_instructions, "there_is_valgrind", lambda: False)
    monkeypatch.setattr("sys.argv", ["count_instructions.py"])
    monkeypatch.setenv("CI", ci)
    assert count_instructions.main() == status
    assert capsys.readouterr().err.count("\n") == 1


def test_the_committed_budgets_can_be_read():
    made_with, budgets = read(count_instructions.BUDGETS.read_text())
    assert made_with.keys() == MADE_WITH.keys()
    assert all(budget > 0 for budget in budgets.values())
