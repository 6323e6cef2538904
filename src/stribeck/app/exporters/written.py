"""Table of an export: Coulomb and viscous friction in the model, identified and written, by joint."""

from collections.abc import Mapping

from stribeck.app.exporters.joints import FORMLESS, WrittenJoint
from stribeck.core.base.text_table import aligned
from stribeck.core.errors import RobotFileError
from stribeck.core.result import JointResult, Result
from stribeck.core.result.tables import bound_text
from stribeck.core.robot import Robot
from stribeck.design import read_friction

LEGEND = "Coulomb friction at mean load + viscous friction times the speed v, in N m and rad/s, or N and m/s:"


def table_of_joints(result: Result, robot: Robot, joints: Mapping[str, WrittenJoint]) -> list[str]:
    """Format one line per joint with Coulomb friction Fc and viscous friction Fv as "Fc + Fv v", and rotor inertia.

    The difference between written and identified friction is the largest from the slow to the top speed of the log,
    at the mean load and over its positions. Empty for targets that store all of the law.
    """
    model = _in_the_model(robot)
    rows = [
        (
            name,
            _sum(model.get(name)),
            _identified(result[name]),
            _sum(terms.plain),
            terms.difference or (_shift(result[name], terms) if terms.plain else "-"),
            next((f"{value:.4g}" for value, unit in terms.stated.values() if unit == "kg m^2"), "-"),
        )
        for name, terms in joints.items()
        if any(each.plain for each in joints.values())
    ]
    head = ("joint", "in the model", "identified", "written", "largest difference", "rotor [kg m^2]")
    return [LEGEND, *aligned([head, *rows])] if rows else []


def _shift(joint: JointResult, terms: WrittenJoint) -> str:
    """State how far the written friction is from the identified curve, where other parameters had to change with it."""
    assert terms.plain is not None
    dry, viscous, _ = terms.plain
    sizes = [(abs(dry + viscous * point.velocity - point.value), point) for point in joint.curve]
    size, point = max(sizes, key=lambda pair: pair[0], default=(0.0, None))
    if point is None or joint.verdict == "no friction" or size < 0.05 * point.half_width:  # rounded numbers
        return "none"
    speed, torque = joint.units()
    return f"{size:.2g} {torque} at {point.velocity:.2g} {speed}"


def _in_the_model(robot: Robot) -> dict[str, tuple[float, float, bool]]:
    """Read Coulomb and viscous friction of the joints of the model file; empty without a file, or without a number."""
    try:
        stated = read_friction(robot.model_file)[0]
    except RobotFileError:
        return {}
    return {name: (own.coulomb, own.viscous, own.rise > 0) for name, own in stated.items()}


def _identified(joint: JointResult) -> str:
    """Format identified friction, mean of both directions; "..." stands for terms beyond Coulomb and viscous ones."""
    if joint.verdict == "no friction":
        return bound_text(joint) or "none"
    coefficients = {
        key: [joint.values[key + way] for way in ("", "_positive", "_negative") if key + way in joint.values]
        for key in ("coulomb", "viscous")
    }
    means = [sum(values) / len(values) if values else 0.0 for values in coefficients.values()]
    means[0] += joint.values.get("load", 0.0) * (joint.mean_load or 0.0)
    ways = {f"{key}{way}" for key in coefficients for way in ("", "_positive", "_negative")}
    others = joint.values.keys() - {"slope", *FORMLESS, *ways}
    return _sum((means[0], means[1], bool(others)))


def _sum(friction: tuple[float, float, bool] | None) -> str:
    return f"{friction[0]:.3g} + {friction[1]:.3g} v" + " + ..." * friction[2] if friction else "-"
