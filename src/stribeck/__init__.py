"""Whole-body joint friction of legged robots and arms, from the logs they already record.

Public names are imported at first use to keep `import stribeck` fast. Each room has a README.md.
"""

import sys

import lazy_loader

from stribeck.moved import MovedModules

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
sys.meta_path.insert(0, MovedModules())  # type: ignore[arg-type]
