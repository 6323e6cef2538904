"""A humanoid similar to DLR's TORO: a table of its links, and the generator of its model file; not in the wheel."""

from stribeck.simulation.robots.toro.model import toro_mjcf as toro_mjcf
from stribeck.simulation.robots.toro.table import FOOT_SIZE as FOOT_SIZE
from stribeck.simulation.robots.toro.table import standing_posture as standing_posture
from stribeck.simulation.robots.toro.table import toro_links as toro_links
