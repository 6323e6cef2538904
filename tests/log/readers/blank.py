"""Messages of ROS types that the tests' typestore lacks, built field by field."""

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from stribeck.log.readers.messages import DEFINITIONS


def store_with_all():
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    return store


STORE = store_with_all()


def blank(name):
    """Make a message of zeros."""
    return STORE.types[name](**{field: _blank(kind) for field, kind in STORE.fielddefs[name][1]})


def _blank(kind):
    node, what = kind
    if node == Nodetype.NAME:
        return blank(what)
    if node == Nodetype.BASE:
        return "" if what[0] == "string" else 0
    inner, length = what
    if node == Nodetype.SEQUENCE:
        return []
    return (
        [blank(inner[1]) for _ in range(length)] if inner[0] == Nodetype.NAME else np.zeros(length, dtype=inner[1][0])
    )
