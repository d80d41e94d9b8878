"""Tables of any library: what offers itself to Arrow."""

from typing import Any

import pyarrow as pa

__all__ = ["arrow_reader"]


def arrow_reader(table: Any) -> Any:  # noqa: ANN401 - anything in, a reader of Arrow out
    """Return what gives the batches of a table of any library."""
    if hasattr(table, "__arrow_c_stream__"):
        return pa.RecordBatchReader.from_stream(table)
    if hasattr(table, "__arrow_c_array__"):
        batch = pa.record_batch(table)
        return pa.RecordBatchReader.from_batches(batch.schema, [batch])
    raise TypeError(
        f"table must be one of Arrow, or offer itself to it, which {type(table).__name__} does not"
    )
