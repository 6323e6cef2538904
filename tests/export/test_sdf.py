"""An SDF that is written again: fixed links keep their own inertias, and poses, numbers and paths mean the same."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from tests.export.found import found_in
from tests.export.test_export import assert_same_dynamics, read_again

from stribeck import Robot, export

MODEL = """<sdf version="1.9"><world name="room"><model name="post">
  <link name="root"><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial></link>
  <link name="rod"><pose>0 0 1 0 0.3 0</pose><inertial><pose degrees="true">0 0 0.5 10 20 30</pose><mass>2</mass>
    <inertia><ixx>0.1</ixx><iyy>0.11</iyy><izz>0.05</izz><ixy>0.01</ixy></inertia></inertial>
    <visual name="look"><geometry><mesh><uri>meshes/rod.dae</uri></mesh></geometry></visual></link>
  <link name="disc"><pose relative_to="rod">0.4 0 0.2 0 0 1</pose><inertial><mass>1.5</mass>
    <inertia><ixx>0.03</ixx><iyy>0.04</iyy><izz>0.05</izz></inertia></inertial>
    <visual name="look"><geometry><mesh><uri>model://post/disc.dae</uri></mesh></geometry></visual></link>
  <joint name="pivot" type="revolute"><parent>root</parent><child>rod</child>
    <axis><xyz>0 1 0</xyz><dynamics><damping>9</damping><spring_stiffness>2</spring_stiffness></dynamics></axis></joint>
  <joint name="weld" type="fixed"><parent>rod</parent><child>disc</child></joint>
</model></world></sdf>"""


def numbers(link: ET.Element, path: str) -> list[float]:
    return [float(word) for word in (link.findtext(path) or "").split()]


def post(folder: Path) -> Robot:
    """Write the model and its robot file to a folder, and return the robot."""
    (folder / "post.sdf").write_text(MODEL)
    (folder / "robot.toml").write_text(f'[robot]\nmodel = "{folder}/post.sdf"\nbase = "fixed"\n')
    return Robot.from_file(folder / "robot.toml")


def test_links_joints_and_paths(tmp_path: Path) -> None:
    robot = post(tmp_path)
    result, corrected = found_in(robot)
    path = tmp_path / "new" / "post.sdf"
    path.parent.mkdir()
    export(result, robot, path, "sdf")
    assert_same_dynamics(corrected, read_again(robot, path))
    model = ET.parse(path).getroot().find("world/model")
    assert model is not None
    rod, disc = (model.find(f"link[@name='{name}']") for name in ("rod", "disc"))
    assert rod is not None
    assert disc is not None
    masses = [numbers(link, "inertial/mass")[0] for link in (rod, disc)]
    assert sum(masses) == pytest.approx(corrected.tree.model.inertias[1].mass)
    ratios = np.array(masses) / [2.0, 1.5]
    assert ratios[0] == pytest.approx(ratios[1], rel=0.2)  # each changes as the body does
    assert numbers(rod, "inertial/pose")[3:] == [0.0, 0.0, 0.0]
    assert rod.findtext("visual/geometry/mesh/uri") == "../meshes/rod.dae"
    assert disc.findtext("visual/geometry/mesh/uri") == "model://post/disc.dae"
    dynamics = model.find("joint[@name='pivot']/axis/dynamics")
    assert dynamics is not None
    stated = {element.tag: float(element.text or "nan") for element in dynamics}
    assert stated == {"friction": 1.2, "damping": 0.3, "spring_stiffness": 2.0}
