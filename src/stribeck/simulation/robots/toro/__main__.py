"""Write the model file."""

from stribeck.simulation.robots.toro.model import MODEL_FILE, toro_mjcf

MODEL_FILE.write_text(toro_mjcf(), encoding="utf-8")
