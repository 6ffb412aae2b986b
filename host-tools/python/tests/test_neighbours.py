"""Models that others wrote against MuJoCo, rigs out to MuJoCo, and joint states of ROS 2 bags."""

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from mcap_ros2.writer import Writer

import bowden

MODELS = Path(__file__).resolve().parents[2] / "core/tests/models"


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    """MuJoCo writes a log of its warnings where it is called."""
    monkeypatch.chdir(tmp_path)


def _compiled(path: Path) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The model in MuJoCo, at rest with all joints at zero and without actuators (the length ranges of those of arm26 do not converge)."""
    spec = mujoco.MjSpec.from_file(str(path))
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def _about_joint(model: mujoco.MjModel, data: mujoco.MjData, joint: str) -> tuple[float, float]:
    """Inertia about a joint's axis without armature, kg m², and torque of gravity about it, N m."""
    place = model.joint(joint).dofadr[0]
    column = np.zeros(model.nv)
    column[place] = 1.0
    inertia = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, inertia, column)
    return float(inertia[place] - model.dof_armature[place]), float(data.qfrc_bias[place])


@pytest.mark.parametrize(("name", "joint"), [("arm26.xml", "shoulder"), ("arm26.xml", "elbow"), ("turned.xml", "knee"), ("turned.xml", "ankle")])
def test_a_rig_of_a_mujoco_model_has_the_inertia_and_gravity_that_mujoco_computes(name, joint, rig, tmp_path):
    path = MODELS / name
    if name == "turned.xml":
        path = tmp_path / name
        path.write_text(TURNED)
    found = bowden.rig_from_mujoco(path, joint, rig)
    model, data = _compiled(path)
    inertia, gravity = _about_joint(model, data, joint)
    load = {key: found.rig[f"load.{key}"] for key in ("mass_kg", "arm_m", "inertia_kg_m2", "viscous_nm_s_per_rad")}
    assert load["mass_kg"] * load["arm_m"] ** 2 + load["inertia_kg_m2"] == pytest.approx(inertia, rel=1e-6)
    armature = float(model.dof_armature[model.joint(joint).dofadr[0]])
    rotor = found.rig["motor.rotor_inertia_kg_m2"] * rig["motor.gear_ratio"] ** 2
    assert rotor == pytest.approx(armature or rig["motor.rotor_inertia_kg_m2"] * rig["motor.gear_ratio"] ** 2)
    # What holds the joint against gravity: m g l sin(theta).
    assert 9.80665 * load["mass_kg"] * load["arm_m"] * math.sin(found.zero_rad) == pytest.approx(gravity, rel=1e-6, abs=1e-9)
    assert load["viscous_nm_s_per_rad"] == pytest.approx(float(np.ravel(model.dof_damping[model.joint(joint).dofadr[0]])[0]))
    assert any(one.why_not for one in found.mapped) and str(found.mapped[0]).startswith("line ")


TURNED = """<mujoco model="turned">
  <compiler angle="degree" eulerseq="zyx"/>
  <default><geom density="700"/><default class="leg"><joint damping="0.3" frictionloss="0.02" armature="0.004" range="-90 90"/></default></default>
  <worldbody><body pos="0 0 1" euler="20 35 50" childclass="leg">
    <joint name="knee" axis="0.2 1 0.1" pos="0.01 0 0.02"/>
    <geom type="capsule" fromto="0 0 0 0.1 0.05 -0.3" size="0.03"/>
    <geom type="ellipsoid" size="0.03 0.05 0.02" pos="0 0.1 0" axisangle="1 0 0 30"/>
    <body pos="0.1 0.05 -0.3" xyaxes="0 1 0 -1 0.2 0">
      <joint name="ankle" axis="1 0 0" damping="0.1"/>
      <inertial pos="0.05 0 0.02" mass="0.4" fullinertia="0.002 0.003 0.0025 0.0001 0.0002 -0.0001"/>
      <body zaxis="1 1 0"><geom type="cylinder" size="0.02 0.1" mass="0.2"/><geom type="box" size="0.02 0.03 0.01" quat="1 0.2 0 0"/></body>
    </body>
  </body></worldbody>
  <actuator><position joint="knee" kp="3"/></actuator>
</mujoco>"""


def test_a_rig_of_a_urdf_has_the_inertia_and_gravity_that_mujoco_computes(rig, tmp_path):
    text = (MODELS / "double_pendulum.urdf").read_text()
    # MuJoCo reads URDF too, but not the meshes, which are not here; and takes the base's frame as the world.
    for tag in ("visual", "collision"):
        while f"<{tag}>" in text:
            start, end = text.index(f"<{tag}>"), text.index(f"</{tag}>") + len(f"</{tag}>")
            text = text[:start] + text[end:]
    path = tmp_path / "pendulum.urdf"
    path.write_text(text)
    for joint in ("joint1", "joint2"):
        found = bowden.rig_from_urdf(MODELS / "double_pendulum.urdf", joint, rig)
        model, data = _compiled(path)
        # Off the upright, where gravity pulls.
        data.qpos[model.joint(joint).qposadr[0]] = 0.3
        mujoco.mj_forward(model, data)
        inertia, gravity = _about_joint(model, data, joint)
        mass, arm = found.rig["load.mass_kg"], found.rig["load.arm_m"]
        assert mass * arm**2 + found.rig["load.inertia_kg_m2"] == pytest.approx(inertia, rel=1e-6)
        assert 9.81 * mass * arm * math.sin(found.zero_rad + 0.3) == pytest.approx(gravity, rel=1e-6)


def test_mujoco_loads_what_is_written_and_it_moves_as_the_rig_does(rig, tmp_path):
    plain = rig.with_values({"sheath.friction_coefficient": 0.0, "motor.inductance_h": 0.0})
    mapped = bowden.export_mujoco(plain, tmp_path / "bench.xml")
    assert any(one.says == "motor.inductance_h" and one.why_not for one in mapped)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "bench.xml"))
    gear = rig["motor.gear_ratio"]
    armature = float(model.dof_armature[model.joint("input").dofadr[0]])
    assert armature == pytest.approx(gear**2 * rig["motor.rotor_inertia_kg_m2"], rel=1e-6)
    # Two volts for a second, then none: the angle of the joint against bowden's own simulation of the same duty.
    rate_hz, seconds = 1000, 2.0
    t_s = np.arange(int(seconds * rate_hz)) / rate_hz
    volts = np.where(t_s < 1.0, 2.0, 0.0)
    duty = volts / rig["motor.supply_v"]
    text = plain.text + '\n[replay]\ninputs = ["duty", "bus_v"]\noutputs = ["theta_out_rad", "theta_in_rad"]\n'
    driven = {"t_s": t_s, "duty": duty, "bus_v": np.full_like(t_s, rig["motor.supply_v"])}
    ours = bowden.replay(bowden.Recording.from_arrays(driven), bowden.Rig(text))["theta_out_rad"]
    data = mujoco.MjData(model)
    theirs = []
    for volt in volts:
        theirs.append(float(data.qpos[model.joint("joint").qposadr[0]]))
        data.ctrl[0] = volt
        mujoco.mj_step(model, data)
    assert np.ptp(theirs) > 0.3
    assert np.sqrt(np.mean((ours - np.array(theirs)) ** 2)) < 0.01 * np.ptp(theirs)


def test_a_diagnosed_joint_goes_into_a_model_that_somebody_else_wrote(rig, tmp_path):
    imported = bowden.rig_from_mujoco(MODELS / "arm26.xml", "elbow", rig)
    text = imported.rig.with_values({"load.viscous_nm_s_per_rad": 0.25}).text + (
        '\n[simulation]\neffects = ["joint_coulomb_friction"]\n[effects.joint_coulomb_friction]\ntorque_nm = 0.11\n'
    )
    bowden.export_mujoco(bowden.Rig(text), tmp_path / "arm.xml", into=MODELS / "arm26.xml", joint="elbow")
    before, _ = _compiled(MODELS / "arm26.xml")
    after, _ = _compiled(tmp_path / "arm.xml")
    elbow = before.joint("elbow").dofadr[0]
    assert float(np.ravel(after.dof_damping[elbow])[0]) == 0.25 and float(after.dof_frictionloss[elbow]) == 0.11
    assert float(np.ravel(after.dof_damping[1 - elbow])[0]) == 0.1
    assert np.array_equal(before.body_mass, after.body_mass)
    with pytest.raises(bowden.InputError, match="no joint `wrist`"):
        bowden.export_mujoco(bowden.Rig(text), tmp_path / "none.xml", into=MODELS / "arm26.xml", joint="wrist")
    assert not (tmp_path / "none.xml").exists()


def test_a_model_is_not_written_over_a_file_that_was_read_nor_into_a_folder_that_is_not_there(rig, tmp_path):
    model, rig_file, missing = tmp_path / "arm.xml", tmp_path / "rig.toml", tmp_path / "none/arm.xml"
    model.write_bytes((MODELS / "arm26.xml").read_bytes())
    rig.save(rig_file)
    for path, options in ((model, {"into": model, "joint": "elbow"}), (tmp_path / "../" / tmp_path.name / "arm.xml", {"into": model, "joint": "elbow"})):
        with pytest.raises(bowden.InputError, match="would overwrite the input .*; name another output"):
            bowden.export_mujoco(rig, path, **options)
    with pytest.raises(bowden.InputError, match="rig.toml: would overwrite the input"):
        bowden.export_mujoco(rig_file, rig_file)
    with pytest.raises(bowden.InputError) as raised:
        bowden.export_mujoco(rig, missing)
    assert str(raised.value) == f"{missing}: folder {missing.parent} does not exist; create it first"
    assert model.read_bytes() == (MODELS / "arm26.xml").read_bytes() and bowden.Rig.load(rig_file) == rig
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.xml", "rig.toml"]


JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def _bag(path: Path, states: list[dict], topic: str = "/joint_states") -> Path:
    """A bag as Foxglove's writer for ROS 2 makes it."""
    with path.open("wb") as file:
        writer = Writer(file)
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        for number, state in enumerate(states):
            stamp_ns = state.pop("stamp_ns", 1_700_000_000_000_000_000 + 2_000_000 * number)
            stamp = {"sec": stamp_ns // 10**9, "nanosec": stamp_ns % 10**9}
            message = {"header": {"stamp": stamp, "frame_id": "base"}, "velocity": [], "effort": [], **state}
            log_time = 1_800_000_000_000_000_000 + 2_000_000 * number
            writer.write_message(topic=topic, schema=schema, message=message, log_time=log_time, publish_time=log_time, sequence=number)
        writer.finish()
    return path


MAPPED = """
[recording.columns]
theta_out_rad = { column = "/joint_states:elbow.position", scale = 1.0, offset = 0.12 }
i_motor_a = { column = "/joint_states:elbow.effort", scale = 0.5, offset = 0.0 }
"""


def test_joint_states_of_a_bag_are_the_columns_that_a_rig_maps(rig, tmp_path):
    # Names of joints have other lengths, so that numbers lie at other places; others publish on the topic, too.
    states = []
    for k in range(300):
        states.append({"name": ["shoulder_pan", "elbow"], "position": [7.0, 0.001 * k], "velocity": [1.0, 0.5], "effort": [0.0, -0.02 * k]})
        states.append({"name": ["gripper"], "position": [0.3]})
    bag = _bag(tmp_path / "bag.mcap", states)
    recording = bowden.Recording.load(bag, rig=bowden.Rig(rig.text + MAPPED))
    assert len(recording.notes) == 1 and "300 of 600 messages are of other joints" in recording.notes[0]
    assert recording["theta_out_rad"] == pytest.approx(0.12 + 0.001 * np.arange(300), abs=1e-15)
    assert recording["i_motor_a"] == pytest.approx(-0.01 * np.arange(300), abs=1e-15)
    assert recording.t_s == pytest.approx(0.004 * np.arange(300), abs=1e-9)


def test_a_bag_without_stamps_has_the_times_at_which_it_was_recorded(rig, tmp_path):
    states = [{"name": ["elbow"], "position": [0.1], "effort": [1.0], "stamp_ns": 0} for _ in range(50)]
    recording = bowden.Recording.load(_bag(tmp_path / "bag.mcap", states), rig=bowden.Rig(rig.text + MAPPED))
    assert recording.t_s == pytest.approx(0.002 * np.arange(50), abs=1e-9)


def test_what_is_no_bag_of_the_rigs_joint_is_refused(rig, tmp_path):
    mapped = bowden.Rig(rig.text + MAPPED)
    others = _bag(tmp_path / "others.mcap", [{"name": ["gripper"], "position": [0.3]} for _ in range(9)])
    with pytest.raises(bowden.InputError, match="/joint_states:elbow.position"):
        bowden.Recording.load(others, rig=mapped)
    elsewhere = _bag(tmp_path / "elsewhere.mcap", [{"name": ["elbow"], "position": [0.3]} for _ in range(9)], topic="/arm")
    with pytest.raises(bowden.InputError, match="/arm"):
        bowden.Recording.load(elsewhere, rig=mapped)
    short = _bag(tmp_path / "short.mcap", [{"name": ["elbow"], "position": [0.3], "effort": [0.0]}, {"name": ["elbow"], "position": []}])
    with pytest.raises(bowden.InputError, match="message 2.*position, velocity and effort"):
        bowden.Recording.load(short, rig=mapped)
