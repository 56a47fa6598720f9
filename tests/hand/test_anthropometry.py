"""Hand sizes by percentile."""

import pytest

from warpjld.errors import InputError
from warpjld.hand import percentile
from warpjld.hand.fit import fit_plan, measure
from warpjld.hand.flesh import PlannedFlesh


def test_the_median_is_the_mean_and_sizes_grow() -> None:
    assert percentile(50, "male") == pytest.approx({"length": 0.194, "breadth": 0.090})
    sizes = [percentile(p, "female") for p in (5, 50, 95)]
    for name in ("length", "breadth"):
        values = [size[name] for size in sizes]
        assert values == sorted(values)
        assert values[2] - values[1] == pytest.approx(1.645 * (0.010 if name == "length" else 0.004), rel=1e-3)


@pytest.mark.parametrize("sex", ["male", "female"])
def test_a_size_makes_a_hand(sex: str) -> None:
    size = percentile(95, sex)
    length, breadth = 1000.0 * size["length"], 1000.0 * size["breadth"]
    measured = measure(PlannedFlesh(fit_plan(length, breadth, {})), length)
    assert measured == pytest.approx((length, breadth), rel=2e-3)


@pytest.mark.parametrize(("percent", "sex"), [(0, "male"), (100, "male"), (50, "any")])
def test_bad_arguments(percent: float, sex: str) -> None:
    with pytest.raises(InputError):
        percentile(percent, sex)
