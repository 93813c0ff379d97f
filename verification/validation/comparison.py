"""Observations, bundled ones or a user's own, with the program's predictions: statistics, verdict, plot."""

# ruff: noqa: ARG001 - every study has the uniform case interface
from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from scipy import special

from ringbalance.identification.kinds.kind import Observations
from ringbalance.identification.reading import KINDS, observations_of, read_observations
from ringbalance.scene.arrays import BoolArray, FloatArray, IntArray, StringArray
from ringbalance.scene.faults import SceneError
from ringbalance.scene.models import Scene
from ringbalance.verification.evidence import Evidence, FigureCurve, Level, Series, as_found, figure
from ringbalance.verification.verdicts import Verdict

PROMISED: Final = 0.93
"""Fraction of the points that must lie within both 95 % uncertainties: 0.95 less a small-sample margin."""
MUTATIONS: Final[Mapping[str | None, float]] = MappingProxyType(
    {None: 1.0, "ten_per_cent_high": 1.1, "ten_per_cent_low": 0.9}
)
"""Factors on the prediction; every comparison with measurements must detect the last two."""
_TOLD: Final = 0.1
"""Relative half-width beyond which a prediction may hide an error that the comparisons must detect."""
_MIN_POINTS: Final = 2
"""Least number of points of a user's file, from which a scatter can be calculated."""
_MIN_SERIES: Final = 3


@dataclass(frozen=True, kw_only=True)
class Predictions:
    """Measured points with their predictions, all fields of one length, SI."""

    measured: FloatArray
    predicted: FloatArray
    stated: FloatArray
    """Expanded uncertainty (95 %) of the prediction."""
    uncertainty: FloatArray
    """U_D, relative."""
    series: StringArray
    columns: Mapping[str, FloatArray]
    """Inputs of the predictions, and further columns that all data sets have."""

    @property
    def bias(self) -> float:
        """Geometric mean of predicted over measured, less one."""
        return math.expm1(float(np.mean(np.log(self.predicted / self.measured))))

    @property
    def used(self) -> FloatArray:
        """Magnitude of each deviation over the root sum of squares of both uncertainties."""
        allowed = np.hypot(self.stated, self.uncertainty * self.measured)
        return np.asarray(np.abs(self.predicted - self.measured) / allowed)

    def where(self, chosen: BoolArray | IntArray | slice) -> Predictions:
        """Some of the points, or all in another order."""
        fields = {name: column[chosen] for name, column in vars(self).items() if name != "columns"}
        return Predictions(**fields, columns={name: column[chosen] for name, column in self.columns.items()})

    @property
    def share_within(self) -> float:
        """Fraction of the points with a deviation within both 95 % uncertainties."""
        return float(np.mean(self.used <= 1))

    @property
    def statistics(self) -> dict[str, float]:
        """Statistics of ln(predicted/measured), relative to the measured values.

        bias = exp(mean) - 1; s_model^2 = s^2 - (U_D/2)^2, zero where the measurements alone explain the
        scatter.  The points of a series share their systematic errors, so the bias is known to t s/sqrt(n) of
        the n means of the series; with fewer than three series, to U_D.
        Returns: Numbers of points and series; the bias, positive where the model predicts too high, with its
            expanded uncertainty (95 %); the scatter of the model alone; the fraction of the points with a
            deviation within both 95 % uncertainties, the stated one and U_D; and the factor on both with
            which 95 % of the points lie within them.
        Source: McGrattan and Toman, Metrologia 48 (2011) 173, for the split of the scatter.
        """
        ratio, names = np.log(self.predicted / self.measured), np.unique(self.series)
        means = np.array([np.mean(ratio[self.series == name]) for name in names])
        if names.size < _MIN_SERIES:
            bias_uncertainty = float(np.mean(self.uncertainty))
        else:
            t = float(special.stdtrit(means.size - 1, 0.975))
            bias_uncertainty = t * float(np.std(means, ddof=1)) / math.sqrt(means.size)
        unexplained = float(np.var(ratio, ddof=1) - np.mean((self.uncertainty / 2) ** 2))
        return {
            "points": ratio.size,
            "series": names.size,
            "bias": self.bias,
            "bias_uncertainty": bias_uncertainty,
            "standard_deviation": math.sqrt(max(unexplained, 0.0)),
            "share_within": self.share_within,
            "width_needed": float(np.quantile(self.used, 0.95)),
        }

    @property
    def verdict(self) -> Verdict:
        """Confirmed where at least the fraction `PROMISED` of the points lies within both uncertainties."""
        return Verdict.CONFIRMED if self.share_within >= PROMISED else Verdict.REFUTED

    def over_reynolds(self, of: str) -> Series:
        """Predicted friction factors with their stated uncertainty, and the measured ones."""
        return figure(
            f"friction factor of {of}, measured and predicted",
            ("Reynolds number", "1", self.columns["reynolds"]),
            FigureCurve("predicted", "1", self.predicted, uncertainty=self.stated),
            FigureCurve("measured", "1", self.measured, style="points"),
            log=True,
        )

    def scatter(self, name: str, unit: str) -> Series:
        """Predicted over measured values. Args: `name`: of the quantity. `unit`: its SI unit."""
        order = np.argsort(self.measured, kind="stable")
        measured, predicted = self.measured[order], self.predicted[order]
        return figure(
            f"{name}: predicted over measured",
            ("measured", unit, measured),
            FigureCurve("equal", unit, measured, uncertainty=(self.uncertainty * self.measured)[order]),
            FigureCurve("predicted", unit, predicted, style="points"),
            log=bool(measured[-1] > 10 * measured[0]),
        )


def measurements(name: str) -> Observations:
    """The data set of a file in `data/`, by its name without ".csv"."""
    path = files("ringbalance.verification.validation") / "data" / f"{name}.csv"
    observations, faults = observations_of(path.read_bytes(), file=path.name)
    if observations is None:
        raise SceneError(faults)
    return observations


def compare(*sets: Observations, mutation: str | None = None) -> Predictions:
    """Predict the points of data sets of one kind.

    Raises: SceneError: a kind that cannot be predicted, or rows that it does not hold for.
    """
    kind = KINDS[sets[0].kind]
    for each in sets:
        problem = kind.obstacle(None, each)
        if kind.stated is None:
            problem = f"nothing predicts data of the kind {each.kind}"
        if problem:
            raise SceneError.of_file(each.file, problem)
    assert kind.stated is not None
    predicted, stated = np.concatenate([kind.stated(each) for each in sets], axis=1)
    shared = set.intersection(*(set(each.columns) for each in sets))
    columns = {name: np.concatenate([each.columns[name] for each in sets]) for name in sorted(shared)}
    (name,) = (column.name for column in kind.measured)
    widths = [each.uncertainty[name] / each.columns[name] for each in sets]
    return Predictions(
        measured=columns[name],
        predicted=MUTATIONS[mutation] * predicted,
        stated=stated,
        uncertainty=np.concatenate(widths),
        series=np.concatenate([each.series for each in sets]),
        columns=columns,
    )


def friction(*sets: Observations, mutation: str | None = None) -> Predictions:
    """`compare` friction factors, in ascending order of the Reynolds number."""
    points = compare(*sets, mutation=mutation)
    return points.where(np.argsort(points.columns["reynolds"], kind="stable"))


def with_left_out(
    judged: Predictions, left_out: Mapping[str, Predictions] = MappingProxyType({}), *, taught: int = 0
) -> dict[str, float]:
    """Statistics of the readings that a case leaves out, and of all readings together.

    Args: `left_out`: readings that are not judged, by name. `taught`: number of readings to which a
        coefficient or an uncertainty was fitted: no predictions, counted in `taught_points` alone.
    Returns: `<name>_points`, `<name>_within` and `<name>_bias` of each, `all_points`, `all_within`.
    """
    numbers = {"taught_points": float(taught)} if taught else {}
    for name, readings in left_out.items():
        numbers |= {
            f"{name}_points": float(readings.used.size),
            f"{name}_within": readings.share_within,
            f"{name}_bias": readings.bias,
        }
    used = np.concatenate([judged.used, *(readings.used for readings in left_out.values())])
    return {**numbers, "all_points": float(used.size), "all_within": float(np.mean(used <= 1))}


def study(
    scene: Scene,
    level: Level,
    defect: str | None,
    *,
    sets: Sequence[str],
    unit: str,
    taught: Sequence[str] = (),
    left_out: Mapping[str, str] = MappingProxyType({}),
) -> Evidence:
    """Evidence of a case that compares bundled data sets of one kind, whatever the scene.

    Args: `unit`: of the measured quantity, SI. `taught`: series from which the stated uncertainty was taken;
        the quantity `calibration` compares their bias and twice their scatter with it. `left_out`: further
        sets that are not judged, by the name of their numbers.
    """
    sources = [measurements(name) for name in sets]
    teaching = [np.isin(data.series, taught) for data in sources]
    parts = [data.where(~series) for data, series in zip(sources, teaching, strict=True)]
    evidence = data_evidence(*parts, unit=unit, mutation=defect)
    others = {name: compare(measurements(other)) for name, other in left_out.items()}
    count = sum(int(series.sum()) for series in teaching)
    beyond = with_left_out(compare(*parts, mutation=defect), others, taught=count)
    numbers = {**evidence.numbers, **beyond}
    if not count:
        return dataclasses.replace(evidence, numbers=numbers)
    rest = [data.where(series) for data, series in zip(sources, teaching, strict=True) if series.any()]
    teachers = compare(*rest, mutation=defect)
    width = math.hypot(teachers.bias, 2 * teachers.statistics["standard_deviation"])
    stated = float(np.mean(teachers.stated / teachers.predicted))
    return dataclasses.replace(
        evidence,
        quantities={**evidence.quantities, **as_found(calibration=abs(width / stated - 1))},
        numbers={**numbers, "taught_width": width},
    )


def data_evidence(*sets: Observations, unit: str, mutation: str | None = None) -> Evidence:
    """Evidence of a case that compares data sets of one kind. Args: `unit`: of the measured quantity, SI."""
    points = compare(*sets, mutation=mutation)
    return Evidence(
        quantities=as_found(share_within=points.share_within, bias=abs(points.bias)),
        numbers=points.statistics,
        series=(points.scatter(KINDS[sets[0].kind].title, unit),),
    )


def _fourfold(points: Predictions) -> bool:
    """True where values are refuted that are confirmed four times as large."""
    fourfold = dataclasses.replace(points, measured=4 * points.measured)
    return (points.verdict, fourfold.verdict) == (Verdict.REFUTED, Verdict.CONFIRMED)


def data_document(path: Path) -> dict[str, Any]:
    """Judgement of a file of measurements, as `ringbalance verify --data FILE --json` prints it.

    Raises: SceneError: not such a file, or too few points.
    """
    (data,) = read_observations([path])
    kind, points = KINDS[data.kind], compare(data)
    if len(data) < _MIN_POINTS:
        raise SceneError.of_file(
            data.file, f"{len(data)} point, and {_MIN_POINTS} are the fewest that can be judged"
        )
    series: dict[str, dict[str, float]] = {}
    fanning = []
    for name in np.unique(points.series).tolist():
        part = points.where(points.series == name)
        series[name] = {"points": part.measured.size, "bias": part.bias, "share_within": part.share_within}
        fanning += [name] if data.kind == "friction" and _fourfold(part) else []
    hint = ""
    if fanning or (data.kind == "friction" and _fourfold(points)):
        of_all = _fourfold(points) or len(fanning) == len(series)
        whose = "these are" if of_all else f"those of {', '.join(fanning)} are"
        hint = f"{whose} Fanning's factors: four times as large, as Darcy's, they are confirmed"
    widths = points.stated / points.predicted
    sure = dataclasses.replace(points, stated=np.minimum(widths, _TOLD) * points.predicted)
    if points.verdict is Verdict.CONFIRMED and sure.verdict is Verdict.REFUTED:
        hint = "confirmed only because predictions are uncertain: known to 10 % each, they would be refuted"
    return {
        "file": str(path),
        "kind": data.kind,
        "title": kind.title,
        "source": data.source,
        "measured": kind.measured[0].name,
        "limit": PROMISED,
        "verdict": points.verdict.value,
        "hint": hint,
        "remarks": list(data.remarks),
        "half_width": {"median": float(np.median(widths)), "largest": float(np.max(widths))},
        "statistics": points.statistics,
        "series": series,
        "points": [
            dict(zip(("series", "measured", "predicted", "stated", "U_D"), row, strict=True))
            for row in zip(
                points.series.tolist(),
                points.measured.tolist(),
                points.predicted.tolist(),
                points.stated.tolist(),
                points.uncertainty.tolist(),
                strict=True,
            )
        ],
    }
