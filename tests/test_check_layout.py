"""Text logs that are laid out in another way: what a recipe must say of them, or what must be done to them first."""

import gzip
import subprocess

import numpy as np
import pytest

from compfilt.logs import parse_recipe, run_log
from compfilt.logs.check import check_log
from compfilt.logs.check.layout import find_layout
from compfilt.logs.errors import LogError
from compfilt.logs.readers import Columns, open_log
from handled import FORCE, GYRO, handled

NAMES = ("t", *GYRO, *FORCE)


@pytest.fixture(scope="module")
def log():
    return handled(seconds=40.0, rate=50.0, seed=3)


def text(log, separator=",", header=True):
    rows = [[f"{value:.6f}" for value in row] for row in np.column_stack([log[name] for name in NAMES])]
    lines = [separator.join(row) for row in ([list(NAMES)] if header else []) + rows]
    return "\n".join(lines) + "\n"


def write(path, content):
    path.write_text(content, encoding="utf-8")
    return path


@pytest.mark.parametrize("separator", [";", "\t", "|", " "])
def test_another_separator_is_found_and_proposed(log, tmp_path, separator):
    """The recipe that is printed runs."""
    path = write(tmp_path / "log.csv", text(log, separator))
    report = check_log(path)
    assert report.wrong == ()
    assert report.rows == 2000
    assert report.about("gyro unit")[0].what == "rad/s"
    assert report.about("separator")[0].fix.startswith("separator = ")
    recipe = parse_recipe(report.recipe)
    assert recipe.separator == separator
    assert run_log(recipe, path, tmp_path / "out.csv").rows == 2000


def test_without_names_too(tmp_path):
    """Columns that are found by what they do are read by the same separator."""
    content = text(handled(seconds=150.0, rate=50.0, seed=3), ";", header=False)
    path = write(tmp_path / "log.csv", "clock;a;b;c;p;q;r\n" + content)
    recipe = parse_recipe(check_log(path).recipe)
    assert recipe.filter.gyro.columns == ("a", "b", "c")
    assert recipe.separator == ";"


def test_lines_may_be_long(tmp_path):
    """As long as those that can be read."""
    names = ";".join(f"column_{i}" for i in range(9000))
    row = ";".join(["0.123456789"] * 9000)
    path = write(tmp_path / "log.csv", f"{names}\n" + 3 * f"{row}\n")
    assert find_layout(path).separator == ";"


def test_the_usual_separator_needs_no_line(log, tmp_path):
    for name, separator in (("log.csv", ","), ("log.tsv", "\t")):
        path = write(tmp_path / name, text(log, separator))
        assert find_layout(path) == (None, ())
        assert "separator" not in check_log(path).recipe


BROKEN = {
    "header": (lambda content: content.split("\n", 1)[1], "the first row is numbers: is the header missing?"),
    "comment": (
        lambda content: "# today\n# by me\n" + content,
        "the names of the columns are not in the first line",
    ),
    "comment between empty lines": (
        lambda content: "\n\n# today\n\n" + content,
        "the names of the columns are not in the first line",
    ),
    "units": (
        lambda content: content.replace("\n", "\ns,deg/s,deg/s,deg/s,g,g,g\n", 1),
        "line 2 holds no number",
    ),
    "units behind an empty line": (
        lambda content: content.replace("\n", "\n\ns,deg/s,deg/s,deg/s,g,g,g\n", 1),
        "line 3 holds no number",
    ),
    "commas": (
        lambda content: content.replace(",", ";").replace(".", ","),
        "the numbers have decimal commas",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_in_the_way_is_said_and_mended(log, tmp_path, name):
    """The command that is proposed makes a log that can be read."""
    spoil, what = BROKEN[name]
    path = write(tmp_path / "my log.csv", spoil(text(log)))
    report = check_log(path)
    assert [finding.what.startswith(what) for finding in report.wrong] == [True]
    assert report.recipe is None
    assert "no samples were read, 1 thing wrong" in str(report)
    (finding,) = report.wrong
    fix = finding.fix.replace("t,gx,gy,gz,ax,ay,az", ",".join(NAMES)).replace("NEW", "new.csv")
    subprocess.run(["sh", "-c", fix], cwd=tmp_path, check=True)
    mended = check_log(tmp_path / "new.csv")
    assert mended.wrong == ()
    assert mended.rows == 2000


def test_a_packed_log_gets_no_command(log, tmp_path):
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(text(log, header=False).encode()))
    (finding,) = check_log(path).wrong
    assert finding.topic == "header"
    assert finding.fix == ""


def test_decimal_commas_between_commas_get_no_command(log, tmp_path):
    """One that makes points of all commas would take the separators away."""
    names, *rows = text(log, ";").splitlines()
    quoted = ['"' + row.replace(".", ",").replace(";", '","') + '"' for row in rows]
    path = write(tmp_path / "log.csv", "\n".join([names.replace(";", ","), *quoted]) + "\n")
    (finding,) = check_log(path).wrong
    assert finding.topic == "decimal commas"
    assert finding.fix == ""


@pytest.mark.parametrize("missing", ["", "NA", "null"])
def test_a_first_sample_that_is_missing_is_no_second_header(log, tmp_path, missing):
    names, rest = text(log).split("\n", 1)
    path = write(tmp_path / "log.csv", f"{names}\n{','.join([missing] * len(NAMES))}\n{rest}")
    assert find_layout(path) == (None, ())


def test_columns_that_are_no_sensors_are_listed(tmp_path):
    rows = "\n".join(f"{i / 100},{i % 7},ja" for i in range(300))
    path = write(tmp_path / "log.csv", "zeit,hoehe,gut\n" + rows + "\n")
    (finding,) = check_log(path).about("axes")
    assert 'there are the columns "zeit", "hoehe", "gut"' in finding.evidence
    assert [line.split(" = ")[0] for line in finding.fix.splitlines()] == ["gyro", "accelerometer"]
    path = write(
        tmp_path / "half.csv",
        "t,gyro_x,gyro_y,gyro_z\n" + "\n".join(f"{i / 100},1,2,3" for i in range(300)) + "\n",
    )
    (finding,) = check_log(path).about("axes")
    assert finding.what.startswith("no accelerometer was found")
    assert finding.fix.startswith("accelerometer = ")


def test_a_log_without_any_number(tmp_path):
    """It is counted, and not read as words in one block and as numbers in the next."""
    path = write(tmp_path / "words.csv", "name,place\n" + "a,b\n" * 10 + "1,2\n" * 399_990)
    report = check_log(path)
    assert report.rows == 400_000
    assert report.about("axes")[0].level == "wrong"


def test_a_recipe_that_splits_at_the_wrong_place_is_told_the_right_one(log, tmp_path):
    path = write(tmp_path / "log.csv", text(log, ";"))
    recipe = parse_recipe(check_log(path).recipe.replace('separator = ";"', 'separator = ","'))
    with pytest.raises(LogError, match=r'the recipe needs separator = ";", not ",", in \[log\]$'):
        run_log(recipe, path, tmp_path / "out.csv")
    with (
        pytest.raises(LogError, match=r'the recipe needs separator = ";", in \[log\]$'),
        open_log(path, Columns(("ax",))),
    ):
        pass


def test_a_single_column_may_have_any_name(tmp_path):
    path = write(tmp_path / "log.csv", '"a;b"\n1.5\n2.5\n')
    with open_log(path, Columns(("a;b",))) as reader:
        assert sum(batch.num_rows for batch in reader.batches()) == 2
    assert find_layout(path).separator is None
