"""Support phases of synthetic gaits with known standing feet."""

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from stribeck.core.dynamics.contact import SupportPhases, find_support_phases
from stribeck.core.errors import LogError, RobotFileError
from stribeck.core.log import RobotLog
from stribeck.core.robot import Contact
from stribeck.core.robot.rooting import BASE_FRAME
from stribeck.core.settings import SupportSettings

RATE = 200.0
MASS = 50.0
WEIGHT = MASS * 9.81
AUTO = SupportSettings()
BIPED = ("left_foot", "right_foot")
QUADRUPED = ("FL", "FR", "RL", "RR")


@dataclass(frozen=True)
class Walker:
    """Robot whose joint positions are the coordinates of its feet in the base, and the rotation vector of the base."""

    feet: tuple[str, ...]
    kind: str = "surface"
    base: str = "floating"
    base_frame: str = BASE_FRAME
    mass: float = MASS
    path: str = "robot.toml"
    gravity: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    up: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))

    @property
    def contacts(self):
        return {foot: Contact(foot, f"{foot}_frame", self.kind) for foot in self.feet}

    def standing(self, feet):  # noqa: ARG002
        return np.ones(3 * len(self.feet) + 3, dtype=bool)

    def foot_pose(self, contact, position):
        k = self.feet.index(contact)
        return Rotation.from_rotvec(position[:, -3:]).inv().as_matrix(), position[:, 3 * k : 3 * k + 3]


@dataclass(frozen=True)
class Gait:
    """Positions of the feet in the world, shape (T, feet, 3), and whether each stands, shape (T, feet)."""

    points: np.ndarray
    standing: np.ndarray

    @property
    def time(self):
        return np.arange(len(self.points)) / RATE

    def log(self, feet, *, imu=True, turning=0.0, **channels):
        """Make a log of a base that follows the feet, pitching and rolling slightly, and turning on request."""
        samples = len(self.points)
        sway = np.sin(2 * np.pi * 0.7 * self.time)[:, None] * [0.03, 0.05, 0.0]
        base = Rotation.from_rotvec(sway + self.time[:, None] * [0.0, 0.0, turning])
        centre = self.points.mean(axis=1) * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.8]
        inside = np.stack([base.inv().apply(self.points[:, k] - centre) for k in range(len(feet))], axis=1)
        position = np.hstack([inside.reshape(samples, -1), base.as_rotvec()])
        channels |= {"base_orientation": base.as_quat() if imu else None, "foot_names": feet, "path": "walk.csv"}
        names = tuple(f"joint_{k}" for k in range(position.shape[1]))
        return RobotLog(time=self.time, joint_names=names, position=position, torque=0 * position, **channels)

    def wrench(self, noise=0.0):
        """Compute foot wrenches that share the weight equally, shape (T, feet, 6)."""
        carrying = np.maximum(self.standing.sum(axis=1, keepdims=True), 1)
        wrench = np.zeros((*self.standing.shape, 6))
        wrench[:, :, 2] = WEIGHT * self.standing / carrying
        wrench[:, :, 2] += noise * np.random.default_rng(0).standard_normal(self.standing.shape)
        return wrench


def walk(feet_homes, swings, *, stand=1.0, swing=0.6, both=0.2, step=0.25, lift=0.05):
    """Make a gait: the feet of each tuple in `swings` move together, with `both` seconds on all feet in between."""
    feet = [np.array(home, dtype=float) for home in feet_homes]
    rows, standing = [], []

    def hold(seconds):
        for _ in range(round(seconds * RATE)):
            rows.append([foot.copy() for foot in feet])
            standing.append([True] * len(feet))

    hold(stand)
    for moving in swings:
        count = round(swing * RATE)
        for s in (np.arange(count) + 0.5) / count:
            smooth = s**3 * (10 - 15 * s + 6 * s**2)
            up = lift * 64 * (s * (1 - s)) ** 3
            rows.append([foot + np.array([step * smooth, 0.0, up]) * (k in moving) for k, foot in enumerate(feet)])
            standing.append([k not in moving for k in range(len(feet))])
        for k in moving:
            feet[k] = feet[k] + [step, 0.0, 0.0]
        hold(both)
    hold(stand)
    return Gait(np.array(rows), np.array(standing))


def biped(**shape):
    return walk([(0, 0.1, 0), (0, -0.1, 0)], [(0,), (1,)] * 4, **shape)


def quadruped(swings, **shape):
    return walk([(0.2, 0.1, 0), (0.2, -0.1, 0), (-0.2, 0.1, 0), (-0.2, -0.1, 0)], swings, **shape)


TROT = [(0, 3), (1, 2)] * 4
CRAWL = [(0,), (3,), (1,), (2,)] * 2


def whole(log):
    return (slice(0, len(log.time)),)


def standing_of(found: SupportPhases, feet, samples):
    standing = np.zeros((samples, len(feet)), dtype=bool)
    for phase in found.phases:
        standing[phase.start : phase.stop] = [foot in phase.feet for foot in feet]
    return standing


def late(found, truth):
    """Compute the largest time error [s] of touchdowns and liftoffs over all feet."""
    worst = 0
    for k in range(truth.shape[1]):
        ours, theirs = (np.flatnonzero(np.diff(stands[:, k].astype(int))) for stands in (found, truth))
        assert len(ours) == len(theirs), f"{len(ours)} events found, {len(theirs)} there"
        worst = max(worst, int(np.abs(ours - theirs).max(initial=0)))
    return worst / RATE


class TestFlags:
    def test_trimming(self):
        gait = biped()
        log = gait.log(BIPED, contact=gait.standing)
        phases = find_support_phases(log, Walker(BIPED), whole(log), AUTO).phases
        for phase in phases[1:-1]:
            steady = (phase.steady_first, phase.steady_last)
            if phase.kind == "single":
                assert (phase.first, phase.last) == (phase.start + 20, phase.stop - 10)  # 0.10 s and 0.05 s at 200 Hz
                assert steady == (phase.start + 30, phase.stop - 30)  # both times at both ends
            else:  # the weight shifts all the time
                assert steady == (phase.start, phase.start)
                assert (phase.first, phase.last) == (phase.start, phase.stop)
        stood, stands = phases[0], phases[-1]  # no foot lands or lifts off where the log begins and ends
        assert (stood.steady_first, stood.steady_last) == (stood.start, stood.stop - 30)
        assert (stands.steady_first, stands.steady_last) == (stands.start + 30, stands.stop)

    def test_short_phases_keep_more_than_half(self):
        flags = np.ones((1000, 2), dtype=bool)
        flags[300:308, 0] = False  # 0.04 s, shorter than min_duration
        flags[400:426, 0] = False  # 0.13 s, less than trim_start and trim_end
        flags[500:600, 0] = False
        log = Gait(np.zeros((1000, 2, 3)), flags).log(BIPED, contact=flags)
        found = find_support_phases(log, Walker(BIPED), whole(log), AUTO)
        singles = [phase for phase in found.phases if phase.kind == "single"]
        assert [phase.last - phase.first for phase in singles] == [0, 14, 70]
        assert "1 of 7 support phases are ignored" in found.notes[0]
        untrimmed = SupportSettings(trim_start=0.0, trim_end=0.0)
        kept = find_support_phases(log, Walker(BIPED), whole(log), untrimmed).phases
        assert [phase.last - phase.first for phase in kept if phase.kind == "single"] == [0, 26, 100]

    def test_flags_that_flicker_at_touchdown_follow_the_majority(self):
        gait = biped()
        flags = gait.standing.copy()
        changes = np.flatnonzero(np.diff(flags[:, 0])) + 1
        flags[changes - 3, 0] ^= True
        flags[changes + 2, 0] ^= True
        flags[::97, 1] ^= True  # noise
        found = find_support_phases(gait.log(BIPED, contact=flags), Walker(BIPED), whole(gait.log(BIPED)), AUTO)
        used = [(phase.feet, phase.start, phase.stop) for phase in found.phases if phase.stop - phase.start > 8]
        clean = find_support_phases(gait.log(BIPED, contact=gait.standing), Walker(BIPED), whole(gait.log(BIPED)), AUTO)
        assert [feet for feet, *_ in used] == [phase.feet for phase in clean.phases]
        assert np.abs(np.subtract([row for _, *row in used], [(p.start, p.stop) for p in clean.phases])).max() <= 6

    def test_a_foot_that_bounces_neither_stands_nor_swings(self):
        flags = np.ones((1000, 2), dtype=bool)
        flags[300:400, 0] = False
        flags[410:415, 0] = False  # off the ground for 0.025 s, after the landing
        log = Gait(np.zeros((1000, 2, 3)), flags).log(BIPED, contact=flags)
        phases = find_support_phases(log, Walker(BIPED), whole(log), AUTO).phases
        found = [(phase.kind, phase.start, phase.stop) for phase in phases[2:4]]
        assert found == [("double", 400, 410), ("touching", 410, 415)]

    def test_feet_come_in_the_robots_order(self):
        gait = biped()
        swapped = gait.log(BIPED[::-1], contact=gait.standing[:, ::-1])
        found = find_support_phases(swapped, Walker(BIPED), whole(swapped), AUTO)
        np.testing.assert_array_equal(standing_of(found, BIPED, len(swapped.time)), gait.standing)

    def test_phases_of_quadrupeds_count_their_feet(self):
        gait = quadruped([(0, 3), (0,), (0, 1, 2), (0, 1, 2, 3)])
        log = gait.log(QUADRUPED, contact=gait.standing)
        phases = find_support_phases(log, Walker(QUADRUPED, "point"), whole(log), AUTO).phases
        kinds = ["multiple", "double", "multiple", "multiple", "multiple", "single", "multiple", "flight", "multiple"]
        assert [phase.kind for phase in phases] == kinds
        trimmed = [phase.first > phase.start for phase in phases]
        assert trimmed == [False, True, False, True, False, True, False, True, False]  # where some limb swings


def pieces_from(shortest):
    return st.lists(st.tuples(st.integers(shortest, 80), st.integers(0, 7)), min_size=1, max_size=12)


@given(st.one_of(pieces_from(1), pieces_from(8)), st.lists(st.integers(1, 400), max_size=3))
@settings(max_examples=60)
def test_phases_partition_every_segment(pieces, cuts):
    """Phases are contiguous; rows of one phase are alike and differ from the neighboring phases."""
    flags = np.concatenate([np.tile([bool(code & bit) for bit in (1, 2, 4)], (n, 1)) for n, code in pieces])
    flickers = min(rows for rows, _ in pieces) < 8  # 0.04 s
    if flickers:  # some foot stands, whatever is removed
        flags = np.vstack([flags, np.ones((400, 3), dtype=bool)])
    feet = ("a", "b", "c")
    log = Gait(np.zeros((len(flags), 3, 3)), flags).log(feet, contact=flags)
    edges = sorted({0, len(flags), *(cut for cut in cuts if cut < len(flags))})
    segments = tuple(slice(a, b) for a, b in pairwise(edges))
    if not flags.any():
        with pytest.raises(LogError, match="no foot ever stands"):
            find_support_phases(log, Walker(feet), segments, AUTO)
        return
    phases = find_support_phases(log, Walker(feet), segments, AUTO).phases
    assert [phase.start for phase in phases] == [0, *(phase.stop for phase in phases[:-1])]
    assert phases[-1].stop == len(flags)
    assert set(edges) <= {0, *(phase.stop for phase in phases)}
    found = standing_of(SupportPhases(phases=phases, source="flags"), feet, len(flags))
    assert flickers or np.array_equal(found, flags)
    assert all(phase.start <= phase.first <= phase.last <= phase.stop for phase in phases)
    assert all(phase.first <= phase.steady_first <= phase.steady_last <= phase.last for phase in phases)


def test_trimming_uses_time_not_samples():
    """Dense and sparse samples lose the same time."""
    gait = biped()
    log = gait.log(BIPED, contact=gait.standing)
    stretched = replace(log, time=np.cumsum(np.where(np.arange(len(log.time)) < 400, 0.005, 0.01)))
    for phase in find_support_phases(stretched, Walker(BIPED), whole(log), AUTO).phases:
        if phase.kind == "single":
            assert stretched.time[phase.first] - stretched.time[phase.start] == pytest.approx(0.10, abs=0.006)


class TestForces:
    def found(self, gait, wrench, feet=BIPED, choice=AUTO, robot=None):
        log = gait.log(feet, foot_wrench=wrench)
        return find_support_phases(log, robot or Walker(feet), whole(log), choice)

    def test_noise_near_the_threshold_makes_no_phases(self):
        """A foot with a tenth of the weight and 1 % noise keeps its state."""
        gait = biped()
        wrench = gait.wrench(noise=0.01 * WEIGHT)
        resting = np.flatnonzero(gait.standing.all(axis=1))[-150:]
        wrench[resting, 0, 2] -= 0.4 * WEIGHT
        wrench[resting, 1, 2] += 0.4 * WEIGHT
        found = self.found(gait, wrench)
        np.testing.assert_array_equal(standing_of(found, BIPED, len(gait.time)), gait.standing)
        single_threshold = SupportSettings(force_on=0.1, force_off=0.1)
        assert len(self.found(gait, wrench, choice=single_threshold).phases) > 2 * len(found.phases)

    def test_a_foot_that_carries_a_part_of_its_load_neither_stands_nor_swings(self):
        gait = biped()
        wrench, whole = gait.wrench(), self.found(gait, gait.wrench())
        swing = next(phase for phase in whole.phases if phase.feet == BIPED[:1])
        rows = slice(swing.start + 20, swing.start + 40)
        wrench[rows, 1, 2], wrench[rows, 0, 2] = 0.1 * WEIGHT, 0.9 * WEIGHT
        touching = [phase for phase in self.found(gait, wrench).phases if phase.kind == "touching"]
        assert [(phase.start, phase.stop, phase.feet) for phase in touching] == [(rows.start, rows.stop, ())]
        assert touching[0].first == touching[0].last
        wrench[rows, 1, 2], wrench[rows, 0, 2] = 0.04 * WEIGHT, 0.96 * WEIGHT
        assert self.found(gait, wrench).phases == whole.phases

    def test_vertical_forces_give_the_same_phases(self):
        """This includes point feet, whose wrench would be rotated from the shank to the vertical."""
        gait = biped()
        wrench = gait.wrench(2.0)
        log = gait.log(BIPED[::-1], foot_force=wrench[:, ::-1, 2])
        found = find_support_phases(log, Walker(BIPED), whole(log), AUTO)
        assert found == self.found(gait, wrench)
        points = find_support_phases(log, Walker(BIPED, kind="point"), whole(log), AUTO)
        assert [phase.feet for phase in points.phases] == [phase.feet for phase in found.phases]
        with pytest.raises(LogError, match=r"in foot_force add up to 50, .*set \[log\] foot_force = \{scale = 9.81"):
            find_support_phases(replace(log, foot_force=log.foot_force / 9.81), Walker(BIPED), whole(log), AUTO)

    def test_point_feet_are_turned_to_the_vertical(self):
        """The frame of a point foot rotates with its shank (here: the base), so its z axis misses much of the force."""
        gait = quadruped(TROT)
        tilt = Rotation.from_rotvec([0.0, 0.9, 0.0])
        upright = gait.wrench()
        wrench = upright.copy()
        log = gait.log(QUADRUPED)
        base = Rotation.from_quat(log.base_orientation)

        class Shanks(Walker):
            def foot_pose(self, _, position):
                return np.broadcast_to(tilt.as_matrix(), (len(position), 3, 3)), np.zeros((len(position), 3))

        for k in range(4):
            wrench[:, k, :3] = tilt.inv().apply(base.inv().apply(upright[:, k, :3]))
        found = self.found(gait, wrench, QUADRUPED, robot=Shanks(QUADRUPED, "point"))
        assert found.notes == ()
        np.testing.assert_array_equal(standing_of(found, QUADRUPED, len(gait.time)), gait.standing)
        single_axis = self.found(gait, upright, QUADRUPED, robot=Shanks(QUADRUPED, "point"))
        assert single_axis.notes == ()


class TestKinematics:
    def found(self, gait, robot, **channels):
        log = gait.log(robot.feet, **channels)
        found = find_support_phases(log, robot, whole(log), AUTO)
        assert found.source == "kinematics"
        return found, standing_of(found, robot.feet, len(log.time))

    @pytest.mark.parametrize("imu", [True, False])
    @pytest.mark.parametrize("shape", [{}, {"lift": 0.03, "step": 0.15}, {"lift": 0.10, "swing": 1.0}, {"both": 0.05}])
    def test_biped_walk(self, imu, shape):
        gait = biped(**shape)
        found, standing = self.found(gait, Walker(BIPED), imu=imu)
        assert late(standing, gait.standing) < 0.07  # less than what is trimmed
        assert "neither contact flags nor foot forces" in found.notes[0]

    @pytest.mark.parametrize("swings", [TROT, CRAWL], ids=["trot", "crawl"])
    @pytest.mark.parametrize("both", [0.0, 0.1])
    def test_no_point_foot_stands_that_is_taken_as_swinging(self, swings, both):
        gait = quadruped(swings, swing=0.4, both=both)
        found, standing = self.found(gait, Walker(QUADRUPED, "point"))
        decided = np.concatenate(
            [np.full(phase.stop - phase.start, phase.kind != "touching") for phase in found.phases]
        )
        assert decided.mean() > 0.8
        assert not (gait.standing & ~standing)[decided].any()

    NOISE, UNEVEN = 1e-4 * np.random.default_rng(0).standard_normal((1680, 2, 3)), [[0.0, 0.0, 0.003], [0.0, 0.0, 0.0]]

    @pytest.mark.parametrize(("displaced", "bound"), [(NOISE, 0.08), (UNEVEN, 0.07)], ids=["noise", "uneven ground"])
    def test_small_displacements_make_no_phases(self, displaced, bound):
        gait = biped()
        _, standing = self.found(Gait(gait.points + displaced, gait.standing), Walker(BIPED))
        assert late(standing, gait.standing) < bound

    def test_point_feet_require_an_orientation(self):
        log = quadruped(TROT).log(QUADRUPED, imu=False)
        with pytest.raises(LogError, match=r"such as 'FL' stand; expected a channel contact, foot_wrench or base"):
            find_support_phases(log, Walker(QUADRUPED, "point"), whole(log), AUTO)


class TestFall:
    def fallen(self, at, gait):
        log = gait.log(BIPED, contact=gait.standing)
        turn = np.where(np.arange(len(log.time)) < at, 0.0, 1.4)
        return replace(log, base_orientation=Rotation.from_rotvec(turn[:, None] * [0.0, 1.0, 0.0]).as_quat())

    def test_phases_after_a_fall_are_ignored(self):
        gait = biped()
        log = self.fallen(600, gait)
        found = find_support_phases(log, Walker(BIPED), (slice(0, 500), slice(510, len(log.time))), AUTO)
        upright = find_support_phases(gait.log(BIPED, contact=gait.standing), Walker(BIPED), whole(log), AUTO)
        assert found.phases[-1].stop == max(phase.stop for phase in upright.phases if phase.stop < 600)
        assert "falls" in found.notes[0]
        assert "60° at 3.00 s" in found.notes[0]

    def test_a_robot_that_lies_from_the_start_is_refused(self):
        log = self.fallen(0, biped())
        with pytest.raises(LogError, match=r"tilts the base by 80° at the start.*wxyz"):
            find_support_phases(log, Walker(BIPED), whole(log), AUTO)


@pytest.mark.parametrize(
    ("feet", "flags", "robot", "source", "said"),
    [
        (("left_foot", "foot_r"), True, BIPED, "auto", r"'foot_r' is not one of .*, right_foot; .*\"right_foot\""),
        (BIPED, True, (*BIPED, "hand"), "auto", "contact 'hand' is not among the log's feet, which are left_foot, "),
        (BIPED, None, BIPED, "flags", "source is 'flags', but the log has no channel contact"),
        (BIPED, None, BIPED, "forces", "source is 'forces', but the log has no channel foot_wrench"),
        (BIPED, False, BIPED, "auto", "all contact flags of left_foot, right_foot are false"),
        (BIPED, None, (), "auto", r"robot.toml: .* add \[contacts.<foot>\]"),
    ],
)
def test_logs_that_do_not_fit_are_refused(feet, flags, robot, source, said):
    gait = biped()
    log = gait.log(feet, contact=None if flags is None else gait.standing & flags)
    with pytest.raises((LogError, RobotFileError), match=said):
        find_support_phases(log, Walker(robot), whole(log), SupportSettings(source=source))
