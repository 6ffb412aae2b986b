"""Files of a case, as every rival reads and writes them.

A folder holds `train.csv` (everything recorded), `inputs.csv` (the held-out recording's inputs alone) and `initial.csv`
(the first 0.1 s of the held-out recording; none of it is compared). A rival writes its prediction, one row a row of
`inputs.csv`, and what it chose.
"""

import json
import sys
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.signal import butter, sosfiltfilt

RATE_HZ = 100.0
"""Rate at which the rivals work: motion is below 2 Hz, and friction turns over within 50 ms."""

CUTOFF_HZ = 40.0
"""Low-pass before the rate is reduced, forward and backward, so that nothing is delayed."""

SPEED_CUTOFF_HZ = 15.0
"""Low-pass of the input angle before it is differentiated: a count of the encoder is 1.5 mrad."""

STILL_RAD_S = 0.01
"""Speed below which the sign of the last motion is kept: friction that holds still points where it pointed."""

FAR_RANGES = 3.0
"""A free run that is so many training ranges off the training data has diverged."""


@dataclass
class Recording:
    """Channels of one recording at one rate."""

    t_s: np.ndarray
    channels: dict[str, np.ndarray]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.channels[name]

    def __len__(self) -> int:
        return len(self.t_s)

    def table(self, names: list[str]) -> np.ndarray:
        """Channels as columns."""
        return np.column_stack([self.channels[name] for name in names])

    def part(self, rows: slice) -> "Recording":
        """Some rows of it."""
        return Recording(self.t_s[rows], {name: values[rows] for name, values in self.channels.items()})


@dataclass
class Case:
    """What a rival may see."""

    folder: Path
    rig: dict
    train: Recording
    """Training recording at `RATE_HZ`, with `REGRESSORS` beside what was recorded."""
    heldout: Recording
    """Held-out inputs at `RATE_HZ`, with `REGRESSORS`."""
    initial: Recording
    """The first 0.1 s of the held-out recording, everything recorded, at its own rate."""
    heldout_t_s: np.ndarray
    """Times at which a prediction is wanted."""
    outputs: list[str]
    """Channels to predict."""

    def initial_state(self) -> np.ndarray:
        """Outputs at the beginning of the held-out recording: their means over 0.1 s, in which nothing moves."""
        return self.initial.table(self.outputs).mean(axis=0)


@dataclass
class Answer:
    """What a rival says of a case."""

    prediction: np.ndarray
    """One column an output; rows at `RATE_HZ`, or as many as a prediction is wanted at."""
    chosen: dict[str, str]
    """Settings that validated best."""
    diverged_s: dict[str, float] = field(default_factory=dict)
    """Channels whose best settings diverged on the held-out inputs, and when; other settings took their place."""

    def take(self, case: Case, output: int, errors: dict, free_run, terms: dict) -> None:
        """Adds an output as the settings of the least error predict it that stay; `free_run` gives the held-out values of
        settings and leaves the number of their terms in `terms`."""
        name = case.outputs[output]
        values, settings, diverged_s = first_that_stays(case, output, sorted(errors, key=errors.__getitem__), free_run)
        self.prediction = np.column_stack([self.prediction, values])
        self.chosen[name] = f"{settings}, {terms[settings]} terms"
        if diverged_s is not None:
            self.diverged_s[name] = diverged_s


REGRESSORS = ["theta_in_rad", "speed_rad_s", "voltage_v", "sign_v"]
"""Input angle without its counts, its speed, the motor's voltage, and sign(v)."""


def read_table(path: Path) -> Recording:
    """Reads a file of numbers with one header line."""
    try:
        with path.open() as file:
            names = file.readline().strip().split(",")
            values = np.loadtxt(file, delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        raise SystemExit(f"{path}: {error}; expected a case that `cargo xtask prove --rivals` wrote") from error
    if "t_s" not in names or values.shape[1] != len(names):
        raise SystemExit(f"{path}: expected a column t_s and as many numbers a line as names in the first")
    columns = dict(zip(names, values.T))
    return Recording(columns.pop("t_s"), columns)


def low_pass(values: np.ndarray, rate_hz: float, cutoff_hz: float) -> np.ndarray:
    """Fourth order, no delay."""
    return sosfiltfilt(butter(2, cutoff_hz, fs=rate_hz, output="sos"), values)


def held_sign(speed: np.ndarray, still: float) -> np.ndarray:
    """sign(v) that keeps its value while |v| is below `still`; 0 until something has moved."""
    sign = np.where(np.abs(speed) > still, np.sign(speed), 0.0)
    last = np.maximum.accumulate(np.where(sign != 0.0, np.arange(len(sign)), -1))
    return np.where(last >= 0, sign[np.maximum(last, 0)], 0.0)


def reduced(recording: Recording) -> tuple[int, dict[str, np.ndarray]]:
    """Low-passed channels, and how many of their rows make one at `RATE_HZ`."""
    rate_hz = 1.0 / np.median(np.diff(recording.t_s))
    smooth = {name: low_pass(values, rate_hz, CUTOFF_HZ) for name, values in recording.channels.items()}
    return max(1, round(rate_hz / RATE_HZ)), smooth


def prepared(recording: Recording) -> Recording:
    """Low-passed, at `RATE_HZ`, with the regressors that every rival is given."""
    rate_hz = 1.0 / np.median(np.diff(recording.t_s))
    every, smooth = reduced(recording)
    angle = low_pass(recording["theta_in_rad"], rate_hz, SPEED_CUTOFF_HZ)
    smooth["theta_in_rad"] = angle
    smooth["speed_rad_s"] = np.gradient(angle, recording.t_s)
    smooth["voltage_v"] = low_pass(recording["duty"] * recording["bus_v"], rate_hz, CUTOFF_HZ)
    smooth["sign_v"] = held_sign(smooth["speed_rad_s"], STILL_RAD_S)
    return Recording(recording.t_s, smooth).part(slice(None, None, every))


def read_case(folder: Path) -> Case:
    """Reads all files of a case."""
    train, inputs, initial = (read_table(folder / f"{name}.csv") for name in ["train", "inputs", "initial"])
    with (folder / "rig.toml").open("rb") as file:
        rig = tomllib.load(file)
    outputs = [name for name in train.channels if name not in inputs.channels]
    return Case(folder, rig, prepared(train), prepared(inputs), initial, inputs.t_s, outputs)


def recalibrated(case: Case) -> tuple[Recording, dict[str, dict[str, np.ndarray]]]:
    """bowden's simulation with recalibrated parameters: of the held-out recording at its own rate, and the outputs of
    `train` and `heldout` as the rivals get them."""
    full = {name: read_table(case.folder / f"recalibrated-{name}.csv") for name in ["train", "heldout"]}
    found = {}
    for name, recording in full.items():
        every, smooth = reduced(recording)
        found[name] = {output: smooth[output][::every] for output in case.outputs}
    return full["heldout"], found


def split(rows: int) -> tuple[slice, slice]:
    """Two thirds to fit, and the last third of the training recording, which chooses between settings."""
    return slice(0, 2 * rows // 3), slice(2 * rows // 3, rows)


def folds(rows: int) -> list[tuple[slice, slice]]:
    """The split, and another one whose first third validates."""
    return [split(rows), (slice(rows // 3, rows), slice(0, rows // 3))]


def advanced(inputs: np.ndarray) -> np.ndarray:
    """Inputs one row earlier: a model that sees the row before the one it predicts then sees the present one. All
    held-out inputs are known, and friction turns over at once."""
    return np.vstack([inputs[1:], inputs[-1:]])


def bounds(train: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Beyond these a free run has diverged."""
    low, high = train.min(axis=0), train.max(axis=0)
    reach = FAR_RANGES * (high - low)
    return low - reach, high + reach


def confined(prediction: np.ndarray, train: np.ndarray) -> tuple[np.ndarray, list[int | None]]:
    """The prediction within bounds: from its first row outside them, or without a number, a channel stays at its last
    good value. Also that row, for each channel."""
    low, high = bounds(train)
    kept, rows = prediction.copy(), []
    for channel, values in enumerate(prediction.T):
        good = np.isfinite(values) & (values >= low[channel]) & (values <= high[channel])
        first = None if good.all() else int(np.argmin(good))
        if first is not None:
            kept[first:, channel] = values[first - 1] if first > 0 else train[:, channel].mean()
        rows.append(first)
    return kept, rows


def relative_error(prediction: np.ndarray, recorded: np.ndarray) -> float:
    """Root mean square over the channels of error over spread: what settings are chosen by."""
    if not np.isfinite(prediction).all():
        return np.inf
    errors = np.sqrt(np.mean((prediction - recorded) ** 2, axis=0))
    return float(np.sqrt(np.mean((errors / recorded.std(axis=0)) ** 2)))


def first_that_stays(case: Case, output: int, ranked: list, free_run) -> tuple[np.ndarray, object, float | None]:
    """The free run of the first settings in the ranking that does not diverge on the held-out inputs, which takes no
    held-out output to see; of the first settings where all do. Also those settings, and when the first diverged."""
    own = case.train.table(case.outputs)[:, [output]]
    first = None
    for settings in ranked:
        values = free_run(settings)
        _, (row,) = confined(values[:, None], own)
        if first is None:
            first = (values, settings, None if row is None else float(case.heldout.t_s[row]))
        if row is None:
            return values, settings, first[2]
    return first


def write_prediction(path: Path, case: Case, prediction: np.ndarray) -> None:
    """Writes the prediction at the held-out recording's own times, straight lines between rows at `RATE_HZ`."""
    if len(prediction) != len(case.heldout_t_s):
        columns = [np.interp(case.heldout_t_s, case.heldout.t_s, values) for values in prediction.T]
        prediction = np.column_stack(columns)
    header = ",".join(["t_s", *case.outputs])
    np.savetxt(
        path, np.column_stack([case.heldout_t_s, prediction]), fmt="%.9g", delimiter=",", header=header, comments=""
    )


def run(predict) -> None:
    """Entry of a rival: reads the folder named on the command line and writes `NAME.csv` and `NAME.json` there."""
    if len(sys.argv) != 2:
        raise SystemExit(f"usage: {sys.argv[0]} FOLDER")
    folder, name = Path(sys.argv[1]), Path(sys.argv[0]).stem
    case = read_case(folder)
    answer = predict(case)
    prediction, rows = confined(answer.prediction, case.train.table(case.outputs))
    write_prediction(folder / f"{name}.csv", case, prediction)
    t_s = case.heldout_t_s if len(prediction) == len(case.heldout_t_s) else case.heldout.t_s
    left = {output: float(t_s[row]) for output, row in zip(case.outputs, rows) if row is not None}
    remarks = {"chosen": answer.chosen, "diverged_s": left | answer.diverged_s}
    (folder / f"{name}.json").write_text(json.dumps(remarks) + "\n")
