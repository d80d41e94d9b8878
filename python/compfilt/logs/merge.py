"""What two parts of a log were like, put together."""

from typing import Any

import numpy as np

from compfilt.logs.clock import LISTED_GAPS

__all__ = ["merge_states"]

State = dict[str, Any]


def merge_states(first: State, second: State) -> State:
    """Return the state of a pipeline that went through both parts, from those of two that went through one each.

    What was counted is added. What a pipeline needs to go on comes from the second.
    """
    return {
        **second,
        "counts": _sums(first["counts"], second["counts"]),
        "faults": np.add(first["faults"], second["faults"]).tolist(),
        "timeline": second["timeline"] and _timelines(first["timeline"], second["timeline"]),
        "lengths": {
            name: np.add(sums, second["lengths"][name]).tolist() for name, sums in first["lengths"].items()
        },
        "signals": [_signals(*pair) for pair in zip(first["signals"], second["signals"], strict=True)],
    }


def _sums(first: dict[str, int], second: dict[str, int]) -> dict[str, int]:
    return {name: first.get(name, 0) + second.get(name, 0) for name in {**first, **second}}


def _timelines(first: State, second: State) -> State:
    return {
        **second,
        "first": first["first"],
        "last": max(first["last"], second["last"]),
        "gaps": first["gaps"] + second["gaps"],
        "listed": (first["listed"] + second["listed"])[:LISTED_GAPS],
        "steps": _steps(first["steps"], second["steps"]),
    }


def _steps(first: State, second: State) -> State:
    shortest, longest = (
        [part[end] for part in (first, second) if part[end] is not None] for end in ("shortest", "longest")
    )
    return {
        "count": first["count"] + second["count"],
        "shortest": min(shortest, default=None),
        "longest": max(longest, default=None),
        "bins": sorted(_sums(dict(first["bins"]), dict(second["bins"])).items()),
    }


def _signals(first: State, second: State) -> State:
    return {
        **second,
        "counts": {
            column: np.add(counts, second["counts"][column]).tolist()
            for column, counts in first["counts"].items()
        },
        "smallest": np.fmin(first["smallest"], second["smallest"]).tolist(),
        "largest": np.fmax(first["largest"], second["largest"]).tolist(),
    }
