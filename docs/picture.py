"""Draw the README's picture: the robot of the demo, and identified and true friction.

python docs/picture.py
"""

import tempfile
from pathlib import Path

import numpy as np
from drawing import GREY, cropped, draw
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from poses import Pose, walk_poses

from stribeck import Robot, identify, read_log
from stribeck.core.result import Result
from stribeck.core.result.mirror import mirrored_pairs
from stribeck.core.result.tables import main_parameters
from stribeck.simulation.demo import Demo, make_demo

JOINTS = ("left_hip_pitch", "left_knee")
APART = 0.95
"""Distance between poses [m]."""
LEFT, RIGHT = (0.26, 0.54, 0.90, 1.0), (0.86, 0.36, 0.12, 1.0)
"""Red, green, blue and opacity of the two sides."""
SEEN_FROM = np.deg2rad(25.0)
"""Angle of the view from the right towards the front [rad], which separates left and right limbs."""
TEXT = 13
"""Size of letters [pt], legible on a phone, whose screen is 390 pixels wide."""
TARGET = Path(__file__).parent / "assets" / "demo.png"


def main() -> None:
    """Run the demonstration and write the picture."""
    with tempfile.TemporaryDirectory() as folder:
        example = make_demo(Path(folder))
        robot = Robot.from_file(example.robot_file)
        result = identify(example.log, robot)
        figure = Figure(figsize=(6.4, 5.0), layout="constrained")
        grid = figure.add_gridspec(2, len(JOINTS), height_ratios=(1.4, 3.1))
        with np.load(example.log.with_suffix(".truth.npz")) as truth:
            walk = walk_poses(robot, read_log(example.log, robot), truth["base_position"])
        draw_walk(figure.add_subplot(grid[0, :]), walk, robot)
    for k, joint in enumerate(JOINTS):
        draw_friction(figure.add_subplot(grid[1, k]), joint, example, result)
    figure.axes[1].set_ylabel("friction torque [N m]", fontsize=TEXT)
    TARGET.parent.mkdir(exist_ok=True)
    figure.savefig(TARGET, dpi=150, metadata={"Software": None})


def draw_walk(axes: Axes, walk: tuple[Pose, ...], robot: Robot) -> None:
    """Draw the robot side by side over one stride."""
    axes.axhline(0.0, color="#888888", lw=0.8, zorder=1)
    names = list(robot.tree.model.names)[2:]
    colours = dict.fromkeys(names, GREY)
    for one, other in mirrored_pairs(names):
        colours[one], colours[other] = LEFT, RIGHT
    configurations = np.array([pose.configuration for pose in walk])
    azimuth = np.array([pose.yaw for pose in walk]) + SEEN_FROM + np.pi / 2
    drawn = draw(str(robot.model_path), np.array(names), np.array(list(colours.values())), configurations, azimuth)
    for k, (pose, (pixels, (left, right, bottom, top))) in enumerate(zip(walk, map(cropped, drawn), strict=True)):
        axes.imshow(pixels, extent=(k * APART + left, k * APART + right, bottom, top), zorder=2)
        axes.text(k * APART, -0.06, f"{pose.time:.2f} s", ha="center", va="top", fontsize=TEXT - 3)
    axes.set_xlim(-APART, len(walk) * APART)
    axes.set_ylim(-0.2, 1.9)
    axes.set_aspect("equal")
    axes.axis("off")


def draw_friction(axes: Axes, joint: str, example: Demo, result: Result) -> None:
    """Draw a joint's samples, the true and the identified curve, without the sensor's offset."""
    assert result.evidence is not None
    samples = result.evidence.samples
    column = samples.joint_names.index(joint)
    rows = np.flatnonzero(samples.usable[:, column])[::4]
    low, high = result.joints[joint].velocity_range
    velocity = np.unique(np.concatenate([np.linspace(low, high, 600), np.linspace(-0.2, 0.2, 200)]))
    known = {**example.parameters[joint], "offset": 0.0}
    truth = example.law.torque(velocity, np.array([known[parameter.name] for parameter in example.law.parameters]))
    seen = samples.friction_torque[rows, column] - result.joints[joint].parameters["offset"].value
    axes.plot(samples.velocity[rows, column], seen, ".", ms=2, color="#9dbfe8", zorder=1)
    axes.plot(velocity, truth, color="black", lw=4.5)
    axes.plot(velocity, result.joints[joint].friction(velocity), color="#f08030", lw=2.2)
    top = 2.5 * np.abs(truth).max()
    axes.set(xlim=(low, high), ylim=(-top, top))
    found, _ = main_parameters(result.joints[joint])[0]
    lines = [f"true Coulomb friction: {known['coulomb']:.3g} N m", f"identified: {found} N m"]
    axes.text(0.5, 0.97, "\n".join(lines), fontsize=TEXT - 2, ha="center", va="top", transform=axes.transAxes)
    axes.set_title(joint.replace("_", " "), fontsize=TEXT)
    axes.set_xlabel("velocity [rad/s]", fontsize=TEXT)
    axes.tick_params(labelsize=TEXT - 1)
    axes.grid(alpha=0.25)


if __name__ == "__main__":
    main()
