"""Logs that are data frames of pandas: one by one, or as the partitions of a Dask data frame."""

from typing import TYPE_CHECKING

import pyarrow as pa

from compfilt.logs.errors import LogError
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.readers.base import check_kinds, check_present, reason
from compfilt.logs.recipe import Recipe

if TYPE_CHECKING:
    import pandas as pd  # type: ignore[import-untyped]

__all__ = ["filter_frame"]


def filter_frame(frame: "pd.DataFrame", recipe: Recipe) -> "pd.DataFrame":
    """Filter a log that is a data frame.

    It is made for ``dask.dataframe``'s ``map_partitions``, with one log a partition: the filter starts anew in every
    partition. For logs that stand below each other in one frame it goes with ``groupby(...).apply``.

    Parameters
    ----------
    frame
        The log, with the columns that the recipe names and maybe others.
    recipe
        What to take, filter and give back.

    Returns
    -------
    pandas.DataFrame
        The columns that the recipe keeps, then those that it makes, with the index of `frame`.

    Raises
    ------
    LogError
        A column is not there, is there twice or holds no numbers, or the log cannot be filtered. The message names the column or the row.
    RecipeError
        The filter cannot be built from the recipe.

    Examples
    --------
    >>> import pandas as pd
    >>> from compfilt.logs import parse_recipe
    >>> recipe = parse_recipe('''
    ... version = 1
    ... [log]
    ... rate = 100.0
    ... measurement = { column = "tilt", unit = "deg" }
    ... derivative = { column = "gyro", unit = "deg/s" }
    ... [filter]
    ... kind = "first_order"
    ... tau = "0.5 s"
    ... [output]
    ... columns = ["estimate"]
    ... ''')
    >>> filter_frame(pd.DataFrame({"tilt": [1.0, 1.0], "gyro": [0.0, 0.0]}), recipe)
       estimate
    0       1.0
    1       1.0

    A folder of Parquet files, each a log, on whatever Dask runs on:

    >>> import dask.dataframe as dd  # doctest: +SKIP
    >>> logs = dd.read_parquet("logs/", split_row_groups=False, aggregate_files=False)  # doctest: +SKIP
    >>> logs.map_partitions(filter_frame, recipe).to_parquet("results/")  # doctest: +SKIP
    """
    # Labels that are no text are nothing that a recipe can name.
    check_present([name for name in frame.columns if isinstance(name, str)], recipe.columns.all)
    try:
        batch = pa.RecordBatch.from_pandas(frame[recipe.columns.all], preserve_index=False)
    except pa.ArrowException as error:
        raise LogError(f"the frame cannot be read: {reason(error)}") from None
    check_kinds(batch.schema, recipe.columns)
    return Pipeline(recipe, batch.schema).process(batch).to_pandas().set_axis(frame.index)
