"""The balancing cube: angles and rates from several inertial sensors, as one pipeline of the core's parts."""

from copy import copy
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from compfilt._core import AccelerometerArray, LinearFilter, State, TiltEstimate, TiltFilter, TiltStream
from compfilt.flags import Flags

__all__ = ["Cube", "CubeEstimate", "CubeSample", "CubeStream"]

Real = npt.NDArray[Any]


class CubeSample(NamedTuple):
    """What a :class:`CubeStream` knows after one sample.

    Attributes
    ----------
    angles : ndarray, shape (2,)
        φ2 and φ3 in rad.
    body_rate, gravity : ndarray, shape (3,)
        u_K in rad/s and the specific force of gravity in m/s², body axes.
    wheel_rate : ndarray, shape (3,), or None
        u_R in rad/s, where the wheels' rates were given.

    Examples
    --------
    >>> import numpy as np
    >>> import compfilt as cf
    >>> array = cf.AccelerometerArray([[0, 0, 0], [0.15, 0, 0], [0, 0.15, 0], [0, 0, 0.15]])
    >>> stream = cf.Cube(array, cf.FirstOrder(tau=1.0)).stream(fs=1000.0)
    >>> sample = stream.update(np.zeros((4, 3)), np.full((4, 3), [-9.81, 0.0, 0.0]), wheel=[1.0, 2.0, 3.0])
    >>> sample.wheel_rate
    array([1., 2., 3.])
    """

    angles: Real
    body_rate: Real
    gravity: Real
    wheel_rate: Real | None


@dataclass(frozen=True, eq=False)
class CubeEstimate:
    """All that the cube's pipeline knows after a run.

    Attributes
    ----------
    body_rate : ndarray, shape (n, 3)
        u_K in rad/s: the mean of the gyros in body axes.
    gravity : ndarray, shape (n, 3)
        The specific force of gravity at the pivot in m/s², body axes.
    wheel_rate : ndarray, shape (n, 3), or None
        u_R = u_K + ψ̇ in rad/s, where the wheels' rates were given.
    flags : ndarray of uint8, shape (n,)
        A set of :class:`Flags` a sample.
    tilt : TiltEstimate
        What the filter of the angles knows.

    Examples
    --------
    >>> import numpy as np
    >>> import compfilt as cf
    >>> array = cf.AccelerometerArray([[0, 0, 0], [0.15, 0, 0], [0, 0.15, 0], [0, 0, 0.15]])
    >>> acc = np.full((1, 4, 3), [-9.81, 0.0, 0.0])
    >>> estimate = cf.Cube(array, cf.FirstOrder(tau=1.0)).estimate(np.ones((1, 4, 3)), acc, fs=1000.0)
    >>> estimate.body_rate
    array([[1., 1., 1.]])
    """

    tilt: TiltEstimate
    body_rate: Real
    gravity: Real
    wheel_rate: Real | None
    flags: npt.NDArray[np.uint8]

    @property
    def angles(self) -> Real:
        """φ2 and φ3 in rad, (n, 2)."""
        return self.tilt.angles

    @property
    def phi2(self) -> Real:
        """φ2 in rad, a copy."""
        return self.tilt.roll

    @property
    def phi3(self) -> Real:
        """φ3 in rad, a copy."""
        return self.tilt.pitch

    @property
    def levels(self) -> Real:
        """The levels of both filters, (order, n, 2)."""
        return self.tilt.levels

    @property
    def bias(self) -> Real:
        """The error of the angle rates in rad/s, (n, 2), where the design estimates one."""
        return self.tilt.bias

    @property
    def state(self) -> State:
        """For ``initial=`` of the next call: the pipeline continues as if undisturbed."""
        return self.tilt.state

    @property
    def counts(self) -> dict[str, int]:
        """How many samples carry each flag."""
        return {str(flag.name).lower(): int(np.count_nonzero(self.flags & flag)) for flag in Flags}


@dataclass(frozen=True)
class Cube:
    """The state estimation of a cube that balances on a corner.

        u_K = mean of S_iᵀ ω_i      u_R = u_K + ψ̇      s = Σ W_i f_i      (φ2, φ3) = TiltFilter(u_K, s)

    Every sensor has a gyro and an accelerometer with the same axes. The parts are :class:`AccelerometerArray` and
    :class:`TiltFilter` with the cube's axes; the core has the same pipeline for firmware, with the same bits. Source: the
    balancing cube's sections 1.1 to 1.3.

    Parameters
    ----------
    array : AccelerometerArray
        Where the sensors sit and how they are turned.
    design : LinearFilter
        The filter of both angles, as in :class:`TiltFilter`.
    rates : {"output", "frozen"}
        Where body rates become angle rates: at the filter's own output, or always at the angles ``at``.
    at : sequence of 2 floats, optional
        φ2 and φ3 in rad for frozen rates; (0, 0) where it is left out.
    gyro : {"unknown", "known"}
        Whether the body rate goes into the extraction of gravity: less noise of the accelerometers, but the gyros' error
        enters.

    Raises
    ------
    ValueError
        A parameter breaks its rule, or the array does not give gravity without the rate.

    Examples
    --------
    >>> import numpy as np
    >>> import compfilt as cf
    >>> array = cf.AccelerometerArray([[0, 0, 0], [0.15, 0, 0], [0, 0.15, 0], [0, 0, 0.15]])
    >>> cube = cf.Cube(array, cf.FirstOrder(tau=1.0))
    >>> acc = np.full((100, 4, 3), [-9.81, 0.0, 0.0])
    >>> estimate = cube.estimate(np.zeros((100, 4, 3)), acc, fs=1000.0)
    >>> bool(abs(estimate.angles).max() < 1e-9)
    True
    """

    array: AccelerometerArray
    design: LinearFilter
    rates: Literal["output", "frozen"] = field(default="output", kw_only=True)
    at: tuple[float, float] | None = field(default=None, kw_only=True)
    gyro: Literal["unknown", "known"] = field(default="unknown", kw_only=True)

    def __post_init__(self) -> None:
        """Check the parts against each other."""
        if not isinstance(self.array, AccelerometerArray):
            raise TypeError("array must be an AccelerometerArray")
        if self.gyro not in ("unknown", "known"):
            raise ValueError(f'gyro must be "unknown" or "known", got "{self.gyro}"')
        if self.at is not None:
            at = np.asarray(self.at, np.float64)
            if at.shape != (2,) or not np.isfinite(at).all():
                raise ValueError("at must be two finite angles in rad")
            object.__setattr__(self, "at", tuple(at.tolist()))
        self._extract(np.empty((0, *self.array.positions.shape)), np.empty((0, 3)))
        self.tilt_filter  # noqa: B018 - it checks design, rates and at

    @property
    def tilt_filter(self) -> TiltFilter:
        """The filter of both angles."""
        return TiltFilter(self.design, axes="cube", rates=self.rates, at=self.at)

    def _extract(self, acc: Real, body_rate: Real) -> Real:
        return self.array.gravity(acc, body_rate if self.gyro == "known" else None)

    def estimate(
        self,
        gyr: npt.ArrayLike,
        acc: npt.ArrayLike,
        wheel: npt.ArrayLike | None = None,
        *,
        fs: float | None = None,
        t: npt.ArrayLike | None = None,
        initial: npt.ArrayLike | State | None = None,
        rule: Literal["backward_euler", "matched"] = "backward_euler",
        missing: Literal["coast", "raise"] = "coast",
        hold: float = 0.1,
        gap_cap: float | None = None,
        backwards: Literal["raise", "restart"] = "raise",
    ) -> CubeEstimate:
        """Run over arrays.

        Parameters
        ----------
        gyr : array_like, shape (n, s, 3)
            Every gyro's reading in rad/s, in its sensor's axes. One with NaN is left out of the mean and flagged.
        acc : array_like, shape (n, s, 3)
            Every accelerometer's reading in m/s², in its sensor's axes. NaN in a channel in use: the angles coast.
        wheel : array_like, shape (n, 3), optional
            The wheels' rates ψ̇ relative to the body in rad/s.
        fs, t, initial, rule, missing, hold, gap_cap, backwards
            As in :meth:`TiltFilter.estimate`.

        Raises
        ------
        ValueError
            The shapes do not fit, or a sample is missing and missing is "raise".
        """
        given = [
            _real(x, name) for x, name in ((gyr, "gyr"), (acc, "acc"), (wheel, "wheel")) if x is not None
        ]
        dtype = np.float32 if all(x.dtype == np.float32 for x in given) else np.float64
        parts = _Parts.of(self, gyr, acc, wheel, dtype, complete=missing == "raise")
        tilt = self.tilt_filter.estimate(
            parts.body_rate,
            parts.gravity,
            fs=fs,
            t=t,
            initial=initial,
            rule=rule,
            missing=missing,
            hold=hold,
            gap_cap=gap_cap,
            backwards=backwards,
        )
        return parts.with_angles(tilt)

    def stream(
        self,
        *,
        fs: float | None = None,
        dtype: npt.DTypeLike = np.float64,
        initial: npt.ArrayLike | State | None = None,
        rule: Literal["backward_euler", "matched"] = "backward_euler",
        missing: Literal["coast", "raise"] = "coast",
        hold: float = 0.1,
        gap_cap: float | None = None,
        backwards: Literal["raise", "restart"] = "raise",
    ) -> "CubeStream":
        """Make a pipeline that carries its state: for samples and blocks as they come.

        Parameters are those of :meth:`TiltFilter.stream`.
        """
        tilt = self.tilt_filter.stream(
            fs=fs,
            dtype=dtype,
            initial=initial,
            rule=rule,
            missing=missing,
            hold=hold,
            gap_cap=gap_cap,
            backwards=backwards,
        )
        return CubeStream(self, tilt, np.dtype(dtype), missing == "raise")


@dataclass
class CubeStream:
    """The cube's pipeline at work: samples or blocks go in as they come, the state stays.

    Examples
    --------
    >>> import numpy as np
    >>> import compfilt as cf
    >>> array = cf.AccelerometerArray([[0, 0, 0], [0.15, 0, 0], [0, 0.15, 0], [0, 0, 0.15]])
    >>> stream = cf.Cube(array, cf.FirstOrder(tau=1.0)).stream(fs=1000.0)
    >>> sample = stream.update(np.full((4, 3), [0.0, 0.0, 2.0]), np.full((4, 3), [-9.81, 0.0, 0.0]))
    >>> sample.body_rate
    array([0., 0., 2.])
    """

    cube: Cube
    _tilt: TiltStream
    _dtype: np.dtype[Any]
    _complete: bool

    def update(
        self,
        gyr: npt.ArrayLike,
        acc: npt.ArrayLike,
        wheel: npt.ArrayLike | None = None,
        dt: float | None = None,
    ) -> CubeSample:
        """One sample: gyr and acc (s, 3), wheel (3,); dt in seconds where the stream has no fs."""
        row = None if wheel is None else np.asanyarray(wheel)[None]
        parts = _Parts.of(
            self.cube,
            np.asanyarray(gyr)[None],
            np.asanyarray(acc)[None],
            row,
            self._dtype,
            complete=self._complete,
        )
        angles = self._tilt.update(parts.body_rate[0], parts.gravity[0], dt)
        wheel_rate = None if parts.wheel_rate is None else parts.wheel_rate[0]
        return CubeSample(angles, parts.body_rate[0], parts.gravity[0], wheel_rate)

    def estimate(
        self,
        gyr: npt.ArrayLike,
        acc: npt.ArrayLike,
        wheel: npt.ArrayLike | None = None,
        t: npt.ArrayLike | None = None,
    ) -> CubeEstimate:
        """Run over a block, gyr and acc (n, s, 3), wheel (n, 3); the state is carried on."""
        parts = _Parts.of(self.cube, gyr, acc, wheel, self._dtype, complete=self._complete)
        return parts.with_angles(self._tilt.estimate(parts.body_rate, parts.gravity, t))

    def process(
        self,
        gyr: npt.ArrayLike,
        acc: npt.ArrayLike,
        wheel: npt.ArrayLike | None = None,
        t: npt.ArrayLike | None = None,
    ) -> Real:
        """Run over a block like ``estimate``; returns the angles only, (n, 2)."""
        return self.estimate(gyr, acc, wheel, t).angles

    def __copy__(self) -> "CubeStream":
        """Copy the state too: the two go on apart."""
        return CubeStream(self.cube, copy(self._tilt), self._dtype, self._complete)

    def reset(self, initial: npt.ArrayLike | State | None = None) -> None:
        """Forget the state: wait for the first measurement, or start from ``initial``."""
        self._tilt.reset(initial)

    @property
    def state(self) -> State:
        """The state between two samples; set it to continue from there."""
        return self._tilt.state

    @state.setter
    def state(self, value: State) -> None:
        self._tilt.state = value


def _real(values: npt.ArrayLike, name: str) -> Real:
    """Take an array of real numbers; masked samples are missing."""
    array = np.asanyarray(values)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name} must hold real numbers, got dtype {array.dtype}")
    if isinstance(array, np.ma.MaskedArray):
        array = np.ma.filled(array.astype(np.result_type(array.dtype, np.float32)), np.nan)
    return np.asarray(array)


class _Parts(NamedTuple):
    """What is known before the angles: it needs no state."""

    body_rate: Real
    gravity: Real
    wheel_rate: Real | None
    flags: npt.NDArray[np.uint8]

    @classmethod
    def of(
        cls,
        cube: Cube,
        gyr: npt.ArrayLike,
        acc: npt.ArrayLike,
        wheel: npt.ArrayLike | None,
        dtype: npt.DTypeLike,
        *,
        complete: bool,
    ) -> "_Parts":
        gyr, acc = _real(gyr, "gyr").astype(dtype, copy=False), _real(acc, "acc").astype(dtype, copy=False)
        body_rate = cube.array.body_rate(gyr)
        absent: npt.NDArray[np.bool_] = ~np.isfinite(gyr).all(axis=(1, 2))
        if complete and absent.any():
            raise ValueError(
                f'gyr has a missing sample (NaN or infinite) at row {absent.argmax()}, and missing is "raise"'
            )
        if len(acc) != len(gyr):
            raise ValueError(
                f"gyr and acc must have the same number of samples, got {len(gyr)} and {len(acc)}"
            )
        wheel_rate = None
        if wheel is not None:
            wheel = _real(wheel, "wheel").astype(dtype, copy=False)
            if wheel.shape != body_rate.shape:
                raise ValueError(f"wheel must have the shape {body_rate.shape}, got {wheel.shape}")
            if complete and not np.isfinite(wheel).all():
                row = int((~np.isfinite(wheel)).any(axis=1).argmax())
                raise ValueError(
                    f'wheel has a missing sample (NaN or infinite) at row {row}, and missing is "raise"'
                )
            wheel_rate = body_rate + wheel
        flags = np.where(absent, np.uint8(Flags.SENSOR_MISSING), np.uint8(0))
        return cls(body_rate, cube._extract(acc, body_rate), wheel_rate, flags)  # noqa: SLF001

    def with_angles(self, tilt: TiltEstimate) -> CubeEstimate:
        """Add what the filter of the angles knows."""
        return CubeEstimate(tilt, self.body_rate, self.gravity, self.wheel_rate, self.flags | tilt.flags)
