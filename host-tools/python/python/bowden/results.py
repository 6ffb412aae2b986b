"""What fits and diagnoses say, as typed values. Numbers are SI; the unit is in the name or in the field `unit`."""

from __future__ import annotations

import dataclasses
import types
import typing
from dataclasses import dataclass
from typing import Any, TypeVar

__all__ = [
    "ChannelError",
    "ChannelFit",
    "Effect",
    "Estimate",
    "FittedParameter",
    "FreeForm",
    "Law",
    "MapAxis",
    "MapChannel",
    "Mismatch",
    "Recalibrated",
    "ResidualMap",
    "Rival",
    "RivalLoss",
    "StageLoss",
    "TriedHypothesis",
    "Unexplained",
]


@dataclass(frozen=True)
class Estimate:
    """A fitted number with its uncertainty."""

    value: float
    std: float | None
    """Standard deviation; `None` at a bound."""
    unit: str
    """Unit; `1` for a ratio."""
    at_bound: bool = False
    """Whether the value lies at an end of its accepted range."""

    @property
    def interval(self) -> tuple[float, float] | None:
        """Ends of the interval that holds the true value in 95 of 100 cases, if errors are normal; `None` at a bound."""
        return None if self.std is None else (self.value - 1.96 * self.std, self.value + 1.96 * self.std)

    def __str__(self) -> str:
        spread = "" if self.std is None else f" ± {self.std:.2g}"
        return f"{self.value:.4g}{spread}" + ("" if self.unit == "1" else f" {self.unit}")


@dataclass(frozen=True)
class Rival:
    """An effect or a law of the same component that could not be excluded beside the named one."""

    id: str
    probability: float
    separating_experiment: str
    """What to record so that the two part."""
    formula: str | None = None
    """Formula of a law; `None` for an effect of the catalogue."""


@dataclass(frozen=True)
class Effect:
    """An effect that the diagnosis reports."""

    id: str
    component: str
    """Part of the joint: `motor`, `transmission`, `joint` or `sensors`."""
    probability: float
    onset_s: float | None
    """When it began, s; `None` for one that is always there."""
    channel: str | None
    """Channel, for an effect of a sensor."""
    parameters: dict[str, Estimate]
    heldout_improvement: float
    """Part of the held-out loss that it removes, at most 1; negative where held-out data are predicted worse with it."""
    training_improvement: float
    """Part of the loss that it removes of the data that were fitted, for which it was chosen."""
    sentence: str
    rivals: tuple[Rival, ...] = ()
    further: tuple[dict[str, Estimate], ...] = ()
    """Parameters of other instances, strongest first."""
    bench: str | None = None
    """The one bench of a study that has it; `None` if all have it."""


@dataclass(frozen=True)
class Recalibrated:
    """A nominal parameter after recalibration."""

    parameter: str
    nominal: float
    fitted: float
    std: float | None
    unit: str
    at_bound: bool
    bench: str | None = None


@dataclass(frozen=True)
class Mismatch:
    """Where recalibrated simulation and recording differ."""

    component: str
    channel: str
    regime: str
    t_start_s: float
    t_end_s: float
    share: float
    """Share of the whole difference, 0 to 1."""


@dataclass(frozen=True)
class MapAxis:
    """Variable over which a residual map runs."""

    variable: str
    unit: str
    edges: tuple[float, ...]
    """Ends of the bins, shape `(bins + 1,)`."""


@dataclass(frozen=True)
class MapChannel:
    """Differences of one channel over every axis of a map, root mean square, in its unit."""

    channel: str
    unit: str
    before_rmse: tuple[tuple[float | None, ...], ...]
    """With the rig as it was, `[axis][bin]`; `None` where the recordings hardly went."""
    after_rmse: tuple[tuple[float | None, ...], ...]
    """The same with the diagnosed physics."""


@dataclass(frozen=True)
class ResidualMap:
    """Where in position, speed, tension and time simulation and recording differ."""

    axes: tuple[MapAxis, ...] = ()
    channels: tuple[MapChannel, ...] = ()


@dataclass(frozen=True)
class FreeForm:
    """A curve or wave over one variable, fitted to what is left of a channel."""

    variable: str
    variable_unit: str
    per_ampere: bool
    unit: str
    points: tuple[tuple[float, ...], ...]
    points_backwards: tuple[tuple[float, ...], ...]
    heldout: bool
    """Whether the next three are of held-out data; otherwise of every third second, to which it was not fitted."""
    heldout_rms_before: float
    heldout_rms_after: float
    heldout_share: float


@dataclass(frozen=True)
class Unexplained:
    """Structure that no named effect explains."""

    component: str
    channel: str
    depends_on: tuple[str, ...]
    sentence: str
    period_rad: float | None = None
    frequency_hz: float | None = None
    free_form: FreeForm | None = None
    modelled: bool = False
    """Whether the diagnosed rig simulates it, as the law."""
    law: str | None = None


@dataclass(frozen=True)
class Law:
    """Physics without a name: a closed form of one variable at one port of the joint."""

    component: str
    port: str
    variables: tuple[str, ...]
    channel: str | None
    formula: str
    coefficients: dict[str, Estimate]
    heldout_improvement: float
    training_improvement: float
    sentence: str
    bench: str | None = None
    """The one bench of a study that it is of; `None` if it is of all."""


@dataclass(frozen=True)
class RivalLoss:
    """What else was tried in the place of a hypothesis."""

    id: str
    """Effect, law, or variable of a curve."""
    heldout_loss: float


@dataclass(frozen=True)
class TriedHypothesis:
    """A hypothesis by itself beside the recalibrated rig, against what else does best in its place."""

    name: str
    component: str
    port: str
    variables: tuple[str, ...]
    channel: str | None
    coefficients: dict[str, Estimate]
    heldout_loss_without: float
    heldout_loss: float
    catalogue: RivalLoss | None
    """Best effect of the catalogue."""
    closed_form: RivalLoss | None
    """Best closed form, at any port."""
    free_curve: RivalLoss | None
    """Best curve through six values at the same port, over one of the variables."""
    beats_catalogue: bool
    beats_closed_form: bool
    beats_free_curve: bool
    found: bool
    """Whether the search found it: it is then one of the laws, and the diagnosed rig simulates it."""
    sentence: str


@dataclass(frozen=True)
class ChannelFit:
    """Differences of one channel on held-out data, root mean square, in its unit."""

    before_rmse: float
    recalibrated_rmse: float
    after_rmse: float
    noise_rmse: float
    """What sensors alone would leave."""
    free_run: bool = False
    """Whether it is of a free run over the whole recording, beside a diagnosis that held the joint to its recorded angle."""


@dataclass(frozen=True)
class StageLoss:
    """Mean loss in squared scales; 1 is what sensor noise and an ordinary bench leave."""

    before: float
    recalibrated: float
    after: float


@dataclass(frozen=True)
class FittedParameter:
    """One nominal parameter, before and after a fit."""

    parameter: str
    bench: str | None
    unit: str
    nominal: float
    fitted: float
    std: float | None
    """Standard deviation; `None` where the data leave it open or the value lies at a bound."""
    at_bound: bool


@dataclass(frozen=True)
class ChannelError:
    """Difference between recordings and replays in one channel, root mean square."""

    channel: str
    unit: str
    before_rmse: float
    after_rmse: float


T = TypeVar("T")


def read(kind: type[T], data: Any) -> T:
    """Makes a value of a type from what JSON says; keys that the type does not know are passed over."""
    return typing.cast(T, _read(kind, data))


def _read(kind: Any, data: Any) -> Any:
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is types.UnionType:
        inner = next(argument for argument in arguments if argument is not type(None))
        return None if data is None else _read(inner, data)
    if origin is tuple:
        return tuple(_read(arguments[0], one) for one in data)
    if origin is dict:
        return {name: _read(arguments[1], one) for name, one in data.items()}
    if dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        known = {field.name for field in dataclasses.fields(kind)}
        return kind(**{name: _read(hints[name], one) for name, one in data.items() if name in known})  # type: ignore[operator]
    return float("nan") if data is None and kind is float else data
