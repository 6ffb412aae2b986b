"""The notebooks run from top to bottom, find what they say, and show their pictures."""

import base64
import os
import re
from pathlib import Path

import nbclient
import nbformat
import pytest

NOTEBOOKS = Path(__file__).resolve().parents[1] / "notebooks"
DOCS = NOTEBOOKS.parents[1] / "docs"
README = NOTEBOOKS.parents[2] / "README.md"


def _run(name: str, folder: Path) -> nbformat.NotebookNode:
    notebook = nbformat.read(NOTEBOOKS / name, as_version=4)
    client = nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": NOTEBOOKS}})
    client.execute()
    # Whoever changes a notebook finds it here with its pictures.
    nbformat.write(notebook, Path(os.environ.get("BOWDEN_NOTEBOOKS", folder)) / name)
    return notebook


def _pictures(notebook: nbformat.NotebookNode) -> list[bytes]:
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    return [base64.b64decode(output.data["image/png"]) for output in outputs if "image/png" in output.get("data", {})]


def _text(notebook: nbformat.NotebookNode) -> str:
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    return "\n".join(output.get("text", "") + "".join(output.get("data", {}).get("text/markdown", "")) for output in outputs)


def _verdict(notebook: nbformat.NotebookNode) -> str:
    """What the diagnosis says first, with the losses before and after."""
    said = [line for line in _text(notebook).splitlines() if line.startswith("**")]
    assert len(said) == 1
    return said[0].partition(" (normalised error")[0]


def _heads(notebook: nbformat.NotebookNode) -> list[str]:
    """Head lines of the tables of effects."""
    return [line for line in _text(notebook).splitlines() if line.startswith("| effect |")]


def _assert_committed_as(executed: nbformat.NotebookNode, name: str) -> None:
    """What readers see without executing it is what executing it gives; the executed one is in BOWDEN_NOTEBOOKS, to be committed."""
    committed = nbformat.read(NOTEBOOKS / name, as_version=4)
    assert _verdict(committed) == _verdict(executed) and _heads(committed) == _heads(executed)


def test_the_servo_lacks_friction_that_grows_with_load(tmp_path):
    notebook = _run("servo.ipynb", tmp_path)
    assert len(_pictures(notebook)) == 5
    assert "gear_load_friction" in _text(notebook)
    _assert_committed_as(notebook, "servo.ipynb")
    # What the front page says of it, in two sentences and a comment.
    losses = re.search(r"held-out loss from ([\d.]+) to ([\d.]+)", _verdict(notebook)).groups()
    page = README.read_text()
    assert re.findall(r"held-out loss from ([\d.]+) to ([\d.]+)", page) == [losses, losses]
    assert f"('missing_physics', 'gear_load_friction', {losses[1]})" in page


def test_a_drag_that_no_catalogue_lists_becomes_its_formula(virtual_bench, tmp_path):
    notebook = _run("law.ipynb", tmp_path)
    assert len(_pictures(notebook)) == 3
    assert "joint_friction_nm = amplitude_nm * abs(omega_out_rad_s)^exponent" in _text(notebook)
    _assert_committed_as(notebook, "law.ipynb")


@pytest.mark.parametrize("name", ["servo.ipynb", "law.ipynb"])
def test_committed_notebooks_show_their_pictures(name):
    assert len(_pictures(nbformat.read(NOTEBOOKS / name, as_version=4))) >= 3


def test_the_picture_of_the_page_is_the_first_of_the_committed_notebook():
    assert (DOCS / "python-law.png").read_bytes() == _pictures(nbformat.read(NOTEBOOKS / "law.ipynb", as_version=4))[0]
