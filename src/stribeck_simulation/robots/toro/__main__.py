"""Writes the model file anew."""

from stribeck_simulation.robots.toro.model import MODEL_FILE, toro_mjcf

MODEL_FILE.write_text(toro_mjcf(), encoding="utf-8")
