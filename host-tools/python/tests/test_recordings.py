"""Recordings and rigs: arrays in and out, frames, and what is refused."""

import pickle

import numpy as np
import pandas
import polars
import pytest

import bowden


def test_arrays_are_views_of_the_recording_that_nobody_can_write_to(recording):
    one, other = recording["theta_out_rad"], recording["theta_out_rad"]
    assert one.ctypes.data == other.ctypes.data
    assert np.shares_memory(one, other) and one.shape == (len(recording),) and one.dtype == np.float64
    with pytest.raises(ValueError, match="read-only"):
        one[0] = 1.0
    with pytest.raises(ValueError):
        one.setflags(write=True)


def test_an_array_outlives_its_recording(rig):
    values = bowden.simulate(rig, seconds=1.0)["f1_n"]
    copied = values.copy()
    junk = [np.zeros(len(values)) for _ in range(200)]
    assert np.array_equal(values, copied) and len(junk) == 200


@pytest.mark.parametrize("frame", [pandas.DataFrame, polars.DataFrame, dict])
def test_frames_and_arrays_go_in_and_come_out_bit_for_bit(recording, frame):
    again = bowden.Recording.from_frame(frame(recording.to_arrays())) if frame is not dict else None
    again = again or bowden.Recording.from_arrays(recording.to_arrays())
    assert again.channels == recording.channels
    assert all(np.array_equal(again[name], recording[name]) for name in ("t_s", *recording.channels))
    assert recording.to_pandas().equals(again.to_pandas())
    assert recording.to_polars().equals(again.to_polars())


def test_layouts_and_dtypes_that_need_a_conversion_give_the_same_values(recording):
    arrays = recording.to_arrays()
    table = np.column_stack(list(arrays.values()))
    strided = bowden.Recording.from_arrays({name: table[:, k] for k, name in enumerate(arrays)})
    assert np.array_equal(strided["f1_n"], recording["f1_n"])
    coarse = bowden.Recording.from_arrays({"t_s": np.arange(4), "duty": np.float32([0.0, 0.5, 1.0, -1.0])})
    assert coarse["duty"].tolist() == [0.0, 0.5, 1.0, -1.0]


def test_files_read_back_bit_for_bit_and_a_recording_can_be_pickled(recording, tmp_path):
    for name in ("a.csv", "a.csv.gz", "a.mcap", "a.parquet"):
        recording.save(tmp_path / name)
        again = bowden.Recording.load(tmp_path / name)
        assert all(np.array_equal(again[role], recording[role]) for role in ("t_s", *recording.channels))
    again = pickle.loads(pickle.dumps(recording))
    assert np.array_equal(again["f1_n"], recording["f1_n"])


def test_a_rig_maps_names_and_units_of_a_frame(servo):
    rig = bowden.Study.load(servo).benches["xl330"]
    assert rig.columns["theta_out_rad"] == "angle_rad"
    frame = pandas.DataFrame({"time_s": [0.0, 0.1], "angle_rad": [1.0, 2.0], "supply_v": 7.0, "torque_enable": True, "note": "text"})
    with pytest.raises(bowden.InputError, match="no column `goal_angle_rad`, which the rig maps to theta_ref_rad"):
        bowden.Recording.from_frame(frame, rig)
    frame["goal_angle_rad"] = 0.5
    mapped = bowden.Recording.from_frame(frame, rig)
    assert mapped["theta_out_rad"].tolist() == [1.0, 2.0] and mapped["drive_enable"].tolist() == [1.0, 1.0]
    assert "note" not in mapped


T_S = np.linspace(0.0, 1.0, 5)


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"duty": T_S}, "no column `t_s`; the header has duty"),
        ({"t_s": T_S, "duty": T_S[:-1]}, "column `duty`: got 4 values beside columns of 5"),
        ({"t_s": T_S, "duty": np.stack([T_S, T_S], 1)}, r"column `duty`: got shape \(5, 2\)"),
        ({"t_s": T_S, "duty": ["a", "b", "c", "d", "e"]}, "column `duty`: got dtype <U1"),
        ({"t_s": T_S, "duty": T_S + 1j}, "column `duty`: got dtype complex128"),
        ({"t_s": T_S, "duty": [0, np.nan, 0, 0, 0]}, "sample 1: column `duty`: got NaN"),
        ({"t_s": T_S[::-1], "duty": T_S}, "sample 1: column `t_s`: got 0.75 s after 1.0 s"),
        ({"t_s": [], "duty": []}, "no samples"),
    ],
)
def test_what_cannot_be_a_recording_is_an_exception_with_what_to_do(columns, said):
    with pytest.raises(bowden.InputError, match=said) as raised:
        bowden.Recording.from_arrays(columns, source="mine")
    assert raised.value.file == "mine"
    assert raised.value.hint or "no samples" in said


def test_a_damaged_file_is_named_with_its_line(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("t_s,duty\n0,0\n1,x\n2,0\n")
    with pytest.raises(bowden.InputError) as raised:
        bowden.Recording.load(path)
    assert (raised.value.file, raised.value.line) == (str(path), 3)
    assert raised.value.hint == "correct the cell or drop the row"
    assert isinstance(raised.value, ValueError)


def test_units_that_cannot_be_are_refused(recording, rig):
    # A joint with tendons turns twice at most: 12.6 rad.
    assert np.max(np.abs(recording["theta_out_rad"])) < 0.6
    degrees = {**recording.to_arrays(), "theta_out_rad": np.degrees(recording["theta_out_rad"])}
    with pytest.raises(bowden.InputError, match="if it is in degrees"):
        bowden.fit(degrees, rig, progress=False)


def test_a_rig_for_other_columns_is_refused(recording, servo):
    with pytest.raises(bowden.InputError, match="no column"):
        bowden.diagnose(recording, bowden.Study.load(servo).benches["xl330"], progress=False)


def test_rigs_are_changed_by_making_another(rig, rig_file, tmp_path):
    other = rig.with_values({"load.mass_kg": 1.25})
    assert (rig["load.mass_kg"], other["load.mass_kg"]) == (bowden.Rig.load(rig_file)["load.mass_kg"], 1.25)
    other.save(tmp_path / "other.toml")
    assert bowden.Rig.load(tmp_path / "other.toml") == other == pickle.loads(pickle.dumps(other))
    with pytest.raises(KeyError):
        rig["controller.delay_s"]
    with pytest.raises(bowden.InputError, match="did you mean `load.mass_kg`"):
        rig["load.mas_kg"]
    with pytest.raises(bowden.InputError, match="allowed"):
        rig.with_values({"load.mass_kg": -1.0})
    with pytest.raises(bowden.InputError, match="no effect `joint_spring` to leave out"):
        rig.without("joint_spring")
    with pytest.raises(bowden.InputError) as raised:
        bowden.Rig('schema = "bowden-rig/1"\nname = "x"\n[load]\nmas_kg = 1.0\n', source="mine.toml")
    assert (raised.value.file, raised.value.line) == ("mine.toml", 4)
