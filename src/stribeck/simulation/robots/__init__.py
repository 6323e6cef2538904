"""Packaged robots."""

from pathlib import Path

MODELS = Path(__file__).parent / "models"
"""Folder of the packaged models and robot files."""
