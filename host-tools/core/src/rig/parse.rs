//! From the text of a rig file to a [`Rig`].

use bowden_model::channel::Channel;
use bowden_model::friction_law::FrictionLaw;
use bowden_model::parameters::{
    JointParameters, LoadParameters, MotorParameters, NOMINAL_PARAMETERS, PulleyParameters, SensorParameters,
    SheathParameters, TendonParameters, nominal,
};
use toml::de::{DeTable, DeValue};

use super::roles::can_drive;
use super::section::{Bounds, FINITE, Section, Source, advice};
use super::{ProportionalLaw, Rig, SCHEMA, effects, laws, undecided};
use crate::outcome::Failure;
use crate::recording::{ColumnMap, ColumnSource, TIME_ROLE};

const SECTIONS: [&str; 15] = [
    "schema",
    "name",
    "motor",
    "pulleys",
    "tendon",
    "sheath",
    "load",
    "sensors",
    "simulation",
    "effects",
    laws::KEY,
    undecided::KEY,
    "controller",
    "recording",
    "replay",
];

/// Slip elements of a tendon when the file does not say.
const DEFAULT_ELEMENTS: u32 = 16;
const MAX_ELEMENTS: u32 = 64;

/// Longest simulation step when the file does not say, s.
const DEFAULT_STEP_S: f64 = 5e-4;
const STEP_S: Bounds = Bounds { lower: 1e-6, upper: 0.01, unit: "s" };

const BITS: (u32, u32) = (4, 32);
const FULL_SCALE_N: Bounds = Bounds { lower: 0.1, upper: 1e6, unit: "N" };
const TENSION_NOISE_N: Bounds = Bounds { lower: 0.0, upper: 1e4, unit: "N" };
const CURRENT_NOISE_A: Bounds = Bounds { lower: 0.0, upper: 1e3, unit: "A" };

const GAIN_DUTY_PER_RAD: Bounds<'static> = Bounds { lower: 1e-6, upper: 1e6, unit: "1/rad" };
const DUTY_LIMIT: Bounds<'static> = Bounds { lower: 1e-3, upper: 1.0, unit: "1" };
const DELAY_S: Bounds<'static> = Bounds { lower: 0.0, upper: 1.0, unit: "s" };

const SMOOTHING_S: Bounds = Bounds { lower: 0.0, upper: 1.0, unit: "s" };

/// Accepted range of a number of `[controller]`.
pub(super) fn controller_bounds(name: &str) -> Bounds<'static> {
    match name {
        "gain_duty_per_rad" => GAIN_DUTY_PER_RAD,
        "duty_limit" => DUTY_LIMIT,
        _ => DELAY_S,
    }
}

pub(super) fn parse(text: &str, name: &str) -> Result<Rig, Failure> {
    let source = Source { name, text };
    let document = DeTable::parse(text).map_err(|error| {
        let span = error.span().unwrap_or(0..0);
        source.at(&span, format!("not TOML: {}; correct it", error.message()))
    })?;
    let file = Section::new(source, "", 0..0, document.get_ref());
    file.check_schema(SCHEMA)?;
    file.refuse_unknown("section", SECTIONS)?;

    let section = |key: &'static str| file.section(key, key);
    let simulation = section("simulation")?;
    let (elements, step_s, friction) = read_simulation(simulation.as_ref())?;
    let joint = JointParameters {
        motor: section("motor")?.as_ref().map(motor).transpose()?,
        pulleys: section("pulleys")?.as_ref().map(pulleys).transpose()?,
        tendon: section("tendon")?.as_ref().map(tendon).transpose()?,
        sheath: section("sheath")?.as_ref().map(sheath).transpose()?,
        load: section("load")?.as_ref().map(load).transpose()?,
        sensors: match section("sensors")? {
            Some(sensors) => {
                read_sensors(&sensors, file.get("tendon").is_some(), file.get("motor").is_some())?
            }
            None => SensorParameters::default(),
        },
        friction,
    };
    let lacks_part = |reason: &str| Err(Failure::bad_input(format!("{name}:1:1: {reason}")));
    if joint.tendon.is_some() && joint.pulleys.is_none() {
        return lacks_part("[tendon] is there and [pulleys] is not; add the radii of the pulleys");
    }
    if joint.tendon.is_none() && joint.motor.is_none() {
        return lacks_part("neither [motor] nor [tendon] is there; add the part that was recorded");
    }
    let replay = match section("replay")? {
        Some(replay) => read_replay(&replay, file.get("controller").is_some())?,
        None => Replay::default(),
    };
    Ok(Rig {
        name: file.string("name")?.map_or_else(|| "unnamed".to_owned(), |(name, _)| name.to_owned()),
        joint,
        effects: [effects::read(&file, simulation.as_ref())?, laws::read(&file)?].concat(),
        controller: section("controller")?.as_ref().map(read_controller).transpose()?,
        elements,
        step_s,
        columns: match section("recording")? {
            Some(recording) => read_columns(&recording)?,
            None => ColumnMap::default(),
        },
        replay_inputs: replay.inputs,
        replay_outputs: replay.outputs,
        free_offsets: replay.free_offsets,
        relative_inputs: replay.relative_inputs,
        smoothing_s: replay.smoothing_s,
        undecided: undecided::read(&file)?,
    })
}

fn nominal_value(section: &Section, key: &str) -> Result<f64, Failure> {
    let spec = nominal(section.name, key).map(|parameter| parameter.spec);
    let bounds = spec.map_or(FINITE, |spec| Bounds { lower: spec.lower, upper: spec.upper, unit: spec.unit });
    let meaning = spec.map_or_else(String::new, |spec| match spec.unit {
        "1" => format!("{}, such as {}", spec.meaning, spec.default),
        unit => format!("{}, such as {} {unit}", spec.meaning, spec.default),
    });
    section.number(key, bounds)?.ok_or_else(|| section.lacks(key, &meaning))
}

/// Refuses keys that the section does not have.
fn refuse_other_keys(section: &Section) -> Result<(), Failure> {
    let of_section = |p: &&bowden_model::parameters::NominalParameter| p.section == section.name;
    section.refuse_unknown("key", NOMINAL_PARAMETERS.iter().filter(of_section).map(|p| p.spec.name))
}

fn motor(section: &Section) -> Result<MotorParameters, Failure> {
    refuse_other_keys(section)?;
    Ok(MotorParameters {
        supply_v: nominal_value(section, "supply_v")?,
        resistance_ohm: nominal_value(section, "resistance_ohm")?,
        inductance_h: nominal_value(section, "inductance_h")?,
        torque_constant_nm_per_a: nominal_value(section, "torque_constant_nm_per_a")?,
        gear_ratio: nominal_value(section, "gear_ratio")?,
        rotor_inertia_kg_m2: nominal_value(section, "rotor_inertia_kg_m2")?,
        viscous_nm_s_per_rad: nominal_value(section, "viscous_nm_s_per_rad")?,
    })
}

fn pulleys(section: &Section) -> Result<PulleyParameters, Failure> {
    refuse_other_keys(section)?;
    Ok(PulleyParameters {
        input_radius_m: nominal_value(section, "input_radius_m")?,
        output_radius_m: nominal_value(section, "output_radius_m")?,
    })
}

fn tendon(section: &Section) -> Result<TendonParameters, Failure> {
    refuse_other_keys(section)?;
    Ok(TendonParameters {
        length_m: nominal_value(section, "length_m")?,
        axial_stiffness_n: nominal_value(section, "axial_stiffness_n")?,
        pretension_n: nominal_value(section, "pretension_n")?,
    })
}

fn sheath(section: &Section) -> Result<SheathParameters, Failure> {
    refuse_other_keys(section)?;
    Ok(SheathParameters {
        wrap_angle_rad: nominal_value(section, "wrap_angle_rad")?,
        friction_coefficient: nominal_value(section, "friction_coefficient")?,
    })
}

fn load(section: &Section) -> Result<LoadParameters, Failure> {
    refuse_other_keys(section)?;
    Ok(LoadParameters {
        mass_kg: nominal_value(section, "mass_kg")?,
        arm_m: nominal_value(section, "arm_m")?,
        inertia_kg_m2: nominal_value(section, "inertia_kg_m2")?,
        viscous_nm_s_per_rad: nominal_value(section, "viscous_nm_s_per_rad")?,
    })
}

/// A key is required when the part that it measures is there.
fn read_sensors(section: &Section, has_tendon: bool, has_motor: bool) -> Result<SensorParameters, Failure> {
    section.refuse_unknown(
        "key",
        ["encoder_bits", "tension_full_scale_n", "adc_bits", "tension_noise_n", "current_noise_a"],
    )?;
    let usual = SensorParameters::default();
    let bits = |key, usual, required, meaning| match section.integer(key, BITS.0, BITS.1)? {
        Some(bits) => Ok(bits),
        None if required => Err(section.lacks(key, meaning)),
        None => Ok(usual),
    };
    let value = |key, bounds, usual, required, meaning| match section.number(key, bounds)? {
        Some(value) => Ok(value),
        None if required => Err(section.lacks(key, meaning)),
        None => Ok(usual),
    };
    Ok(SensorParameters {
        encoder_bits: bits("encoder_bits", usual.encoder_bits, true, "bits of the encoders, such as 12")?,
        tension_full_scale_n: value(
            "tension_full_scale_n",
            FULL_SCALE_N,
            usual.tension_full_scale_n,
            has_tendon,
            "full scale of the tension channels, such as 98.0665 N",
        )?,
        adc_bits: bits("adc_bits", usual.adc_bits, has_tendon, "bits of the tension converter, such as 12")?,
        tension_noise_n: value(
            "tension_noise_n",
            TENSION_NOISE_N,
            usual.tension_noise_n,
            has_tendon,
            "standard deviation, such as 0.1 N",
        )?,
        current_noise_a: value(
            "current_noise_a",
            CURRENT_NOISE_A,
            usual.current_noise_a,
            has_motor,
            "standard deviation, such as 0.01 A",
        )?,
    })
}

fn read_simulation(section: Option<&Section>) -> Result<(usize, f64, FrictionLaw), Failure> {
    let Some(section) = section else {
        return Ok((DEFAULT_ELEMENTS as usize, DEFAULT_STEP_S, FrictionLaw::Distributed));
    };
    section.refuse_unknown("key", ["friction", "effects", "elements", "step_s"])?;
    let friction = match section.string("friction")? {
        None | Some(("distributed", _)) => FrictionLaw::Distributed,
        Some(("lumped", _)) => FrictionLaw::Lumped,
        Some((other, span)) => {
            let reason =
                format!("simulation.friction: got `{other}`; {}", advice(other, ["distributed", "lumped"]));
            return Err(section.source.at(&span, reason));
        }
    };
    let elements = section.integer("elements", 1, MAX_ELEMENTS)?.unwrap_or(DEFAULT_ELEMENTS);
    Ok((elements as usize, section.number("step_s", STEP_S)?.unwrap_or(DEFAULT_STEP_S), friction))
}

fn read_controller(section: &Section) -> Result<ProportionalLaw, Failure> {
    section.refuse_unknown("key", ["kind", "gain_duty_per_rad", "duty_limit", "delay_s"])?;
    match section.string("kind")? {
        Some(("proportional", _)) => {}
        Some((other, span)) => {
            let reason = format!("controller.kind: got `{other}`, expected `proportional`; correct it");
            return Err(section.source.at(&span, reason));
        }
        None => return Err(section.lacks("kind", "law of the position loop: proportional")),
    }
    let required =
        |key, bounds, meaning| section.number(key, bounds)?.ok_or_else(|| section.lacks(key, meaning));
    Ok(ProportionalLaw {
        gain_duty_per_rad: required("gain_duty_per_rad", GAIN_DUTY_PER_RAD, "duty per rad of error")?,
        duty_limit: required("duty_limit", DUTY_LIMIT, "largest duty, such as 1")?,
        delay_s: section.number("delay_s", DELAY_S)?.unwrap_or(0.0),
    })
}

fn roles_with_time() -> impl Iterator<Item = &'static str> + Clone {
    [TIME_ROLE].into_iter().chain(Channel::ALL.into_iter().map(Channel::role))
}

fn read_columns(recording: &Section) -> Result<ColumnMap, Failure> {
    recording.refuse_unknown("key", ["columns"])?;
    let mut map = ColumnMap::default();
    let Some(value) = recording.get("columns") else { return Ok(map) };
    let DeValue::Table(table) = value.get_ref() else {
        return Err(recording.wrong_type("columns", value, "a table"));
    };
    let columns = Section::new(recording.source, "recording.columns", value.span(), table);
    columns.refuse_unknown("role", roles_with_time())?;
    for (role, _, value) in columns.entries() {
        let name = columns.path(role);
        let source = match value.get_ref() {
            DeValue::Table(table) => read_column(&Section::new(columns.source, &name, value.span(), table))?,
            _ => return Err(columns.wrong_type(role, value, "a table { column = \"...\" }")),
        };
        match Channel::from_role(role) {
            Some(channel) => map.channels.push((channel, source)),
            None => map.time = Some(source),
        }
    }
    Ok(map)
}

fn read_column(section: &Section) -> Result<ColumnSource, Failure> {
    section.refuse_unknown("key", ["column", "scale", "offset"])?;
    let (column, _) = section.text("column", "name of the column in the recordings")?;
    let scale = section.number("scale", FINITE)?.unwrap_or(1.0);
    if scale == 0.0 {
        let span = section.get("scale").map_or(section.span.clone(), toml::Spanned::span);
        let reason =
            format!("{}: got 0, which would erase the column; give the unit's factor", section.path("scale"));
        return Err(section.source.at(&span, reason));
    }
    Ok(ColumnSource {
        column: column.to_owned(),
        scale,
        offset: section.number("offset", FINITE)?.unwrap_or(0.0),
    })
}

type Channels = Option<Vec<Channel>>;

/// What `[replay]` says.
#[derive(Default)]
struct Replay {
    inputs: Channels,
    outputs: Channels,
    free_offsets: Vec<Channel>,
    relative_inputs: Vec<Channel>,
    smoothing_s: Vec<(Channel, f64)>,
}

fn read_replay(section: &Section, has_controller: bool) -> Result<Replay, Failure> {
    section.refuse_unknown("key", ["inputs", "outputs", "free_offsets", "relative_inputs", "smoothing_s"])?;
    let inputs = read_channels(section, "inputs", |channel| match channel {
        Channel::ThetaRef if !has_controller => {
            Some("needs the law of the position loop; add [controller] or take duty as input".to_owned())
        }
        channel if can_drive(channel) => None,
        _ => Some("cannot drive a replay; take angles, torques or duty as inputs".to_owned()),
    })?;
    let outputs = read_channels(section, "outputs", |channel| match &inputs {
        Some(inputs) if inputs.contains(&channel) => Some("is an input too; keep one of the two".to_owned()),
        _ => None,
    })?;
    let drives = |channel: &Channel| match &inputs {
        Some(inputs) => inputs.contains(channel),
        None => can_drive(*channel),
    };
    let no_input = || Some("is no input of the replay; name it in replay.inputs or drop it here".to_owned());
    let free_offsets = read_channels(section, "free_offsets", |channel| match (&outputs, &inputs) {
        (Some(outputs), _) if !outputs.contains(&channel) => {
            Some("is no output of the replay; name it in replay.outputs or drop it here".to_owned())
        }
        (None, Some(inputs)) if inputs.contains(&channel) => {
            Some("is an input; an arbitrary zero of an input belongs in replay.relative_inputs".to_owned())
        }
        _ => None,
    })?;
    let relative_inputs =
        read_channels(
            section,
            "relative_inputs",
            |channel| if drives(&channel) { None } else { no_input() },
        )?;
    let mut smoothing_s = Vec::new();
    if let Some(table) = section.section("smoothing_s", "replay.smoothing_s")? {
        table.refuse_unknown("role", Channel::ALL.into_iter().map(Channel::role))?;
        for (role, span, _) in table.entries() {
            let Some(channel) = Channel::from_role(role) else { continue };
            if let (false, Some(reason)) = (drives(&channel), no_input()) {
                return Err(table.source.at(&span, format!("`{role}` in {} {reason}", table.name)));
            }
            if let Some(time_s) = table.number(role, SMOOTHING_S)? {
                smoothing_s.push((channel, time_s));
            }
        }
    }
    Ok(Replay {
        inputs,
        outputs,
        free_offsets: free_offsets.unwrap_or_default(),
        relative_inputs: relative_inputs.unwrap_or_default(),
        smoothing_s,
    })
}

fn read_channels(
    section: &Section,
    key: &str,
    objection: impl Fn(Channel) -> Option<String>,
) -> Result<Channels, Failure> {
    let Some(names) = section.strings(key)? else { return Ok(None) };
    let mut channels = Vec::new();
    for (name, span) in names {
        let Some(channel) = Channel::from_role(name) else {
            let known = advice(name, Channel::ALL.into_iter().map(Channel::role));
            return Err(section
                .source
                .at(&span, format!("unknown role `{name}` in {}; {known}", section.path(key))));
        };
        if channels.contains(&channel) {
            let reason = format!("`{name}` stands twice in {}; name it once", section.path(key));
            return Err(section.source.at(&span, reason));
        }
        if let Some(reason) = objection(channel) {
            return Err(section.source.at(&span, format!("`{name}` in {} {reason}", section.path(key))));
        }
        channels.push(channel);
    }
    if channels.is_empty() {
        return Err(section.lacks(key, "at least one role"));
    }
    Ok(Some(channels))
}
