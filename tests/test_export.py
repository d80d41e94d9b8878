"""Recipes as source code for a chip: it compiles, and gives the bits of Python's float32."""

import json
import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import compfilt as cf
from compfilt.angles import quaternion_to_angles
from compfilt.logs.errors import UsageError
from compfilt.logs.export import export_recipe
from compfilt.logs.export.header import BUILD, HEADER
from compfilt.logs.export.subject import numbers
from compfilt.logs.recipe import load_recipe, parse_recipe
from pages import blocks
from test_cli import compfilt, one_line

ROOT = Path(__file__).parents[1]
BUILT = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "firmware"

LINEAR = """
version = 1
[log]
rate = 80.0
measurement = {{ column = "y", unit = "{unit}" }}
derivative = {{ column = "u", unit = "{unit}/s{power}" }}
[filter]
{filter}
[output]
columns = ["estimate"]
unit = "{unit}"
"""

ATTITUDE = """
version = 1
[log]
rate = 80.0
gyro = {{ columns = ["gx", "gy", "gz"], unit = "rad/s" }}
accelerometer = {{ columns = ["ax", "ay", "az"], unit = "m/s^2" }}
axes = "flu"
[filter]
{filter}
[output]
columns = ["quaternion"]
unit = "rad"
"""

TILT = """
version = 1
[log]
rate = 80.0
gyro = {{ columns = ["gx", "gy", "gz"], unit = "rad/s" }}
accelerometer = {{ columns = ["ax", "ay", "az"], unit = "m/s^2" }}
axes = "{axes}"
[filter]
kind = "tilt"
{filter}
[output]
columns = ["flags"]
unit = "rad"
"""

IN_C = {
    "first_order": 'kind = "first_order"\ntau = 0.3',
    "pi": 'kind = "pi"\nkp = 2.1\nki = 0.9\nperiod = 1.5\ninput = "trapezoid"',
    "butterworth": 'kind = "butterworth"\nomega0 = 3.3\nq = 0.8',
    "third_order": 'kind = "third_order"\ntau = 0.7',
    "chain": 'kind = "chain"\ncoefficients = [3.0, 2.0]',
}
IN_RUST = IN_C | {
    "split": 'kind = "butterworth"\norder = 4\nsplit = 2\nomega0 = 3.3',
    "matched": 'kind = "butterworth"\norder = 3\nomega0 = 3.3\nrule = "matched"',
    "inertial": 'kind = "second_order_inertial"\ntau = 0.7',
}
RATE = 'kind = "rate"\ntau = 0.4'
ATTITUDES = {
    "explicit": 'kind = "attitude"\nmethod = "mahony"\nkp = 0.7\nki = 0.03\nbias_limit = "3 deg/s"\nacc_range = "16 g"',
    "plain": 'kind = "attitude"\ntau = 2.3\ngyro_delay = "4 ms"\nadvance = "10 ms"\nrest_force = 0.3',
    "learning": 'kind = "attitude"\nmethod = "self_calibrating"\n'
    "calibration = [[0.01, 0.002, 0.0], [0.0, -0.01, 0.0], [0.003, 0.0, 0.02]]",
}
ATTITUDES_IN_RUST = ATTITUDES | {
    "direct": 'kind = "attitude"\nmethod = "mahony"\nkp = 0.7\nform = "direct"',
    "steep": 'kind = "attitude"\norder = 3\nsplit = 2',
}
TILTS = {
    "rolling": ("flu", 'design = { kind = "first_order", tau = 0.3 }'),
    "aircraft": ("frd", 'design = { kind = "pi", kp = 2.1, ki = 0.9 }\ninitial = ["20 deg", "-70 deg"]'),
    "standing": ("cube", 'design = { kind = "butterworth", omega0 = 3.3, q = 0.8 }'),
}
TILTS_IN_RUST = TILTS | {
    "steep_tilt": ("flu", 'design = { kind = "butterworth", omega0 = 3.3, order = 3 }\nrule = "matched"'),
}

Y, U = np.random.default_rng(0).normal(size=(2, 300)).astype(np.float32)
Y[7] = np.nan
GYR = np.random.default_rng(1).normal(size=(300, 3)).astype(np.float32) * np.float32(0.5)
GYR[11] = np.nan
ACC = (np.random.default_rng(2).normal(size=(300, 3)) + np.array([0, 0, 9.8])).astype(np.float32)
ACC[13, 1] = np.nan


def linear(filter_):
    inertial = "third" in filter_ or "inertial" in filter_
    unit, power = ("m", "^2") if inertial else ("rad", "")
    return parse_recipe(LINEAR.format(filter=filter_, unit=unit, power=power), "some/the recipe.toml")


def attitude(filter_):
    return parse_recipe(ATTITUDE.format(filter=filter_), "2nd.toml")


def tilt(axes, filter_):
    return parse_recipe(TILT.format(axes=axes, filter=filter_), "2nd.toml")


def bits(values):
    return np.ascontiguousarray(values, np.float32).view(np.uint32).ravel().tolist()


def stream(recipe):
    return recipe.filter.start(80.0, np.float32, missing="coast")


def expected(recipe):
    """The last levels, quaternion or angles of Python."""
    if recipe.filter.kind == "attitude":
        return bits(stream(recipe).estimate(GYR, ACC).quaternion[-1])
    if recipe.filter.kind == "tilt":
        return bits(stream(recipe).estimate(GYR, ACC).angles[-1])
    return bits(stream(recipe).estimate(Y, U).levels[:, -1])


def rate_expected():
    levels = cf.RateFilter(0.4).estimate(np.nan_to_num(Y), U, fs=80.0, initial=0.0).levels
    return bits(levels[:, -1])


def run(*command, cwd, **environment):
    done = subprocess.run(
        command,
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
        env={**os.environ, **environment},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def needs(*programs):
    missing = [program for program in programs if shutil.which(program) is None]
    if missing:
        pytest.skip(f"needs {', '.join(missing)}")


def floats(values):
    """Numbers as C and Rust read them, exactly."""
    return ", ".join(f"0x{word:08x}" for word in bits(values))


C_MAIN = """
#include <stdio.h>
#include <string.h>
{includes}
static const uint32_t Y[] = {{{y}}}, U[] = {{{u}}}, GYR[] = {{{gyr}}}, ACC[] = {{{acc}}};
static float number(uint32_t bits) {{ float f; memcpy(&f, &bits, 4); return f; }}
static void show(const char *name, const float *numbers, int count) {{
  printf("%s", name);
  for (int i = 0; i < count; i++) {{ uint32_t bits; memcpy(&bits, &numbers[i], 4); printf(" %u", bits); }}
  printf("\\n");
}}
int main(void) {{
  {body}
  return 0;
}}
"""

C_LINEAR = """{{
    CompfiltState{order} state;
    compfilt_start_{order}(&state);
    for (int i = 0; i < 300; i++) compfilt_update_{order}(&{name}, &state, number(Y[i]), number(U[i]), NULL);
    show("{name}", state.levels, {order});
  }}"""

C_RATE = """{
    CompfiltRateState state;
    compfilt_rate_start(&state, 0.0f);
    for (int i = 0; i < 300; i++) {
      const float y = number(Y[i]);
      compfilt_rate_update(&rate, &state, y == y ? y : 0.0f, number(U[i]));
    }
    show("rate", state.levels, 1);
  }"""

C_TILT = """{{
    CompfiltTiltState{order} state;
    float angles[2];
    if ({start}(&state) != COMPFILT_STATUS_OK) return 1;
    for (int i = 0; i < 300; i++) {{
      float gyr[3], acc[3];
      for (int a = 0; a < 3; a++) {{ gyr[a] = number(GYR[3 * i + a]); acc[a] = number(ACC[3 * i + a]); }}
      compfilt_tilt_update_{order}(&{name}, {name}_axes, &state, gyr, acc, NULL);
    }}
    compfilt_tilt_angles_{order}(&{name}, {name}_axes, &state, angles);
    show("{name}", angles, 2);
  }}"""

C_ATTITUDE = """{{
    Compfilt{type} filter;
    Compfilt{type}State state;
    float q[4];
    if ({name}_make(&filter) != COMPFILT_STATUS_OK) return 1;
    compfilt_{kind}_start(&state);
    for (int i = 0; i < 300; i++) {{
      float gyr[3], acc[3];
      for (int a = 0; a < 3; a++) {{ gyr[a] = number(GYR[3 * i + a]); acc[a] = number(ACC[3 * i + a]); }}
      compfilt_{kind}_update(&filter, &state, gyr, acc, NULL, NULL);
    }}
    {read}
    show("{name}", q, 4);
  }}"""

ORDERS = {"first_order": 1, "third_order": 3, "rolling": 1}
C_KINDS = {"explicit": "mahony", "plain": "gravity", "learning": "calibrating"}


def c_body():
    blocks = [C_LINEAR.format(name=name, order=ORDERS.get(name, 2)) for name in IN_C]
    for name, (_, filter_) in TILTS.items():
        order = ORDERS.get(name, 2)
        start = f"{name}_start" if "initial" in filter_ else f"compfilt_tilt_start_{order}"
        blocks.append(C_TILT.format(name=name, order=order, start=start))
    for name, kind in C_KINDS.items():
        read = f"compfilt_{kind}_attitude(&filter, &state, q);"
        if kind == "mahony":
            read = "q[0] = state.rotation.w; memcpy(q + 1, state.rotation.v, 12);"
        blocks.append(C_ATTITUDE.format(name=name, kind=kind, type=kind.title(), read=read))
    return "\n  ".join([*blocks, C_RATE])


@pytest.mark.parametrize("compiler", ["gcc", "g++"])
def test_c_gives_the_same_bits(tmp_path, compiler):
    needs("cargo", "gcc", "g++")
    run(
        *[
            "cargo",
            "rustc",
            "--quiet",
            "--locked",
            "--package",
            "compfilt-capi",
            "--profile",
            "firmware",
            "--crate-type",
            "staticlib",
        ],
        *("--features", "panic-handler"),
        cwd=ROOT,
        CARGO_TARGET_DIR=str(BUILT),
    )
    recipes = {name: linear(text) for name, text in (IN_C | {"rate": RATE}).items()}
    recipes |= {name: attitude(text) for name, text in ATTITUDES.items()}
    recipes |= {name: tilt(*texts) for name, texts in TILTS.items()}
    for name, recipe in recipes.items():
        source = export_recipe(recipe, "c").replace("the_recipe", name).replace("recipe_2nd", name)
        (tmp_path / f"{name}.h").write_text(
            source.replace("_EXPORTED_THE_RECIPE", f"_{name}"), encoding="utf-8"
        )
    arrays = {"y": floats(Y), "u": floats(U), "gyr": floats(GYR), "acc": floats(ACC)}
    # Every header has the guard of its recipe's name, which is the same for some of them here.
    includes = "\n".join(f'#undef COMPFILT_EXPORTED_RECIPE_2ND_H\n#include "{name}.h"' for name in recipes)
    extension, standard = (".c", "c99") if compiler == "gcc" else (".cc", "c++17")
    main = tmp_path / f"main{extension}"
    main.write_text(C_MAIN.format(includes=includes, body=c_body(), **arrays), encoding="utf-8")
    options = ["-Wall", "-Wextra", "-Werror", "-pedantic", f"-std={standard}", "-O1", "-I", "."]
    library = BUILT / "firmware" / "libcompfilt_capi.a"
    run(compiler, *options, "-I", str(HEADER.parent), main.name, str(library), "-o", "main", cwd=tmp_path)
    printed = {
        name: list(map(int, words))
        for name, *words in map(str.split, run("./main", cwd=tmp_path).splitlines())
    }
    wanted = {name: expected(recipe) for name, recipe in recipes.items() if name != "rate"}
    assert printed == wanted | {"rate": rate_expected()}


PAGE = blocks(ROOT / "docs" / "embedded.md")
EMBEDDED = [block for block in PAGE if block.language == "c"]
STRICT = ["gcc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I", str(HEADER.parent)]


@pytest.mark.parametrize("block", EMBEDDED, ids=lambda block: block.where)
def test_the_documented_c_compiles(block, tmp_path):
    needs("gcc")
    for recipe in (block for block in PAGE if block.language == "toml"):
        header = export_recipe(parse_recipe(recipe.text, recipe.name), "c", fs=100.0)
        (tmp_path / recipe.name).with_suffix(".h").write_text(header, encoding="utf-8")
    (tmp_path / "seat.c").write_text(block.text, encoding="utf-8")
    run(*STRICT, "-c", "seat.c", cwd=tmp_path)


ANGLES_MAIN = """
#include <stdio.h>
void roll_and_pitch(const float q[4], float *roll, float *pitch);
float yaw(const float q[4]);
int main(void) {{
  static const float q[][4] = {{{quaternions}}};
  for (unsigned i = 0; i < sizeof q / sizeof q[0]; i++) {{
    float roll, pitch;
    roll_and_pitch(q[i], &roll, &pitch);
    printf("%.9g %.9g %.9g\\n", (double)roll, (double)pitch, (double)yaw(q[i]));
  }}
  return 0;
}}
"""


def test_the_documented_angles_are_those_of_python(tmp_path):
    needs("gcc")
    (block,) = (block for block in EMBEDDED if block.name == "angles.c")
    quaternions = np.random.default_rng(3).normal(size=(100, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    written = ", ".join("{" + ", ".join(f"{part!r}f" for part in row) + "}" for row in quaternions.tolist())
    (tmp_path / "angles.c").write_text(block.text, encoding="utf-8")
    (tmp_path / "main.c").write_text(ANGLES_MAIN.format(quaternions=written), encoding="utf-8")
    run(*STRICT, "angles.c", "main.c", "-lm", "-o", "angles", cwd=tmp_path)
    printed = np.array([line.split() for line in run("./angles", cwd=tmp_path).splitlines()], float)
    turns = (printed - quaternion_to_angles(quaternions)) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-5)


def test_the_tutorial_has_the_same_formula():
    tutorial = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    (block,) = (block for block in EMBEDDED if block.name == "angles.c")
    formula = block.text.partition("{\n")[2].partition("\n}")[0]
    assert formula.count("\n") == 3
    assert formula in tutorial


RUST_LINEAR = """
    let filter = {name}::filter().unwrap();
    let mut state = compfilt_core::StreamState::new();
    for (y, u) in Y.iter().zip(&U) {{
        filter.update(&{name}::GAINS, &mut state, f32::from_bits(*y), f32::from_bits(*u), &mut ());
    }}
    show("{name}", &state.levels.levels);
"""
RUST_RATE = """
    rate::filter().unwrap();
    let mut state = compfilt_core::linear::RateState::new(0.0);
    for (y, u) in Y.iter().zip(&U) {
        let y = f32::from_bits(*y);
        rate::GAINS.update(&mut state, if y.is_nan() { 0.0 } else { y }, f32::from_bits(*u));
    }
    show("rate", &state.rate.levels);
"""
RUST_ATTITUDE = """
    let (filter, gains) = {name}::filter().unwrap();
    let mut state = compfilt_core::attitude::{state}::new();
    for (gyr, acc) in GYR.chunks(3).zip(ACC.chunks(3)) {{
        filter.update({update}, &vector(gyr), &vector(acc), None);
    }}
    let rotation = {rotation};
    show("{name}", &[rotation.w, rotation.v.x, rotation.v.y, rotation.v.z]);
"""
RUST_TILT = """
    let filter = {name}::filter().unwrap();
    let mut state = compfilt_core::TiltState::{state};
    for (gyr, acc) in GYR.chunks(3).zip(ACC.chunks(3)) {{
        filter.update(&{name}::GAINS, &mut state, &vector(gyr), &vector(acc));
    }}
    show("{name}", filter.angles(&state).as_slice());
"""
RUST_MAIN = """
use compfilt_core::nalgebra::Vector3;
{modules}
fn vector(bits: &[u32]) -> Vector3<f32> {{ Vector3::from_fn(|i, _| f32::from_bits(bits[i])) }}
fn show(name: &str, numbers: &[f32]) {{
    let words: Vec<_> = numbers.iter().map(|number| number.to_bits().to_string()).collect();
    println!("{{name}} {{}}", words.join(" "));
}}
const Y: [u32; 300] = [{y}];
const U: [u32; 300] = [{u}];
const GYR: [u32; 900] = [{gyr}];
const ACC: [u32; 900] = [{acc}];
fn main() {{
{body}
}}
"""
MANIFEST = """
[package]
name = "exported"
version = "0.0.0"
edition = "2024"
[dependencies]
compfilt-core = {{ path = {core} }}
[lints.rust]
warnings = "deny"
[workspace]
"""


def rust_body():
    blocks = [RUST_LINEAR.format(name=name) for name in IN_RUST] + [RUST_RATE]
    for name in ATTITUDES_IN_RUST:
        kind = {"explicit": "Mahony", "direct": "Mahony", "learning": "SelfCalibration"}.get(name, "Gravity")
        update = "gains, &mut state" if kind == "SelfCalibration" else "&gains, &mut state"
        rotation = "state.rotation" if kind == "Mahony" else "filter.attitude(&state).unwrap().0"
        blocks.append(RUST_ATTITUDE.format(name=name, state=f"{kind}State", update=update, rotation=rotation))
    for name, texts in TILTS_IN_RUST.items():
        initial = tilt(*texts).filter.stream.get("initial")
        state = "new()" if initial is None else "from_angles(&[{}_f32, {}_f32].into())".format(*initial)
        blocks.append(RUST_TILT.format(name=name, state=state))
    return "".join(f"    {{{block}    }}\n" for block in blocks)


def test_rust_gives_the_same_bits(tmp_path):
    needs("cargo")
    recipes = {name: linear(text) for name, text in (IN_RUST | {"rate": RATE}).items()}
    recipes |= {name: attitude(text) for name, text in ATTITUDES_IN_RUST.items()}
    recipes |= {name: tilt(*texts) for name, texts in TILTS_IN_RUST.items()}
    source = tmp_path / "src"
    source.mkdir()
    for name, recipe in recipes.items():
        (source / f"{name}.rs").write_text(export_recipe(recipe, "rust"), encoding="utf-8")
    arrays = {"y": floats(Y), "u": floats(U), "gyr": floats(GYR), "acc": floats(ACC)}
    modules = "\n".join(f"mod {name};" for name in recipes)
    main = RUST_MAIN.format(modules=modules, body=rust_body(), **arrays)
    (source / "main.rs").write_text(main, encoding="utf-8")
    core = json.dumps(str(ROOT / "crates" / "compfilt-core"))
    (tmp_path / "Cargo.toml").write_text(MANIFEST.format(core=core), encoding="utf-8")
    shutil.copy(ROOT / "Cargo.lock", tmp_path)
    printed = run("cargo", "run", "--quiet", cwd=tmp_path, CARGO_TARGET_DIR=str(BUILT / "exported"))
    words = {name: list(map(int, words)) for name, *words in map(str.split, printed.splitlines())}
    wanted = {name: expected(recipe) for name, recipe in recipes.items() if name != "rate"}
    assert words == wanted | {"rate": rate_expected()}


@pytest.mark.parametrize("language", ["rust", "c"])
def test_a_recipes_name_cannot_end_the_comment(language):
    recipe = replace(linear(IN_C["pi"]), source="some/x\n#error\r\u2028*.toml")
    heading = export_recipe(recipe, language, fs=100.0).splitlines()[:3]
    assert any(r"from x\n#error\r\u2028*.toml: do not" in line for line in heading)


def test_the_source_says_where_it_comes_from():
    source = export_recipe(linear(IN_C["first_order"]), "rust", fs=100.0)
    heading = source.splitlines()[:3]
    assert (
        heading[0]
        == f"//! Written by compfilt {cf.__version__} from the recipe.toml: do not change it by hand."
    )
    assert heading[1] == "//! FirstOrder(tau=0.3), sample rate 100 Hz, sample period 0.01 s."
    assert "f32::from_bits(0x3c23d70a) /* 0.01 */" in source
    assert "0x1.47ae14p-7f /* 0.01, bits 0x3c23d70a */" in export_recipe(linear(IN_C["pi"]), "c", fs=100.0)


def test_numbers_are_rounded_once():
    (number,) = numbers(0.1)
    assert (number.bits, number.decimal) == ("0x3dcccccd", "0.1")


@pytest.mark.parametrize(
    ("recipe", "to", "message"),
    [
        (
            linear(IN_RUST["split"]),
            "c",
            "Butterworth.* cannot be exported: the C interface has orders 1 and 2",
        ),
        (linear(IN_RUST["matched"]), "c", "by backward Euler; --to rust has all"),
        (linear(IN_C["pi"] + "\ndelay = 0.05"), "rust", r"\[filter\] delay cannot be exported"),
        (attitude(ATTITUDES_IN_RUST["direct"]), "c", "with ki above 0"),
        (attitude(ATTITUDES_IN_RUST["steep"]), "c", "of order 2 with split 1"),
        (tilt(*TILTS_IN_RUST["steep_tilt"]), "c", "TiltFilter.* cannot be exported: the C interface has"),
        (
            tilt("flu", 'rates = "frozen"\ndesign = { kind = "first_order", tau = 0.3 }'),
            "c",
            r"\[filter\] rates = \"frozen\" cannot be exported: it is for logs; leave rates and at out",
        ),
        (load_recipe(ROOT / "examples/recipes/cube.toml"), "c", "write it in Rust, with compfilt_core::Cube"),
        (linear(IN_C["pi"]), "ada", '"ada" is no language to export to: it is one of c, rust'),
    ],
)
def test_what_a_language_does_not_have_is_refused(recipe, to, message):
    with pytest.raises(UsageError, match=message):
        export_recipe(recipe, to)


def test_a_rate_is_needed_and_checked():
    text = LINEAR.format(filter=IN_C["pi"], unit="rad", power="")
    recipe = parse_recipe(text.replace("rate = 80.0", 'time = { column = "t", unit = "s" }'), "pi.toml")
    with pytest.raises(UsageError, match="give the chip's sample rate in Hz with --fs"):
        export_recipe(recipe, "c")
    assert "sample rate 50 Hz" in export_recipe(recipe, "c", fs=50.0)
    for wrong in (0.0, -1.0, float("nan"), 1e-30):
        with pytest.raises(UsageError, match="fs"):
            export_recipe(recipe, "c", fs=wrong)


def test_the_command(tmp_path):
    text = LINEAR.format(filter=IN_C["pi"], unit="rad", power="")
    (tmp_path / "pi.toml").write_text(text, encoding="utf-8")
    printed = compfilt("export", "pi.toml", "--to", "c", cwd=tmp_path)
    assert (printed.returncode, printed.stderr) == (0, "")
    written = compfilt("export", "pi.toml", "--to", "c", "-o", "pi.h", cwd=tmp_path)
    assert (written.returncode, written.stdout) == (0, "")
    result, header, library = written.stderr.splitlines()
    assert result == "compfilt: pi.toml -> pi.h"
    assert str(HEADER.parent) in header
    assert BUILD in library
    assert (tmp_path / "pi.h").read_text(encoding="utf-8") == printed.stdout
    one_line(compfilt("export", "pi.toml", "--to", "c", "-o", "pi.h", cwd=tmp_path), 2, "already there")
    one_line(compfilt("export", "pi.toml", "--to", "d", cwd=tmp_path), 2, '"d" is no language')


@pytest.mark.parametrize("word", ["default", "fn", "class"])
def test_a_recipe_named_like_a_word_of_the_language(word):
    source = export_recipe(replace(linear(IN_C["pi"]), source=f"{word}.toml"), "c", fs=100.0)
    assert f" recipe_{word} = {{" in source


def test_the_recipes_factors_stand_above_the_filter():
    text = TILT.format(axes="frd", filter=TILTS["rolling"][1])
    mounted = text.replace('unit = "rad/s"', 'unit = "rad/s", scale = [1, -1, -0.5]')
    heading = export_recipe(parse_recipe(mounted, "x.toml"), "c").partition("*/")[0]
    assert "The recipe multiplies gyro by 1, -1, -0.5: so must the chip, before the filter." in heading
    assert "in the recipe's axes, frd; the angles are roll and pitch." in heading
    assert "multiplies" not in export_recipe(parse_recipe(text, "x.toml"), "c")


def export_pi(folder, *options):
    (folder / "pi.toml").write_text(LINEAR.format(filter=IN_C["pi"], unit="rad", power=""), encoding="utf-8")
    return compfilt("export", "pi.toml", *options, cwd=folder)


def test_the_header_beside_the_source(tmp_path):
    header = tmp_path / "compfilt.h"
    for name in ("pi.h", "another.h"):
        done = export_pi(tmp_path, "--to", "c", "-o", name, "--with-header")
        assert done.returncode == 0, done.stderr
        assert f"{HEADER} -> compfilt.h" in done.stderr
        assert header.read_bytes() == HEADER.read_bytes()


def test_another_header_is_replaced_by_force_only(tmp_path):
    header = tmp_path / "compfilt.h"
    header.write_text("of another release", encoding="utf-8")
    options = ("--to", "c", "-o", "pi.h", "--with-header")
    one_line(export_pi(tmp_path, *options), 2, "compfilt.h: is already there")
    assert not (tmp_path / "pi.h").exists()
    assert export_pi(tmp_path, *options, "--force").returncode == 0
    assert header.read_bytes() == HEADER.read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--to", "rust", "-o", "pi.rs", "--with-header"), "--with-header goes with --to c and -o FILE"),
        (("--to", "c", "--with-header"), "--with-header goes with --to c and -o FILE"),
        (("--to", "c", "-o", "compfilt.h"), "compfilt.h is the header that the source includes"),
    ],
)
def test_a_header_without_a_place_is_refused(tmp_path, options, message):
    one_line(export_pi(tmp_path, *options), 2, message)
    assert {path.name for path in tmp_path.iterdir()} == {"pi.toml"}
