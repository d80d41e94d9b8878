"""Motion in a recording that should be at rest: it is found, and rest is not taken for it."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import noises
from compfilt import noise, simulate
from compfilt.noise import NotAtRest, Span, find_motion, longest_rest

FS = 100.0


@pytest.mark.parametrize("fs", [10.0, 100.0, 1000.0])
@pytest.mark.parametrize("step", [0.0, 0.002, 0.02])
def test_rest_is_no_motion(fs, step):
    """White noise with a drift, whatever the rate and the resolution of the sensor."""
    rng = np.random.default_rng(1)
    count = round(200 * fs)
    gyro, acc = noises.still(count, fs, rng)
    gyro += np.column_stack([noises.walk(2e-5, fs, count, rng) for _ in range(3)])
    if step:
        gyro, acc = np.round(gyro / step) * step, np.round(acc / step) * step
    assert find_motion(gyro, acc, fs=fs) == ()


@settings(max_examples=25)
@given(
    st.integers(0, 2),
    st.floats(20.0, 50.0),
    st.floats(1.5, 10.0),
    st.floats(0.02, 1.0),
    st.integers(0, 2**32 - 1),
)
def test_a_turn_is_found(axis, start, lasts, rate, seed):
    """From about where it starts to about where it ends, a window being half a second."""
    gyro, acc = noises.still(8000, FS, np.random.default_rng(seed))
    t = np.arange(8000) / FS
    gyro[(t >= start) & (t < start + lasts), axis] += rate
    spans = find_motion(gyro, acc, fs=FS)
    assert spans[0].start == pytest.approx(start, abs=1.01)
    assert spans[-1].end == pytest.approx(start + lasts, abs=1.01)
    # In between a steady turn about the vertical is as quiet as a rest.
    assert all(start - 1.01 <= span.start <= span.end <= start + lasts + 1.01 for span in spans)


def test_a_knock_is_found():
    gyro, acc = noises.still(8000, FS, np.random.default_rng(2))
    acc[4321] += [0.0, 0.5, 0.0]
    (span,) = find_motion(gyro, acc, fs=FS)
    assert span.start <= 43.21 <= span.end
    assert span.end - span.start <= 1.0


def test_what_never_rests_is_motion_all_the_time():
    """A hand that trembles, and a body that leans over so slowly that no window shows it."""
    rng = np.random.default_rng(3)
    gyro, acc = noises.still(6000, FS, rng)
    t = np.arange(6000) / FS
    shaken = gyro + 0.3 * np.sin(2 * np.pi * 1.7 * t)[:, None]
    assert find_motion(shaken, acc, fs=FS) == (Span(0.0, 60.0),)
    lean = np.radians(5.0) * t / 60.0
    leaning = acc + 9.8 * np.column_stack([np.sin(lean), 0 * lean, np.cos(lean) - 1.0])
    assert find_motion(gyro, leaning, fs=FS) == (Span(0.0, 60.0),)


def test_the_rests_of_a_simulated_drive():
    """The static test of the child seat has three moves of 1.5 s; then the car drives to the end."""
    log = simulate.child_seat(duration=150.0, seed=1)
    gyro = np.radians(np.column_stack([log[name] for name in ("gx", "gy", "gz")]))
    acc = 9.80665 * np.column_stack([log[name] for name in ("ax", "ay", "az")])
    spans = find_motion(gyro, acc, fs=FS)
    moved = [span for span in spans if span.end < 60.0]
    for span, start in zip(moved, (12.0, 27.0, 45.0), strict=True):
        assert span.start == pytest.approx(start, abs=0.6)
        assert span.end == pytest.approx(start + 1.5, abs=0.6)
    assert spans[-1].end == 150.0
    assert 59.0 < spans[3].start < 62.0


def test_the_longest_rest():
    motion = (Span(0.0, 2.0), Span(10.0, 12.0))
    assert longest_rest(motion, 15.0) == Span(2.0, 10.0)
    assert longest_rest((), 15.0) == Span(0.0, 15.0)
    assert longest_rest((Span(0.0, 15.0),), 15.0) is None


def test_a_refusal_names_the_times():
    error = NotAtRest([Span(i, i + 0.5) for i in range(10, 17)])
    assert str(error) == (
        "not at rest from 10.0 s to 10.5 s, 11.0 s to 11.5 s, 12.0 s to 12.5 s, 13.0 s to 13.5 s, 14.0 s to 14.5 s and 2 times more"
    )
    assert pickle.loads(pickle.dumps(error)).motion == error.motion


def test_shapes_are_checked():
    gyro, acc = noises.still(100, FS, np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"^gyro must have the shape \(n, 3\), got \(100,\)$"):
        find_motion(gyro[:, 0], acc, fs=FS)
    with pytest.raises(ValueError, match=r"^gyro and acc must be equally long, not 100 and 90$"):
        find_motion(gyro, acc[:90], fs=FS)
    with pytest.raises(ValueError, match=r"^gyro and acc must be equally long"):
        noise.analyse(gyro, acc[:90], fs=FS)
