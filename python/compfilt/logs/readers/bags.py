"""ROS bags and MCAP files: a column is a field of a topic's messages, ``/imu/data.angular_velocity.x``.

Besides the fields there is ``/imu/data.receive_time``. Times of two fields, as in ``header.stamp``, are one column. Both
are whole numbers of nanoseconds.
"""

import contextlib
import functools
import itertools
import operator
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from compfilt.logs.errors import LogError, TruncatedLog, quoted
from compfilt.logs.readers.base import (
    MOST_FIELDS,
    Columns,
    LogReader,
    Reading,
    check_kinds,
    check_present,
    check_rows,
    plain_errors,
    reason,
    rows_or_truncated,
    size_of,
)
from compfilt.logs.readers.mended import MendedMcap, is_cut

__all__ = ["open_reader", "read_columns"]

RECEIVE_TIME = "receive_time"
"""The column that holds when a message was recorded."""

DEEPEST = 20
"""How deep types may lie in each other."""

BROKEN = (Exception,)
"""What rosbags raises on damaged files: besides its own errors those of SQLite, zstd, lz4, bz2 and of Python itself."""

TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
"""The types that are read as one column."""

BEGINS = {b"#ROSBAG V": ".bag", b"SQLite format 3\0": ".db3", b"\x89MCAP0\r\n": ".mcap"}
"""How bags begin, and the endings by which rosbags knows them."""


_SystemPath: Any = type(Path())
"""Before Python 3.12 only the class of this system can have classes below it."""


class _BagPath(_SystemPath):  # type: ignore[misc]
    """A path with the ending that rosbags asks for, whatever the file is called."""

    ending = ""

    @property
    def suffix(self) -> str:
        return self.ending


class _Field(NamedTuple):
    """A field of a message, or of a message within it."""

    take: Callable[[Any], Any]
    type: Any


def read_columns(path: Path) -> pa.Schema:
    """Read which columns a bag has."""
    with _opened(path) as bag:
        return pa.schema(
            [
                (f"{connection.topic}.{name}", field.type)
                for connection in {connection.topic: connection for connection in bag.connections}.values()
                for name, field in _fields(bag, connection.msgtype).items()
            ]
        )


@contextlib.contextmanager
def open_reader(path: Path, columns: Columns, _batch_bytes: int, batch_rows: int) -> Iterator[LogReader]:
    """Open a bag; its messages are read in the order in which they were recorded."""
    topic = _one_topic(columns)
    cut = _is_cut_mcap(path)
    with _opened(path) as bag:
        connections = [connection for connection in bag.connections if connection.topic == topic]
        if not connections:
            _fail_without(topic, [connection.topic for connection in bag.connections])
        kinds = {connection.msgtype for connection in connections}
        if len(kinds) > 1:
            raise LogError(
                f"the topic {quoted(topic)} has messages of several types: {', '.join(sorted(kinds))}"
            )
        fields = {f"{topic}.{name}": field for name, field in _fields(bag, kinds.pop()).items()}
        check_present(list(fields), columns.all)
        schema = pa.schema([(name, fields[name].type) for name in columns.all])
        check_kinds(schema, columns)
        count = sum(connection.msgcount for connection in connections)
        check_rows(count)
        takes = [fields[name].take for name in columns.all]
        done = 0

        def rows() -> Iterator[tuple[Any, ...]]:
            for connection, time, data in bag.messages(connections):
                message = _Message(bag.deserialize(data, connection.msgtype), time)
                yield tuple(take(message) for take in takes)

        def batches() -> Iterator[pa.RecordBatch]:
            nonlocal done
            for batch in rows_or_truncated(_gathered(rows(), schema, batch_rows), *BROKEN):
                done += batch.num_rows
                yield batch
            if cut:
                raise TruncatedLog(done, "the file ends too early")

        size = size_of(path)
        yield Reading(schema, size, batches, lambda: size * done // count)


class _Message(NamedTuple):
    """A message and when it was recorded."""

    content: Any
    time: int


def _gathered(rows: Iterator[tuple[Any, ...]], schema: pa.Schema, count: int) -> Iterator[pa.RecordBatch]:
    """Put rows together to batches; those before an error are a batch too."""
    held: list[tuple[Any, ...]] = []
    failure: Exception | None = None
    while failure is None:
        try:
            held.append(next(rows))
        except StopIteration:
            break
        except BROKEN as error:
            failure = error
        if len(held) >= count:
            yield _batch(held, schema)
            held = []
    if held:
        yield _batch(held, schema)
    if failure is not None:
        raise failure


def _batch(rows: list[tuple[Any, ...]], schema: pa.Schema) -> pa.RecordBatch:
    arrays = [
        pa.array(values, field.type) for values, field in zip(zip(*rows, strict=True), schema, strict=True)
    ]
    return pa.RecordBatch.from_arrays(arrays, schema=schema)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[AnyReader]:
    shown: Any = path
    if _is_cut_mcap(path):
        shown = MendedMcap(path)
    elif not path.is_dir():
        shown = _BagPath(path)
        shown.ending = _ending(path)
    with plain_errors(*BROKEN):
        # Bags of older releases of ROS 2 do not hold the types of their messages.
        bag = AnyReader([shown], default_typestore=get_typestore(Stores.LATEST))
        try:
            bag.open()
        except AnyReaderError as error:
            if shown.suffix == ".bag" and "index" in str(error):
                raise LogError(
                    f"the bag has no index, or a damaged one: {reason(error)}; rosbag reindex makes it anew"
                ) from None
            raise
    try:
        yield bag
    finally:
        bag.close()


def _ending(path: Path) -> str:
    """Return the ending that a bag should have: by its first bytes, or where these are damaged by the one it has."""
    with plain_errors(), path.open("rb") as file:
        begins = file.read(16)
    told = (ending for magic, ending in BEGINS.items() if begins.startswith(magic))
    return next(told, path.suffix.lower())


def _is_cut_mcap(path: Path) -> bool:
    return not path.is_dir() and _ending(path) == ".mcap" and is_cut(path)


def _one_topic(columns: Columns) -> str:
    """Return the topic of all columns."""
    topics: dict[str, str] = {}
    for name in columns.all:
        topic, dot, field = name.partition(".")
        if not (topic and dot and field):
            raise LogError(f'{quoted(name)} is no column of a bag, which are named "/topic.field"')
        topics.setdefault(topic, name)
    if len(topics) > 1:
        first, second = list(topics.values())[:2]
        raise LogError(
            f"columns {quoted(first)} and {quoted(second)} are of two topics, which have times of their own: "
            "choose all columns, the time too, from one"
        )
    return next(iter(topics))


def _fail_without(topic: str, present: list[str]) -> None:
    try:
        check_present(sorted(set(present)), [topic])
    except LogError as error:
        raise LogError(str(error).replace("column", "topic", 1)) from None


def _fields(bag: AnyReader, kind: str) -> dict[str, _Field]:
    """List the columns of a type of message."""
    receive_time = _Field(operator.attrgetter("time"), pa.int64())
    found = {RECEIVE_TIME: receive_time}
    with plain_errors(*BROKEN):
        found |= {
            name: _Field(_composed(take), held)
            for name, take, held in _below(bag.typestore.fielddefs, kind, 0, itertools.count(1))
        }
    return found


def _composed(take: Callable[[Any], Any]) -> Callable[[_Message], Any]:
    return lambda message: take(message.content)


def _below(
    types: Any,  # noqa: ANN401
    kind: str,
    depth: int,
    seen: Iterator[int],
) -> Iterator[tuple[str, Callable[[Any], Any], Any]]:
    """List the fields of a type: name, how to take it out of a message, and its type in Arrow; `seen` numbers them."""
    if depth > DEEPEST:
        raise LogError(f"the type {quoted(kind)} is nested too deeply")
    for name, (node, described) in types[kind][1]:
        take = operator.attrgetter(name)
        _count(seen, kind)
        if node == Nodetype.BASE:
            yield name, take, _arrow(described[0])
        elif node == Nodetype.NAME and described in TIMES:
            yield name, functools.partial(_nanoseconds, take), pa.int64()
        elif node == Nodetype.NAME:
            for below, deeper, held in _below(types, described, depth + 1, seen):
                yield f"{name}.{below}", functools.partial(_through, take, deeper), held
        elif node == Nodetype.ARRAY and described[0][0] == Nodetype.BASE:
            for i in range(described[1]):
                _count(seen, kind)
                yield f"{name}[{i}]", functools.partial(_element, take, i), _arrow(described[0][1][0])


def _count(seen: Iterator[int], kind: str) -> None:
    if next(seen) > MOST_FIELDS:
        raise LogError(f"the type {quoted(kind)} declares more than {MOST_FIELDS} fields")


def _through(outer: Callable[[Any], Any], inner: Callable[[Any], Any], message: Any) -> Any:  # noqa: ANN401
    return inner(outer(message))


def _element(take: Callable[[Any], Any], i: int, message: Any) -> Any:  # noqa: ANN401
    return take(message)[i]


def _nanoseconds(take: Callable[[Any], Any], message: Any) -> int:  # noqa: ANN401
    time = take(message)
    return int(time.sec) * 1_000_000_000 + int(time.nanosec)


def _arrow(name: str) -> Any:  # noqa: ANN401 - a type of Arrow
    """Return Arrow's type for one of ROS."""
    if match := re.fullmatch(r"(u?int|float)(8|16|32|64)", name):
        return getattr(pa, name if match[1] != "float" else f"float{match[2]}")()
    return {"bool": pa.bool_(), "byte": pa.uint8(), "char": pa.uint8()}.get(name, pa.string())
