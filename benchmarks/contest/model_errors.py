"""Published model files: without meshes, and with wrong inertias in some cases."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from stribeck.core.base.typing import Array

MASS = 0.05
"""Largest error of a mass [1]."""
SHIFT = (0.005, 0.010)
"""Smallest and largest error of a center of mass [m]."""
MOMENT = 0.2
"""Largest error of a principal moment of inertia [1]."""
TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
"""Attributes of an inertia tensor in a URDF: the upper triangle, row by row."""


def publish_model(source: Path, target: Path, generator: np.random.Generator | None) -> None:
    """Write a model without visual elements; a generator draws wrong but physically possible inertias."""
    tree = ElementTree.parse(source)
    for link in tree.iter("link"):
        for looks in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(looks)
    for inertial in tree.iter("inertial") if generator else ():
        mjcf = inertial.get("mass") is not None
        mass, moments = (inertial, inertial) if mjcf else (inertial.find("mass"), inertial.find("inertia"))
        assert generator is not None
        assert mass is not None
        assert moments is not None
        place = inertial if mjcf else inertial.find("origin")
        if place is None:
            place = ElementTree.SubElement(inertial, "origin")
        _scale_mass(mass, "mass" if mjcf else "value", generator)
        _shift(place, "pos" if mjcf else "xyz", generator)
        if mjcf:
            moments.set("diaginertia", _text(_wrong_moments(_numbers(moments.get("diaginertia", "")), generator)))
        else:
            _wrong_tensor(moments, generator)
    tree.write(target, encoding="utf-8", xml_declaration=True)


def _scale_mass(element: ElementTree.Element, key: str, generator: np.random.Generator) -> None:
    element.set(key, repr(float(element.get(key, "0")) * float(generator.uniform(1 - MASS, 1 + MASS))))


def _shift(element: ElementTree.Element, key: str, generator: np.random.Generator) -> None:
    away = generator.standard_normal(3)
    away *= generator.uniform(*SHIFT) / np.linalg.norm(away)
    element.set(key, _text(_numbers(element.get(key, "0 0 0")) + away))


def _wrong_tensor(element: ElementTree.Element, generator: np.random.Generator) -> None:
    rows, columns = np.triu_indices(3)
    tensor = np.zeros((3, 3))
    tensor[rows, columns] = tensor[columns, rows] = [float(element.get(key, "0")) for key in TENSOR]
    moments, axes = np.linalg.eigh(tensor)
    wrong = axes @ np.diag(_wrong_moments(moments, generator)) @ axes.T
    for key, value in zip(TENSOR, wrong[rows, columns], strict=True):
        element.set(key, repr(float(value)))


def _wrong_moments(moments: Array, generator: np.random.Generator) -> Array:
    """Draw wrong but possible principal moments, shape (3,); impossible input moments are returned unchanged."""
    wrong = moments * generator.uniform(1 - MOMENT, 1 + MOMENT, 3)
    tries = 0
    while 2 * wrong.max() > wrong.sum():
        wrong, tries = moments * generator.uniform(1 - MOMENT, 1 + MOMENT, 3), tries + 1
        if tries == 100:
            return moments
    return np.asarray(wrong)


def _numbers(text: str) -> Array:
    return np.array(text.split(), dtype=float)


def _text(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
