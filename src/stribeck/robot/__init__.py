"""What the robot is: its file, its model, and the tree of its bodies rooted where it stands."""

from stribeck.robot.packages import model_path as model_path
from stribeck.robot.robot import Robot as Robot
from stribeck.robot.robot import from_robot_file as from_robot_file
from stribeck.robot.robot_file import Contact as Contact
from stribeck.robot.robot_file import read_robot_file as read_robot_file
