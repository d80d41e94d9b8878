"""Simulated logs as files."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from compfilt.motion import Array

__all__ = ["SEAT_UNITS", "write"]

SEAT_UNITS: Mapping[str, str] = MappingProxyType(
    {
        name: unit
        for unit, names in {
            "s": ["t"],
            "g": ["ax", "ay", "az"],
            "deg/s": ["gx", "gy", "gz"],
            "deg": ["true_roll", "true_pitch"],
        }.items()
        for name in names
    }
)


def write(columns: Mapping[str, Array], path: str | Path, units: Mapping[str, str] = SEAT_UNITS) -> None:
    """Write the columns of a simulated log to a CSV or Parquet file; needs the extra ``logs``.

    Parameters
    ----------
    columns
        Arrays of one length by their names.
    path
        The file; its ending decides on the format.
    units
        The unit of each column, for formats that can hold it; those of `child_seat` by default.

    Raises
    ------
    UsageError
        The file's ending is not known.
    LogError
        The file cannot be written; nothing is left behind.
    """
    import pyarrow as pa  # noqa: PLC0415 - simulating needs numpy only

    from compfilt.logs.writers import check_ending, create_log  # noqa: PLC0415

    check_ending(Path(path))
    fields = [
        pa.field(name, pa.float64(), metadata={"unit": units[name]} if name in units else None)
        for name in columns
    ]
    batch = pa.RecordBatch.from_arrays(
        [pa.array(values) for values in columns.values()], schema=pa.schema(fields)
    )
    with create_log(Path(path), batch.schema) as writer:
        writer.write(batch)
