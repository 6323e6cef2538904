"""Actuators of Isaac Lab: joint friction and rotor inertias as keywords of any of its actuator configurations.

`friction` and `dynamic_friction` are efforts [N m], [N], and `viscous_friction` is in [N m s/rad], [N s/m], since
Isaac Sim 5.0 (PhysX 5.6); before, `friction` was a coefficient without a unit.
"""

import re
from collections import defaultdict
from collections.abc import Mapping

from stribeck.export.forms import plain
from stribeck.export.python_text import dictionary_text, docstring
from stribeck.export.ranges import JointRanges
from stribeck.export.target import Request, Target

MODULE = '''
ACTUATORS = [
{groups}
]
"""Keywords of an actuator configuration, in SI units, of joints of which the same was found.

`friction` is the effort that holds at rest, `dynamic_friction` the one of a moving joint. For Isaac Sim 5.0 and newer.
"""


def actuators(stiffness=None, damping=None, **settings):
    """Return the `actuators` of an ArticulationCfg; gains that are None are those of the USD file."""
    from isaaclab.actuators import ImplicitActuatorCfg

    return {{
        f"friction_{{k}}": ImplicitActuatorCfg(stiffness=stiffness, damping=damping, **found, **settings)
        for k, found in enumerate(ACTUATORS)
    }}
'''

EVENTS = '''
{ranges}
"""Joint -> keyword of its actuator -> lowest and highest value, in SI units."""

{scales}
"""Joint -> lowest and highest friction as a whole over the one found [1]."""


def events(asset="robot", mode="startup"):
    """Return event terms by name, of a robot whose actuators are those of `--to isaaclab` (Isaac Lab 2.3, 3.0).

    `randomize_joint_parameters` draws static, dynamic and viscous friction from one range, each by itself, so that it
    scales them, and friction as a whole stays in the range that was found.
    """
    from isaaclab.envs import mdp
    from isaaclab.managers import EventTermCfg, SceneEntityCfg

    def term(joint, **params):
        params = {{"asset_cfg": SceneEntityCfg(asset, joint_names=[PATTERNS[joint]]), **params}}
        return EventTermCfg(func=mdp.randomize_joint_parameters, mode=mode, params=params)

    terms = {{}}
    for k, (joint, found) in enumerate(RANGES.items()):
        if joint in SCALES:
            terms[f"friction_{{k}}"] = term(joint, friction_distribution_params=SCALES[joint], operation="scale")
        if "armature" in found:
            terms[f"armature_{{k}}"] = term(joint, armature_distribution_params=found["armature"], operation="abs")
    return terms


{patterns}
"""Joint -> regular expression of its name."""
'''


def isaaclab_ranges(lines: list[str], joints: Mapping[str, JointRanges]) -> str:
    """Return the module of ranges."""
    return docstring(lines) + EVENTS.format(
        ranges=dictionary_text("RANGES", {name: own.numbers for name, own in joints.items()}),
        scales=dictionary_text("SCALES", {name: own.friction for name, own in joints.items() if own.friction}),
        patterns=dictionary_text("PATTERNS", {name: re.escape(name) for name in joints}),
    )


def isaaclab_text(request: Request) -> str:
    """Return the module.

    Isaac Lab takes zero for a joint that a dictionary of its group lacks, so that a group has joints of which the same
    is stated.
    """
    groups: dict[tuple[str, ...], list[str]] = defaultdict(list)
    for name, terms in request.joints.items():
        groups[tuple(sorted(terms.stated))].append(name)
    rows = []
    for words, names in groups.items():
        patterns = {name: re.escape(name) for name in names}
        rows += ["    {", f'        "joint_names_expr": {list(patterns.values())!r},']
        for word in words:
            values = {patterns[name]: request.joints[name].stated[word][0] for name in names}
            rows.append(f'        "{word}": {values!r},')
        rows.append("    },")
    return docstring(request.lines) + MODULE.format(groups="\n".join(rows))


TARGET = Target(
    title="Isaac Lab: friction, dynamic_friction, viscous_friction, armature of actuators",
    forms={
        "plain": plain(static="friction", coulomb="dynamic_friction", viscous="viscous_friction", armature="armature")
    },
    suffix=".py",
    text=isaaclab_text,
    ranges=isaaclab_ranges,
)
