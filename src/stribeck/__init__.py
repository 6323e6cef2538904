"""Whole-body joint friction of legged robots and arms, from the logs they already record.

Public names are imported at first use to keep `import stribeck` fast. Rooms are described in the README.md of each.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
