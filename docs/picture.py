"""Draw the README's picture: the demonstration's robot, and the friction found in its log beside the truth.

python docs/picture.py
"""

import tempfile
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stribeck import Robot, identify
from stribeck.friction import get_law
from stribeck.result import Result
from stribeck_simulation.demo import Demo, make_demo
from stribeck_simulation.pictures.walk import WalkPicture

JOINTS = ("left_hip_roll", "left_hip_pitch", "left_knee", "left_ankle_pitch")
APART = 0.95
"""Between poses [m]."""
TARGET = Path(__file__).parent / "assets" / "demo.png"


def main() -> None:
    """Run the demonstration and write the picture."""
    with tempfile.TemporaryDirectory() as folder:
        example = make_demo(Path(folder))
        result = identify(example.log, Robot.from_file(example.robot_file))
    figure = Figure(figsize=(11, 5.2), layout="constrained")
    grid = figure.add_gridspec(2, len(JOINTS), height_ratios=(2.1, 3.1))
    draw_walk(figure.add_subplot(grid[0, :]), example.walk)
    for k, joint in enumerate(JOINTS):
        draw_friction(figure.add_subplot(grid[1, k]), joint, example, result)
    first = figure.axes[1]
    first.set_ylabel("friction torque [N m]", fontsize=9)
    first.legend(fontsize=8, loc="upper left")
    TARGET.parent.mkdir(exist_ok=True)
    figure.savefig(TARGET, dpi=110, metadata={"Software": None})


def draw_walk(axes: Axes, walk: WalkPicture) -> None:
    """Draw the robot side by side over one stride, as far as MuJoCo can draw without a screen here."""
    axes.axhline(0.0, color="#888888", lw=0.8, zorder=1)
    for k, pose in enumerate(walk.poses):
        if (seen := pose.picture) is not None:
            extent = (k * APART + seen.left, k * APART + seen.right, seen.bottom, seen.top)
            axes.imshow(seen.pixels, extent=extent, zorder=2)
            axes.text(k * APART, -0.06, f"{pose.time:.2f} s", ha="center", va="top", fontsize=8)
    axes.set_xlim(-APART, len(walk.poses) * APART)
    axes.set_ylim(-0.2, 1.9)
    axes.set_aspect("equal")
    axes.axis("off")


def draw_friction(axes: Axes, joint: str, example: Demo, result: Result) -> None:
    """Draw a joint's samples, the law that was put in and the law that was found."""
    law = get_law(result.law)
    assert result.evidence is not None
    samples = result.evidence.samples
    column = samples.joint_names.index(joint)
    rows = np.flatnonzero(samples.usable[:, column])[::4]
    low, high = result.joints[joint].velocity_range
    velocity = np.unique(np.concatenate([np.linspace(low, high, 600), np.linspace(-0.2, 0.2, 200)]))
    found = np.array([parameter.value for parameter in result.joints[joint].parameters.values()])
    truth = np.array([example.parameters[joint][parameter.name] for parameter in law.parameters])
    seen = samples.friction_torque[rows, column]
    axes.plot(samples.velocity[rows, column], seen, ".", ms=1.2, color="#9dbfe8", zorder=1)
    axes.plot(velocity, law.torque(velocity, truth), color="black", lw=3.0, label="truth")
    axes.plot(velocity, law.torque(velocity, found), color="#f08030", lw=1.4, label="found")
    axes.set_xlim(low, high)
    axes.set_ylim(*np.percentile(seen, [0.5, 99.5]))
    axes.set_title(joint.replace("_", " "), fontsize=10)
    axes.set_xlabel("velocity [rad/s]", fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.25)


if __name__ == "__main__":
    main()
