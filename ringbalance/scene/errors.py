"""The one list of uncertain quantities of a liquid ring: every input, and every error of a model.

Static intervals take both sides of each (its 2.5 and 97.5 % quantiles), drawn devices its quantiles, `fit`
the errors of models as nuisance parameters, and rankings their names.  The effect of an error is computed by
its model; this module has the error's distribution, the quantity it acts on and whether devices differ in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from types import MappingProxyType
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from scipy.special import ndtr, ndtri

from ringbalance.scene.arrays import FloatArray
from ringbalance.scene.fitted import (
    CAVITY_ERROR,
    CLEARING_ERROR,
    CREST_ERROR,
    HOLE_ERROR,
    JET_ERROR,
    MODEL,
    START_ERROR,
)
from ringbalance.scene.keys.schema import LIQUID_RING
from ringbalance.scene.models import Scene
from ringbalance.scene.uncertain import (
    NORMAL_95,
    UNCERTAIN_QUANTITIES,
    fitted_causes,
    independent_half_widths,
    moved,
)

Distribution: TypeAlias = Literal["normal", "lognormal", "uniform"]
"""Shape of a distribution; lognormal: a factor 1 + U at the expanded uncertainty (95 %) U."""
Varies: TypeAlias = Literal["devices", "chambers", "not known"]
"""Population over which a quantity varies; "not known": one unknown value common to all devices."""
NOT_KNOWN: Final = "not known"
_ASSUMED_INFLUENCE_U95: Final = 0.05
"""Relative expanded uncertainty (95 %) of an influence coefficient for which the scene states none."""
_ASSUMED_LAG_U95_RAD: Final = math.radians(3.0)
"""Expanded uncertainty (95 %) of a lag angle for which the scene states none."""
ASSUMED_AMPLITUDE: Final = 0.05
"""Relative expanded uncertainty (95 %) of the initial amplitude from one machine to the next."""
FITTED: Final = "fitted"
"""Group of all inputs that were fitted together."""
FITTED_DIRECTION: Final = "fitted together, direction"
"""Prefix of the name of a direction of fitted inputs; a number follows."""
LOSS: Final = f"{MODEL}loss of the tube"
"""Error of a flow law other than the scene's: of the law's velocity, or of the paper's k."""
WAVES: Final = f"{MODEL}waves"
MOMENT: Final = f"{MODEL}moment"
VOLUME: Final = f"{MODEL}volume"
"""Errors of a chamber's liquid outside `MODEL_KINDS`: of pressure, of moment, and of volume by facets."""
AMPLITUDE: Final = "rotor.initial_amplitude"
PHASE: Final = "rotor.initial_phase"
RUNOUT_PHASE: Final = "sensor.runout_phase"
_PARTS: Final = ("even", "odd")


@dataclass(frozen=True, kw_only=True)
class ModelKind:
    """Error of a model: affected quantity, distribution and population."""

    acts_on: str
    parts: tuple[str, ...] = ("",)
    """Names of the error's parts; a random function of Re has two."""
    distribution: Distribution = "normal"
    varies: Varies = "not known"
    by_fit: bool = False
    """True if only data of a built device determine this error; a design has no such error."""
    applies: Callable[[Scene], bool] = lambda _: True

    def names(self, cause: str) -> tuple[str, ...]:
        """Names of the parts, such as "model: ends, even"."""
        return tuple(f"{MODEL}{cause}, {part}" if part else f"{MODEL}{cause}" for part in self.parts)


def _has_model(scene: Scene) -> bool:
    """True if a model gives k; False if the scene prescribes it."""
    return scene.tube.drag_coefficient is None


def _has_bends(scene: Scene) -> bool:
    return _has_model(scene) and bool(scene.tube.bends)


def _has_crest(scene: Scene) -> bool:
    return scene.tube.hump_radius is not None


def _has_arc(scene: Scene) -> bool:
    return _has_crest(scene) and scene.tube.hump_shape == "arc"


def _has_gas_hole(scene: Scene) -> bool:
    return scene.disc.gas_hole_diameter is not None


def _has_dissolved_gas(scene: Scene) -> bool:
    return _has_crest(scene) and scene.liquid.dissolved_gas == "saturated"


def _of_loss(acts_on: str, applies: Callable[[Scene], bool] = _has_model) -> ModelKind:
    return ModelKind(acts_on=acts_on, parts=_PARTS, applies=applies)


def _as_built(acts_on: str, applies: Callable[[Scene], bool] = _has_model) -> ModelKind:
    return ModelKind(acts_on=acts_on, parts=_PARTS, varies="devices", by_fit=True, applies=applies)


MODEL_KINDS: Final[Mapping[str, ModelKind]] = MappingProxyType(
    {
        START_ERROR: ModelKind(acts_on="start of an injection", varies="chambers", by_fit=True),
        CLEARING_ERROR: ModelKind(acts_on="flow that carries gas off the crest", applies=_has_crest),
        CAVITY_ERROR: ModelKind(
            acts_on="pressure over the crest", distribution="uniform", applies=_has_dissolved_gas
        ),
        CREST_ERROR: ModelKind(acts_on="loss up to the crest", distribution="uniform", applies=_has_arc),
        HOLE_ERROR: ModelKind(
            acts_on="flow through the gas hole", distribution="uniform", applies=_has_gas_hole
        ),
        JET_ERROR: ModelKind(acts_on="velocity on the axis of the gas jet", applies=_has_gas_hole),
        "friction correlation": _of_loss("friction of the tube"),
        "rotation model": _of_loss("friction that rotation adds"),
        "rotation entry": _of_loss("friction that rotation adds near the inlet"),
        "ends": _of_loss("loss of entrance and exit"),
        "bends": _of_loss("loss of the bends", _has_bends),
        "friction as built": _as_built("friction of the tube"),
        "rotation as built": _as_built("friction that rotation adds"),
        "entrance as built": _as_built("loss of the entrance"),
        "bends as built": _as_built("loss of the bends", _has_bends),
    }
)
"""Model errors by `ErrorCause`. Each error of k is a random function of Re with a range of its own and two
parts, see `physics.tube.loss.with_errors`; "as built" frees the shape of k(u).  The flow that clears the
crest and the pressure of the cavity there are known within the spans of `reduced_model.tube.regime`, the end
of the crest's arc within that of `reduced_model.tube.path`, discharge and decay of the gas jet within those
of `physics.gas_jet`.  The start of the flow has no measurements to compare with: it depends on the column's
inertia, on a valve that does not open as fast as it closes, and on the side to which liquid on the crest
runs when the gas is shut, up to half of the tube.  Its expanded
uncertainty (95 %) is taken as the time L/2u in which the flow passes that half."""
MODEL_ERRORS: Final[Mapping[str, str]] = MappingProxyType(
    {name: cause for cause, kind in MODEL_KINDS.items() for name in kind.names(cause)}
)
"""Cause by the name of each part; a part counts in standard deviations."""


@dataclass(frozen=True, kw_only=True)
class Uncertainty:
    """One uncertain quantity."""

    name: str
    """Key of a quantity of the scene, or name of a model's error as `ModelError.named` takes it."""
    group: str
    """Heading of its effect in reports: the name, "fitted", or the cause of a model's error."""
    acts_on: str
    varies: Varies
    distribution: Distribution = "normal"
    half_width: float | None = None
    """Expanded uncertainty (95 %), SI, or relative for a factor; None: the model has its own."""
    change: Mapping[str, float] = field(default_factory=dict)
    """Changes of the scene for one standard deviation, for `moved`; empty: no scene contains the quantity."""

    def deviation(self, quantile: Any) -> Any:
        """Deviation at quantiles, in standard deviations; the ends of a uniform range lie at 1.96."""
        if self.distribution == "uniform":
            return NORMAL_95 * (2.0 * np.asarray(quantile) - 1.0)
        return ndtri(quantile)

    def deviation_of_normal(self, deviate: Any) -> Any:
        """Deviation, in standard deviations, with the exceedance probability of a standard normal deviate."""
        return self.deviation(ndtr(deviate)) if self.distribution == "uniform" else deviate

    def moved(self, scene: Scene, deviation: Any) -> Scene:
        """The scene with this quantity larger by some standard deviations, within physical limits."""
        return moved(scene, {name: deviation * each for name, each in self.change.items()})

    def sides(self, scene: Scene) -> tuple[Scene, Scene]:
        """The scene at the 2.5 and 97.5 % quantiles of this quantity."""
        end = float(self.deviation(0.975))
        return self.moved(scene, -end), self.moved(scene, end)

    def document(self) -> dict[str, Any]:
        """Fields for JSON, without `group` and `change`."""
        return {key: value for key, value in asdict(self).items() if key not in ("group", "change")}


def uncertainties(
    scene: Scene,
    *,
    among: Collection[str] = UNCERTAIN_QUANTITIES,
    models: bool = True,
    fitted_models: bool = True,
) -> tuple[Uncertainty, ...]:
    """Uncertainties of a scene: inputs, directions of jointly fitted inputs, and errors of models.

    Args: `among`: inputs to include. `models`: True to include errors of models. `fitted_models`: True to
        include errors of models that were fitted together with inputs.
    """
    alone = tuple(
        of_input(name, width) for name, width in independent_half_widths(scene).items() if name in among
    )
    inputs = (*alone, *directions(scene, among=among, errors=fitted_models))
    return (*inputs, *model_uncertainties(scene), of_chamber(WAVES), of_chamber(MOMENT)) if models else inputs


def of_flow(scene: Scene) -> tuple[Uncertainty, ...]:
    """Uncertainties that may move the flow in the tube by a change of the scene."""
    among = [name for name, table in UNCERTAIN_QUANTITIES.items() if table != "rotor" or name == "speed"]
    return tuple(each for each in uncertainties(scene, among=among) if each.change)


def of_input(name: str, width: float) -> Uncertainty:
    """A quantity of the scene with its half-width (95 %), SI."""
    table = UNCERTAIN_QUANTITIES[name]
    return Uncertainty(
        name=name,
        group=name,
        acts_on=f"{table}.{name}",
        varies="not known" if LIQUID_RING.tables[table].keys[name].common else "devices",
        half_width=width,
        change={name: width / NORMAL_95},
    )


def directions(
    scene: Scene,
    *,
    among: Collection[str] = UNCERTAIN_QUANTITIES,
    errors: bool = True,
    turned: FloatArray | None = None,
) -> tuple[Uncertainty, ...]:
    """Independent directions of the scene's fitted inputs and errors.

    Args: `errors`: True to include errors of models. `turned`: orthonormal columns that combine these
        directions into others.
    """
    keys = [each.key for each in scene.fitted.quantities]
    which = [i for i, key in enumerate(keys) if (errors if key.startswith(MODEL) else key in among)]
    columns = scene.fitted.directions(np.array(which, dtype=np.int64))
    changes = (columns if turned is None else columns @ turned).T.tolist()
    names = [keys[i] for i in which]
    return tuple(
        Uncertainty(
            name=f"{FITTED_DIRECTION} {number + 1}",
            group=FITTED,
            acts_on=", ".join(names),
            varies="not known",
            change=dict(zip(names, change, strict=True)),
        )
        for number, change in enumerate(changes)
    )


def model_uncertainties(scene: Scene, *, built: bool = False) -> tuple[Uncertainty, ...]:
    """Errors of a design's models, without those that were fitted together with inputs.

    Args: `built`: True for all errors that a fit to data of a built device uses.
    """
    fitted = fitted_causes(scene)
    return tuple(
        Uncertainty(
            name=name,
            group=f"{MODEL}{cause}",
            acts_on=kind.acts_on,
            varies=kind.varies,
            distribution=kind.distribution,
            change={name: 1.0},
        )
        for cause, kind in MODEL_KINDS.items()
        if kind.applies(scene) and (built or not (kind.by_fit or cause in fitted))
        for name in kind.names(cause)
    )


def of_chamber(name: str, half_width: float | None = None) -> Uncertainty:
    """`WAVES`, `MOMENT` or `VOLUME`. Args: `half_width`: relative; None: it depends on the fill."""
    acts_on = {
        WAVES: "pressure of the chambers' liquid",
        MOMENT: "moment of the chambers' liquid",
        VOLUME: "volume of a chamber",
    }[name]
    return Uncertainty(
        name=name,
        group=name,
        acts_on=acts_on,
        varies="not known",
        distribution="lognormal" if name == MOMENT else "normal",
        half_width=half_width,
    )


def of_runs(scene: Scene) -> tuple[Uncertainty, ...]:
    """Further uncertainties of device runs: influence coefficient and lag angle where the scene states none,
    amplitude and phase of the initial vibration, phase of a runout where the scene states none."""
    rotor, stated = scene.rotor, {each.key for each in scene.fitted.quantities}
    stated |= {each.quantity for each in scene.uncertainty}
    assumed = {
        "influence_coefficient": _ASSUMED_INFLUENCE_U95 * rotor.influence_coefficient,
        "lag_angle": _ASSUMED_LAG_U95_RAD,
    }
    errors = [of_input(name, width) for name, width in assumed.items() if name not in stated]
    starts: list[tuple[str, Distribution, float]] = [
        (AMPLITUDE, "lognormal", ASSUMED_AMPLITUDE),
        (PHASE, "uniform", scene.requirement.phase_range),
    ]
    if scene.sensor.runout_amplitude is not None and scene.sensor.runout_phase is None:
        starts.append((RUNOUT_PHASE, "uniform", math.pi))
    for name, distribution, width in starts:
        errors.append(
            Uncertainty(
                name=name,
                group=name,
                acts_on=name,
                varies="devices",
                distribution=distribution,
                half_width=width,
            )
        )
    return tuple(errors)


def with_places(scene: Scene, errors: Collection[Uncertainty]) -> Scene:
    """The scene with a zero error for each cause in `errors`: scenes moved by them differ only in numbers."""
    return moved(scene, {name: 0.0 for each in errors for name in each.change if name.startswith(MODEL)})


def larger(changes: FloatArray) -> FloatArray:
    """Larger change of both sides for each error, of those by `designs.changes_of`; NaN where both are."""
    return np.asarray(np.fmax(*np.abs(np.moveaxis(changes, 1, 0))))


def by_group(errors: Sequence[Uncertainty], changes: FloatArray) -> dict[str, FloatArray]:
    """Expanded uncertainties (95 %) by group: root of the sum of squares of the larger change for each error.

    Args: `changes`: as of `designs.changes_of`.
    """
    squares: dict[str, Any] = {}
    for error, change in zip(errors, larger(changes), strict=True):
        squares[error.group] = squares.get(error.group, 0.0) + np.square(change)
    return {group: np.sqrt(square) for group, square in squares.items()}


def both_sides(changes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Expanded uncertainties (95 %) downwards and upwards: root of the sum of squares over all errors.

    Args: `changes`: as of `designs.changes_of`.
    """
    finite = np.nan_to_num(changes)
    lowered, raised = np.max(np.maximum(-finite, 0.0), axis=1), np.max(np.maximum(finite, 0.0), axis=1)
    return np.sqrt(np.sum(lowered**2, axis=0)), np.sqrt(np.sum(raised**2, axis=0))
