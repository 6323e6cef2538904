"""Corrections of model and calibration: one object per correction."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from stribeck.core.base.typing import Array
from stribeck.core.equations.whole_log.corrections import calibration, model
from stribeck.core.equations.whole_log.corrections.correction import Correction, Layout
from stribeck.core.robot import Robot
from stribeck.core.settings import Settings

CORRECTIONS: tuple[Correction, ...] = (model.BODIES, *calibration.CALIBRATION, *model.MODEL)
"""Corrections in the order of their columns; a log is corrected in the reverse order.

The overdispersion widens the priors from bodies to the delay of the base.
"""


def find_corrections(
    robot: Robot,
    names: Sequence[str],
    settings: Settings,
    wrenches: int = 0,
    command_delays: Sequence[tuple[float, float]] = (),
) -> Layout:
    """Lay out the corrections: none, inertias and the torque delay, or also sensor calibration; rotors in addition.

    `names` are joints, then couplings; `wrenches` is the number of wrench sensors. The delays of commands, which come
    with their standard errors [s], are not corrected: they were found before, and only their errors matter.
    """
    asked = settings.fit_armature
    everywhere = asked is True or (asked == "auto" and robot.torque_source != "link_side_sensor")
    chosen = set(asked) if isinstance(asked, list) else set(names) - robot.bare if everywhere else set()
    rotors = tuple(k for k, name in enumerate(names) if name in chosen)  # bare joints: their rotors are the couplings'
    modelled = dict(zip(robot.joint_names, robot.armature.tolist(), strict=True))
    armature = np.array([modelled.get(names[k], 0.0) for k in rotors])
    guessed = np.array([names[k] not in robot.known_rotors for k in rotors], dtype=bool)
    delays = dict(zip(robot.joint_names, command_delays, strict=False))
    errors = tuple(delays[name][1] for name in names if name in delays)
    if settings.corrections == "none":
        return lay_out({}, Layout(rotors=rotors, armature=armature, guessed=guessed, command_delays=errors))
    counts = {"torque_delay": int(not errors), "wrenches": sum(calibration.WRENCH) * wrenches}
    if settings.corrections == "calibration":
        counts |= {correction.name: correction.count(robot, names) for correction in CORRECTIONS if correction.count}
        counts["base_delay"] *= not errors
    bodies = list(robot.tree.model.names)[1:]
    layout = Layout(
        bodies=tuple(map(str, bodies)),
        floating=robot.base == "floating",
        inertial_parameters=inertial_parameters_of(robot),
        command_delays=errors,
        rotors=rotors,
        armature=armature,
        guessed=guessed,
        payloads=tuple(payload.mass for payload in robot.payloads),
    )
    return lay_out(counts, layout)


def inertial_parameters_of(robot: Robot) -> Array:
    """Collect the inertial parameters of all bodies of a robot, shape (bodies, 10)."""
    return np.stack([inertia.toDynamicParameters() for inertia in list(robot.tree.model.inertias)[1:]])


def lay_out(counts: Mapping[str, int], layout: Layout) -> Layout:
    """Add the sizes of all corrections to a layout; `counts` are the sizes of sensor corrections by name."""
    sizes = {entry.name: entry.size(layout) if entry.size else counts.get(entry.name, 0) for entry in CORRECTIONS}
    return replace(layout, sizes=sizes)
