"""Verdicts against the rank of the exact Fisher information, and the products of powers that it leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from synthetic_rigs import READINGS, observations

from ringbalance.identification.device import Models
from ringbalance.identification.fitting import FitResult, fit
from ringbalance.identification.identifiability import DEPENDENT, Identified, _power_text
from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.reading import KINDS
from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.models import Scene
from ringbalance.scene.origins import InputUncertainty
from ringbalance.scene.uncertain import with_value
from scenes import with_tables

RADII = np.array([0.040, 0.042, 0.0445, 0.0445])
SURFACE = 0.034


@pytest.fixture
def scene(paper_scene: Scene) -> Scene:
    """Nothing is known beforehand; k is prescribed, as the paper does."""
    exact = replace(paper_scene.liquid, density_uncertainty=0.0, viscosity_uncertainty=0.0)
    bare = replace(paper_scene, liquid=exact, uncertainty=())
    return with_value(scene=bare, quantity="drag_coefficient", value=50.0)


def noisy(
    kind: str, scene: Scene, columns: dict[str, npt.ArrayLike], chambers: Sequence[str] = ()
) -> Observations:
    """What a scene measures, to a thousandth."""
    plan = observations(kind, columns, chambers)
    found = KINDS[kind].predict(scene, plan, Models.of(scene))
    random = np.random.default_rng(1)
    seen = found + 1e-3 * np.sqrt(np.mean(found**2)) * random.standard_normal(found.size)
    if kind == "trial_weight":
        vector = 1e-5 + seen[: len(plan)] + 1j * seen[len(plan) :]
        return observations(kind, columns | {"amplitude": np.abs(vector), "phase": np.angle(vector)})
    return observations(kind, columns | {KINDS[kind].noisy_column(plan): seen}, chambers)


def pressures(scene: Scene, *, speeds: npt.ArrayLike | None = None) -> Observations:
    columns: dict[str, npt.ArrayLike] = {"radius": RADII, "surface_radius": SURFACE, "pressure": 1.0}
    return noisy("pressure", scene, columns | ({} if speeds is None else {"speed": speeds}))


def weights(scene: Scene) -> Observations:
    columns: dict[str, npt.ArrayLike] = {"unbalance": [0, 1e-4, 1e-4, 2e-4, 2e-4], "angle": [0, 1, 3, 5, 2]}
    return noisy("trial_weight", scene, columns)


def rank(slopes: FloatArray) -> int:
    """Number of independent directions among the columns that are not zero, each of norm one."""
    norms = np.linalg.norm(slopes, axis=0)
    return int(np.linalg.matrix_rank(slopes[:, norms > 0] / norms[norms > 0], tol=DEPENDENT))


def verdicts(result: FitResult) -> dict[str, Identified]:
    return {p.name: p.verdict for p in result.parameters}


def test_density_and_speed_from_pressures(scene: Scene) -> None:
    """P = rho omega^2 (r^2 - a^2)/2: columns 1 and 2 of d ln P, of rank one; rho omega^2 is what is seen."""
    exact = np.outer(RADII**2 - SURFACE**2, [1.0, 2.0])
    found = fit(scene, data=[pressures(scene)], parameters=["density", "speed"])
    assert rank(exact) == rank(found.optimum.slopes) == 1
    assert set(verdicts(found).values()) == {Identified.STRUCTURALLY}
    assert [c.text for c in found.combinations] == ["density speed^2"]
    product = scene.liquid.density * scene.rotor.speed**2
    seen = found.combinations[0]
    assert abs(np.log(seen.value / product)) < 2 * seen.relative_uncertainty < 0.01


def test_the_surface_tells_nothing_apart_from_density(scene: Scene) -> None:
    """With the speed of each row in the file the scene's has no part: a column of zeros."""
    exact = np.outer(RADII**2 - SURFACE**2, [1.0, 0.0])
    data = pressures(scene, speeds=scene.rotor.speed * np.array([0.8, 0.9, 1.0, 1.1]))
    found = fit(scene, data=[data], parameters=["density", "speed"])
    assert rank(exact) == rank(found.optimum.slopes) == 1
    assert verdicts(found) == {"density": Identified.IDENTIFIED, "speed": Identified.STRUCTURALLY}
    assert found.combinations == ()


def test_trial_weights_say_nothing_of_the_tube(scene: Scene) -> None:
    names = ["influence_coefficient", "lag_angle", "bore"]
    found = fit(scene, data=[weights(scene)], parameters=names)
    assert rank(found.optimum.slopes) == 2
    assert verdicts(found) == {
        "influence_coefficient": Identified.IDENTIFIED,
        "lag_angle": Identified.IDENTIFIED,
        "bore": Identified.STRUCTURALLY,
    }


def injections(
    scene: Scene,
    times: npt.ArrayLike,
    *,
    noise: float,
    seed: int,
    pressures: npt.ArrayLike | None = None,
) -> Observations:
    """Injections from equal fills, with the vibration read before and after; under the scene's gas if no
    pressures are given."""
    rows, random = np.size(times), np.random.default_rng(seed)
    columns: dict[str, npt.ArrayLike] = {
        "gas_time": times,
        "pressure": scene.gas.pressure if pressures is None else pressures,
        "fill_ratio": scene.disc.initial_fill,
        **dict.fromkeys(READINGS, 0.0),
    }
    chambers = [("ABCD" * rows)[i] for i in range(rows)]
    plan = observations("injection", columns, chambers)
    found = KINDS["injection"].predict(scene, plan, Models.of(scene))
    error = noise * (random.standard_normal((2, rows)) + 1j * random.standard_normal((2, rows)))
    after, before = 1e-6 + found[:rows] + 1j * found[rows:] + error[0], 1e-6 + error[1]
    readings: tuple[FloatArray, ...] = (np.abs(before), np.angle(before), np.abs(after), np.angle(after))
    return observations("injection", columns | dict(zip(READINGS, readings, strict=True)), chambers)


def test_injections_alone_see_kappa_lambda(scene: Scene) -> None:
    """V = kappa lambda(...): the two columns are equal; the lag is the direction of V."""
    data = injections(scene, np.linspace(0.1, 0.4, 8), noise=1e-8, seed=1)
    found = fit(scene, data=[data], parameters=["influence_coefficient", "lambda_factor", "lag_angle"])
    assert rank(found.optimum.of_prediction) == 2
    assert verdicts(found)["lag_angle"] is Identified.IDENTIFIED
    assert [c.text for c in found.combinations] == ["kappa lambda"]


def with_free_loss(scene: Scene, name: str) -> Scene:
    """The paper's prescribed k, or one that is calculated and lacks a loss."""
    bare = with_tables(scene, tube={"drag_coefficient": None})
    return scene if name == "drag_coefficient" else bare


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.heavy) for seed in range(2, 27))]
)
@pytest.mark.parametrize("loss", ["drag_coefficient", "extra_loss"])
def test_end_rates_alone_see_lambda_squared_over_k_plus_one(scene: Scene, loss: str, seed: int) -> None:
    """A rate is lambda u with u^2 = 2 H/(k + 1): whatever the truth, the product is found and its interval
    holds it."""
    same = seed % 2 == 0
    random = np.random.default_rng(seed)
    # Over a crest next to the level, which still holds it: the less is lifted first, the more this is a rate.
    near = replace(scene.tube, hump_radius=38e-3, hump_shape="point")
    scene = with_free_loss(replace(scene, tube=near), loss)
    truth = with_value(scene=scene, quantity="lambda_factor", value=random.uniform(0.93, 1.07))
    high, low = (60.0, 40.0) if loss == "drag_coefficient" else (3.0, 0.5)
    truth = with_value(scene=truth, quantity=loss, value=random.uniform(low, high))
    times = np.full(12, 0.05) if same else random.uniform(0.04, 0.07, 12)
    data = injections(truth, times, noise=1e-8, seed=seed)
    found = fit(scene, data=[data], parameters=["lambda_factor", loss])
    assert [c.text for c in found.combinations] == ["lambda^2/(k + 1)"]
    if same:
        assert rank(found.optimum.of_prediction) == 1
        assert set(verdicts(found).values()) == {Identified.STRUCTURALLY}
    else:
        assert Identified.STRUCTURALLY not in verdicts(found).values()
    assert all(
        "lambda^2/(k + 1)" in p.text for p in found.parameters if p.verdict is not Identified.IDENTIFIED
    )
    if loss == "drag_coefficient":
        true = truth.disc.moment_factor**2 / ((truth.tube.drag_coefficient or 0.0) + 1)
        product = found.combinations[0]
        assert abs(np.log(product.value / true)) < 2 * product.relative_uncertainty


@pytest.mark.parametrize("loss", ["drag_coefficient", "extra_loss"])
def test_end_rates_at_various_pressures_see_no_more(scene: Scene, loss: str) -> None:
    """Where k depends on the velocity, and the start of the flow on k, pressures over a third do tell k; but
    not beyond what correlations and start are uncertain by, at the noise of the scene's own sensor."""
    random = np.random.default_rng(3)
    bare = with_tables(with_free_loss(scene, loss), gas={"pressure": 0.8e6})
    truth = with_value(scene=bare, quantity=loss, value=45.0 if loss == "drag_coefficient" else 1.5)
    data = injections(
        truth,
        random.uniform(0.04, 0.07, 24),
        noise=scene.sensor.amplitude_noise,
        seed=3,
        pressures=0.8e6 * random.uniform(1.0, 1.33, 24),
    )
    found = fit(bare, data=[data], parameters=["lambda_factor", loss])
    assert set(verdicts(found).values()) == {Identified.PRACTICALLY}
    assert [c.text for c in found.combinations] == ["lambda^2/(k + 1)"]


def weighed(scene: Scene) -> Observations:
    """Six transfers whose liquid is weighed."""
    columns: dict[str, npt.ArrayLike] = {
        "fill_ratio": [0.25] * 6,
        "pressure": scene.gas.pressure,
        "gas_time": [0.2, 0.3, 0.4] * 2,
        "mass": 1.0,
    }
    return noisy("transfer", scene, columns)


def test_an_amount_and_a_time_tell_both_apart(scene: Scene) -> None:
    """Liquid weighed beside the end rates: no combination is needed any more."""
    data = injections(scene, np.full(12, 0.05), noise=1e-8, seed=1)
    names = ["lambda_factor", "drag_coefficient"]
    found = fit(scene, data=[data, weighed(scene)], parameters=names)
    assert set(verdicts(found).values()) == {Identified.IDENTIFIED}
    assert found.combinations == ()


def test_a_prior_that_says_more_than_the_data(scene: Scene) -> None:
    """A bore known to a ten-thousandth is not identified by weighing to a hundredth."""
    data = weighed(scene)
    known = replace(scene, uncertainty=(replace_bore(scene, 1e-4),))
    assert verdicts(fit(known, data=[data], parameters=["bore"]))["bore"] is Identified.PRACTICALLY
    assert verdicts(fit(scene, data=[data], parameters=["bore"]))["bore"] is Identified.IDENTIFIED


def replace_bore(scene: Scene, relative: float) -> InputUncertainty:
    return InputUncertainty(quantity="bore", half_width=relative * scene.tube.bore, relative=False)


@pytest.mark.parametrize(
    ("exponents", "text"),
    [
        ([2, -1], "a^2/b"),
        ([1, 1], "a b"),
        ([-1, 2], "b^2/a"),
        ([1, -0.24], "a/b^0.24"),
    ],
)
def test_products_of_powers(exponents: list[float], text: str) -> None:
    assert _power_text(["a", "b"], np.array(exponents)) == text
