"""``compfilt design`` as a user meets it."""

import json
import signal
import subprocess
import sys

import pytest

from compfilt import design, simulate
from compfilt.__main__ import main

NOISE = ["--measurement-noise", "0.001", "--gyro-noise", "0.002"]


@pytest.fixture
def compfilt(tmp_path, monkeypatch, capsys):
    """Run the command inside this process."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["compfilt", "design", *arguments])
        before = signal.getsignal(signal.SIGTERM)
        try:
            status = main()
        except SystemExit as leaving:
            status = leaving.code
        finally:
            signal.signal(signal.SIGTERM, before)
        return subprocess.CompletedProcess(arguments, status, *capsys.readouterr())

    return run


def told(process):
    assert process.returncode == 0, process.stderr
    assert process.stderr == ""
    return json.loads(process.stdout)


def test_from_noise(compfilt):
    expected = design.from_densities(measurement=1e-3, derivative=2e-3, walk=1e-4, kind="pi", fs=100.0)
    assert told(compfilt(*NOISE, "--walk", "1e-4", "--fs", "100", "--json")) == expected.as_json()
    text = compfilt(*NOISE, "--walk", "1e-4", "--fs", "100").stdout
    assert text == f"{expected.table('rad')}\n{expected.recipe_line()}\n"


def test_from_noise_over_splits(compfilt):
    found = told(
        compfilt(*NOISE, "--kind", "butterworth", "--order", "3", "--split", "1", "--fs", "100", "--json")
    )
    expected = design.from_spectra(
        measurement=1e-3, derivative=2e-3, kind="butterworth", order=3, split=1, fs=100.0
    )
    assert found == expected.as_json()


def test_from_a_wanted_speed(compfilt):
    assert told(compfilt("--cutoff", "0.5", "--json")) == design.from_cutoff(0.5).as_json()
    settling = design.from_settling_time(3.0, kind="third_order")
    assert told(compfilt("--settling-time", "3", "--kind", "third_order", "--json")) == settling.as_json()
    assert told(compfilt("--bias-time", "20", "--json")) == design.from_bias_time(20.0).as_json()
    predicted = told(compfilt("--cutoff", "0.5", *NOISE, "--fs", "100", "--json"))["prediction"]
    assert predicted["sigma"] > 0.0


def test_from_what_the_noise_command_printed(compfilt, tmp_path):
    densities = {"measurement": 1e-3, "derivative": 2e-3, "walk": 1e-4}
    (tmp_path / "noise.json").write_text(json.dumps({"rate": 100.0, "densities": densities, "channels": []}))
    expected = design.from_densities(**densities, kind="pi", fs=100.0)
    assert told(compfilt("--noise", "noise.json", "--json")) == expected.as_json()


def test_from_recordings(compfilt, tmp_path):
    simulate.write(simulate.child_seat(duration=30.0), tmp_path / "seat.csv")
    (tmp_path / "seat.toml").write_text(
        'version = 1\n[log]\ntime = { column = "t", unit = "s" }\naxes = "flu"\n'
        'gyro = { columns = ["gx", "gy", "gz"], unit = "deg/s" }\n'
        'accelerometer = { columns = ["ax", "ay", "az"], unit = "g" }\n'
        '[filter]\nkind = "tilt"\ndesign = { kind = "first_order", tau = 0.5 }\n'
        '[output]\ncolumns = ["roll"]\nunit = "deg"\n'
    )
    given = ["--recording", "seat.csv", "--recipe", "seat.toml", "--truth", "roll=true_roll"]
    found = told(compfilt(*given, "--json"))
    assert found["design"]["kind"] == "first_order"
    assert 0.5 < found["measured"]["error on the recordings (RMS)"] < 20.0
    assert "error on the recordings (RMS) / deg" in compfilt(*given).stdout
    without_truth = told(compfilt(*given[:4], "--json"))
    assert without_truth["design"]["kind"] == "first_order"
    given[-1] = "roll=roll"
    missing = compfilt(*given)
    assert missing.returncode == 1
    assert "seat.csv: " in missing.stderr
    assert missing.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "nothing to choose by"),
        (["--cutoff", "1", "--bias-time", "1"], "different ways"),
        (["--cutoff", "-1"], "cutoff must be"),
        (["--cutoff", "1", "--kind", "kalman"], "kind must be one of"),
        (["--bias-time", "1", "--split", "1"], "--split does not go with --bias-time"),
        (["--truth", "roll=a"], "belong together"),
        (
            ["--recording", "a.csv", "--recipe", "a.toml", "--truth", "roll"],
            "a.toml: the recipe cannot be read",
        ),
        (
            ["--recording", "a.csv", "--recipe", "a.toml", "--truth", "roll=a", "--fs", "9"],
            "--recording goes with no noise",
        ),
        (["--cutoff", "1", "--fs", "100"], "belong together"),
        (["--cutoff", "1", *NOISE], "belong together"),
        (["--cutoff", "1", "--gyro-noise", "0.1"], "go with --measurement-noise and --fs"),
        (["--cutoff", "1", "--walk", "-1"], "go with --measurement-noise and --fs"),
        (["--cutoff", "1", "--bias", "0.1"], "go with --measurement-noise and --fs"),
        (["--cutoff", "1", "--rule", "matched"], "go with --measurement-noise and --fs"),
        ([*NOISE, "--fs", "9", "--bias", "nan"], "bias must be finite and not negative"),
        (["--measurement-noise", "1e-300", "--gyro-noise", "1e300"], "what floating point can hold"),
        (["--measurement-noise", "1e300", "--gyro-noise", "1e-300"], "what floating point can hold"),
        ([*NOISE, "--order", "2"], "--fs is needed"),
        ([*NOISE, "--fs", "0"], "fs must be"),
        ([*NOISE, "--fs", "1e300"], "fs must lie between 1e-12 and 1e+12 Hz, not 1e+300"),
        ([*NOISE, "--fs", "1e300", "--kind", "butterworth"], "fs must lie between 1e-12 and 1e+12 Hz"),
        ([*NOISE, "--fs", "1e-300"], "fs must lie between 1e-12 and 1e+12 Hz, not 1e-300"),
        ([*NOISE, "--fs", "1e-5"], "fs must lie between 0.002 and 2e+12 Hz to predict"),
        ([*NOISE, "--bias", "0.1"], "--bias and --rule go with --fs"),
        ([*NOISE, "--rule", "matched"], "--bias and --rule go with --fs"),
        ([*NOISE, "--fs", "9", "--rule", "euler"], 'rule must be "backward_euler" or "matched"'),
        ([*NOISE, "--kind", "pi"], "--walk, or give --bias-time"),
        ([*NOISE, "--kind", "third_order"], "--walk, or give --bias-time"),
        ([*NOISE, "--noise", "noise.json"], "give one or the other"),
        (["--noise", "noise.json"], "noise.json: cannot be read: No such file"),
        (["--measurement-noise", "1"], "derivative must be above 0"),
    ],
)
def test_what_cannot_be_done_is_one_line(compfilt, arguments, words):
    process = compfilt(*arguments)
    assert process.returncode == 2
    assert process.stdout == ""
    assert process.stderr.startswith("compfilt: ")
    assert process.stderr.count("\n") == 1
    assert words in process.stderr


def test_of_any_speed_that_can_be_written(compfilt):
    assert "cut-off 1e+300 Hz" in compfilt("--cutoff", "1e300").stdout


@pytest.mark.parametrize(
    "content",
    [
        b'{"rate": 1.0}',
        b"\xff\xfe\x00",
        b"[" * 100_000,
        b'{"rate": 1, "densities": {"measurement": 1%s, "derivative": 1, "walk": 0}}' % (b"0" * 400),
    ],
    ids=["shape", "bytes", "deep", "huge"],
)
def test_another_file_than_of_noise_is_refused(compfilt, tmp_path, content):
    (tmp_path / "other.json").write_bytes(content)
    process = compfilt("--noise", "other.json")
    assert (process.returncode, process.stderr) == (
        2,
        "compfilt: other.json: must be what compfilt noise --json printed\n",
    )


def test_without_scipy(tmp_path):
    code = "import sys; sys.modules['scipy'] = None; sys.argv[1:] = ['design', '--cutoff', '1']\n"
    code += "from compfilt.__main__ import main; sys.exit(main())"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert result.returncode == 2
    assert "pip install 'compfilt[design]'" in result.stderr
    assert result.stderr.count("\n") == 1


def noise_file(folder, **changed):
    densities = {"measurement": 1e-3, "derivative": 2e-3, "walk": 0.0} | changed
    rate = densities.pop("rate", 100.0)
    (folder / "noise.json").write_text(json.dumps({"rate": rate, "densities": densities}))


@pytest.mark.parametrize(
    ("changed", "arguments", "words"),
    [
        ({"measurement": 0.0}, [], "measurement must be positive and finite, not 0"),
        ({"derivative": 0.0}, [], "derivative must be above 0 for kind 'first_order'"),
        ({"derivative": -1.0}, [], "densities.derivative must be finite and not negative, not -1"),
        ({"walk": float("nan")}, [], "densities.walk must be finite and not negative, not nan"),
        ({"rate": -100.0}, [], "rate must be positive and finite, not -100"),
        ({"rate": 1e300}, [], "rate must lie between 1e-12 and 1e+12 Hz"),
        ({"measurement": 1e-300, "derivative": 1e300}, [], "the ratios of the densities must be"),
        (
            {},
            ["--kind", "pi"],
            "kind pi chooses its gains by the random walk of the bias, which is 0: give it with --walk",
        ),
    ],
)
def test_a_value_of_a_noise_file_that_is_refused_names_the_file(
    compfilt, tmp_path, changed, arguments, words
):
    noise_file(tmp_path, **changed)
    process = compfilt("--noise", "noise.json", *arguments)
    assert (process.returncode, process.stdout) == (2, "")
    assert process.stderr.startswith(f"compfilt: noise.json: {words}")
    assert process.stderr.count("\n") == 1


def test_what_is_wrong_beside_a_noise_file_does_not_name_it(compfilt, tmp_path):
    noise_file(tmp_path)
    for arguments, words in ((["--kind", "kalman"], "kind must be"), (["--fs", "1e300"], "fs must lie")):
        assert compfilt("--noise", "noise.json", *arguments).stderr.startswith(f"compfilt: {words}")


def test_a_walk_stands_in_for_that_of_the_noise_file(compfilt, tmp_path):
    noise_file(tmp_path)
    expected = design.from_densities(measurement=1e-3, derivative=2e-3, walk=1e-4, kind="pi", fs=100.0)
    found = told(compfilt("--noise", "noise.json", "--kind", "pi", "--walk", "1e-4", "--json"))
    assert found == expected.as_json()
    by_time = told(compfilt("--noise", "noise.json", "--bias-time", "60", "--json"))
    assert by_time["design"]["kind"] == "pi"
    assert by_time["prediction"]["fs"] == 100.0


@pytest.mark.parametrize(("kind", "unit"), [("first_order", "rad"), ("second_order_inertial", "m")])
def test_the_predicted_error_has_a_unit(compfilt, kind, unit):
    assert f"predicted error at 100 Hz / {unit}: " in compfilt(*NOISE, "--kind", kind, "--fs", "100").stdout
