"""Tables of other libraries through a pipeline: the bits of Arrow's, in pieces as in one."""

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

from compfilt.logs import Pipeline, parse_recipe
from compfilt.logs.errors import LogError
from format_files import SIGNALS, data, recipe, table

RECIPE = parse_recipe(recipe())


class Stream:
    """What offers a stream to Arrow, and nothing else."""

    def __init__(self, held):
        self._held = held

    def __arrow_c_stream__(self, requested_schema=None):
        return self._held.__arrow_c_stream__(requested_schema)


class Array:
    """What offers one batch to Arrow, and nothing else."""

    def __init__(self, held):
        self._held = held

    def __arrow_c_array__(self, requested_schema=None):
        return self._held.__arrow_c_array__(requested_schema)


KINDS = {
    "arrow": lambda held: held,
    "chunked": lambda held: pa.concat_tables([held.slice(0, 700), held.slice(700, 1), held.slice(701)]),
    "batch": lambda held: held.combine_chunks().to_batches()[0],
    "reader": lambda held: pa.RecordBatchReader.from_batches(held.schema, held.to_batches(300)),
    "pandas": lambda held: held.to_pandas(),
    "polars": pl.from_arrow,
    "stream": Stream,
    "array": lambda held: Array(held.combine_chunks().to_batches()[0]),
}


def bits(result):
    return {name: result.column(name).to_numpy().tobytes() for name in result.column_names}


@pytest.fixture(scope="module")
def expected():
    (batch,) = table(data()).combine_chunks().to_batches()
    return Pipeline(RECIPE, batch.schema).process(batch)


@pytest.mark.parametrize("kind", KINDS)
def test_every_table_gives_the_bits_of_arrow(expected, kind):
    out = Pipeline(RECIPE).filter(KINDS[kind](table(data())))
    assert isinstance(out, pa.Table)
    assert out.schema.equals(expected.schema, check_metadata=True)
    assert bits(out) == {
        name: expected.column(name).to_numpy(zero_copy_only=False).tobytes() for name in out.column_names
    }


def test_tables_follow_each_other(expected):
    pipeline = Pipeline(RECIPE)
    held = table(data())
    parts = [pipeline.filter(held.slice(begin, 400)) for begin in range(0, 2000, 400)]
    assert bits(pa.concat_tables(parts)) == {
        name: expected.column(name).to_numpy(zero_copy_only=False).tobytes() for name in expected.schema.names
    }
    assert pipeline.rows == 2000
    assert pipeline.filter(held.slice(0, 0)).num_rows == 0


def test_points_in_time_of_data_frames():
    silent = parse_recipe(recipe().replace(', unit = "us"', "", 1))
    frame = pd.DataFrame(data())
    frame["t"] = pd.to_datetime(frame["t"], unit="us").astype("datetime64[us]")
    held = Pipeline(parse_recipe(recipe())).filter(table(data()))
    assert bits(Pipeline(silent).filter(frame)) == bits(held)
    assert bits(Pipeline(silent).filter(pl.from_pandas(frame))) == bits(held)


def test_float32_needs_the_schema():
    single = pa.table(
        {name: column.astype(np.float32) if name != "t" else column for name, column in data().items()}
    )
    assert Pipeline(RECIPE, single.schema).filter(single).schema.field("roll").type == pa.float32()
    assert Pipeline(RECIPE).filter(single).schema.field("roll").type == pa.float64()


def test_what_is_not_copied():
    """The numbers of a frame are read where they are."""
    frame = pl.DataFrame(data())
    reader = pa.RecordBatchReader.from_stream(frame)
    (batch,) = list(reader)
    here = frame["gx"].to_numpy(allow_copy=False).__array_interface__["data"][0]
    assert batch.column("gx").buffers()[1].address == here


def test_what_is_refused():
    held = table(data(50))
    for other in (None, {"t": [1.0]}, np.zeros((3, 3)), [held]):
        with pytest.raises(
            TypeError, match=r"table must be one of Arrow, or offer itself to it, which .* does not"
        ):
            Pipeline(RECIPE).filter(other)
    with pytest.raises(LogError, match=r'^there is no column "gx"'):
        Pipeline(RECIPE).filter(held.drop_columns("gx"))
    with pytest.raises(LogError, match=r'^there are 2 columns "gx"$'):
        Pipeline(RECIPE).filter(held.append_column("gx", held.column("gx")))
    words = held.set_column(held.schema.get_field_index("gx"), "gx", pa.array(["x"] * 50))
    with pytest.raises(LogError, match=r'^column "gx" holds string, not numbers$'):
        Pipeline(RECIPE).filter(words)
    assert set(SIGNALS) < set(held.column_names)
