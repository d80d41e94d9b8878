"""Systems as objects of SciPy and of python-control, which are imported only here."""

from importlib import import_module
from typing import Any

import numpy as np

from compfilt.interop.system import System

__all__ = ["from_control", "from_scipy", "to_control", "to_scipy"]


def to_scipy(system: System) -> Any:  # noqa: ANN401 - SciPy has no types
    """Return a `scipy.signal.StateSpace`; its ``dt`` is True where the sample period is not stated."""
    signal = _library("scipy.signal", "pip install 'compfilt[design]'")
    period = {} if system.dt == 0.0 else {"dt": system.dt or True}
    return signal.StateSpace(system.A, system.B, system.C, system.D, **period)


def to_control(system: System) -> Any:  # noqa: ANN401 - python-control has no types
    """Return a `control.StateSpace` with the names of inputs, outputs and states."""
    control = _library("control", "pip install control")
    return control.StateSpace(
        system.A,
        system.B,
        system.C,
        system.D,
        True if system.dt is None else system.dt,
        inputs=list(system.inputs),
        outputs=list(system.outputs),
        states=list(system.states),
        remove_useless_states=False,
    )


def from_scipy(system: Any) -> System:  # noqa: ANN401
    """Return the matrices of a system of `scipy.signal`, in any of its representations.

    Raises
    ------
    TypeError
        It is no such system.
    ValueError
        It is discrete and its sample period is not stated.
    """
    signal = _library("scipy.signal", "pip install 'compfilt[design]'")
    if not isinstance(system, signal.lti | signal.dlti):
        raise TypeError(f"system must be a system of scipy.signal, got {type(system).__name__}")
    return _from_matrices(system.to_ss())


def from_control(system: Any) -> System:  # noqa: ANN401
    """Return the matrices of a state space or a transfer function of python-control.

    Raises
    ------
    TypeError
        It is no such system.
    ValueError
        It is discrete and its sample period is not stated.
    """
    control = _library("control", "pip install control")
    if not isinstance(system, control.StateSpace | control.TransferFunction):
        raise TypeError(
            f"system must be a StateSpace or TransferFunction of control, got {type(system).__name__}"
        )
    return _from_matrices(control.ss(system))


def _from_matrices(system: Any) -> System:  # noqa: ANN401
    if system.dt is True:
        raise ValueError("system must state its sample period: its dt is True")
    A, B, C, D = (np.array(part, dtype=np.float64) for part in (system.A, system.B, system.C, system.D))
    return System(A, B, C, D, float(system.dt or 0.0))


def _library(name: str, how: str) -> Any:  # noqa: ANN401
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        wanted = name.partition(".")[0]
        if (error.name or "").partition(".")[0] != wanted:
            raise
        raise ImportError(f"{wanted} is not installed: {how}") from error
