"""First robot file from a model and a log; remaining questions are left to the user."""

from stribeck.check.init.answers import draft_robot_file as draft_robot_file
from stribeck.check.init.draft import Draft as Draft
