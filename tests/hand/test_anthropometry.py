"""Hand sizes by percentile."""

import pytest

from warpjld.errors import InputError
from warpjld.hand import build_hand, percentile


def test_the_median_is_the_mean_and_sizes_grow() -> None:
    assert percentile(50, "male") == pytest.approx({"length": 0.194, "breadth": 0.090})
    sizes = [percentile(p, "female") for p in (5, 50, 95)]
    for name in ("length", "breadth"):
        values = [size[name] for size in sizes]
        assert values == sorted(values)
        assert values[2] - values[1] == pytest.approx(1.645 * (0.010 if name == "length" else 0.004), rel=1e-3)


def test_a_size_builds_a_hand() -> None:
    rig = build_hand(**percentile(5, "female"), resolution=2000)
    assert -rig.surface.vertices[:, 2].min() == pytest.approx(percentile(5, "female")["length"], rel=0.01)


@pytest.mark.parametrize(("percent", "sex"), [(0, "male"), (100, "male"), (50, "any")])
def test_bad_arguments(percent: float, sex: str) -> None:
    with pytest.raises(InputError):
        percentile(percent, sex)
