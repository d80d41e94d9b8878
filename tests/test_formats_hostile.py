"""Files made to do harm: little memory, one clear line, nothing of them is run and nothing beside them is read."""

import gzip
import re
import struct
import subprocess
import sys
import zipfile
from types import SimpleNamespace

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from compfilt.logs.check.source import number_columns
from compfilt.logs.errors import LogError, TruncatedLog
from compfilt.logs.readers import Columns, bags, open_log, read_schema
from format_files import FORMATS, SIGNALS, data, write

MEMORY = 150 << 10
"""How many KiB more than the imports a log may take."""

MEASURE = """
import resource, sys
from compfilt.logs.readers import Columns, check_library, open_log
for name in ("text", "npz", "hdf5", "parquet", "arrow"):
    __import__(f"compfilt.logs.readers.{name}")
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
before, rows, error = peak(), 0, None
try:
    with open_log(sys.argv[1], Columns(tuple(sys.argv[2:]))) as reader:
        for batch in reader.batches():
            rows += batch.num_rows
except Exception as caught:
    error = caught
print(rows, peak() - before, type(error).__name__, error)
"""


def measured(path, *columns):
    """Read a log in a process of its own; return its rows, the KiB it took, and what it said."""
    done = subprocess.run(
        [sys.executable, "-c", MEASURE, str(path), *columns],
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    assert done.stdout.count("\n") == 1
    rows, memory, kind, message = done.stdout.strip().split(" ", 3)
    assert len(message) < 1000
    assert kind in ("NoneType", "LogError", "TruncatedLog"), message
    return int(rows), int(memory), message


def read(path, *columns, keep=()):
    with open_log(path, Columns(columns, (), keep)) as reader:
        return pa.Table.from_batches(list(reader.batches()), reader.schema)


@pytest.mark.parametrize("head", [b"", b"t,a\n", b"t,a\n1,2\n"])
def test_a_gigabyte_of_zeros_in_a_megabyte(tmp_path, head):
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(head) + 64 * gzip.compress(bytes(1 << 24)))
    assert path.stat().st_size < 10 << 20
    rows, memory, message = measured(path, "a")
    assert memory < MEMORY
    assert (rows, message) in [
        (0, "a line is longer than 1048576 bytes"),
        (0, "the file holds no rows"),
        (1, "the log cannot be read from line 3 on: a line is longer than 1048576 bytes"),
    ]


def test_more_zeros_in_an_array_than_memory_may_be_taken(tmp_path):
    path = tmp_path / "log.npz"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("a.npy", "w") as file,
    ):
        file.write(npy_header((1 << 25,)))
        zeros = bytes(1 << 24)
        for _ in range(16):
            file.write(zeros)
    rows, memory, message = measured(path, "a")
    assert (rows, message) == (1 << 25, "None")
    assert memory < MEMORY


def npy_header(shape, descr="<f8"):
    text = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


def test_a_row_of_200_megabytes(tmp_path):
    path = tmp_path / "log.csv"
    with path.open("wb") as file:
        file.write(b"t,a\n1,2\n3,4")
        file.seek(200_000_000)  # a hole, which is read as zeros
        file.write(b"\n5,6\n")
    rows, memory, message = measured(path, "a")
    assert memory < MEMORY
    assert (rows, message) == (
        1,
        "the log cannot be read from line 3 on: a line is longer than 1048576 bytes",
    )


def test_a_million_columns(tmp_path):
    path = tmp_path / "log.csv"
    names = ",".join(f"c{i}" for i in range(1_000_000))
    path.write_text(names + "\n" + ",".join("1" for _ in range(1_000_000)) + "\n", encoding="ascii")
    rows, memory, message = measured(path, "c5")
    assert memory < MEMORY
    assert message == "a line is longer than 1048576 bytes"
    path.write_text(names[:1_000_000].rpartition(",")[0] + "\n1\n", encoding="ascii")
    rows, memory, message = measured(path, "colum")
    assert memory < MEMORY
    assert rows == 0
    assert message.startswith('there is no column "colum"')


@pytest.mark.parametrize("ask", [read_schema, number_columns, lambda path: read(path, "t")])
@pytest.mark.parametrize("ending", ["parquet", "arrow"])
def test_a_name_that_is_no_text(tmp_path, ending, ask):
    path = tmp_path / f"log.{ending}"
    with_a_name_that_is_no_text(path, {"t": [0.0, 1.0], "name": [1.0, 2.0]})
    with pytest.raises(LogError, match=r"^the name of a column is not a text in UTF-8$"):
        ask(path)


def test_a_name_that_is_no_text_within_a_column(tmp_path):
    path = tmp_path / "log.arrow"
    with_a_name_that_is_no_text(path, {"t": [0.0, 1.0], "both": [{"name": 1.0}, {"name": 2.0}]})
    assert [column.name for column in number_columns(path)] == ["t"]
    assert read(path, "t").num_rows == 2
    with pytest.raises(LogError, match=r'^column "both" holds struct<.*, not numbers$'):
        read(path, "both")


def with_a_name_that_is_no_text(path, columns):
    """Write a log with a column "name", and put other bytes in place of it."""
    if path.suffix == ".parquet":
        # Otherwise Arrow takes the names from a copy of the schema in the metadata.
        pq.write_table(pa.table(columns), path, store_schema=False)
    else:
        with pa.ipc.new_file(path, pa.table(columns).schema) as writer:
            writer.write_table(pa.table(columns))
    path.write_bytes(path.read_bytes().replace(b"name", b"n\xff\xfee"))


def test_rows_that_are_declared_but_not_there(tmp_path):
    with zipfile.ZipFile(tmp_path / "log.npz", "w") as archive:
        archive.writestr("a.npy", npy_header((10**9,)) + bytes(80))
        archive.writestr("wide.npy", npy_header((10, 10**9)) + bytes(80))
    rows, memory, message = measured(tmp_path / "log.npz", "a")
    assert (rows, message) == (10, "the log cannot be read from row 11 on: an array ends too early")
    assert memory < MEMORY
    rows, memory, message = measured(tmp_path / "log.npz", "wide[5]")
    assert message == 'there is no column "wide[5]"; there are a'
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file.create_dataset("pieces", (10**9,), np.float64, chunks=(1000,))[:10] = 1.0
        file.create_dataset("whole", (10**9,), np.float64)
        file.create_dataset("wide", (10, 10**9), np.float64, chunks=(1, 1000))
        file.create_dataset("thick", (3 * 10**8,), np.uint8, chunks=(3 * 10**8,), compression="gzip")[:10] = 1
    for name, message in [
        ("pieces", 'column "pieces" declares 1000000000 rows, but only 1 of 1000000 pieces are stored'),
        ("whole", 'column "whole" declares 1000000000 rows, but they are not stored'),
        ("wide[7]", 'column "wide[7]" declares 10 rows, but only 0 of 10000000 pieces are stored'),
        ("thick", 'column "thick" is stored in pieces of more than 256 MB'),
    ]:
        with pytest.raises(LogError, match=f"^{re.escape(message)}$"):
            read(tmp_path / "log.h5", name)


def test_a_parquet_file_that_declares_more_rows_than_it_has(tmp_path):
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table({"a": np.zeros(70_000)}), path)
    content = path.read_bytes()
    size = struct.unpack("<I", content[-8:-4])[0] + 8
    footer = content[-size:]
    assert varint(70_000) in footer
    path.write_bytes(content[:-size] + footer.replace(varint(70_000), varint(1_000_000)))
    rows, memory, message = measured(path, "a")
    assert memory < MEMORY
    assert rows in (0, 70_000)
    assert message.startswith("the log cannot be read from row ")


def varint(number):
    """Encode a number of three bytes as Thrift does."""
    twice = 2 * number
    return bytes([twice & 127 | 128, twice >> 7 & 127 | 128, twice >> 14])


def test_many_rows_in_a_small_parquet_file(tmp_path):
    path = tmp_path / "log.parquet"
    with pq.ParquetWriter(path, pa.schema([("a", pa.float64())]), compression="zstd") as writer:
        zeros = pa.table({"a": np.zeros(10**6)})
        for _ in range(30):
            writer.write_table(zeros, row_group_size=10**6)
    assert path.stat().st_size < 1 << 20
    rows, memory, _ = measured(path, "a")
    assert rows == 3 * 10**7
    assert memory < MEMORY


@pytest.mark.parametrize("depth", [60, 500])
def test_types_that_are_nested_deeply(tmp_path, depth):
    held = pa.float64()
    for _ in range(depth):
        held = pa.struct([("a", held)])
    table = pa.table([pa.array([1.0]), pa.array([None], held)], ["a", "b"])
    pq.write_table(table, tmp_path / "log.parquet")
    if depth > 100:
        with pytest.raises(LogError, match="too deeply nested"):
            read(tmp_path / "log.parquet", "a")
        return
    with pa.ipc.new_file(tmp_path / "log.arrow", table.schema) as writer:
        writer.write_table(table)
    for name in ("log.parquet", "log.arrow"):
        assert read(tmp_path / name, "a").num_rows == 1
        with pytest.raises(LogError, match=r'^column "b" holds struct<a: struct<.*\.\.\., not numbers$'):
            read(tmp_path / name, "b")


NAMES = [
    "two\nlines",
    'a "quoted" one',
    "\x1b[2Jcleared",
    "nul\0",
    "\u2028separated",
    "back\\slash",
    300 * "x",
    "ä µ",
]


@pytest.mark.parametrize("name", NAMES)
def test_messages_stay_on_one_line_whatever_a_column_is_called(tmp_path, name):
    table = pa.table({name: ["text"], f"{name}s": ["text"]})
    pq.write_table(table, tmp_path / "log.parquet")
    with pa.ipc.new_file(tmp_path / "log.arrow", table.schema) as writer:
        writer.write_table(table)
    for path in (tmp_path / "log.parquet", tmp_path / "log.arrow"):
        for column in (name, f"{name}x"):
            with pytest.raises(LogError) as error:
                read(path, column)
            message = str(error.value)
            assert message.isprintable()
            assert len(message) < 600
            if name == "ä µ":
                assert '"ä µ' in message


def test_values_stay_on_one_line(tmp_path):
    (tmp_path / "log.csv").write_bytes(b"t,a\n1,2\n2,\x1b[31mred\x07\n3,4\n")
    with pytest.raises(LogError, match=r'^line 3: column "a" holds "\\x1b\[31mred\\x07", not a number$'):
        read(tmp_path / "log.csv", "a")


def test_the_ways_to_write_what_is_no_number(tmp_path):
    words = ["nan", "NaN", "-nan", "NAN", "NA", "N/A", "null", "", "inf", "-inf", "Infinity", "1e400"]
    (tmp_path / "log.csv").write_text("t,a\n" + "".join(f"0,{word}\n" for word in words), encoding="ascii")
    values = read(tmp_path / "log.csv", "a").column("a").to_numpy()
    assert np.isnan(values[:8]).all()
    np.testing.assert_array_equal(values[8:], [np.inf, -np.inf, np.inf, np.inf])


def ulog(*messages):
    text = b"ULog\x01\x12\x35\x01" + bytes(8)
    for kind, content in messages:
        text += struct.pack("<HB", len(content), ord(kind)) + content
    return text


@pytest.mark.parametrize(
    "formats",
    [
        (b"imu:uint64_t timestamp;imu next;",),
        (b"imu:uint64_t timestamp;b[60000] x;", b"b:c[60000] x;", b"c:float[60000] x;"),
        (b"imu:uint64_t timestamp;float x;", b"other:other[60000] x;"),
        tuple(
            f"{name}:{below} x;{below} y;".encode()
            for name, below in zip("abcdefghijklmnopqrst", "bcdefghijklmnopqrstu", strict=True)
        ),
    ],
)
def test_types_of_a_ulog_that_unfold_without_end(tmp_path, formats):
    path = tmp_path / "log.ulg"
    topics = [("A", bytes(3) + formats[0].partition(b":")[0])]
    path.write_bytes(ulog(("B", bytes(40)), *(("F", form) for form in formats), *topics, ("D", bytes(12))))
    with pytest.raises(LogError, match="declares more than 10000 fields"):
        read(path, f"{formats[0].partition(b':')[0].decode()}.x")


@pytest.mark.parametrize(
    "definitions",
    [
        ["float64[20000] x"],
        [f"t/B{i} x\nt/B{i} y" for i in range(1, 15)] + ["float64 x"],
        ["t/B1[3] unread\nt/B1 x\nt/B1 y", "float64[9000] x"],
    ],
)
def test_types_of_a_bag_that_unfold_without_end(definitions):
    store = get_typestore(Stores.LATEST)
    for number, text in enumerate(definitions):
        store.register(get_types_from_msg(text, f"t/msg/B{number}"))
    with pytest.raises(LogError, match=r'^the type ".*" declares more than 10000 fields$'):
        bags._fields(SimpleNamespace(typestore=store), "t/msg/B0")


@pytest.mark.parametrize("size", [0, 100, 10_000])
@pytest.mark.parametrize(
    "name",
    [
        "log.csv",
        "log.csv.gz",
        "log.parquet",
        "log.arrow",
        "log.npz",
        "log.h5",
        "log.ulg",
        "log.bag",
        "log.db3",
        "log.mcap",
    ],
)
def test_files_of_noise(tmp_path, name, size):
    rng = np.random.default_rng(size)
    begins = {
        "log.csv": b"t,a\n",
        "log.csv.gz": b"\x1f\x8b\x08",
        "log.parquet": b"PAR1",
        "log.arrow": b"ARROW1\0\0",
        "log.npz": b"PK\x03\x04",
        "log.h5": b"\x89HDF\r\n\x1a\n",
        "log.ulg": b"ULog\x01\x12\x35",
        "log.bag": b"#ROSBAG V2.0\n",
        "log.db3": b"SQLite format 3\0",
        "log.mcap": b"\x89MCAP0\r\n",
    }
    for seed in range(5):
        path = tmp_path / f"{seed}{name}"
        path.write_bytes(begins[name] + rng.bytes(size))
        with pytest.raises(LogError) as error:
            read(path, "/imu.x" if name in ("log.bag", "log.db3", "log.mcap") else "imu.x")
        assert str(error.value).isprintable()
        assert not isinstance(error.value, TruncatedLog)


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "bag.v2"])
def test_files_with_wrong_bytes(tmp_path, capfd, name):
    path, names, _ = write(tmp_path, name, data(200))
    content = path.read_bytes()
    rng = np.random.default_rng(7)
    columns = Columns(tuple(names[signal] for signal in SIGNALS), (names["t"],))
    said = []
    for _ in range(30):
        damaged = bytearray(content)
        # The ends of a file, where its index stands, are the likeliest to mislead.
        ends = [*range(min(2000, len(content))), *range(max(0, len(content) - 2000), len(content))]
        for place in (*rng.choice(ends, 2), rng.integers(len(content))):
            damaged[place] = rng.integers(256)
        path.write_bytes(damaged)
        try:
            with open_log(path, columns) as reader:
                assert sum(batch.num_rows for batch in reader.batches()) <= 200
        except LogError as error:
            said.append(str(error))
    assert said
    assert all(message.isprintable() for message in said)
    assert capfd.readouterr().err == ""
