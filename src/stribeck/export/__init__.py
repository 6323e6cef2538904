"""What was found, written as a model that a simulator reads."""

from stribeck.export.targets import TARGETS as TARGETS
from stribeck.export.write import export as export
from stribeck.export.write import export_ranges as export_ranges
from stribeck.export.write import export_samples as export_samples
