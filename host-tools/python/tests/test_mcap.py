"""A recorded run in the hands of others: the reader of the MCAP project, and a checker of JSON Schema."""

import json
import subprocess
from datetime import UTC, datetime, timedelta
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader

import bowden

PAGE = Path(__file__).resolve().parents[2] / "docs/recordings.md"


@pytest.fixture(scope="module")
def run(bowden_command, tmp_path_factory) -> Path:
    """Half a second of the simulated board."""
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    command = [bowden_command, "record", "--port", "sim", "--seconds", "0.5", "--note", "for others", "--out", path]
    subprocess.run(command, check=True, capture_output=True)
    return path


def test_rows_and_units_are_as_the_schema_in_the_file_says(run):
    recording = bowden.Recording.load(run)
    with run.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        schema, channel = next((schema, channel) for schema, channel, _ in reader.iter_messages())
        messages = [message for _, _, message in reader.iter_messages()]
    assert (channel.topic, channel.message_encoding, schema.name, schema.encoding) == ("/bowden/samples", "json", "bowden.Sample", "jsonschema")
    described = json.loads(schema.data)
    jsonschema.Draft202012Validator.check_schema(described)
    checker = jsonschema.Draft202012Validator(described | {"additionalProperties": False, "required": list(described["properties"])})
    rows = [json.loads(message.data) for message in messages]
    for row in rows:
        checker.validate(row)
    for column, unit in {"t_s": "time, s", "f1_n": "N", "theta_out_rad": "rad", "encoder_in_count_raw": "count"}.items():
        assert described["properties"][column]["description"] == unit
        assert channel.metadata[f"unit.{column}"] == unit.removeprefix("time, ")
    assert len(rows) == len(recording) == 5000
    for column in ("t_s", *recording.channels):
        assert np.array_equal([row[column] for row in rows], recording[column]), column
    assert [message.log_time for message in messages] == [round(1e9 * row["t_s"]) for row in rows]


def test_the_code_of_the_page_reads_what_is_known_of_the_run(run, monkeypatch, capsys):
    code = PAGE.read_text().split("```python\n")[1].split("```")[0]
    monkeypatch.chdir(run.parent)
    names: dict = {}
    exec(code, names)
    about = names["about"]["bowden.recording"]
    started = datetime.fromisoformat(about["started_utc"][:26] + "+00:00")
    assert timedelta(0) <= datetime.now(UTC) - started < timedelta(hours=1)
    assert about["note"] == "for others" and "[tendon]" in about["rig"]
    assert names["about"]["bowden.end"]["rows"] == "5000"
    assert capsys.readouterr().out == f"{about['started_utc']} 5000 {bowden.Recording.load(run)['theta_out_rad'][-1]}\n"
