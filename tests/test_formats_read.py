"""Every format gives what the same data give as Parquet, to the bit; what cannot be read is named."""

import importlib.util
import subprocess
import sys

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from compfilt.logs import parse_recipe, run_log
from compfilt.logs.errors import LogError, UsageError
from compfilt.logs.readers import Columns, check_library, open_log, read_schema
from compfilt.logs.run import plan
from format_files import FORMATS, PLAIN, SIGNALS, ULOG, data, recipe, table, write, write_csv


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Every format, written once."""
    folder = tmp_path_factory.mktemp("formats")
    return {name: write(folder, name, data()) for name in FORMATS}


def read(path, columns, **options):
    with open_log(path, columns, **options) as reader:
        batches = list(reader.batches())
        assert all(batch.schema.equals(reader.schema) for batch in batches)
        assert reader.position() == reader.size
    return pa.Table.from_batches(batches, reader.schema)


def wanted(names):
    return Columns(tuple(names[name] for name in SIGNALS), (names["t"],))


def result(path, text, out, **options):
    summary = run_log(parse_recipe(text), path, out, **options)
    return pq.read_table(out), summary


def same_bits(one, other):
    assert one.column_names == other.column_names
    for name in one.column_names:
        assert one.column(name).to_numpy().tobytes() == other.column(name).to_numpy().tobytes(), name


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("rows", [1 << 16, 97])
def test_every_format_gives_the_bits_of_parquet(files, tmp_path, name, rows):
    path, names, unit = files[name]
    columns = data()
    columns["t"] = columns["t"] * (1000 if unit == "ns" else 1)
    pq.write_table(pa.table(columns), tmp_path / "same.parquet")
    expected, summary = result(tmp_path / "same.parquet", recipe(PLAIN, unit), tmp_path / "expected.parquet")
    out, found = result(
        path, recipe(names, unit), tmp_path / "out.parquet", batch_rows=rows, batch_bytes=100 * rows
    )
    assert (found.rows, found.gaps, found.counts) == (summary.rows, summary.gaps, summary.counts)
    assert summary.rows == 2000
    assert summary.gaps == 1
    same_bits(out, expected)


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_has_its_columns_in_the_order_in_which_they_are_asked_for(files, name):
    path, names, unit = files[name]
    out = read(path, wanted(names), batch_rows=333, batch_bytes=10_000)
    assert out.column_names == wanted(names).all
    for key in SIGNALS:
        np.testing.assert_array_equal(out.column(names[key]).to_numpy(), data()[key])
    np.testing.assert_array_equal(
        out.column(names["t"]).to_numpy(), data()["t"] * (1000 if unit == "ns" else 1)
    )
    assert set(wanted(names).all) <= set(read_schema(path).names) | {
        name for name in ULOG.values() if "[1]" in name
    }


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_proposes_a_column_that_is_written_nearly_so(files, name):
    path, names, _ = files[name]
    slip = names["gx"].replace("gx", "gxx").replace("velocity", "velocitty").replace("g[", "gg[")
    with pytest.raises(LogError, match="there is no column") as error:
        read(path, Columns((slip,)))
    assert f'(is it "{names["gx"]}"' in str(error.value).replace('" or "', '"(is it "')


@pytest.mark.parametrize("name", FORMATS)
def test_the_position_grows_to_the_size(files, name):
    path, names, _ = files[name]
    with open_log(path, wanted(names), batch_rows=100, batch_bytes=5000) as reader:
        positions = [reader.position() for _ in reader.batches()]
        positions.append(reader.position())
    assert positions == sorted(positions)
    assert positions[-1] == reader.size
    if ".csv" not in name and ".tsv" not in name:  # Arrow reads some blocks of a text ahead
        assert len(set(positions)) > 5


def test_separators(tmp_path):
    write_csv(tmp_path / "log.csv", data(100), ";")
    text = recipe(log='separator = ";"')
    out, _ = result(tmp_path / "log.csv", text, tmp_path / "out.parquet")
    write_csv(tmp_path / "comma.csv", data(100))
    expected, _ = result(tmp_path / "comma.csv", recipe(), tmp_path / "expected.parquet")
    same_bits(out, expected)
    for wrong in ("", ";;", "é", "\\n", '\\"'):
        with pytest.raises(UsageError, match=r"\[log\] separator must be"):
            parse_recipe(recipe(log=f'separator = "{wrong}"'))


@pytest.mark.parametrize(
    ("name", "separator"), [("log.tsv", "\t"), ("LOG.TSV", "\t"), ("a.tsv.b.csv", ","), ("log.tsv.csv", ",")]
)
def test_the_ending_alone_tells_the_separator(tmp_path, name, separator):
    path = tmp_path / name
    path.write_text(separator.join("ab") + "\n" + separator.join("12") + "\n", encoding="utf-8")
    assert read_schema(path).names == ["a", "b"]


@pytest.mark.parametrize("name", FORMATS)
def test_capital_letters_in_an_ending_change_nothing(files, tmp_path, name):
    path, names, _ = files[name]
    if path.is_dir():
        pytest.skip("a folder has no ending")
    loud = tmp_path / name.upper()
    loud.write_bytes(path.read_bytes())
    assert read(loud, wanted(names)).num_rows == 2000


def test_formats_are_told_by_their_first_bytes_where_the_ending_is_not_known(files, tmp_path):
    for name in ("log.parquet", "log.arrow", "log.h5", "log.ulg", "log.bag", "log.db3", "log.mcap"):
        path, names, _ = files[name]
        unknown = tmp_path / f"{path.stem}.data"
        unknown.write_bytes(path.read_bytes())
        assert read(unknown, wanted(names)).num_rows == 2000
        wrong = tmp_path / "log.csv"
        wrong.write_bytes(path.read_bytes())
        with pytest.raises(LogError, match=r"by its first bytes this is a file of .*, not of CSV"):
            read(wrong, wanted(names))


@pytest.mark.parametrize("name", ["log.ulg", "log.bag", "log.mcap"])
def test_columns_of_two_topics_do_not_go_together(files, name):
    path, names, _ = files[name]
    other = {"log.ulg": "other.x"}.get(name, "/imu/raw.angular_velocity.x")
    with pytest.raises(
        LogError, match=f'^columns "{names["gx"]}" and "{other}" are of two topics'.replace("[", r"\[")
    ):
        read(path, Columns((names["gx"], other)))
    with pytest.raises(LogError, match='"gx" is no column of a '):
        read(path, Columns(("gx",)))


def test_topics_that_are_not_there(files):
    with pytest.raises(LogError, match=r'^there is no topic "/imu/date" \(is it "/imu/data" or'):
        read(files["log.mcap"][0], Columns(("/imu/date.header.stamp",)))
    with pytest.raises(LogError, match=r'^there is no topic "imus"'):
        read(files["log.ulg"][0], Columns(("imus.timestamp",)))
    with pytest.raises(LogError, match=r'^there is no topic "imu\[2\]"'):
        read(files["log.ulg"][0], Columns(("imu[2].timestamp",)))
    with pytest.raises(LogError, match=r'^there is no topic "vectors"'):
        read(files["log.ulg"][0], Columns(("vectors.g[0]",)))


def test_instances_of_a_ulog_are_apart(files):
    path = files["log.ulg"][0]
    assert read(path, Columns(("imu.sensor.g[0]",), ("imu.timestamp",))).num_rows == 667
    assert read(path, Columns(("other.x",))).column("other.x").unique().to_pylist() == [0.5]


def test_receive_times_and_arrays_of_a_bag(files):
    for name in ("log.bag", "bag.v2", "log.db3", "log.mcap"):
        path = files[name][0]
        kept = ("/imu/data.header.frame_id",)
        array = "/imu/data.angular_velocity_covariance[4]"
        out = read(path, Columns((array,), ("/imu/data.receive_time",), kept), batch_rows=300)
        np.testing.assert_array_equal(out.column("/imu/data.receive_time").to_numpy(), 1000 * data()["t"] + 5)
        assert out.column(array).unique().to_pylist() == [4.0]
        assert out.column(kept[0]).unique().to_pylist() == ["imu"]


def test_arrays_of_different_lengths_do_not_go_together(tmp_path):
    np.savez(tmp_path / "log.npz", a=np.zeros(5), b=np.zeros(6), c=np.zeros((5, 2)))
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["a"], file["b"], file["c"] = np.zeros(5), np.zeros(6), np.zeros((5, 2))
    for name in ("log.npz", "log.h5"):
        assert read(tmp_path / name, Columns(("a", "c[1]"))).num_rows == 5
        with pytest.raises(LogError, match='column "a" has 5 rows, but "b" has 6'):
            read(tmp_path / name, Columns(("a", "b")))


def test_text_is_kept(tmp_path):
    words = ["ä", "", 'b "c"']
    np.savez(tmp_path / "log.npz", a=np.arange(3.0), words=np.array(words))
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["a"], file["words"] = np.arange(3.0), words
    for name in ("log.npz", "log.h5"):
        assert read(tmp_path / name, Columns(("a",), (), ("words",))).column("words").to_pylist() == words
        with pytest.raises(LogError, match='column "words" holds string, not numbers'):
            read(tmp_path / name, Columns(("words",)))


def test_links_of_hdf5_are_not_followed(tmp_path):
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["x"] = np.zeros(5)
    np.zeros(5).tofile(tmp_path / "secret.bin")
    layout = h5py.VirtualLayout((5,), np.float64)
    layout[:] = h5py.VirtualSource(str(tmp_path / "secret.h5"), "x", (5,))
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["a"] = np.arange(5.0)
        file["external"] = h5py.ExternalLink("secret.h5", "x")
        file["outside"] = h5py.ExternalLink("secret.h5", "/")
        file["soft"] = h5py.SoftLink("/external")
        file.create_dataset("raw", (5,), np.float64, external=[(str(tmp_path / "secret.bin"), 0, 40)])
        file.create_virtual_dataset("virtual", layout)
    for name, message in [
        ("external", "is a link to another file, which is not followed"),
        ("outside/x", "is a link to another file, which is not followed"),
        ("soft", 'is a link; name what it leads to: "/external"'),
        ("raw", "stands in another file, which is not read"),
        ("virtual", "stands in another file, which is not read"),
    ]:
        with pytest.raises(LogError, match=f'^column "{name}" {message}$'):
            read(tmp_path / "log.h5", Columns((name,)))
    assert read(tmp_path / "log.h5", Columns(("a",))).num_rows == 5


def test_nothing_is_unpickled(tmp_path):
    class Bomb:
        def __reduce__(self):
            return open, (str(tmp_path / "exploded"), "w")

    np.savez(tmp_path / "log.npz", a=np.arange(2.0), bomb=np.array([Bomb(), Bomb()], dtype=object))
    assert read(tmp_path / "log.npz", Columns(("a",))).num_rows == 2
    for columns in (Columns(("bomb",)), Columns(("a",), (), ("bomb",))):
        with pytest.raises(LogError, match='column "bomb" holds object, not numbers'):
            read(tmp_path / "log.npz", columns)
    assert not (tmp_path / "exploded").exists()


def test_folders_that_are_no_bags(tmp_path):
    (tmp_path / "folder.bag").mkdir()
    with pytest.raises(LogError, match="this is a folder, not a file"):
        read(tmp_path / "folder.bag", Columns(("a",)))


TIMES = {
    "timestamp[ns]": (pa.timestamp("ns"), 1000, "ns"),
    "timestamp[us, UTC]": (pa.timestamp("us", "UTC"), 1, "us"),
    "duration[us]": (pa.duration("us"), 1, "us"),
}


@pytest.mark.parametrize("kind", TIMES)
@pytest.mark.parametrize("ending", ["parquet", "arrow"])
def test_times_of_arrow_tell_their_unit(tmp_path, kind, ending):
    held, factor, unit = TIMES[kind]
    columns = data()
    columns["t"] = factor * columns["t"]
    pq.write_table(pa.table(columns), tmp_path / "whole.parquet")
    expected, _ = result(tmp_path / "whole.parquet", recipe(unit=unit), tmp_path / "expected.parquet")
    timed = table(columns)
    timed = timed.set_column(1, "t", timed.column("t").cast(held))
    path = tmp_path / f"log.{ending}"
    if ending == "parquet":
        pq.write_table(timed, path)
    else:
        with pa.ipc.new_file(path, timed.schema) as writer:
            writer.write_table(timed)
    silent = recipe().replace(', unit = "us"', "", 1).replace('"flags"]', '"flags"]\nkeep = ["t"]')
    for text in (silent, silent.replace('column = "t"', f'column = "t", unit = "{unit}"')):
        out, _ = result(path, text, tmp_path / "out.parquet", batch_rows=100)
        assert out.schema.field("t").type == held
        assert out.schema.field("t").metadata == {b"unit": unit.encode()}
        same_bits(out.drop_columns("t"), expected)
    with pytest.raises(LogError, match=f'column "t" is in {unit}, but the recipe says ms'):
        result(path, recipe(unit="ms"), tmp_path / "wrong.parquet")


def test_a_time_without_a_unit_is_refused(tmp_path):
    path = tmp_path / "log.parquet"
    pq.write_table(table(data()), path)
    silent = recipe().replace(', unit = "us"', "", 1)
    with pytest.raises(
        LogError, match=r'column "t" does not tell its unit: the recipe needs one, as in time = '
    ):
        result(path, silent, tmp_path / "out.parquet")
    field = pa.field("t", pa.int64(), metadata={"unit": "us"})
    pq.write_table(
        pa.table(list(data().values()), pa.schema([field, *((s, pa.float64()) for s in SIGNALS)])), path
    )
    told, _ = result(path, silent, tmp_path / "told.parquet")
    said, _ = result(path, recipe(), tmp_path / "said.parquet")
    same_bits(told, said)
    with pytest.raises(LogError, match='column "t" is in us, but the recipe says s'):
        result(path, recipe(unit="s"), tmp_path / "wrong.parquet")


def test_points_in_time_of_a_csv(tmp_path):
    columns = data(100)
    write_csv(tmp_path / "whole.csv", columns | {"t": 1000 * columns["t"]})
    expected, _ = result(tmp_path / "whole.csv", recipe(unit="ns"), tmp_path / "expected.parquet")
    text = (columns["t"].astype("datetime64[us]")).astype(str)
    lines = [",".join(columns)]
    for i, t in enumerate(text):
        # The first ones are at whole seconds.
        lines.append(
            ",".join(
                [str(t), *("" if np.isnan(columns[s][i]) else repr(float(columns[s][i])) for s in SIGNALS)]
            )
        )
    (tmp_path / "log.csv").write_text("\n".join(lines), encoding="utf-8")
    silent = recipe().replace(', unit = "us"', "", 1)
    out, _ = result(tmp_path / "log.csv", silent, tmp_path / "out.parquet", batch_bytes=500)
    same_bits(out, expected)
    (tmp_path / "log.csv").write_text("\n".join(lines).replace(str(text[70]), "today"), encoding="utf-8")
    with pytest.raises(LogError, match='column "t" holds "today", not a time'):
        result(tmp_path / "log.csv", silent, tmp_path / "out.parquet", batch_bytes=500)


def test_a_point_in_time_that_is_missing_is_named(tmp_path):
    columns = data(100)
    columns["t"] = pa.array(
        [None if i == 41 else t for i, t in enumerate(columns["t"].tolist())], pa.timestamp("us")
    )
    pq.write_table(pa.table(columns), tmp_path / "log.parquet")
    with pytest.raises(LogError, match='row 42 has no time in column "t"'):
        result(tmp_path / "log.parquet", recipe(), tmp_path / "out.parquet")


def test_a_time_before_the_first_one_runs_backwards_in_unsigned_numbers_too(tmp_path):
    columns = data(100)
    for kind in (np.uint64, np.uint32):
        columns["t"] = np.arange(100, 200).astype(kind)
        columns["t"][50] = 3
        pq.write_table(pa.table(columns), tmp_path / "log.parquet")
        with pytest.raises(LogError, match=r"row 51: time runs backwards by 0\.000146 s"):
            result(tmp_path / "log.parquet", recipe(), tmp_path / "out.parquet")


LIBRARIES = {
    "log.h5": ("h5py", "hdf5"),
    "log.ulg": ("pyulog", "ulog"),
    "log.mcap": ("rosbags", "bags"),
    "log.bag": ("rosbags", "bags"),
}


@pytest.mark.parametrize("name", LIBRARIES)
def test_a_library_that_is_missing_is_named(files, tmp_path, monkeypatch, name):
    path, names, _ = files[name]
    library, extra = LIBRARIES[name]
    message = rf'files are read with {library}: pip install "compfilt\[{extra}\]"$'
    (tmp_path / "recipe.toml").write_text(recipe(names), encoding="utf-8")
    without = (
        f"import sys; sys.modules['{library}'] = None; from compfilt.__main__ import main; sys.exit(main())"
    )
    done = subprocess.run(
        [sys.executable, "-c", without, "run", "recipe.toml", str(path), "-o", "out.parquet"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f'pip install "compfilt[{extra}]"' in done.stderr
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["recipe.toml"]
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == library else found(name))
    with pytest.raises(UsageError, match=message):
        plan([path], str(tmp_path / "out.parquet"))
    for module in [name for name in sys.modules if name.partition(".")[0] == library]:
        monkeypatch.setitem(sys.modules, module, None)
    module = {"pyulog": "ulog", "h5py": "hdf5"}.get(library, "bags")
    monkeypatch.delitem(sys.modules, f"compfilt.logs.readers.{module}", raising=False)
    with pytest.raises(UsageError, match=message):
        open_log(path, wanted(names))


def test_libraries_that_are_there(files):
    for path, _, _ in files.values():
        check_library(path)
