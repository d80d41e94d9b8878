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


def save_npz(table, path, **more):
    np.savez(path, **{name: table[name].to_numpy() for name in table.column_names}, **more)


WRITERS = {
    "parquet.parquet": lambda table, path: pq.write_table(table, path, row_group_size=77),
    "one.parquet": pq.write_table,
    "plain.arrow": lambda table, path: pa.feather.write_feather(table, path, "uncompressed", chunksize=130),
    "lz4.feather": lambda table, path: pa.feather.write_feather(table, path, "lz4", chunksize=130),
    "arrays.npz": save_npz,
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


def test_columns_of_tables_and_foreign_bytes(tmp_path):
    wide = np.arange(12.0).reshape(4, 3)
    np.savez(tmp_path / "log.npz", rows=wide, columns=np.asfortranarray(wide), big=wide[:, 0].astype(">f8"))
    names = ["rows[1]", "columns[2]", "big"]
    schema = pa.schema([(name, pa.float64()) for name in names])
    with rows.FORMATS[".npz"](tmp_path / "log.npz", schema) as reader:
        (batch,) = reader.read(1, 3, 10)
    assert batch.to_pydict() == {"rows[1]": [4.0, 7.0], "columns[2]": [5.0, 8.0], "big": [3.0, 6.0]}


def test_what_is_compressed_is_refused(tmp_path, table):
    np.savez_compressed(tmp_path / "log.npz", t=np.arange(3))
    with pytest.raises(LogError, match='"t" is compressed'), opened(tmp_path / "log.npz", table, ["t"]):
        pass


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
