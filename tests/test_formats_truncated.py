"""Logs that end too early: all that is readable comes out, then one sentence says from which row on nothing is."""

import gzip
import pickle
import re
import zipfile

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compfilt.logs import parse_recipe, run_log
from compfilt.logs.errors import LogError, RowError, TruncatedLog
from compfilt.logs.readers import Columns, is_text, open_log
from format_files import FORMATS, SIGNALS, data, recipe, write, write_mcap

N = 400


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("truncated")
    return {name: write(folder, name, data(N)) for name in FORMATS if name != "bag.v2"}


def read(path, columns, **options):
    """Return the rows that can be read, and what was said after them."""
    batches = []
    try:
        with open_log(path, columns, **options) as reader:
            batches.extend(reader.batches())
    except LogError as error:
        return (pa.Table.from_batches(batches) if batches else None), error
    return pa.Table.from_batches(batches), None


def read_cut(path, folder, size, columns, **options):
    cut = folder / path.name
    cut.write_bytes(path.read_bytes()[:size])
    return read(cut, columns, **options)


def check_begin(table, error, names, unit, *, text):
    """Check that the rows are the log's first ones, and that the error counts them."""
    assert "\n" not in str(error)
    rows = 0 if table is None else table.num_rows
    if isinstance(error, TruncatedLog):
        assert error.rows == rows
        place = f"line {rows + 2}" if text else f"row {rows + 1}"
        assert str(error).startswith(f"the log cannot be read from {place} on: ")
    columns = data(N)
    columns["t"] *= 1000 if unit == "ns" else 1
    for key in ("t", *SIGNALS) if rows else ():
        np.testing.assert_array_equal(table.column(names[key]).to_numpy(), columns[key][:rows], strict=False)
    return rows


def wanted(names):
    return Columns(tuple(names[name] for name in SIGNALS), (names["t"],))


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "bag.v2"])
@settings(max_examples=25)
@given(st.floats(0.0, 0.999), st.sampled_from([50, 1 << 16]))
def test_what_is_left_of_a_cut_log_is_its_begin(files, tmp_path_factory, name, part, rows):
    path, names, unit = files[name]
    size = int(part * path.stat().st_size)
    folder = tmp_path_factory.mktemp("cut")
    table, error = read_cut(path, folder, size, wanted(names), batch_rows=rows, batch_bytes=100 * rows)
    if table is None:
        assert type(error) in (LogError, TruncatedLog)
        return
    if name in ("log.csv", "log.tsv"):
        # The last number of a row that has all its fields may be cut without anybody being able to tell.
        whole = path.read_bytes()[:size].count(b"\n") - 1
        assert 0 <= table.num_rows - whole <= 1
        table = table.slice(0, whole)
        if isinstance(error, TruncatedLog):
            assert error.rows == whole
        if error is not None or not whole:
            return
    rows = check_begin(table, error, names, unit, text=is_text(path))
    if name not in OPEN_ENDED:
        assert error is not None or rows == N


OPEN_ENDED = ("log.csv", "log.tsv", "log.ipc", "log.ulg")
"""Formats in which nothing need stand behind the last row: that they were cut there cannot be told."""

SALVAGED = {
    "log.csv": 0.98,
    "log.csv.gz": 0.9,
    "log.tsv": 0.98,
    "log.arrow": 0.6,
    "log.ipc": 0.6,
    "log.feather": 0.6,
    "log.ulg": 0.98,
}
"""Which part of the rows that stand in the first four fifths of a file comes out, at least."""


@pytest.mark.parametrize("name", SALVAGED)
def test_most_of_a_cut_log_is_read(files, tmp_path, name):
    path, names, unit = files[name]
    size = 4 * path.stat().st_size // 5
    table, error = read_cut(path, tmp_path, size, wanted(names), batch_rows=50)
    assert isinstance(error, TruncatedLog)
    assert (0 if table is None else table.num_rows) >= int(0.8 * N * SALVAGED[name])
    if name not in ("log.csv", "log.tsv"):
        check_begin(table, error, names, unit, text=is_text(path))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("log.parquet", "the file is damaged or of another kind"),
        ("log.npz", "the file is damaged or of another kind"),
        ("log.h5", "the file is damaged or of another kind: .*truncated file"),
        ("log.bag", "the bag has no index, or a damaged one: .*; rosbag reindex makes it anew"),
        ("log.db3", "the file is damaged or of another kind"),
    ],
)
def test_formats_with_an_index_at_the_end_say_so(files, tmp_path, name, message):
    path, names, _ = files[name]
    table, error = read_cut(path, tmp_path, path.stat().st_size // 2, wanted(names))
    assert table is None
    assert type(error) is LogError
    with pytest.raises(LogError, match=message):
        raise error


CSV = "t,angle,rate\n0.0,1.5,2.5\n0.1,1.25,2.25\n0.2,1.125,2.125"

ENDS = [
    ("", 3, None),
    ("\n", 3, None),
    ("\r\n", 3, None),
    ("\n\n\n", 3, None),
    ("\n0.3", 3, "its last row has 1 fields, not 3"),
    ("\n0.3,1.0\n", 3, "its last row has 2 fields, not 3"),
    ("\n0.3,1.0\n\n", 3, "its last row has 2 fields, not 3"),
    ("\n0.3,1.0,", 4, None),  # an empty field is a missing number
    ("\n0.3,1.0,5e-", 3, "its last row ends within a field"),
    ("\n" + 5000 * "\0", 3, "its last row has 1 fields, not 3"),
]


@pytest.mark.parametrize(("end", "rows", "why"), ENDS)
@pytest.mark.parametrize("packed", [False, True])
def test_the_last_row_of_a_csv(tmp_path, end, rows, why, packed):
    path = tmp_path / "log.csv"
    path.write_text(CSV + end, encoding="utf-8", newline="")
    if packed:
        path = tmp_path / "log.csv.gz"
        path.write_bytes(gzip.compress((CSV + end).encode()))
    table, error = read(path, Columns(("angle", "rate"), ("t",)))
    assert table.num_rows == rows
    assert table.column("t").to_pylist()[:3] == [0.0, 0.1, 0.2]
    if why is None:
        assert error is None
    else:
        assert str(error) == f"the log cannot be read from line {rows + 2} on: {why}"


@pytest.mark.parametrize(
    ("end", "message"),
    [
        ("\n0.3,1.0\n0.4,1,2", "line 5 has 2 fields, not 3"),
        ("\n0.3,1.0,x\n", 'line 5: column "rate" holds "x", not a number'),
        ("\n0.3,1.0,x,y", "line 5 has 4 fields, not 3"),
    ],
)
def test_rows_of_a_csv_that_are_wrong_but_not_cut(tmp_path, end, message):
    (tmp_path / "log.csv").write_text(CSV + end, encoding="utf-8")
    _, error = read(tmp_path / "log.csv", Columns(("angle", "rate"), ("t",)))
    assert type(error) is LogError
    assert str(error) == message


def test_one_row_without_a_line_break(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,angle\n1,2", encoding="utf-8")
    table, error = read(path, Columns(("angle",), ("t",)))
    assert (table.num_rows, error) == (1, None)
    path.write_text("t,angle\n1", encoding="utf-8")
    table, error = read(path, Columns(("angle",), ("t",)))
    assert (table, str(error)) == (None, "the file holds no rows")


def test_a_parquet_file_that_is_damaged_in_the_middle(tmp_path):
    path = tmp_path / "log.parquet"
    values = np.random.default_rng(0).normal(size=3000)
    pq.write_table(
        pa.table({"a": values}), path, row_group_size=1000, compression="zstd", use_dictionary=False
    )
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle - 500 : middle + 500] = bytes(1000)
    path.write_bytes(content)
    table, error = read(path, Columns(("a",)))
    assert isinstance(error, TruncatedLog)
    assert table.num_rows == error.rows == 1000
    np.testing.assert_array_equal(table.column("a").to_numpy(), values[:1000])


def test_an_arrow_file_that_ends_between_two_batches(tmp_path):
    path = tmp_path / "log.arrow"
    with pa.ipc.new_file(path, pa.schema([("a", pa.float64())])) as writer:
        writer.write_table(pa.table({"a": np.arange(300.0)}), 100)
    with pa.memory_map(str(path)) as source:
        source.seek(8)
        stream = pa.ipc.open_stream(source)
        stream.read_next_batch()
        stream.read_next_batch()
        end = source.tell()
    table, error = read_cut(path, tmp_path, end, Columns(("a",)))
    assert table.column("a").to_pylist() == list(range(200))
    assert str(error) == "the log cannot be read from row 201 on: the file ends too early"


def test_an_hdf5_dataset_that_is_damaged_in_the_middle(tmp_path):
    path = tmp_path / "log.h5"
    values = np.random.default_rng(0).normal(size=3000)
    with h5py.File(path, "w") as file:
        dataset = file.create_dataset("a", data=values, chunks=(1000,), fletcher32=True)
        place = dataset.id.get_chunk_info(1).byte_offset
    content = bytearray(path.read_bytes())
    content[place + 10] ^= 0xFF
    path.write_bytes(content)
    table, error = read(path, Columns(("a",)), batch_rows=500)
    assert isinstance(error, TruncatedLog)
    assert table.num_rows == error.rows == 1000


def test_an_array_that_is_shorter_than_it_declares(tmp_path):
    path = tmp_path / "log.npz"
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000,), }"
    with zipfile.ZipFile(path, "w") as archive:
        text = header.ljust(117).encode() + b"\n"
        archive.writestr("a.npy", b"\x93NUMPY\x01\x00" + bytes([118, 0]) + text + np.arange(5.0).tobytes())
    table, error = read(path, Columns(("a",)))
    assert table.column("a").to_pylist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert str(error) == "the log cannot be read from row 6 on: an array ends too early"


def test_a_long_mcap_is_read_up_to_its_cut(tmp_path):
    columns = data(20_000)
    path = tmp_path / "log.mcap"
    write_mcap(path, columns)
    names = FORMATS["log.mcap"][1]
    table, error = read_cut(path, tmp_path, 4 * path.stat().st_size // 5, wanted(names))
    assert isinstance(error, TruncatedLog)
    assert 12_000 < table.num_rows < 16_000
    np.testing.assert_array_equal(table.column(names["ax"]).to_numpy(), columns["ax"][: table.num_rows])


def test_a_run_on_a_cut_log_keeps_what_is_readable(files, tmp_path):
    path = tmp_path / "log.csv"
    path.write_bytes(files["log.csv"][0].read_bytes()[:9000])
    out = tmp_path / "out.parquet"
    summary = run_log(parse_recipe(recipe()), path, out)
    assert re.fullmatch(
        r"the log cannot be read from line \d+ on: its last row has \d fields, not 7", summary.truncated
    )
    assert pq.read_metadata(out).num_rows == summary.rows > 0


def test_the_error_pickles():
    error = pickle.loads(pickle.dumps(TruncatedLog(7, "a\nb")))
    assert (error.rows, str(error)) == (7, r"the log cannot be read from row 8 on: a\nb")
    error = pickle.loads(pickle.dumps(TruncatedLog(7, "a", text=True)))
    assert (error.rows, str(error)) == (7, "the log cannot be read from line 9 on: a")
    error = pickle.loads(pickle.dumps(RowError(7, "row 7 is odd")))
    assert (error.row, str(error), str(error.in_text())) == (7, "row 7 is odd", "line 8 is odd")
