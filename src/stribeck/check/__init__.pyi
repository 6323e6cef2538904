from .audit.audit import audit_or_stop as audit_or_stop
from .drives.torques import find_torques as find_torques
from .init.answers import draft_robot_file as draft_robot_file
from .inspection import Inspection as Inspection
from .inspection import JointInspection as JointInspection
from .inspection import inspect_log as inspect_log
