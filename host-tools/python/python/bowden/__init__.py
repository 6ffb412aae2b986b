"""Finds which physics a simulated tendon-driven joint lacks, from recordings of the real one.

```python
import bowden

d = bowden.diagnose(["train.csv"], rig="rig.toml", heldout=["other.csv"])
d.verdict  # "missing_physics"
d.effects[0].id, d.effects[0].probability, d.effects[0].parameters
d.report("report.html")
bowden.replay("other.csv", d.rig)["theta_out_rad"]  # numpy, rad
```

SI units throughout; the unit is in the name. `bowden.plots` draws with matplotlib.
"""

from bowden.diagnosis import Diagnosis, Trace
from bowden.errors import Error, InputError, RepairedWarning, StoppedEarlyWarning
from bowden.hypothesis import Coefficient, Hypothesis
from bowden.neighbours import Imported, Mapped, export_mujoco, rig_from_mujoco, rig_from_urdf
from bowden.progress import ProgressLike
from bowden.recording import UNITS, Frame, Recording, RecordingLike
from bowden.results import (
    ChannelError,
    ChannelFit,
    Effect,
    Estimate,
    FittedParameter,
    FreeForm,
    Law,
    MapAxis,
    MapChannel,
    Mismatch,
    Recalibrated,
    ResidualMap,
    Rival,
    RivalLoss,
    StageLoss,
    TriedHypothesis,
    Unexplained,
)
from bowden.rig import Rig, RigLike
from bowden.study import Study, StudyRecording
from bowden.surveys import Survey, survey
from bowden.work import Fit, Motion, diagnose, fit, replay, simulate

__all__ = [
    "UNITS",
    "ChannelError",
    "ChannelFit",
    "Coefficient",
    "Diagnosis",
    "Effect",
    "Error",
    "Estimate",
    "Fit",
    "FittedParameter",
    "Frame",
    "FreeForm",
    "Hypothesis",
    "Imported",
    "InputError",
    "Law",
    "MapAxis",
    "MapChannel",
    "Mapped",
    "Mismatch",
    "Motion",
    "ProgressLike",
    "Recalibrated",
    "Recording",
    "RecordingLike",
    "RepairedWarning",
    "ResidualMap",
    "Rig",
    "RigLike",
    "Rival",
    "RivalLoss",
    "StageLoss",
    "StoppedEarlyWarning",
    "Study",
    "StudyRecording",
    "Survey",
    "Trace",
    "TriedHypothesis",
    "Unexplained",
    "diagnose",
    "export_mujoco",
    "fit",
    "replay",
    "rig_from_mujoco",
    "rig_from_urdf",
    "simulate",
    "survey",
]
