"""What a scene says of the measurements that it was fitted to; no result depends on it."""

from dataclasses import dataclass
from typing import Annotated

from ringbalance.scene.keys.declaration import listed, needed, standard, unused
from ringbalance.scene.keys.fields import Bounds, number, numbers, whole
from ringbalance.scene.keys.quantities import OneLine

Number = Annotated[float, number(Bounds())]
Numbers = Annotated[tuple[float, ...], numbers()]


@dataclass(frozen=True, kw_only=True)
class MeasuredFile:
    """One file of measurements."""

    file: Annotated[OneLine, needed("name, without its folder")]
    kind: Annotated[OneLine, needed("of its measurements")]
    rows: Annotated[int, whole(1, 10**9), needed("number of measurements")]
    sha256: Annotated[OneLine, needed("of its bytes")]


@dataclass(frozen=True, kw_only=True)
class MeasuredQuantity:
    """One quantity of the scene before and after the fit; intervals are those of 95 %."""

    quantity: Annotated[OneLine, needed('its path, such as "tube.bore"')]
    unit: Annotated[OneLine, needed("of the numbers beside it; 1 for none")]
    before: Annotated[Number, needed("value before the fit")]
    before_low: Annotated[Number | None, unused("nothing was known", "lower end of its interval")] = None
    before_high: Annotated[Number | None, unused("nothing was known", "upper end of its interval")] = None
    value: Annotated[Number, needed("fitted value")]
    low: Annotated[Number | None, unused("the data set no end", "lower end of its interval")] = None
    high: Annotated[Number | None, unused("the data set no end", "upper end of its interval")] = None
    verdict: Annotated[OneLine, needed("whether the data identify it")]
    profile: Annotated[Numbers, unused("none", "values at which the likelihood was searched")] = ()
    rise: Annotated[
        Numbers,
        unused("none", "at each of them, minus two log likelihood above its least, over the 95 % one"),
    ] = ()


@dataclass(frozen=True, kw_only=True)
class MeasuredFinding:
    """One sentence about the fit."""

    about: Annotated[OneLine, needed('"combination", "correlation", "residuals", "uncertainty" or "value"')]
    text: Annotated[OneLine, needed("what was found")]


@dataclass(frozen=True, kw_only=True)
class Measured:
    """Data, fit and findings of `ringbalance fit --save`."""

    files: Annotated[
        tuple[MeasuredFile, ...],
        standard([], "files of measurements"),
        listed('[{ file = "run.csv", kind = "injection", rows = 40, sha256 = "..." }, ...]'),
    ] = ()
    quantities: Annotated[
        tuple[MeasuredQuantity, ...],
        standard([], "quantities before and after"),
        listed(
            '[{ quantity = "tube.bore", unit = "mm", before = 1.5, value = 1.48, verdict = "identified" }, '
            "...]"
        ),
    ] = ()
    findings: Annotated[
        tuple[MeasuredFinding, ...],
        standard([], "what else was found"),
        listed('[{ about = "residuals", text = "..." }, ...]'),
    ] = ()
