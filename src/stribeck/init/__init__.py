"""A first robot file, from a model and a log: what both say is written down, what neither says is asked."""

from stribeck.init.answers import draft_robot_file as draft_robot_file
from stribeck.init.draft import Draft as Draft
