"""Pictures of recordings and diagnoses, with matplotlib. Every function returns a `Figure`, which a notebook shows.

Needs matplotlib: `pip install "./host-tools/python[plots]"`.
"""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bowden.errors import InputError
from bowden.recording import UNITS, Recording, RecordingLike, as_recording
from bowden.rig import RigLike, as_rig
from bowden.work import replay

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bowden.diagnosis import Diagnosis

__all__ = ["before_after", "hysteresis", "law", "overview", "residual_map"]

_MEASURED = "black"
_BEFORE = "tab:orange"
_AFTER = "tab:blue"

_BINS = 40
"""Bins of a law's picture: with ten seconds at 1 kHz each holds some 250 samples."""

_FEWEST = 5
"""Fewest samples from which a bin is drawn."""


_NOTEBOOK_DPI = 80
"""Dots an inch in a notebook: a picture of 10 inches fills its width."""


def _figure(**options: Any) -> tuple[Figure, Any]:
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        message = "pictures need matplotlib; pip install matplotlib"
        raise InputError(message, hint="pip install matplotlib") from error

    class Picture(Figure):
        """A figure that notebooks show by themselves; not made by pyplot, so that there is no window and nothing to be closed."""

        def _repr_png_(self) -> bytes:
            data = io.BytesIO()
            self.savefig(data, format="png", dpi=_NOTEBOOK_DPI)
            return data.getvalue()

    size = options.pop("figsize")
    figure = Picture(figsize=size, layout="constrained")
    return figure, figure.subplots(squeeze=False, **options)


def overview(diagnosis: Diagnosis, channels: list[str] | None = None) -> Figure:
    """Measured and simulated over time, one row a channel of the first recording, and what is left beside it."""
    traces = diagnosis.traces
    chosen = list(traces) if channels is None else channels
    lacking = [name for name in chosen if name not in traces]
    if lacking or not chosen:
        message = f"channels: no trace of {', '.join(lacking)}; there are {', '.join(traces)}"
        raise InputError(message, hint=f"there are {', '.join(traces)}")
    figure, axes = _figure(figsize=(10, 1 + 1.9 * len(chosen)), nrows=len(chosen), ncols=2, sharex=True)
    for (left, right), name in zip(axes, chosen, strict=True):
        trace = traces[name]
        left.plot(trace.t_s, trace.before, color=_BEFORE, lw=0.9, label="rig as it was")
        left.plot(trace.t_s, trace.after, color=_AFTER, lw=0.9, label="diagnosed")
        left.plot(trace.t_s, trace.measured, color=_MEASURED, lw=0.7, label="measured")
        left.set_ylabel(_label(name, trace.unit))
        right.plot(trace.t_s, trace.measured - trace.before, color=_BEFORE, lw=0.7)
        right.plot(trace.t_s, trace.measured - trace.after, color=_AFTER, lw=0.7)
        right.axhline(0.0, color="0.5", lw=0.5)
    axes[0, 0].legend(loc="upper right", fontsize="small")
    axes[0, 1].set_title("measured minus simulated", fontsize="medium")
    for axis in axes[-1]:
        axis.set_xlabel("t_s, s")
    return figure


def residual_map(diagnosis: Diagnosis) -> Figure:
    """Differences of every channel over position, speed, tension and time: above with the rig as it was, below diagnosed.

    Colour is the root mean square difference over the largest that the channel has with the rig as it was; white is where the
    recordings hardly went.
    """
    said = diagnosis.residual_map
    if not said.axes or not said.channels:
        raise InputError("the diagnosis has no residual map: nothing moved; record a motion", hint="record a motion")
    height = 2.0 + 0.6 * len(said.channels)
    figure, axes = _figure(figsize=(3.2 * len(said.axes) + 1, height), nrows=2, ncols=len(said.axes), sharey=True)
    image: Any = None
    for row, when in enumerate(("before_rmse", "after_rmse")):
        for column, variable in enumerate(said.axes):
            cells = []
            for channel in said.channels:
                largest = max((v or 0.0 for bins in channel.before_rmse for v in bins), default=0.0) or 1.0
                values = getattr(channel, when)[column]
                cells.append([math.nan if value is None else value / largest for value in values])
            axis = axes[row, column]
            rows = np.arange(len(said.channels) + 1)
            image = axis.pcolormesh(variable.edges, rows, np.array(cells), vmin=0.0, vmax=1.0, cmap="viridis")
            axis.set_yticks(rows[:-1] + 0.5, [channel.channel for channel in said.channels])
            if row == 1:
                axis.set_xlabel(_label(variable.variable, variable.unit))
        axes[row, 0].set_ylabel("rig as it was" if row == 0 else "diagnosed")
    figure.colorbar(image, ax=axes, label="share of the largest difference")
    return figure


def hysteresis(
    recording: RecordingLike, rig: RigLike, *, x: str = "theta_in_rad", y: str | None = None, before: RigLike | None = None
) -> Figure:
    """Loops of one channel over another: measured, replayed with a rig, and with another one `before`.

    Args:
        recording: The recording.
        rig: What simulates it, such as the diagnosed rig.
        x: Channel of the abscissa, recorded.
        y: Channel of the ordinate, recorded and simulated; the first such one by default.
        before: A second rig to compare with.
    """
    believed = as_rig(rig)
    measured = as_recording(recording, believed)
    simulated = replay(measured, believed)
    both = [name for name in simulated.channels if name in measured and name != x]
    if x not in measured or not both or (y is not None and y not in both):
        message = f"{measured.source}: no {x} and {y or 'output'} to draw; recorded and simulated are {', '.join(both)}"
        raise InputError(message, measured.source, hint=f"recorded and simulated are {', '.join(both)}")
    over = both[0] if y is None else y
    figure, axes = _figure(figsize=(6, 5))
    axis = axes[0, 0]
    if before is not None:
        other = replay(measured, before)
        axis.plot(measured[x], other[over], color=_BEFORE, lw=0.8, label="rig as it was")
    axis.plot(measured[x], simulated[over], color=_AFTER, lw=0.8, label="simulated")
    axis.plot(measured[x], measured[over], color=_MEASURED, lw=0.6, label="measured")
    axis.set_xlabel(_label(x, UNITS[x]))
    axis.set_ylabel(_label(over, UNITS[over]))
    axis.legend(fontsize="small")
    return figure


def law(
    recording: RecordingLike, rig: RigLike, *, effect: str = "law", variable: str | None = None, channel: str | None = None
) -> Figure:
    """What a law (or a named effect) does, against what it is to explain, over its variable.

    Points: measured minus simulated without it, mean of a bin and its standard error. Line: what it adds to the simulation, simulated
    with it minus simulated without it, mean of the same bin.

    Args:
        recording: The recording, best one that was held out.
        rig: The diagnosed rig, which simulates the law.
        effect: Which effect is left out; `"law"` is all laws.
        variable: `theta_in_rad`, `theta_out_rad`, `omega_in_rad_s`, `omega_out_rad_s`, `t_s` or a recorded channel; by default that of
            the rig's first law.
        channel: Where it is looked at; by default the one whose difference it reduces most.
    """
    believed = as_rig(rig)
    measured = as_recording(recording, believed)
    with_it, without_it = replay(measured, believed), replay(measured, believed.without(effect))
    both = [name for name in with_it.channels if name in measured]
    if channel is None:
        channel = max(both, key=lambda name: _removed(measured[name], with_it[name], without_it[name]), default=None)
    if channel is None or channel not in both:
        message = f"{measured.source}: no channel {channel} to draw; recorded and simulated are {', '.join(both)}"
        raise InputError(message, measured.source, hint=f"recorded and simulated are {', '.join(both)}")
    over = _variable_of(believed.text) if variable is None else variable
    x = _values_of(over, measured, with_it)
    # A constant difference is the zero of a sensor and no part of the law.
    residual = measured[channel] - without_it[channel]
    residual = residual - float(np.mean(measured[channel] - with_it[channel]))
    added = with_it[channel] - without_it[channel]
    edges = np.linspace(float(np.min(x)), float(np.max(x)), _BINS + 1)
    place = np.clip(np.digitize(x, edges) - 1, 0, _BINS - 1)
    centre, points, error, line = [], [], [], []
    for bin_ in range(_BINS):
        inside = place == bin_
        count = int(inside.sum())
        if count < _FEWEST:
            continue
        centre.append(0.5 * (edges[bin_] + edges[bin_ + 1]))
        points.append(float(residual[inside].mean()))
        error.append(float(residual[inside].std() / math.sqrt(count)))
        line.append(float(added[inside].mean()))
    figure, axes = _figure(figsize=(7, 4.5))
    axis = axes[0, 0]
    axis.errorbar(centre, points, yerr=error, fmt="o", ms=3.5, lw=0.8, color=_MEASURED, label=f"measured minus simulated without {effect}")
    axis.plot(centre, line, color=_AFTER, lw=1.6, label=f"what {effect} adds")
    axis.axhline(0.0, color="0.5", lw=0.5)
    axis.set_xlabel(over)
    axis.set_ylabel(_label(channel, UNITS[channel]))
    axis.legend(fontsize="small")
    return figure


def before_after(diagnosis: Diagnosis) -> Figure:
    """Held-out differences of every channel: rig as it was, recalibrated, diagnosed, and what sensors alone would leave."""
    channels = diagnosis.channels
    figure, axes = _figure(figsize=(8, 1.4 + 0.6 * len(channels)))
    axis = axes[0, 0]
    stages = (
        ("before_rmse", "rig as it was", _BEFORE),
        ("recalibrated_rmse", "recalibrated", "tab:gray"),
        ("after_rmse", "diagnosed", _AFTER),
    )
    places = np.arange(len(channels))
    for index, (name, label, colour) in enumerate(stages):
        ratios = [_over(getattr(channel, name), channel.before_rmse) for channel in channels.values()]
        axis.barh(places + 0.25 * (index - 1), ratios, height=0.23, color=colour, label=label)
    noise = [_over(channel.noise_rmse, channel.before_rmse) for channel in channels.values()]
    axis.plot(noise, places, "|", color=_MEASURED, ms=18, label="sensors alone")
    axis.set_yticks(places, list(channels))
    axis.invert_yaxis()
    axis.set_xlabel("held-out difference (RMS) over that of the rig as it was")
    axis.legend(fontsize="small", loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def _over(value: float, whole: float) -> float:
    return value / whole if whole > 0.0 else math.nan


def _label(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name}, {unit}"


def _removed(measured: NDArray[np.float64], with_it: NDArray[np.float64], without_it: NDArray[np.float64]) -> float:
    """Relative reduction of the variance of the differences by simulating it."""
    before = float(np.var(measured - without_it))
    return 1.0 - float(np.var(measured - with_it)) / before if before > 0.0 else 0.0


def _variable_of(rig: str) -> str:
    import tomllib

    laws = tomllib.loads(rig).get("law", [])
    if not laws:
        message = "the rig has no law; say with variable= what the effect depends on"
        raise InputError(message, hint="say with variable= what the effect depends on")
    return str(laws[0]["variables"][0])


def _values_of(variable: str, measured: Recording, simulated: Recording) -> NDArray[np.float64]:
    """Values of a variable, shape `(samples,)`; what is simulated is free of noise and comes first."""
    speeds = {"omega_in_rad_s": "theta_in_rad", "omega_out_rad_s": "theta_out_rad"}
    name = speeds.get(variable, variable)
    for recording in (simulated, measured):
        if name in recording or name == "t_s":
            values = recording[name]
            return np.gradient(values, recording.t_s) if variable in speeds else values
    known = ", ".join(("t_s", *speeds, *measured.channels))
    message = f"variable: no {variable} in the recording; take one of {known}"
    raise InputError(message, measured.source, hint=f"take one of {known}")
