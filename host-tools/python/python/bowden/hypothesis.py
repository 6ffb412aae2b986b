"""Hypotheses: physics of your own, as a function of what a port of the joint sees."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bowden import _bowden
from bowden.errors import InputError

__all__ = ["Coefficient", "Hypothesis"]


@dataclass(frozen=True)
class Coefficient:
    """A number that the fit finds."""

    start: float | Sequence[float]
    """Where the search starts; several starts are tried in all combinations, at most 64."""
    lower: float
    """Smallest value."""
    upper: float
    """Largest value."""
    unit: str = "1"
    """Unit, as results print it."""


class Hypothesis:
    """A function of one or two variables at a port of the joint, as a term of the search.

    ```python
    def rubbing_lip(theta_out_rad, level_nm, at_rad, width_rad):
        return level_nm / (1 + ((theta_out_rad - at_rad) / width_rad) ** 6)

    lip = bowden.Hypothesis(
        rubbing_lip,
        port="joint_friction_nm",
        coefficients={
            "level_nm": bowden.Coefficient(0.1, 0.0, 2.0, "N·m"),
            "at_rad": bowden.Coefficient([-0.3, 0.0, 0.3], -1.0, 1.0, "rad"),
            "width_rad": bowden.Coefficient(0.1, 0.01, 1.0, "rad"),
        },
    )
    d = bowden.diagnose("train.csv", "rig.toml", hypotheses=[lip])
    d.hypotheses[0].heldout_loss, d.hypotheses[0].beats_catalogue
    ```

    Parameters of the function that are no coefficients are variables of the port:

    | port | variables | the function returns |
    |---|---|---|
    | `motor_torque_nm` | `theta_in_rad`, `omega_in_rad_s`, `motor_torque_nm`, `t_s` | torque at the input pulley, N·m |
    | `motor_friction_nm` | the same | dry friction at the input pulley, N·m, against the motion |
    | `sheath_friction` | `theta_in_rad`, `theta_out_rad`, `relative_tension`, `t_s` | relative change of the friction coefficient |
    | `tendon_length` | `theta_in_rad`, `theta_out_rad`, `t_s` | length over what the pretension stretches the tendons by |
    | `joint_torque_nm` | `theta_out_rad`, `omega_out_rad_s`, `t_s` | torque on the joint, N·m |
    | `joint_friction_nm` | the same | dry friction of the joint, N·m, against the motion |
    | `reading` | `value`, `t_s` | what the sensor of `channel` shows beyond the true value |

    Slower than an effect of the catalogue: the function is called once for every set of coefficients that is simulated, with arrays of all
    knots of a grid (1025 points, or 65 times 65 of two variables), and the simulation interpolates. A diagnosis makes some thousand such calls. The
    grid covers what the variables do in a replay of the rig as stated and half of that beyond; farther out the last value holds. A jump is a
    ramp of one knot's width: dry friction belongs to a friction port, which opposes motion by itself.

    A hypothesis stays in memory until the process ends, and so does its function with all that this refers to; every diagnosis that tries
    it keeps another copy of what is stated here.
    """

    def __init__(
        self,
        function: Callable[..., ArrayLike],
        *,
        port: str,
        coefficients: Mapping[str, Coefficient],
        name: str | None = None,
        channel: str | None = None,
        ranges: Mapping[str, tuple[float, float]] | None = None,
        pointwise: bool = False,
    ) -> None:
        """States a hypothesis; the function is called once to see that it works.

        Args:
            function: Variables come as arrays of shape `(points,)`, coefficients as floats; returns one value a point.
            port: Where it acts.
            coefficients: Start and range of every coefficient; the first is the strength.
            name: Lower-case letters, digits and `_`; by default the function's.
            channel: Which sensor, at the port `reading`.
            ranges: Ranges of variables, in place of what the rig's replay shows.
            pointwise: Calls the function point by point, with floats: for one that has `if` on a variable. Some hundred times slower.

        Raises:
            InputError: What cannot be stated; an exception of the function is its cause.
        """
        name = getattr(function, "__name__", "") if name is None else name
        parameters = _parameters(function, name)
        unknown = [coefficient for coefficient in coefficients if coefficient not in parameters]
        if unknown:
            raise _refused(name, f"the function has no parameter {unknown[0]}", "correct `coefficients`")
        variables = [parameter for parameter in parameters if parameter not in coefficients]
        limits = dict(ranges or {})
        alien = [variable for variable in limits if variable not in variables]
        if alien:
            raise _refused(name, f"the function has no variable {alien[0]}", "correct `ranges`")
        self._name = name
        self._port = port
        self._function = function
        self._coefficients = dict(coefficients)
        self._native = _bowden.NativeHypothesis(
            name,
            port,
            channel,
            [(variable, _pair(name, limits.get(variable))) for variable in variables],
            [(known, one.unit, float(one.lower), float(one.upper), _starts(one.start)) for known, one in coefficients.items()],
            _evaluator(function, variables, list(coefficients), pointwise),
        )

    @property
    def name(self) -> str:
        """Name in results and rig files."""
        return self._name

    @property
    def port(self) -> str:
        """Where it acts."""
        return self._port

    @property
    def coefficients(self) -> dict[str, Coefficient]:
        """Start and range of every coefficient."""
        return dict(self._coefficients)

    def __call__(self, *arguments: Any, **named: Any) -> ArrayLike:
        """The function itself."""
        return self._function(*arguments, **named)

    def __repr__(self) -> str:
        return f"Hypothesis({self._name!r}, port={self._port!r})"


def _refused(name: str, reason: str, hint: str) -> InputError:
    return InputError(f"hypothesis `{name}`: {reason}; {hint}", f"hypothesis `{name}`", hint=hint)


def _parameters(function: Callable[..., ArrayLike], name: str) -> list[str]:
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError) as error:
        raise _refused(name, "the parameters of the function cannot be read", "wrap it in a function with named ones") from error
    if any(one.kind not in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY) for one in parameters):
        raise _refused(name, "the function takes parameters without a name", "name every parameter")
    return [one.name for one in parameters]


def _pair(name: str, limits: tuple[float, float] | None) -> tuple[float, float] | None:
    if limits is None:
        return None
    low, high = (float(limit) for limit in limits)
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise _refused(name, f"got the range {low} to {high}", "state two numbers that rise")
    return low, high


def _starts(start: float | Sequence[float]) -> list[float]:
    return [float(one) for one in start] if isinstance(start, Iterable) else [float(start)]


def _evaluator(
    function: Callable[..., ArrayLike], variables: list[str], coefficients: list[str], pointwise: bool
) -> Callable[[list[NDArray[np.float64]], list[float]], NDArray[np.float64]]:
    def evaluate(columns: list[NDArray[np.float64]], values: list[float]) -> NDArray[np.float64]:
        fixed = dict(zip(coefficients, values, strict=True))
        # What is no number is refused where it comes back, with the point at which it does.
        with np.errstate(all="ignore"):
            if pointwise:
                points = zip(*(column.tolist() for column in columns), strict=True)
                result: ArrayLike = [float(function(**dict(zip(variables, point, strict=True)), **fixed)) for point in points]  # type: ignore[arg-type]
            else:
                result = function(**dict(zip(variables, columns, strict=True)), **fixed)
            array = np.asarray(result, dtype=np.float64)
        if array.shape not in ((), columns[0].shape):
            message = f"it returned an array of shape {array.shape} for points of shape {columns[0].shape}"
            raise ValueError(message)
        return np.ascontiguousarray(np.broadcast_to(array, columns[0].shape))

    return evaluate
