"""Draw the five pictures of docs/idea.md from the log of the demonstration: python docs/idea.py."""

import tempfile
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from studies.paper.figures import ink, save

from stribeck import Robot, identify, read_log
from stribeck.core.base.typing import Array
from stribeck.core.judgement.curve import WIDEST, relative_width
from stribeck.simulation.demo import make_demo

JOINT, STANDING = "left_knee", "right_foot"
SWING, SHORT = (4.82, 5.5), (4.0, 7.0)
"""Parts of the walk [s]: the swing of this leg in the pictures, and a short log."""
FOLDER = Path(__file__).parent / "assets"


def main() -> None:
    """Run the demonstration and write the pictures."""
    with tempfile.TemporaryDirectory() as folder:
        example = make_demo(Path(folder))
        robot = Robot.from_file(example.robot_file)
        log = read_log(example.log, robot)
    result = identify(log, robot)
    short = identify(log.between(*SHORT), robot)
    assert result.evidence is not None
    samples, knee = result.evidence.samples, result.joints[JOINT]
    column = samples.joint_names.index(JOINT)
    rows = np.flatnonzero((samples.time >= SWING[0]) & (samples.time <= SWING[1]))[::3]
    time, velocity, friction = samples.time[rows], samples.velocity[rows, column], samples.friction_torque[rows, column]
    place, offset = log.joint_names.index(JOINT), knee.parameters["offset"].value  # of the sensor, not friction
    position, torque = (np.interp(time, log.time, each[:, place]) for each in (log.position, log.torque))

    def lines(figure: Figure, label: str, *drawn: tuple[Array, str, str]) -> None:
        axes = figure.subplots()
        for values, name, color in drawn:
            axes.plot(time, values, color=color, label=name)
        axes.set(xlabel="time [s]", ylabel=label, xlim=SWING)
        axes.grid(True)
        if len(drawn) > 1:
            axes.legend()

    def curve(figure: Figure) -> None:
        axes, swings = figure.subplots(), samples.support == samples.support_names.index(STANDING)
        own = np.flatnonzero(samples.usable[:, column] & swings)[::14]
        speeds, known = np.linspace(*knee.velocity_range, 400), {**example.parameters[JOINT], "offset": 0.0}
        truth = example.law.torque(speeds, np.array([known[each.name] for each in example.law.parameters]))
        seen = samples.friction_torque[own, column] - offset
        axes.plot(samples.velocity[own, column], seen, ".", color="C0", ms=1.5)
        axes.plot(speeds, truth, color=ink(), lw=3, label="true friction")
        axes.plot(speeds, knee.friction(speeds), color="C1", label="identified curve")
        axes.set(xlabel="velocity [rad/s]", ylabel="torque [N m]")
        axes.grid(True)
        axes.legend()

    def trusted(figure: Figure) -> None:
        axes, legs = figure.subplots(), [name for name, joint in result.joints.items() if joint.verdict == "identified"]
        for label, found, marker in (("3 s", short, "o"), ("30 s", result, "s")):
            curves = [(found.joints[name].curve, k) for k, name in enumerate(legs)]
            known = [(100 * relative_width(curve), k) for curve, k in curves if curve]
            axes.plot(*zip(*known, strict=True), marker, ms=4, label=f"{label} of walking")
        axes.axvline(100 * WIDEST, color=ink(), label="limit of weak")
        axes.set_yticks(range(len(legs)), legs, fontsize=7)
        axes.set(xlabel="half of the 95 % interval [% of the friction]", xscale="log", xlim=(0.3, 300))
        axes.set_xticks([1, 10, 100], ["1", "10", "100"])
        axes.grid(True)
        axes.legend()

    save("idea-leg", lambda figure: lines(figure, "knee position [rad]", (position, "knee", "C0")), FOLDER)
    both = (torque, "measured", "C0"), (torque - friction, "gravity and inertia", ink())
    save("idea-model", lambda figure: lines(figure, "torque [N m]", *both), FOLDER)
    left = (friction - offset, "difference", "C1"), (np.sign(velocity), "direction of motion", ink())
    save("idea-left", lambda figure: lines(figure, "torque [N m]", *left), FOLDER)
    save("idea-curve", curve, FOLDER)
    save("idea-trust", trusted, FOLDER)


if __name__ == "__main__":
    main()
