"""Exporters: results as robot models, data and code for simulators and controllers."""

from stribeck.app.exporters.targets import TARGETS as TARGETS
from stribeck.app.exporters.write import export as export
from stribeck.app.exporters.write import export_ranges as export_ranges
from stribeck.app.exporters.write import export_samples as export_samples
