"""Whatever a result holds that its schema allows, it can be kept, read, drawn, printed, compared and exported."""

import io
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.exporters.found import found_in
from tests.result.made import estimate, joint, result
from tests.robot.test_robot import MJCF, URDF, write_robot
from tests.samples import make_samples

from stribeck.cli import console
from stribeck.cli.truth import print_truth
from stribeck.errors import SettingsError, StribeckError
from stribeck.exporters import export
from stribeck.friction import AUTO, LAWS, get_law
from stribeck.friction.terms import BEYOND_VELOCITY, LADDER
from stribeck.friction_torque.samples import FrictionSamples
from stribeck.log.sampling import LARGEST
from stribeck.report import write_report
from stribeck.result import (
    BodyCorrection,
    Corrections,
    CurvePoint,
    Evidence,
    JointResult,
    LogSummary,
    ParameterEstimate,
    Result,
    TermVerdict,
    TorqueR2,
    Validation,
    read_result,
)
from stribeck.result.compare import compare, compare_sides
from stribeck.robot import Robot

EXTREMES = st.sampled_from([0.0, -0.0, 5e-324, 1e-300, 1e-9, 0.5, 1.0, 1e7, 1e300, -1e-300, -1.0, -1e300])
NUMBERS = st.one_of(EXTREMES, st.floats(-100, 100))
POSITIVE = NUMBERS.map(abs)
PAIRS = st.tuples(NUMBERS, NUMBERS)
RANGES = PAIRS.map(lambda pair: tuple(sorted(pair)))
NAMES = st.one_of(
    st.sampled_from(["left_knee", "right_knee", "shoulder", "elbow", "slide", "<b>&\"'", "[red]", "a/b.c_d", "$x_1$"]),
    st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8),
)
TEXTS = st.one_of(st.text(st.characters(exclude_categories=["Cs"]), max_size=30), st.just("friction [/] & <x> " * 40))
QUICK = settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
SLOW = settings(QUICK, max_examples=10)
"""Figures take most of the time."""


OF_FIELDS = {
    "value": NUMBERS,
    "interval_95": RANGES,
    "unit": st.sampled_from(["N m", "N", "1", "kg m^2"]),
    "verdict": st.sampled_from(["identified", "weak", "no friction", "not excited"]),
}
"""By the name of a field; other fields are positive numbers."""


def built(kind: type, fields: str) -> st.SearchStrategy[Any]:
    return st.builds(kind, **{name: OF_FIELDS.get(name, POSITIVE) for name in fields.split()})


ESTIMATES = built(ParameterEstimate, "value standard_error interval_95 unit verdict")
POINTS = built(CurvePoint, "velocity value standard_error interval_95 unit")
VALIDATIONS = built(Validation, "rms rms_zero_friction rms_coulomb_only")
DECISIONS = st.sampled_from(["kept", "refused", "open"])
TERMS = st.builds(TermVerdict, verdict=DECISIONS, reason=TEXTS)
TERMS |= st.builds(TermVerdict, verdict=DECISIONS, reason=TEXTS, gain=NUMBERS, gain_error=POSITIVE)
R2 = st.builds(TorqueR2, nominal=NUMBERS, corrected=st.none() | NUMBERS)
TRIPLES = st.tuples(NUMBERS, NUMBERS, NUMBERS)
SIXES = st.tuples(*[NUMBERS] * 6)
BODIES = st.builds(
    BodyCorrection,
    mass=PAIRS,
    mass_error=POSITIVE,
    centre_of_mass=st.tuples(TRIPLES, TRIPLES),
    centre_of_mass_error=TRIPLES,
    inertia=st.tuples(SIXES, SIXES),
    known=st.floats(0, 1),
)


@st.composite
def joints(draw: Callable[..., Any], law: str) -> JointResult:
    """Draw a joint: one without numbers, or with those of the law, some of its terms left out, and a rotor inertia."""
    parameters = [*get_law(law).parameters, *(BEYOND_VELOCITY if law == AUTO else ())]
    names = [p.name for p in parameters if p.neutral is None or draw(st.booleans())]
    names += draw(st.sampled_from([[], ["armature"]]))
    excited = draw(st.booleans())
    terms = st.fixed_dictionaries({term.name: TERMS for term in LADDER})
    row = st.tuples(*[st.floats(-1, 1)] * len(names))
    return JointResult(
        parameters={name: draw(ESTIMATES) for name in names if excited},
        verdict=draw(OF_FIELDS["verdict"]),
        reason=draw(TEXTS),
        samples=draw(st.sampled_from([0, 1, 10**12])),
        velocity_range=draw(RANGES),
        reversals=draw(st.integers(0, 10**9)),
        residual_rms=draw(st.none() | POSITIVE),
        validation=draw(st.none() | VALIDATIONS),
        positive_power_fraction=draw(st.none() | st.floats(0, 1)),
        terms=draw(st.none() | terms) if law == AUTO else None,
        mean_load=draw(st.none() | NUMBERS) if law == AUTO else None,
        position_range=draw(st.none() | RANGES),
        correlation=draw(st.none() | st.tuples(*[row] * len(names))) if excited else None,
        load_deviation=draw(st.none() | POSITIVE) if law == AUTO else None,
        curve=draw(st.just(()) | st.tuples(POINTS, POINTS, POINTS)),
        torque_r2=draw(st.none() | R2),
        mean_direction=draw(st.none() | st.tuples(NUMBERS, NUMBERS)) if law == AUTO else None,
    )


@st.composite
def results(draw: Callable[..., Any], law: str | None = None, names: st.SearchStrategy[str] = NAMES) -> Result:
    """Draw a result without evidence."""
    law = law or draw(st.sampled_from([*LAWS, AUTO]))
    calibration = st.dictionaries(names, st.tuples(NUMBERS, POSITIVE), max_size=2)
    corrections = st.builds(
        Corrections,
        chi_square=POSITIVE,
        disagreement=POSITIVE,
        bodies=st.dictionaries(names, BODIES, max_size=2),
        torque_gain=calibration,
        encoder_zero=calibration,
        torque_delay=st.none() | st.tuples(NUMBERS, POSITIVE),
        base_delay=st.none() | st.tuples(NUMBERS, POSITIVE),
    )
    paths = draw(st.one_of(TEXTS, st.lists(TEXTS, min_size=1, max_size=3)))
    return Result(
        robot=draw(NAMES),
        log=LogSummary(
            path=paths,
            sha256="ab" if isinstance(paths, str) else ["ab"] * len(paths),
            duration=draw(POSITIVE),
            rate=draw(st.sampled_from([1e-6, 0.5, 1e3, 1e9])),
            samples_used=draw(st.integers(0, 10**12)),
        ),
        law=law,
        method=draw(st.sampled_from(["curve-fit", "whole-log"])),
        joints=draw(st.dictionaries(names, joints(law), max_size=2)),
        warnings=draw(st.lists(TEXTS, max_size=2)),
        stribeck="0",
        corrections=draw(st.none() | corrections),
    )


@st.composite
def evidence(draw: Callable[..., Any], result: Result) -> Evidence:
    """Draw what the report shows beside a result: few samples, of any size, some of them not known."""
    names = tuple(result.joints)
    samples = draw(_samples(names))
    spans = st.tuples(st.floats(0, 10), st.floats(0, 40), NAMES, st.booleans())
    return Evidence(
        samples=samples,
        phases=[(start, start + length, foot, used) for start, length, foot, used in draw(st.lists(spans, max_size=3))],
        close_up=draw(st.none() | _samples(names)),
        provenance=draw(st.lists(st.tuples(TEXTS, TEXTS), max_size=2)),
        notes=draw(st.lists(TEXTS, max_size=2)),
        prismatic=frozenset(draw(st.lists(st.sampled_from(names), max_size=1))) if names else frozenset(),
        correction=(samples, samples) if draw(st.booleans()) else None,
    )


@st.composite
def _samples(draw: Callable[..., Any], names: tuple[str, ...]) -> FrictionSamples:
    size = draw(st.sampled_from([0, 1, 2, 40]))
    shape, generator = (size, len(names)), np.random.default_rng(draw(st.integers(0, 3)))
    scale = draw(st.sampled_from([0.0, 1e-300, 1.0, LARGEST]))
    return make_samples(
        generator.normal(size=shape) * draw(st.sampled_from([0.0, 1e-9, 1.0])),
        np.where(generator.random(shape) < 0.1, np.nan, generator.normal(size=shape) * scale),
        names,
        acceleration=generator.normal(size=shape),
        usable=generator.random(shape) < 0.8,
    )


def printed(show: Callable[[Any], None], found: Any) -> str:
    with redirect_stdout(io.StringIO()) as out:
        show(found)
    return out.getvalue()


def done_or_refused(action: Callable[[], Any]) -> Any:
    """Return what an action returns, None where it is refused."""
    with suppress(StribeckError):
        return action()
    return None


@QUICK
@given(results())
def test_any_result_is_read_as_it_was_written(tmp_path: Path, result: Result) -> None:
    (tmp_path / "result.json").write_text(result.to_json(), encoding="utf-8")
    assert read_result(tmp_path / "result.json") == result


@QUICK
@given(results())
def test_any_result_is_printed(result: Result) -> None:
    assert printed(console.print_result, result)
    truth = {name: dict.fromkeys(joint.parameters, 1.0) for name, joint in result.joints.items()}
    assert printed(lambda found: print_truth(found, truth), result)


@QUICK
@given(st.sampled_from([*LAWS, AUTO]).flatmap(lambda law: st.tuples(results(law), results(law))))
def test_any_two_results_are_compared(pair: tuple[Result, Result]) -> None:
    for found in (done_or_refused(lambda: compare(*pair)), done_or_refused(lambda: compare_sides(pair[0]))):
        if found is not None:
            assert found.to_json()
            assert printed(console.print_comparison, found)


@SLOW
@given(results().flatmap(lambda result: st.tuples(st.just(result), evidence(result))))
def test_any_result_is_drawn(tmp_path: Path, drawn: tuple[Result, Evidence]) -> None:
    result = replace(drawn[0], evidence=drawn[1])
    write_report(result, tmp_path / "report.html")
    assert "</html>" in (tmp_path / "report.html").read_text(encoding="utf-8")


@QUICK
@given(st.sampled_from([(URDF, "arm.urdf", "urdf"), (MJCF, "arm.xml", "mjcf")]), st.data())
def test_any_result_is_exported_or_refused(tmp_path: Path, model: tuple[str, str, str], data: st.DataObject) -> None:
    text, name, target = model
    robot = Robot.from_file(write_robot(tmp_path, model=text, name=name))
    result = data.draw(results(names=st.sampled_from(robot.joint_names)))
    if result.corrections and data.draw(st.booleans()):
        result = replace(result, corrections=_of_this_robot(result.corrections, robot))
    path = tmp_path / f"out.{name}"
    path.unlink(missing_ok=True)
    if done_or_refused(lambda: export(result, robot, path, target)) is not None:
        ElementTree.parse(path)
    else:
        assert not path.exists()


def _of_this_robot(corrections: Corrections, robot: Robot) -> Corrections:
    """Let the bodies be those of the robot before they were corrected."""
    model, lower = robot.tree.model, np.tril_indices(3)
    bodies = {}
    for name, body in corrections.bodies.items():
        inertia = model.inertias[model.getJointId(name)]
        bodies[name] = replace(
            body,
            mass=(float(inertia.mass), body.mass[1]),
            centre_of_mass=(tuple(inertia.lever.tolist()), body.centre_of_mass[1]),
            inertia=(tuple(inertia.inertia[lower].tolist()), body.inertia[1]),
        )
    return replace(corrections, bodies=bodies)


def plain(name: str = "shoulder", value: float = 1.0, standard_error: float = 0.1) -> Result:
    """Return a result with one parameter of one joint."""
    found = replace(estimate(1.0), value=value, standard_error=standard_error)
    made = result("coulomb-viscous", "walk.npz", **{name: joint({"coulomb": found}, samples=9)})
    return replace(made, robot="arm")


@pytest.mark.parametrize("name", ["[/]", "[red]", "[left]", ":cat:", "left's", "el\\", "\\[x]"])
def test_names_are_printed_as_they_are(name: str) -> None:
    result = replace(plain(name), robot=name)
    silent = replace(result.joints[name], parameters={}, reason=name)
    assert printed(console.print_result, result).count(name) == 3  # title, line, parameters
    assert f"{name}\\" not in printed(console.print_result, result)
    assert printed(console.print_comparison, compare(result, result)).count(name) == 1
    quiet = replace(result, joints={name: silent})
    assert printed(lambda found: print_truth(found, {}), quiet).count(name) == 3


@pytest.mark.parametrize("name", ["walk---1.npz", "walk\x01.npz", "walk\n-->.npz"])
def test_a_model_may_name_any_log(tmp_path: Path, name: str) -> None:
    robot = Robot.from_file(write_robot(tmp_path))
    result, _ = found_in(robot)
    export(replace(result, log=replace(result.log, path=name)), robot, tmp_path / "out.urdf", "urdf")
    ElementTree.parse(tmp_path / "out.urdf")


UNSOUND = {
    "not a number": ('"value": 1.0', '"value": NaN', "is not JSON"),
    "infinite": ('"value": 1.0', '"value": 1e999', "is not JSON"),
    "text": ('"value": 1.0', '"value": "1"', "key 'joints.shoulder.parameters.coulomb.value' is '1'"),
    "no interval": ("[\n            0.8,\n            1.2\n          ]", "[0.8]", "parameters.coulomb.interval_95"),
    "a truth for a number": ('"samples": 9', '"samples": true', "key 'joints.shoulder.samples' is True"),
    "nothing": ('"joints": {', '"joints": null, "x": {', "key 'joints' is None"),
    "deep": ('"schema": 1', '"schema": 1, "x": ' + "[" * 10**5 + "]" * 10**5, "is not JSON"),
    "mark": ("{\n", "\ufeff{\n", None),
}


@pytest.mark.parametrize("case", UNSOUND)
def test_an_unsound_result_is_refused_by_key(tmp_path: Path, case: str) -> None:
    old, new, words = UNSOUND[case]
    text = plain().to_json()
    assert old in text
    path = tmp_path / "result.json"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    if words is None:
        assert read_result(path) == plain()
        return
    with pytest.raises(SettingsError, match=words) as caught:
        read_result(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert len(str(caught.value)) < 600
