"""Packaged robots."""

from pathlib import Path

MODELS = Path(__file__).parent / "models"
"""Folder of the packaged models and robot files."""
TORO, TORO_MODEL = MODELS / "toro.toml", MODELS / "toro.xml"
"""Robot file and generated model of a humanoid like TORO."""
