"""A header for C, on top of compfilt.h."""

from collections.abc import Iterable, Mapping

import numpy as np

import compfilt
from compfilt.logs.export.subject import Number, Subject, numbers
from compfilt.logs.kinds.attitude import Attitude
from compfilt.logs.kinds.tilt import Tilt

__all__ = ["c_source"]

_FILTERS = {(1, 1): "CompfiltFilter1", (2, 1): "CompfiltFilter2", (3, 2): "CompfiltFilter3"}
"""The types of the C interface, by order and derivative order."""

_FORMS = {"explicit": "EXPLICIT", "passive": "PASSIVE", "direct": "DIRECT"}

_NO_CAP = float(np.finfo(np.float32).max)


def c_source(subject: Subject) -> str:
    """Write a header with a constant filter, or with a function that makes one."""
    guard = f"COMPFILT_EXPORTED_{subject.name.upper()}_H"
    heading = "\n".join(f" * {line}" for line in subject.heading)
    match subject.filter:
        case Attitude():
            body = _attitude(subject)
        case Tilt():
            body = _tilt(subject)
        case _:
            body = _linear(subject)
    return (
        f'/*\n{heading}\n */\n#ifndef {guard}\n#define {guard}\n\n#include "compfilt.h"\n\n{body}\n#endif\n'
    )


def _literal(number: Number) -> str:
    """Write a number exactly, in hexadecimal; the decimal and the bits are for people."""
    mantissa, _, exponent = float(number.value).hex().partition("p")
    if "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return f"{mantissa}p{exponent}f /* {number.decimal}, bits {number.bits} */"


def _linear(subject: Subject) -> str:
    """Write the constant filter of a linear design, with the function that it is for."""
    rate = isinstance(subject.design, compfilt.RateFilter)
    used = "compfilt_rate_update" if rate else f"compfilt_update_{subject.design.order}"
    return f"/* For {used}. */\n{_constant(subject)}"


def _tilt(subject: Subject) -> str:
    """Write the constant filter of both angles and their axes, and a start where the recipe has one."""
    order, stream = subject.design.order, subject.filter.stream
    axes = f"{subject.name}_axes"
    start = _tilt_start(subject, *stream["initial"]) if "initial" in stream else ""
    return (
        f"/* For compfilt_tilt_update_{order} and compfilt_tilt_angles_{order}, with {axes}. */\n"
        f"{_constant(subject)}\n"
        f"static const uint8_t {axes} = COMPFILT_AXES_{subject.axes.upper()};\n{start}"
    )


def _tilt_start(subject: Subject, first: float, second: float) -> str:
    """Write a function that starts both angles in rad."""
    order = subject.design.order
    one, other = (_literal(number) for number in numbers([first, second]))
    return f"""
/* Starts where the recipe does, in the place of compfilt_tilt_start_{order}. */
static inline CompfiltStatus {subject.name}_start(CompfiltTiltState{order} *state) {{
    const CompfiltStatus status = compfilt_start_{order}_at(&state->angles[0], {one});
    if (status != COMPFILT_STATUS_OK) {{
        return status;
    }}
    return compfilt_start_{order}_at(&state->angles[1], {other});
}}
"""


def _constant(subject: Subject) -> str:
    """Write the filter of a linear design as a constant."""
    design, options = subject.design, subject.filter.stream
    kind = _FILTERS.get((design.order, design.derivative_order))
    if kind is None or design.split != design.order or subject.rule != "backward_euler":
        raise subject.refuse(
            "the C interface has orders 1 and 2 with a first derivative and order 3 with a second, without a split, "
            "by backward Euler; --to rust has all"
        )
    gains = subject.gains()
    settings = {
        "period": options.get("period") or 0.0,
        "hold": subject.hold,
        "gap_cap": _NO_CAP,
    }
    trapezoid = int(options.get("input") == "trapezoid")
    lines = [
        *_field("coefficients", gains["coefficients"]),
        f"    {trapezoid}, /* input */",
        *(f"    {_literal(numbers(value)[0])}, /* {name} */" for name, value in settings.items()),
        *(line for name in ("shifts", "ramp", "correction") for line in _field(name, gains[name])),
    ]
    return f"static const {kind} {subject.name} = {{\n" + "\n".join(lines) + "\n};\n"


def _field(name: str, values: Iterable[Number]) -> list[str]:
    return ["    {", *(f"        {_literal(value)}," for value in values), f"    }}, /* {name} */"]


def _attitude(subject: Subject) -> str:
    """Write a function that makes an attitude filter."""
    design = subject.design
    if isinstance(design, compfilt.Mahony):
        return _mahony(subject, design)
    return _gravity(subject, design)


def _mahony(subject: Subject, design: compfilt.Mahony) -> str:
    if design.ki == 0.0:
        raise subject.refuse("the C interface has Mahony's filter with ki above 0; --to rust has both")
    settings = {"bias_limit": design.bias_limit, "sensors.hold": subject.hold}
    if design.acc_range is not None:
        settings["sensors.force_range"] = design.acc_range
    kp, ki, fs = (_literal(number) for number in numbers([design.kp, design.ki, subject.fs]))
    return _maker(
        subject,
        "CompfiltMahony",
        [
            "    const CompfiltStatus status = compfilt_mahony(",
            f"        {kp},",
            f"        {ki},",
            f"        COMPFILT_MAHONY_FORM_{_FORMS[design.form]},",
            f"        1.0f / {fs}, filter);",
        ],
        settings,
    )


def _gravity(subject: Subject, design: compfilt.GravityFilter) -> str:
    if not design.self_calibrating and (design.order, design.split) != (2, 1):
        raise subject.refuse(
            "the C interface has the gravity filter of order 2 with split 1; --to rust has all"
        )
    fields = {
        "tau": design.tau,
        "zeta": 0.5 if design.zeta is None else design.zeta,
        "gyro_delay": design.gyro_delay,
        "advance": design.advance,
        "hold": subject.hold,
        "acc_range": design.acc_range or 0.0,
        "rest_time": design.rest_time,
        "rest_rate": design.rest_rate,
        "rest_force": design.rest_force,
        "rest_drift": design.rest_drift,
        "bias_limit": design.bias_limit,
        "heading_tau": design.heading_tau,
    }
    kind = "calibrating" if design.self_calibrating else "gravity"
    known = design.calibration or []
    (fs,) = numbers(subject.fs)
    return _maker(
        subject,
        f"Compfilt{kind.title()}",
        [
            "    static const CompfiltGravityDesign design = {",
            *(f"        {_literal(numbers(value)[0])}, /* {name} */" for name, value in fields.items()),
            "    };",
            f"    const CompfiltStatus status = compfilt_{kind}(&design, 1.0f / {_literal(fs)}, filter);",
        ],
        {f"known[{j}][{i}]": value for i, row in enumerate(known) for j, value in enumerate(row)},
    )


def _maker(subject: Subject, kind: str, body: list[str], settings: Mapping[str, float]) -> str:
    """Write a function that makes a filter and changes some of its numbers."""
    lines = [
        "/* Makes the filter: call it once, before the first sample. */",
        f"static inline CompfiltStatus {subject.name}_make({kind} *filter) {{",
        *body,
    ]
    if settings:
        lines += ["    if (status != COMPFILT_STATUS_OK) {", "        return status;", "    }"]
        lines += [f"    filter->{name} = {_literal(numbers(value)[0])};" for name, value in settings.items()]
    return "\n".join([*lines, "    return status;", "}", ""])
