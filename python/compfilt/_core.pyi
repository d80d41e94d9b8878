from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray
from typing_extensions import disjoint_base

__all__ = [
    "Butterworth",
    "Chain",
    "Estimate",
    "FirstOrder",
    "LinearFilter",
    "PiForm",
    "RateFilter",
    "SecondOrderInertial",
    "State",
    "Stream",
    "ThirdOrder",
    "TiltEstimate",
    "TiltFilter",
    "TiltStream",
    "__version__",
    "_debug_build",
    "_flags",
    "_stream",
    "alpha_to_tau",
    "angle_rates",
    "tau_to_alpha",
    "tilt",
]

_Real: TypeAlias = NDArray[np.floating[Any]]
_Rule: TypeAlias = Literal["backward_euler", "matched"]
_Input: TypeAlias = Literal["sample", "trapezoid"]
_Missing: TypeAlias = Literal["coast", "raise"]
_Backwards: TypeAlias = Literal["raise", "restart"]
_Axes: TypeAlias = Literal["flu", "frd", "cube"]

__version__: str
_debug_build: bool
_flags: list[tuple[str, int]]

def alpha_to_tau(alpha: float, fs: float) -> float: ...
def tau_to_alpha(tau: float, fs: float) -> float: ...
def tilt(acc: ArrayLike, *, axes: _Axes = "flu") -> _Real: ...
def angle_rates(angles: ArrayLike, gyr: ArrayLike, *, axes: _Axes = "flu") -> _Real: ...
def _stream(made_by: Any, keywords: dict[str, Any], state: State) -> Any: ...

@final
class State:
    def __new__(
        cls, order: int, dtype: str, time: float | None, kind: str, numbers: list[list[float]]
    ) -> State: ...
    @property
    def kind(self) -> str: ...
    @property
    def order(self) -> int: ...
    @property
    def channels(self) -> int: ...
    @property
    def dtype(self) -> str: ...
    @property
    def time(self) -> float | None: ...
    @property
    def levels(self) -> NDArray[np.float64]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Estimate:
    @property
    def levels(self) -> _Real: ...
    @property
    def level_names(self) -> tuple[str, ...]: ...
    @property
    def angle(self) -> _Real: ...
    @property
    def rate(self) -> _Real: ...
    @property
    def position(self) -> _Real: ...
    @property
    def velocity(self) -> _Real: ...
    @property
    def acceleration(self) -> _Real: ...
    @property
    def bias(self) -> _Real: ...
    @property
    def flags(self) -> NDArray[np.uint8]: ...
    @property
    def counts(self) -> dict[str, int]: ...
    @property
    def state(self) -> State: ...

@final
class Stream:
    def update(self, y: ArrayLike, u: ArrayLike, dt: float | None = None) -> Any: ...
    def process(self, y: ArrayLike, u: ArrayLike, t: ArrayLike | None = None) -> _Real: ...
    def estimate(self, y: ArrayLike, u: ArrayLike, t: ArrayLike | None = None) -> Estimate: ...
    def predict(self, u: ArrayLike, dt: float | None = None) -> Any: ...
    def correct(self, y: ArrayLike) -> Any: ...
    def reset(self, initial: ArrayLike | State | None = None) -> None: ...
    @property
    def state(self) -> State: ...
    @state.setter
    def state(self, value: State) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@disjoint_base
class LinearFilter:
    @property
    def coefficients(self) -> tuple[float, ...]: ...
    @property
    def order(self) -> int: ...
    @property
    def derivative_order(self) -> int: ...
    @property
    def split(self) -> int: ...
    @property
    def level_names(self) -> tuple[str, ...]: ...
    @property
    def poles(self) -> NDArray[np.complex128]: ...
    def filter(
        self,
        measurement: ArrayLike,
        derivative: ArrayLike,
        *,
        fs: float | None = None,
        t: ArrayLike | None = None,
        initial: ArrayLike | State | None = None,
        rule: _Rule = "backward_euler",
        input: _Input = "sample",
        period: float | None = None,
        delay: float = 0.0,
        missing: _Missing = "coast",
        hold: float = 0.1,
        gap_cap: float | None = None,
        backwards: _Backwards = "raise",
        exact: bool = True,
        workers: int = 1,
        out: _Real | None = None,
    ) -> _Real: ...
    def estimate(
        self,
        measurement: ArrayLike,
        derivative: ArrayLike,
        *,
        fs: float | None = None,
        t: ArrayLike | None = None,
        initial: ArrayLike | State | None = None,
        rule: _Rule = "backward_euler",
        input: _Input = "sample",
        period: float | None = None,
        delay: float = 0.0,
        missing: _Missing = "coast",
        hold: float = 0.1,
        gap_cap: float | None = None,
        backwards: _Backwards = "raise",
        exact: bool = True,
        workers: int = 1,
    ) -> Estimate: ...
    def stream(
        self,
        *,
        fs: float | None = None,
        channels: int | None = None,
        dtype: DTypeLike | None = None,
        initial: ArrayLike | State | None = None,
        rule: _Rule = "backward_euler",
        input: _Input = "sample",
        period: float | None = None,
        delay: float = 0.0,
        missing: _Missing = "coast",
        hold: float = 0.1,
        gap_cap: float | None = None,
        backwards: _Backwards = "raise",
        workers: int = 1,
    ) -> Stream: ...
    def frequency_response(
        self, omega: ArrayLike, *, fs: float | None = None, rule: _Rule = "backward_euler"
    ) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class FirstOrder(LinearFilter):
    def __new__(cls, tau: float) -> FirstOrder: ...
    @property
    def tau(self) -> float: ...

@final
class PiForm(LinearFilter):
    def __new__(cls, kp: float, ki: float) -> PiForm: ...
    @property
    def kp(self) -> float: ...
    @property
    def ki(self) -> float: ...

@final
class Butterworth(LinearFilter):
    def __new__(
        cls, omega0: float, order: int = 2, q: float = 1.0, split: int | None = None
    ) -> Butterworth: ...
    @property
    def omega0(self) -> float: ...
    @property
    def q(self) -> float: ...

@final
class ThirdOrder(LinearFilter):
    def __new__(cls, tau: float) -> ThirdOrder: ...
    @classmethod
    def from_gains(cls, k1: float, k2: float, k3: float) -> ThirdOrder: ...
    @classmethod
    def butterworth(cls, omega0: float) -> ThirdOrder: ...

@final
class SecondOrderInertial(LinearFilter):
    def __new__(cls, tau: float) -> SecondOrderInertial: ...
    @classmethod
    def butterworth(cls, omega0: float) -> SecondOrderInertial: ...

@final
class Chain(LinearFilter):
    def __new__(
        cls, coefficients: ArrayLike, derivative_order: int = 1, split: int | None = None
    ) -> Chain: ...

@final
class RateFilter(LinearFilter):
    def __new__(cls, tau: float) -> RateFilter: ...
    @property
    def tau(self) -> float: ...
    @property
    def drift_free(self) -> FirstOrder: ...

@final
class TiltFilter:
    def __new__(
        cls,
        design: LinearFilter,
        *,
        axes: _Axes = "flu",
        rates: Literal["output", "frozen"] = "output",
        at: tuple[float, float] | list[float] | None = None,
    ) -> TiltFilter: ...
    @property
    def design(self) -> LinearFilter: ...
    @property
    def axes(self) -> _Axes: ...
    @property
    def rates(self) -> Literal["output", "frozen"]: ...
    @property
    def at(self) -> tuple[float, float] | None: ...
    def estimate(
        self,
        gyr: ArrayLike,
        acc: ArrayLike,
        *,
        fs: float | None = None,
        t: ArrayLike | None = None,
        initial: ArrayLike | State | None = None,
        rule: _Rule = "backward_euler",
        missing: _Missing = "coast",
        hold: float = 0.1,
        gap_cap: float | None = None,
        backwards: _Backwards = "raise",
    ) -> TiltEstimate: ...
    def stream(
        self,
        *,
        fs: float | None = None,
        dtype: DTypeLike | None = None,
        initial: ArrayLike | State | None = None,
        rule: _Rule = "backward_euler",
        missing: _Missing = "coast",
        hold: float = 0.1,
        gap_cap: float | None = None,
        backwards: _Backwards = "raise",
    ) -> TiltStream: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class TiltEstimate:
    @property
    def angles(self) -> _Real: ...
    @property
    def roll(self) -> _Real: ...
    @property
    def pitch(self) -> _Real: ...
    @property
    def bias(self) -> _Real: ...
    @property
    def levels(self) -> _Real: ...
    @property
    def flags(self) -> NDArray[np.uint8]: ...
    @property
    def counts(self) -> dict[str, int]: ...
    @property
    def state(self) -> State: ...

@final
class TiltStream:
    def update(self, gyr: ArrayLike, acc: ArrayLike, dt: float | None = None) -> _Real: ...
    def process(self, gyr: ArrayLike, acc: ArrayLike, t: ArrayLike | None = None) -> _Real: ...
    def estimate(self, gyr: ArrayLike, acc: ArrayLike, t: ArrayLike | None = None) -> TiltEstimate: ...
    def reset(self, initial: ArrayLike | State | None = None) -> None: ...
    @property
    def state(self) -> State: ...
    @state.setter
    def state(self, value: State) -> None: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...
