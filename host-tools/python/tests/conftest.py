"""What the tests stand on: files of the checkout, and programs that `cargo xtask test` has built and named."""

import os
import subprocess
from pathlib import Path

import pytest

import bowden

WORKSPACE = Path(__file__).resolve().parents[3]


def _program(variable: str) -> str:
    path = os.environ.get(variable)
    if path is None:
        pytest.skip(f"{variable} names no program; `cargo xtask test --python` builds and names it")
    return path


@pytest.fixture(scope="session")
def servo() -> Path:
    """Study file of a real servo."""
    return WORKSPACE / "host-tools/studies/xl330-pendulum/study.toml"


@pytest.fixture(scope="session")
def rig_file() -> Path:
    """A bench with motor, tendons and load."""
    return WORKSPACE / "host-tools/core/tests/rigs/bench.toml"


@pytest.fixture(scope="session")
def rig(rig_file: Path) -> bowden.Rig:
    return bowden.Rig.load(rig_file)


@pytest.fixture(scope="session")
def recording(rig: bowden.Rig) -> bowden.Recording:
    """Eight seconds of that bench with more friction than its rig file states."""
    return bowden.simulate(rig.with_values({"sheath.friction_coefficient": 0.15}), seconds=8.0, rate_hz=500.0, seed=5)


@pytest.fixture(scope="session")
def bowden_command() -> str:
    return _program("BOWDEN_BIN")


@pytest.fixture(scope="session")
def virtual_bench() -> str:
    return _program("VIRTUAL_BENCH")


@pytest.fixture(scope="session")
def play(virtual_bench: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of a bench that conceals play in the joint."""
    folder = tmp_path_factory.mktemp("play")
    options = ["--effect", "joint_backlash", "--seed", "4", "--seconds", "9", "--heldout-seconds", "6"]
    subprocess.run([virtual_bench, "record", *options, "--out", folder], check=True)
    return folder


@pytest.fixture(scope="session")
def play_diagnosis(play: Path) -> bowden.Diagnosis:
    return bowden.diagnose([play / "train.csv"], rig=play / "rig.toml", heldout=[play / "heldout.csv"], progress=False)
