"""Links share a correction so that their sum is what was found and each can exist."""

import numpy as np
import pinocchio as pin
import pytest

from stribeck.exporters.links import possible, share
from stribeck.robot.inertial_parameters import pseudo_inertia


def some_links(count: int, seed: int) -> np.ndarray:
    pin.seed(seed)
    sizes = np.random.default_rng(seed).uniform(0.05, 0.4, (count, 4))
    return np.stack(
        [pseudo_inertia(pin.SE3.Random().act(pin.Inertia.FromEllipsoid(*size)).toDynamicParameters()) for size in sizes]
    )


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("count", [1, 2, 7])
def test_the_sum_is_what_was_found_and_each_link_can_exist(count: int, seed: int) -> None:
    links = some_links(count, seed)
    found = some_links(1, seed + 50)[0]
    shared = share(links, found)
    np.testing.assert_allclose(shared.sum(axis=0), found, atol=1e-12 * np.abs(found).max())
    assert np.linalg.eigvalsh(shared).min() > 0


def test_no_correction_changes_nothing_and_frames_do_not_matter() -> None:
    links, found = some_links(3, 2), some_links(1, 3)[0]
    np.testing.assert_allclose(share(links, links.sum(axis=0)), links, atol=1e-12)
    one = links[0]
    assert possible(one) is one
    pose = pin.SE3.Random().homogeneous
    np.testing.assert_allclose(
        share(pose @ links @ pose.T, pose @ found @ pose.T), pose @ share(links, found) @ pose.T, atol=1e-10
    )


def test_an_empty_link_and_a_sensor_stay_and_an_impossible_link_becomes_possible() -> None:
    links, found = some_links(3, 4), some_links(1, 5)[0]
    links[0] = 0.0
    links[1, 2, 2] -= 1.0
    shared = share(links, found)
    assert not shared[0].any()
    assert np.linalg.eigvalsh(shared[1:]).min() > 0
    links = some_links(3, 7)
    links[1] *= 1e-3
    found = 1.1 * links.sum(axis=0)
    shared = share(links, found)
    np.testing.assert_array_equal(shared[1], links[1])
    np.testing.assert_allclose(shared.sum(axis=0), found, atol=1e-12 * np.abs(found).max())
