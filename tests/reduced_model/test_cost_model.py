"""The committed cost model knows every kind of work, and a fit finds the seconds that made the times."""

from __future__ import annotations

import numpy as np
import pytest

from ringbalance.verification.selection_studies.measure import CostModel, committed_costs, fitted_costs

TRUE = CostModel(seconds={"solve": 2e-3, "unknown_2d": 3e-6}, fitted_on="test")


def test_a_fit_finds_the_seconds() -> None:
    works = [{"solve": s, "unknown_2d": u} for s, u in ((3.0, 300.0), (3.0, 3e4), (30.0, 1e3), (150.0, 5e4))]
    found = fitted_costs(works=works, seconds=[TRUE.cost(w) for w in works], fitted_on="made")
    assert {k: pytest.approx(v, rel=1e-6) for k, v in TRUE.seconds.items()} == dict(found.seconds)


def test_a_fit_bears_noise_and_keeps_what_it_did_not_see() -> None:
    rng = np.random.default_rng(1)
    works = [{"solve": float(rng.integers(1, 100))} for _ in range(40)]
    times = [TRUE.cost(w) * float(np.exp(rng.normal(0, 0.2))) for w in works]
    prior = CostModel(seconds={"solve": 1e-3, "table": 5e-4}, fitted_on="before")
    found = fitted_costs(works=works, seconds=times, fitted_on="noisy", prior=prior)
    assert found.seconds["solve"] == pytest.approx(2e-3, rel=0.15)
    assert found.seconds["table"] == pytest.approx(5e-4)


def test_unknown_work_is_refused() -> None:
    with pytest.raises(ValueError, match="flops"):
        TRUE.cost({"flops": 1.0})


@pytest.mark.parametrize(("works", "seconds"), [([], []), ([{"solve": 1.0}], []), ([{"solve": 1.0}], [0.0])])
def test_senseless_fits_are_refused(works: list[dict[str, float]], seconds: list[float]) -> None:
    with pytest.raises(ValueError, match="one time above zero"):
        fitted_costs(works=works, seconds=seconds, fitted_on="")


def test_the_committed_model_has_a_price_for_everything() -> None:
    costs = committed_costs()
    assert all(value > 0 for value in costs.seconds.values())
    assert costs.fitted_on
