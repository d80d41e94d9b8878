"""A module for Rust, on top of compfilt-core."""

from collections.abc import Iterable

import compfilt
from compfilt.logs.export.subject import Number, Subject, numbers
from compfilt.logs.kinds.attitude import Attitude
from compfilt.logs.kinds.tilt import Tilt

__all__ = ["rust_source"]

_AXES = {"flu": "Flu", "frd": "Frd", "cube": "Cube"}
_FORMS = {"explicit": "Explicit", "passive": "Passive", "direct": "Direct"}


def rust_source(subject: Subject) -> str:
    """Write a module with constant gains and a function that makes the filter."""
    heading = "\n".join(f"//! {line}" for line in subject.heading)
    body = _attitude(subject) if isinstance(subject.filter, Attitude) else _linear(subject)
    return f"{heading}\n\n{body}"


def _literal(number: Number) -> str:
    """Write a number by its bits; the decimal is for people."""
    return f"f32::from_bits({number.bits}) /* {number.decimal} */"


def _one(value: float) -> str:
    return _literal(numbers(value)[0])


def _array(values: Iterable[Number]) -> str:
    return "[" + ", ".join(_literal(value) for value in values) + "]"


def _linear(subject: Subject) -> str:
    """Write the gains of a linear design, and the stream, or the tilt filter, that has the policies."""
    gains, design = subject.gains(), subject.design
    order, derivative_order = design.order, design.derivative_order
    chain = f"compfilt_core::Chain<f32, {order}, {derivative_order}>"
    made = f"compfilt_core::Chain::<f32, {order}, {derivative_order}>::new({_array(gains['coefficients'])})?"
    if design.split != order:
        kind, type_ = (
            f"compfilt_core::linear::SplitGains<f32, {order}>",
            f"compfilt_core::Split<f32, {order}>",
        )
        parts = ["dt", "half_dt", "feedback", "damping", "correction"]
        made += f".split({design.split})?"
    else:
        kind, type_ = f"compfilt_core::Gains<f32, {order}, {derivative_order}>", chain
        parts = ["shifts", "ramp", "correction"]
    single = ("dt", "half_dt", "damping")
    arguments = [_literal(gains[part][0]) if part in single else _array(gains[part]) for part in parts]
    constant = f"<{kind}>::from_parts(\n    " + ",\n    ".join(arguments) + ",\n)"
    if subject.rule == "matched":
        type_ = f"compfilt_core::Matched<f32, {order}, {derivative_order}>"
        made += ".matched()"
    if isinstance(design, compfilt.RateFilter):
        kind, type_ = "compfilt_core::linear::RateGains<f32>", "compfilt_core::RateFilter<f32>"
        constant = f"compfilt_core::linear::RateGains::from_parts({constant})"
        made = f"compfilt_core::RateFilter::new({_one(design.tau)})?"
    return (
        f"/// The gains, {', '.join(parts)}: `GAINS.step(&mut state, y, u)` where every sample is there.\n"
        f"pub const GAINS: {kind} = {constant};\n\n" + _policies(subject, type_, made)
    )


def _policies(subject: Subject, type_: str, made: str) -> str:
    """Write the function that makes what meets missing samples."""
    options = subject.filter.stream
    if isinstance(subject.filter, Tilt):
        kind = f"compfilt_core::TiltFilter<f32, {type_}>"
        axes = f"compfilt_core::Axes::{_AXES[subject.axes]}"
        steps = [f"compfilt_core::TiltFilter::new({made}, {axes})"]
    else:
        kind = f"compfilt_core::Stream<f32, {type_}>"
        steps = [f"compfilt_core::Stream::new({made})"]
    if options.get("input") == "trapezoid":
        steps.append(".input(compfilt_core::Input::Trapezoid)")
    if options.get("period"):
        steps.append(f".period({_one(options['period'])})?")
    steps.append(f".hold({_one(subject.hold)})")
    return (
        "/// The filter with what happens to missing samples: `filter.update(&GAINS, &mut state, ...)`.\n"
        "///\n/// # Errors\n/// None: the numbers were checked when they were written.\n"
        f"pub fn filter() -> Result<{kind}, compfilt_core::Error> {{\n    "
        + "\n        ".join(steps)
        + "\n}\n"
    )


def _attitude(subject: Subject) -> str:
    """Write a function that makes an attitude filter and its gains."""
    design = subject.design
    if isinstance(design, compfilt.Mahony):
        return _mahony(subject, design)
    return _gravity(subject, design)


def _mahony(subject: Subject, design: compfilt.Mahony) -> str:
    coefficients = [design.kp, design.ki] if design.ki > 0.0 else [design.kp]
    order = len(coefficients)
    settings = [f".bias_limit({_one(design.bias_limit)})?", f".hold({_one(subject.hold)})?"]
    if design.acc_range is not None:
        settings.append(f".force_range({_one(design.acc_range)})?")
    form = f"compfilt_core::attitude::MahonyForm::{_FORMS[design.form]}"
    return _maker(
        f"(compfilt_core::attitude::Mahony<f32, {order}>, compfilt_core::Gains<f32, {order}, 1>)",
        [
            f"let design = compfilt_core::Chain::<f32, {order}, 1>::new({_array(numbers(coefficients))})?;",
            f"let filter = compfilt_core::attitude::Mahony::new(design, {form})",
            *(f"    {setting}" for setting in _closed(settings)),
            f"Ok((filter, compfilt_core::Discretise::at(&design, {_period(subject)})?))",
        ],
    )


def _gravity(subject: Subject, design: compfilt.GravityFilter) -> str:
    settings = [
        ".rest(compfilt_core::attitude::RestRule::default()",
        f"    .time({_one(design.rest_time)})?",
        f"    .rate({_one(design.rest_rate)})?",
        f"    .force({_one(design.rest_force)})?",
        f"    .drift({_one(design.rest_drift)})?",
        f"    .bias_limit({_one(design.bias_limit)})?)",
        f".heading(compfilt_core::attitude::HeadingRule::new({_one(design.heading_tau)})?)",
        f".delay({_one(design.gyro_delay)})?",
        f".advance({_one(design.advance)})?",
        f".hold({_one(subject.hold)})?",
    ]
    if design.acc_range is not None:
        settings.append(f".force_range({_one(design.acc_range)})?")
    if design.self_calibrating:
        if design.calibration is not None:
            known = [_one(value) for row in design.calibration for value in row]
            settings.append(f".calibrated(compfilt_core::nalgebra::Matrix3::new({', '.join(known)}))")
        zeta = 0.5 if design.zeta is None else design.zeta
        return _maker(
            "(compfilt_core::attitude::SelfCalibratingFilter<f32>, compfilt_core::Dt<f32>)",
            [
                "let filter = compfilt_core::attitude::SelfCalibratingFilter::new(",
                f"    {_one(design.tau)}, {_one(zeta)})?",
                *(f"    {setting}" for setting in _closed(settings)),
                f"Ok((filter, compfilt_core::Dt::new({_period(subject)})?))",
            ],
        )
    return _maker(
        f"(compfilt_core::attitude::GravityFilter<f32, {design.order}>, "
        f"compfilt_core::linear::SplitGains<f32, {design.order}>)",
        [
            *_gravity_design(design),
            *(f"    {setting}" for setting in _closed(settings)),
            f"let gains = filter.at({_period(subject)})?;",
            "Ok((filter, gains))",
        ],
    )


def _gravity_design(design: compfilt.GravityFilter) -> list[str]:
    """Write what the core computes from tau and the order."""
    order, split = design.order, design.split
    if order == 2 and split == 1 and design.zeta is not None:
        return [
            "let filter = compfilt_core::attitude::GravityFilter::<f32, 2>::second_order(",
            f"    {_one(design.tau)}, {_one(design.zeta)})?",
        ]
    lines = [f"let omega0 = compfilt_core::nalgebra::ComplexField::sqrt(2.0_f32) / {_one(design.tau)};"]
    if order == 2 and design.zeta is not None:
        lines.append(f"let coefficients = [{_one(2.0 * design.zeta)} * omega0, omega0 * omega0];")
        lines.append("let design = compfilt_core::Chain::<f32, 2, 1>::new(coefficients)?;")
    else:
        lines.append(f"let design = compfilt_core::Butterworth::<f32, {order}>::new(omega0)?;")
    return [*lines, f"let filter = compfilt_core::attitude::GravityFilter::new(design.split({split})?)?"]


def _closed(settings: list[str]) -> list[str]:
    """End a chain of calls."""
    return [*settings[:-1], settings[-1] + ";"]


def _period(subject: Subject) -> str:
    return f"1.0 / {_one(subject.fs)}"


def _maker(kind: str, body: list[str]) -> str:
    lines = "\n".join(f"    {line}" for line in body)
    return (
        "/// Makes the filter and its gains: call it once, before the first sample.\n"
        "///\n/// # Errors\n/// None: the numbers were checked when they were written.\n"
        f"pub fn filter() -> Result<{kind}, compfilt_core::Error> {{\n{lines}\n}}\n"
    )
