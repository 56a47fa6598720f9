"""The paper's loop: when it settles, and that it then agrees with the coupled method."""

from dataclasses import replace

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem import Body, HexMesh, LinearElastic, Prescribed, Status, box, merge, prescribe
from warpjld.fem.contact import ContactSolution, Pair, press


def _named(mesh: HexMesh, name: str, shift: tuple[float, float, float]) -> HexMesh:
    faces = {f"{name}.{key}": value for key, value in mesh.faces.items()}
    regions = np.zeros(len(mesh.elements), np.int32)
    return replace(mesh, nodes=mesh.nodes + np.array(shift), regions=regions, region_names=(name,), faces=faces)


def _blocks(master_over_slave: float) -> tuple[Body, Prescribed]:
    """A block pressed .1 of its height into a wider one under it; the upper is repelled by the lower."""
    lower = _named(box((1, 1, 1), counts=(3, 3, 3)), "lower", (0, 0, 0))
    upper = _named(box((0.8, 0.8, 1), counts=(3, 3, 3)), "upper", (0.1, 0.1, 1.0))
    mesh = merge(lower, upper)
    fixed = prescribe(mesh, "lower.z-", x=0.0, y=0.0, z=0.0) + prescribe(mesh, "upper.z+", x=0.0, y=0.0, z=-0.1)
    return Body(mesh, {"lower": LinearElastic(master_over_slave, 0.3), "upper": LinearElastic(1.0, 0.3)}), fixed


def _press(ratio: float, **options: bool) -> ContactSolution:
    body, fixed = _blocks(ratio)
    return press(body, fixed, [Pair("upper.z-", "lower.z+")], method="paper", check=False, **options)


@pytest.mark.parametrize("ratio", [0.1, 0.5, 1.0])
def test_it_never_settles_for_an_object_as_stiff_as_the_flesh(ratio):
    solution = _press(ratio)
    assert solution.status in (Status.MAX_ITERATIONS, Status.STAGNATED)
    assert "did not settle" in solution.message


@pytest.mark.parametrize(("ratio", "turns"), [(2.0, 15), (10.0, 6)])
def test_it_settles_where_the_skin_is_stiffer(ratio, turns):
    solution = _press(ratio)
    assert solution.converged
    assert solution.steps[0] // 2 <= turns


@pytest.mark.parametrize(("ratio", "agreement"), [(0.1, 0.05), (0.5, 0.02), (1.0, 0.02), (2.0, 0.02), (10.0, 0.02)])
def test_relaxed_after_aitken_it_settles_and_agrees_with_the_coupled_method(ratio, agreement):
    body, fixed = _blocks(ratio)
    # repelled nodes stick
    together = press(body, fixed, [Pair("upper.z-", "lower.z+", friction=1e3)]).last.touches[0]
    by_turns = _press(ratio, aitken=True)
    assert by_turns.converged
    assert by_turns.last.touches[0].force[2] == pytest.approx(together.force[2], rel=agreement)
    # action equals reaction
    assert np.abs(by_turns.last.touches[0].nodal.sum(axis=0)).max() < 1e-12


def test_what_it_cannot_do_is_refused():
    body, fixed = _blocks(1.0)
    with pytest.raises(InputError, match="neither friction nor bonds"):
        press(body, fixed, [Pair("upper.z-", "lower.z+", friction=0.5)], method="paper")
    with pytest.raises(InputError, match="want augmented or paper"):
        press(body, fixed, [Pair("upper.z-", "lower.z+")], method="papers")
