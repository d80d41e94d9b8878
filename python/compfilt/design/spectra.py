"""Gains from the spectra of both signals' noise."""

from collections.abc import Sequence

from compfilt.checks import sample_rate
from compfilt.design.assess import assessed
from compfilt.design.family import Family, family
from compfilt.design.least import least
from compfilt.design.prediction import NoiseModel
from compfilt.design.result import Designed
from compfilt.design.running import Rule
from compfilt.design.source import Noise

__all__ = ["from_spectra"]

SLOWEST, FASTEST = 1e-6, 0.5
"""Where omega0 is looked for, as a share of the sample rate."""


def from_spectra(
    *,
    measurement: Noise,
    derivative: Noise,
    fs: float,
    walk: float | Sequence[float] = 0.0,
    bias: float = 0.0,
    kind: str = "first_order",
    order: int | None = None,
    split: int | None = None,
    derivative_order: int | None = None,
    rule: Rule = "backward_euler",
) -> Designed:
    """Return the gains with the least predicted error at a sample rate, for noise of any colour.

    It is the rule of S0 (docs/derivations.md) as a number: over all stable filters of the kind, order and split the least
    of ::

        σ² = ∫ |LP|² S_y + |HP|² S_u/ω^(2M) df + walk + bias²

    with the responses of the filter that runs at `fs`. For white noise and fs far above the cut-off it gives the gains of
    `from_densities`.

    Parameters
    ----------
    measurement, derivative : float or Spectrum
        Noise of the measurement and of its derivative: a two-sided density in unit/√Hz, or a spectrum as `compfilt.noise`
        makes it (one-sided). Below its lowest frequency a spectrum counts as flat, and its mean does not count.
    fs : float
        Sample rate in Hz.
    walk : float or sequence of float
        Two-sided density of the random walk of the derivative's bias, in its unit/s/√Hz; beyond what a spectrum shows
        already. Default 0.
    bias : float
        A constant error of the derivative, in its unit. Default 0.
    kind : {"first_order", "pi", "butterworth", "third_order", "second_order_inertial", "chain"}
        "first_order", "butterworth" and "second_order_inertial" (with Butterworth poles) have one free gain, the others
        one for each order.
    order, split : int, optional
        Of "butterworth" and "chain". Default 2, and split = order.
    derivative_order : int, optional
        Of "chain": which derivative of the measurement the second signal is. Default 1.
    rule : {"backward_euler", "matched"}
        How the design becomes gains.

    Returns
    -------
    Designed

    Raises
    ------
    ValueError
        If a number breaks its rule, both signals are not noisy, or the kind does not follow a walking bias.
    TypeError
        If an argument is of another kind.

    Examples
    --------
    A platform that vibrates at 20 Hz disturbs the angle, so the filter gets slower than for the white noise alone:

    >>> import numpy as np
    >>> from types import SimpleNamespace
    >>> from compfilt.design import from_spectra
    >>> frequency = np.linspace(0.0, 50.0, 501)
    >>> density = np.full(501, 2 * 0.01**2)
    >>> density[195:206] += 1.0
    >>> shaken = SimpleNamespace(frequency=frequency, density=density)
    >>> calm = from_spectra(measurement=0.01, derivative=0.01, fs=100.0).design
    >>> shaken = from_spectra(measurement=shaken, derivative=0.01, fs=100.0).design
    >>> round(calm.tau, 2), round(shaken.tau, 2)
    (1.0, 1.7)
    """
    chosen = family(kind, order, split, derivative_order)
    rate = sample_rate("fs", fs)
    noise = NoiseModel.of(measurement, derivative, walk, bias)
    _check_noise(noise, chosen)
    design, at_end = least(
        chosen,
        lambda design: noise.predict(design, rate, rule).sigma,
        SLOWEST * rate,
        FASTEST * rate,
    )
    result = assessed(design, noise, rate, rule)
    return (
        result.with_warning("the best gains lie at the end of the search: one signal is nearly all noise")
        if at_end
        else result
    )


def _check_noise(noise: NoiseModel, chosen: Family) -> None:
    if noise.measurement.silent:
        raise ValueError("measurement must have noise: without any the measurement alone is best")
    if noise.derivative.silent and not noise.walk and not noise.bias:
        raise ValueError("derivative must have noise: without any the derivative alone is best")
    if len(noise.walk) > chosen.walks_absorbed:
        raise ValueError(
            f"walk must be left out for kind {chosen.kind!r} of order {chosen.order} and split {chosen.split}: its error "
            "would grow without bound; use 'pi', or a split of at least 2"
        )
