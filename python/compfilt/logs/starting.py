"""The stream of a recipe's filter, and the precision in which it computes."""

from typing import Any

import numpy as np
import pyarrow as pa

from compfilt.logs.errors import RecipeError
from compfilt.logs.recipe import Recipe

__all__ = ["dtype_of", "start_stream"]


def dtype_of(recipe: Recipe, schema: pa.Schema | None) -> type[np.floating]:
    """float32 if every signal is, otherwise float64."""
    single = schema is not None and all(
        schema.field(name).type == pa.float32() for name in recipe.signal_columns
    )
    return np.float32 if single else np.float64


def start_stream(recipe: Recipe, dtype: type[np.floating], **options: Any) -> Any:  # noqa: ANN401 - any stream
    """Make the filter and a stream of it; what the core refuses is an error of the recipe."""
    # Missing samples have been judged before they come here.
    policy: dict[str, Any] = {"missing": "coast", **options}
    if recipe.policy.hold is not None:
        policy["hold"] = recipe.policy.hold
    try:
        return recipe.filter.start(recipe.clock.rate, dtype, **policy)
    except (ValueError, TypeError) as error:
        raise RecipeError(f"{recipe.source}: [filter] {error}") from None
