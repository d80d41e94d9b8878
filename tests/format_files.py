"""One log in every format that can be read, each file made by a library that is not the one under test where there is one."""

import gzip
import io
import struct

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet as pq
from rosbags.rosbag1 import Writer as Bag1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2
from rosbags.typesys import Stores, get_typestore

SIGNALS = ("gx", "gy", "gz", "ax", "ay", "az")

RECIPE = """
version = 1
[log]
time = {{ column = "{t}", unit = "{unit}" }}
gyro = {{ columns = ["{gx}", "{gy}", "{gz}"], unit = "deg/s" }}
accelerometer = {{ columns = ["{ax}", "{ay}", "{az}"], unit = "g" }}
axes = "flu"
{log}
[filter]
kind = "tilt"
design = {{ kind = "pi", kp = 2.0, ki = 0.5 }}
[policy]
gap = {{ longer_than = "1 s", do = "reset" }}
[output]
columns = ["roll", "pitch", "bias", "flags"]
unit = "deg"
"""

PLAIN = {name: name for name in ("t", *SIGNALS)}
NESTED = {"t": "imu/t"} | {
    f"{kind}{axis}": f"imu/{kind}[{i}]" for kind in "ga" for i, axis in enumerate("xyz")
}
TABLES = {"t": "t"} | {f"{kind}{axis}": f"{kind}[{i}]" for kind in "ga" for i, axis in enumerate("xyz")}
ULOG = {"t": "imu[1].timestamp"} | {
    f"{kind}{axis}": f"imu[1].sensor.{kind}[{i}]" for kind in "ga" for i, axis in enumerate("xyz")
}
ROS = {"t": "/imu/data.header.stamp"} | {
    f"{kind}{axis}": f"/imu/data.{field}.{axis}"
    for kind, field in (("g", "angular_velocity"), ("a", "linear_acceleration"))
    for axis in "xyz"
}


def data(n=2000, seed=0):
    """Time in µs from some epoch, with a gap and a repeated time; missing numbers."""
    rng = np.random.default_rng(seed)
    t = 1_700_000_000_000_000 + np.cumsum(rng.integers(5_000, 15_000, n))
    t[n // 2 :] += 5_000_000
    t[n // 4] = t[n // 4 - 1]
    columns = {"t": t}
    for name in SIGNALS:
        columns[name] = rng.normal(1.0 if name == "az" else 0.0, 0.3, n)
        columns[name][rng.integers(0, n, n // 50)] = np.nan
    return columns


def recipe(names=PLAIN, unit="us", log=""):
    return RECIPE.format(**names, unit=unit, log=log)


def table(columns):
    return pa.table({"unused": np.zeros(len(columns["t"])), **columns})


def write_csv(path, columns, separator=","):
    with io.StringIO() as text:
        text.write(separator.join(columns) + "\n")
        for row in zip(*(column.tolist() for column in columns.values()), strict=True):
            text.write(separator.join("" if value != value else repr(value) for value in row) + "\n")
        content = text.getvalue().encode()
    if path.suffix == ".gz":
        content = gzip.compress(content)
    if path.suffix == ".zst":
        with pa.CompressedOutputStream(pa.OSFile(str(path), "wb"), "zstd") as file:
            file.write(content)
    else:
        path.write_bytes(content)


def write_parquet(path, columns):
    pq.write_table(table(columns), path, row_group_size=300)


def write_arrow(path, columns):
    with pa.ipc.new_file(path, table(columns).schema) as writer:
        writer.write_table(table(columns), 300)


def write_stream(path, columns):
    with pa.ipc.new_stream(path, table(columns).schema) as writer:
        writer.write_table(table(columns), 300)


def write_feather(path, columns):
    pyarrow.feather.write_feather(table(columns), path, compression="zstd", chunksize=300)


def write_npz(path, columns):
    np.savez(path, **columns)


def write_packed_npz(path, columns):
    np.savez_compressed(
        path, g=stacked("g", columns), a=np.asfortranarray(stacked("a", columns)), t=columns["t"]
    )


def write_hdf5(path, columns):
    with h5py.File(path, "w") as file:
        group = file.create_group("imu")
        group["t"] = columns["t"]
        group.create_dataset("g", data=stacked("g", columns), chunks=(70, 2), compression="gzip")
        group.create_dataset("a", data=stacked("a", columns).astype(">f8"))


def stacked(kind, columns):
    return np.column_stack([columns[f"{kind}{axis}"] for axis in "xyz"])


def write_ulog(path, columns):
    """Write a ULog by the description of the format, since its library has no means to make one."""
    with path.open("wb") as file:

        def message(kind, content):
            file.write(struct.pack("<HB", len(content), ord(kind)) + content)

        file.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1))
        message("B", bytes(40))
        message("F", b"imu:uint64_t timestamp;vectors sensor;uint8_t[2] _padding0;")
        message("F", b"vectors:double[3] g;double[3] a;")
        message("F", b"other:uint64_t timestamp;float x;")
        key = b"char[4] sys_name"
        message("I", bytes([len(key)]) + key + b"test")
        for number, (instance, name) in enumerate([(0, b"imu"), (1, b"imu"), (0, b"other")]):
            message("A", struct.pack("<BH", instance, number) + name)
        for i, t in enumerate(columns["t"].tolist()):
            values = [columns[name][i] for name in SIGNALS]
            message("D", struct.pack("<HQ6d", 1, t, *values))
            message("D", struct.pack("<HQf", 2, t, 0.5))
            if i % 3 == 0:
                message("D", struct.pack("<HQ6d", 0, t, *[0.0] * 6))
            if i % 500 == 0:
                message("S", bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12]))


def imu_messages(store, columns, *, first):
    """Yield the time in ns and the message of every row."""
    types = store.types
    vector, header = types["geometry_msgs/msg/Vector3"], types["std_msgs/msg/Header"]
    for i, t in enumerate((1000 * columns["t"]).tolist()):
        stamp = types["builtin_interfaces/msg/Time"](sec=t // 10**9, nanosec=t % 10**9)
        number = {"seq": i} if first else {}
        yield (
            t,
            types["sensor_msgs/msg/Imu"](
                header=header(stamp=stamp, frame_id="imu", **number),
                orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
                orientation_covariance=np.zeros(9),
                angular_velocity=vector(*(columns[name][i] for name in ("gx", "gy", "gz"))),
                angular_velocity_covariance=np.arange(9.0),
                linear_acceleration=vector(*(columns[name][i] for name in ("ax", "ay", "az"))),
                linear_acceleration_covariance=np.zeros(9),
            ),
        )


def write_bag(path, columns, **options):
    store = get_typestore(Stores.ROS1_NOETIC)
    with Bag1(path, **options) as bag:
        imu, other = (bag.add_connection(f"/imu/{name}", IMU, typestore=store) for name in ("data", "raw"))
        for t, message in imu_messages(store, columns, first=True):
            content = store.serialize_ros1(message, IMU)
            bag.write(imu, t + 5, content)
            bag.write(other, t + 6, content)


def write_bag2(path, columns, plugin=StoragePlugin.SQLITE3):
    """Write a ROS 2 bag, which is a folder."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Bag2(path, version=9, storage_plugin=plugin) as bag:
        imu, other = (bag.add_connection(f"/imu/{name}", IMU, typestore=store) for name in ("data", "raw"))
        for t, message in imu_messages(store, columns, first=False):
            content = store.serialize_cdr(message, IMU)
            bag.write(imu, t + 5, content)
            bag.write(other, t + 6, content)


def write_db3(path, columns):
    _take_out(path, columns, StoragePlugin.SQLITE3)


def write_mcap(path, columns):
    _take_out(path, columns, StoragePlugin.MCAP)


def _take_out(path, columns, plugin):
    """Write a bag, and keep the one file in it that holds the messages."""
    folder = path.with_name(f"{path.name}.folder")
    write_bag2(folder, columns, plugin)
    (file,) = folder.glob(f"*{path.suffix}")
    file.rename(path)
    (folder / "metadata.yaml").unlink()
    folder.rmdir()


IMU = "sensor_msgs/msg/Imu"

FORMATS = {
    "log.csv": (write_csv, PLAIN, "us"),
    "log.csv.gz": (write_csv, PLAIN, "us"),
    "log.csv.zst": (write_csv, PLAIN, "us"),
    "log.tsv": (lambda path, columns: write_csv(path, columns, "\t"), PLAIN, "us"),
    "log.parquet": (write_parquet, PLAIN, "us"),
    "log.arrow": (write_arrow, PLAIN, "us"),
    "log.ipc": (write_stream, PLAIN, "us"),
    "log.feather": (write_feather, PLAIN, "us"),
    "log.npz": (write_npz, PLAIN, "us"),
    "packed.npz": (write_packed_npz, TABLES, "us"),
    "log.h5": (write_hdf5, NESTED, "us"),
    "log.ulg": (write_ulog, ULOG, "us"),
    "log.bag": (write_bag, ROS, "ns"),
    "bag.v2": (write_bag2, ROS, "ns"),
    "log.db3": (write_db3, ROS, "ns"),
    "log.mcap": (write_mcap, ROS, "ns"),
}
"""Every format: how it is written, how the columns are named in it, and the unit of the time."""


def write(folder, name, columns):
    """Write a log; return its path, the names of its columns, and the unit of its time."""
    write_format, names, unit = FORMATS[name]
    path = folder / name
    write_format(path, columns)
    return path, names, unit
