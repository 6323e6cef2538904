"""What the friction is of, by where the torque was measured (docs/result.md, "What the friction is of")."""

from stribeck.report.page import Section, render
from stribeck.typing import TorqueSource

MEANING: dict[TorqueSource, str] = {
    "link_side_sensor": "The torque sensors sit behind the gears: the friction is that of what lies between sensor "
    "and link, bearings, seals and cables. The friction of gear and motor, which is most of a "
    "joint's, is not in it, nor is the rotor's inertia. An error of a sensor's gain scales all "
    "friction of its joint.",
    "motor_side_sensor": "The torque sensors sit between motor and gear: the friction is that of gear, bearings and "
    "seals, by the joint's speed. The motor's own friction and the rotor's inertia are before "
    "the sensor and not in it; what turns behind it, the gear's input side, is, and its inertia "
    "counts with the ratio squared. Errors of sensor gain and gear ratio scale all friction of "
    "the joint.",
    "motor_current": "The torques are motor currents times torque constant and gear ratio: the friction is all of "
    "motor, gear and bearings, and the rotor's inertia belongs to the dynamics. An error of the "
    "torque constant, which falls as the magnets warm, scales all friction of its joint; torque that "
    "a saturating motor loses, cogging and the current of its own iron losses look like friction.",
    "command": "The torques are what the drives were asked for: the friction is what was lost between command and "
    "link, that of motor, gear and bearings and also what a drive does not deliver. Errors of its torque "
    "constant, its limits of current and voltage, its own compensation of friction and the delay of its "
    "control loop cannot be told from friction.",
}
"""One paragraph a source."""


def torque_meaning(source: TorqueSource) -> Section:
    """Return the section that says what the friction is of, and what this source cannot tell."""
    return Section(
        anchor="torque-source",
        title="What the friction is of",
        body=render("torque_meaning.html.j2", source=source, meaning=MEANING[source]),
    )
