"""Joints between the base and frames of a robot, and the loops that connect them."""

from collections.abc import Iterable, Sequence

from stribeck.core.robot.rooting import RootedModel
from stribeck.core.settings import LoopTable


def columns_to(tree: RootedModel, frame: str) -> set[int]:
    """Find the columns of the joints between the base and a frame."""
    joint = int(tree.model.frames[tree.model.getFrameId(frame)].parentJoint)
    return {tree.column(above) for above in tree.path_to_root(joint)}


def columns_of_limbs(tree: RootedModel, frames: Iterable[str], loops: Sequence[LoopTable]) -> set[int]:
    """Find the columns of the joints between the base and any of the frames, or in a loop with one of them."""
    columns = set[int]().union(*(columns_to(tree, frame) for frame in frames))
    for group in _loop_groups(tree, loops):  # a ground force on a loop acts on all of its joints
        if columns & group:
            columns |= group
    return columns


def _loop_groups(tree: RootedModel, loops: Sequence[LoopTable]) -> list[set[int]]:
    """Group the columns of joints that loops connect."""
    groups: list[set[int]] = []
    for loop in loops:
        first, second = (columns_to(tree, frame) for frame in loop.frames)
        joined = first ^ second
        apart = [group for group in groups if not group & joined]
        groups = [*apart, joined.union(*(group for group in groups if group & joined))]
    return groups
