"""Robot file, robot model, and its kinematic tree rooted at a standing foot."""

from stribeck.core.robot.packages import model_path as model_path
from stribeck.core.robot.robot import Robot as Robot
from stribeck.core.robot.robot_file import Contact as Contact
from stribeck.core.robot.robot_file import read_robot_file as read_robot_file
from stribeck.core.robot.robot_file import robot_fields as robot_fields
