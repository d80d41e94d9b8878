"""Rows out of the middle of a log are those of the whole, in every format that has them."""

import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from compfilt.logs import rows
from compfilt.logs.errors import LogError
from compfilt.logs.readers import Columns
from compfilt.logs.rows import can_read_rows, open_rows

ROWS = 1000


@pytest.fixture(scope="module")
def table():
    rng = np.random.default_rng(0)
    return pa.table({"unused": rng.normal(size=ROWS), "y": rng.normal(size=ROWS), "t": np.arange(ROWS)})


WRITERS = {
    "parquet.parquet": lambda table, path: pq.write_table(table, path, row_group_size=77),
    "one.parquet": pq.write_table,
    "plain.arrow": lambda table, path: pa.feather.write_feather(table, path, "uncompressed", chunksize=130),
    "lz4.feather": lambda table, path: pa.feather.write_feather(table, path, "lz4", chunksize=130),
}


@pytest.fixture(scope="module", params=WRITERS)
def log(request, table, tmp_path_factory):
    path = tmp_path_factory.mktemp("rows") / request.param
    WRITERS[request.param](table, path)
    return path


def opened(path, table, names):
    """Open without the checks, which belong to the reader in order."""
    return rows.FORMATS[path.suffix](path, pa.schema([table.schema.field(name) for name in names]))


@given(ends=st.tuples(st.integers(0, ROWS), st.integers(0, ROWS)), batch=st.integers(1, 400))
def test_any_rows(ends, batch, log, table):
    start, stop = sorted(ends)
    with opened(log, table, ["t", "y"]) as reader:
        assert (reader.starts[0], reader.starts[-1]) == (0, ROWS)
        batches = list(reader.read(start, stop, batch))
    assert all(0 < piece.num_rows <= batch for piece in batches)
    found = pa.Table.from_batches(batches, schema=reader.schema)
    assert found.equals(table.select(["t", "y"]).slice(start, stop - start))


def test_the_checks_are_those_of_every_log(tmp_path, table):
    path = tmp_path / "log.parquet"
    pq.write_table(table, path)
    with pytest.raises(LogError, match='no column "z"'), open_rows(path, Columns(("z",))):
        pass
    with pytest.raises(LogError, match="cannot be read"), open_rows(tmp_path / "no.parquet", Columns(("y",))):
        pass
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(LogError), open_rows(path, Columns(("y",))):
        pass


def test_a_csv_has_no_rows_in_the_middle(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("y\n1\n", encoding="utf-8")
    assert not can_read_rows(path)
    with pytest.raises(LogError, match="only be read in order"), open_rows(path, Columns(("y",))):
        pass


def test_a_damaged_file_is_a_log_error(tmp_path, table):
    path = tmp_path / "log.parquet"
    pq.write_table(table, path, row_group_size=100)
    whole = bytearray(path.read_bytes())
    whole[4:100] = b"\xff" * 96  # the first page's header
    path.write_bytes(whole)
    with pytest.raises(LogError), open_rows(path, Columns(("unused",))) as reader:
        next(reader.read(0, 100, 100))


def test_an_arrow_file_that_points_beside_its_text_is_a_log_error(tmp_path):
    """Reading it as it is would end the process."""
    path = tmp_path / "log.arrow"
    numbers = np.arange(1000, 1000 + ROWS)
    text = pa.array([f"row {number}" for number in numbers])
    pa.feather.write_feather(pa.table({"y": numbers * 1.0, "note": text}), path, "uncompressed")
    offsets = np.arange(0, 8 * ROWS + 1, 8, dtype=np.int32).tobytes()
    damaged = bytearray(path.read_bytes())
    at = damaged.index(offsets) + 4 * (ROWS // 2)
    damaged[at : at + 4] = np.int32(2**31 - 1).tobytes()
    path.write_bytes(damaged)
    with pytest.raises(LogError, match="damaged"), open_rows(path, Columns(("y",), keep=("note",))) as reader:
        list(reader.read(0, ROWS, 100))


def test_rows_that_a_parquet_file_only_declares(tmp_path):
    """Those of the next row group are not taken in their place."""
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table({"y": np.arange(900.0)}), path, row_group_size=300)
    declare_more(path, 300, 310)
    with open_rows(path, Columns(("y",))) as reader:
        assert reader.starts == [0, 310, 620, 930]
        assert sum(batch.num_rows for batch in reader.read(0, 300, 100)) == 300
    with (
        pytest.raises(LogError, match="rows that it does not have"),
        open_rows(path, Columns(("y",))) as reader,
    ):
        list(reader.read(0, 320, 100))


def declare_more(path, rows, more):
    """Write other numbers of rows into a Parquet file's row groups."""
    whole = path.read_bytes()
    begin = len(whole) - 8 - int.from_bytes(whole[-8:-4], "little")
    # A number in thrift's compact form, zigzag, as field 3 of a row group behind the field before it.
    old, new = (b"\x16" + varint(2 * number) + b"\x26" for number in (rows, more))
    footer = whole[begin:]
    assert len(old) == len(new)
    assert old in footer
    path.write_bytes(whole[:begin] + footer.replace(old, new))


def varint(number):
    found = b""
    while number >= 128:
        found += bytes([number % 128 + 128])
        number //= 128
    return found + bytes([number])
