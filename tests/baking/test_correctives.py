"""What drives corrective shapes: known errors of a chain of bones come back, and far joints do not enter them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.spatial.transform import Rotation

from warpjld.baking.correctives import Correctives, features, fit_correctives
from warpjld.baking.predicted import deforming_bones

BONES, PER_BONE = 12, 5
SKIN = csc_array(np.repeat(np.eye(BONES), PER_BONE, axis=0))


def turned(seed: int, alone: int, together: int) -> NDArray[np.float64]:
    """Quaternions (F, B, 4): every bone ``alone`` times by itself, then ``together`` poses of all of them."""
    random = np.random.default_rng(seed)
    vectors = np.zeros((BONES * alone + together, BONES, 3))
    for bone in range(BONES):
        vectors[bone * alone : (bone + 1) * alone, bone] = random.normal(scale=0.7, size=(alone, 3))
    vectors[BONES * alone :] = random.normal(scale=0.7, size=(together, BONES, 3))
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat(canonical=True).reshape(-1, BONES, 4)


def errors_of(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Errors (F, V, 3): the skin of bone b is deformed by b and by the next bone, cubically in their rotations."""
    x, y, z = turns[..., 0], turns[..., 1], turns[..., 2]
    own = np.stack([x * y, z**2, x**3 + y], axis=-1)
    out = own + 0.5 * np.roll(own, -1, axis=1)
    scale = 0.01 * (1.0 + np.arange(BONES))[:, None]
    return np.repeat(out * scale, PER_BONE, axis=1)


def fitted(turns: NDArray[np.float64], errors: NDArray[np.float64], count: int) -> Correctives:
    straight = np.broadcast_to(np.eye(3, dtype=np.float32), (*errors.shape, 3))
    return fit_correctives(errors, straight, turns, SKIN, count)


def test_the_bones_that_deform_a_part_are_found() -> None:
    turns = turned(1, 6, 20)
    found = deforming_bones(errors_of(turns).astype(np.float32), features(turns), SKIN)
    wanted = np.eye(BONES, dtype=bool)
    np.testing.assert_array_equal(found, wanted | np.roll(wanted, 1, axis=0))


def test_a_bone_that_never_turns_alone_may_deform_all() -> None:
    turns = turned(2, 0, 30)
    assert deforming_bones(errors_of(turns).astype(np.float32), features(turns), SKIN).all()
    turns[:, 4] = (0.0, 0.0, 0.0, 1.0)
    assert not deforming_bones(errors_of(turns).astype(np.float32), features(turns), SKIN)[4].any()


def test_errors_of_few_poses_are_predicted_in_others() -> None:
    """With fewer poses than features of all bones, but more than those of two."""
    seen, unseen = turned(3, 6, 60), turned(4, 1, 60)
    found = fitted(seen, errors_of(seen), 3 * BONES)
    wanted = errors_of(unseen)
    got = np.tensordot(found.weights(unseen), found.shapes, 1)
    assert np.linalg.norm(got - wanted) < 0.02 * np.linalg.norm(wanted)


def test_few_shapes_go_where_errors_are_largest() -> None:
    """Of as many orthonormal shapes none leave much less: the best ones of the errors themselves, freely weighted."""
    turns = turned(5, 6, 200)
    errors = errors_of(turns)
    found = fitted(turns, errors, 8)
    left = errors - np.tensordot(found.weights(turns), found.shapes, 1)
    values = np.linalg.svd(errors.reshape(len(errors), -1), compute_uv=False)
    assert np.linalg.norm(left) < 1.02 * np.linalg.norm(values[8:])
