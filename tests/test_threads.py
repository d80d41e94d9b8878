"""Threads: a stream is refused to a second call at once, calls let other threads run, and nothing is shared by accident."""

import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import pytest

import compfilt as cf
from designs import assert_same_bits, pickled, precisions, random_signals

FS = 100.0
PI = cf.PiForm(2.0, 1.0)
AT_WORK = "this stream is at work in another call"


@dataclass(frozen=True)
class Kind:
    """What has streams of its own kind, one sample of its two signals, and what else its streams can do."""

    design: object
    sample: tuple[object, object]
    keywords: dict[str, float]
    others: tuple[str, ...] = ()

    def stream(self):
        return self.design.stream(**self.keywords)

    def block(self, rows):
        """The same sample over and over, so that the order of blocks does not matter."""
        return tuple(np.repeat(np.asarray(signal)[None], rows, axis=0) for signal in self.sample)

    def calls(self, stream):
        """Every way to use a stream."""
        block = self.block(3)
        return {
            "update": lambda: stream.update(*self.sample),
            "process": lambda: stream.process(*block),
            "estimate": lambda: stream.estimate(*block),
            "predict": lambda: stream.predict(self.sample[1]),
            "correct": lambda: stream.correct(self.sample[0]),
            "reset": stream.reset,
            "state": lambda: stream.state,
            "set state": lambda: setattr(stream, "state", self.stream().state),
            "compare": lambda: stream == self.stream(),
            "compare with": lambda: self.stream() == stream,
            "pickle": lambda: pickled(stream),
            "repr": lambda: repr(stream),
        }


UPRIGHT = ([0.1, 0.0, 0.0], [0.0, 0.0, 9.81])
KINDS = {
    "linear": Kind(PI, (1.0, 0.5), {"fs": FS}, ("predict", "correct")),
    "tilt": Kind(cf.TiltFilter(PI), UPRIGHT, {"fs": FS}),
    "Mahony": Kind(cf.Mahony(1.0, 0.1), UPRIGHT, {"fs": FS}),
    "gravity": Kind(cf.GravityFilter(), UPRIGHT, {"fs": FS}),
    "observer": Kind(
        cf.Observer([[0.5]], [[1.0]], [[1.0]], [[0.25]]), ([2.0], [1.0]), {}, ("predict", "correct")
    ),
}
ALWAYS = ("update", "process", "estimate", "reset", "state", "set state")
OBJECTS = ("compare", "compare with", "pickle", "repr")
all_kinds = pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS.keys())
every_call = pytest.mark.parametrize(
    ("kind", "name"),
    [
        pytest.param(kind, call, id=f"{name} {call}")
        for name, kind in KINDS.items()
        for call in (*ALWAYS, *kind.others, *OBJECTS)
    ],
)


def in_another_thread(action):
    """The error that it raised there."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(action).exception()


def side_by_side(action, threads):
    """What the action returned in each of the threads, which start together."""
    start = threading.Barrier(threads)

    def run():
        start.wait()
        return action()

    with ThreadPoolExecutor(threads) as pool:
        return [future.result() for future in [pool.submit(run) for _ in range(threads)]]


def succeeds(call, error, message):
    """Whether it did; if not, this error must be why."""
    try:
        call()
    except error as refused:
        assert str(refused).startswith(message)  # noqa: PT017
        return False
    return True


# ------------------------------------------------------------------------------------------------- one stream, two calls


class Interrupt:
    """An array-like that does something else while a stream asks it for its numbers."""

    def __init__(self, values, action):
        self.values = values
        self.action = action

    def __array__(self, dtype=None, copy=None):
        self.action()
        return self.values


@every_call
@pytest.mark.parametrize("other_thread", [False, True])
def test_a_stream_at_work_refuses_other_calls(kind, name, other_thread):
    """A RuntimeError instead of a race; the call at work is not disturbed. No chance is involved: the second call is
    made while the first one waits for it."""
    stream, alone = kind.stream(), kind.stream()
    call = kind.calls(stream)[name]
    caught = []

    def disturb():
        if other_thread:
            caught.append(in_another_thread(call))
        else:
            with pytest.raises(RuntimeError) as error:
                call()
            caught.append(error.value)

    first, second = kind.block(4)
    got = stream.process(Interrupt(first, disturb), second)
    assert isinstance(caught[0], RuntimeError)
    assert str(caught[0]).startswith(AT_WORK)
    assert_same_bits(np.asarray(got), np.asarray(alone.process(first, second)))
    assert stream.state == alone.state


@every_call
def test_the_same_calls_work_when_nothing_else_does(kind, name):
    kind.calls(kind.stream())[name]()


@all_kinds
def test_no_method_was_forgotten(kind):
    public = {name for name in dir(kind.stream()) if not name.startswith("_")}
    assert public <= {*ALWAYS, *kind.others}


@all_kinds
@pytest.mark.parametrize("samples", [1, 20_000], ids=["update", "process"])
def test_blocks_from_many_threads_go_in_one_after_the_other_or_not_at_all(kind, samples):
    """Whatever the threads' order, the state is that of as many blocks as went in."""
    stream, alone = kind.stream(), kind.stream()
    block = kind.block(samples)
    rounds = 400 if samples == 1 else 10

    def call():
        return stream.update(*kind.sample) if samples == 1 else stream.process(*block)

    def work():
        return sum(succeeds(call, RuntimeError, AT_WORK) for _ in range(rounds))

    went_in = sum(side_by_side(work, 4))
    assert went_in >= 1
    for _ in range(went_in):
        alone.process(*block)
    assert stream.state == alone.state


def test_the_array_protocols_own_error_is_not_swallowed():
    def fail():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        PI.filter(Interrupt(np.zeros(4), fail), np.zeros(4), fs=FS)


# --------------------------------------------------------------------------------------------- designs and arrays shared


@precisions
def test_streams_of_one_design_run_side_by_side(dtype):
    y, u = random_signals(20_000, dtype=dtype)
    expected = PI.filter(y, u, fs=FS)

    def work():
        stream = PI.stream(fs=FS, dtype=dtype)
        return np.concatenate([stream.process(y[n : n + 500], u[n : n + 500]) for n in range(0, 20_000, 500)])

    for result in side_by_side(work, 4):
        assert_same_bits(result, expected)


def test_workers_of_calls_side_by_side_do_not_mix():
    """Each call has threads of its own, which lend nothing to each other."""
    y, u = random_signals(100_000, 16)
    expected = PI.filter(y, u, fs=FS)
    for result in side_by_side(lambda: PI.filter(y, u, fs=FS, workers=2), 3):
        assert_same_bits(result, expected)


def test_one_out_for_two_calls_is_refused_or_written_once():
    y, u = random_signals(100_000)
    expected = PI.filter(y, u, fs=FS)
    out = np.empty_like(y)

    def call():
        PI.filter(y, u, fs=FS, out=out)

    def work():
        message = "out must be writable and not in use elsewhere"
        return sum(succeeds(call, ValueError, message) for _ in range(20))

    assert sum(side_by_side(work, 2)) >= 1
    assert_same_bits(out, expected)


# ------------------------------------------------------------------------------------------------ other threads meanwhile


@pytest.fixture
def no_forced_switches():
    """Threads change only where one lets go of the interpreter by itself."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)
    yield
    sys.setswitchinterval(before)


def counting_during(call):
    """How often another thread, which always lets go again at once, had its turn during the call."""
    turns, stop = 0, False

    def count():
        nonlocal turns
        while not stop:
            turns += 1
            time.sleep(0)

    thread = threading.Thread(target=count)
    thread.start()
    try:
        before = turns
        call()
        return turns - before
    finally:
        stop = True
        thread.join()


LONG = np.zeros(1_000_000)
LONG_CALLS = {
    "filter": lambda: PI.filter(LONG, LONG, fs=FS),
    "filter with every option": lambda: PI.filter(LONG, LONG, fs=FS, period=1.0, input="trapezoid"),
    "estimate": lambda: PI.estimate(LONG, LONG, fs=FS),
    "workers": lambda: PI.filter(LONG.reshape(-1, 4), LONG.reshape(-1, 4), fs=FS, workers=2),
    "stream": lambda: PI.stream(fs=FS).process(LONG, LONG),
}


@pytest.mark.skipif(not getattr(sys, "_is_gil_enabled", lambda: True)(), reason="there is no lock to release")
@pytest.mark.usefixtures("no_forced_switches")
@pytest.mark.parametrize("call", LONG_CALLS.values(), ids=LONG_CALLS.keys())
def test_other_threads_run_meanwhile(call):
    """With the lock held throughout it would be none, in every attempt."""
    assert any(counting_during(call) for _ in range(20))


@pytest.mark.usefixtures("no_forced_switches")
def test_counting_sees_a_lock_that_is_held():
    """The test above can fail."""
    assert not any(counting_during(lambda: np.float64(1.0) + 1.0) for _ in range(20))
