"""Exporters: results as robot models, data and code for simulators and controllers."""

from stribeck.exporters.targets import TARGETS as TARGETS
from stribeck.exporters.write import export as export
from stribeck.exporters.write import export_ranges as export_ranges
from stribeck.exporters.write import export_samples as export_samples
