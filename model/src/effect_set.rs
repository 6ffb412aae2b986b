//! The effects that one simulation contains, sorted by component.

use crate::channel::Channel;
use crate::effect::Effect;
use crate::effect::{
    ActiveEffect, Component, DrivePort, EffectState, JointPort, MAX_PARAMETERS, MAX_STATE, MotorPort,
    SensorPort, TransmissionPort,
};
use crate::friction_law::FrictionLaw;

/// Largest number of effects in one simulation.
pub const MAX_ACTIVE: usize = 16;

/// More than [`MAX_ACTIVE`] effects were asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooManyEffects;

impl core::fmt::Display for TooManyEffects {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "more than {MAX_ACTIVE} effects in one simulation; leave some out")
    }
}

impl core::error::Error for TooManyEffects {}

/// Effects of one simulation: configuration only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EffectSet {
    active: [Option<ActiveEffect>; MAX_ACTIVE],
    count: usize,
    /// Effects of each component: every step asks for them many times, and their descriptors are behind a call.
    of_component: [Places; Component::ALL.len()],
    /// Whether any effect changes from step to step what it says of the transmission.
    transmission_varies: bool,
}

/// Places of the effects of one component in the set, in ascending order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Places {
    among_all: [u8; MAX_ACTIVE],
    count: usize,
}

impl Places {
    const NONE: Self = Self { among_all: [0; MAX_ACTIVE], count: 0 };

    fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.among_all.iter().take(self.count).map(|place| usize::from(*place))
    }
}

/// State of every effect of an [`EffectSet`], in its order.
pub type EffectStates = [EffectState; MAX_ACTIVE];

/// States at the start of a run.
pub const FRESH_STATES: EffectStates = [[0.0; MAX_STATE]; MAX_ACTIVE];

impl EffectSet {
    /// No effects.
    pub const EMPTY: Self = Self {
        active: [None; MAX_ACTIVE],
        count: 0,
        of_component: [Places::NONE; Component::ALL.len()],
        transmission_varies: false,
    };

    /// Adds an effect.
    ///
    /// # Errors
    /// [`TooManyEffects`] when the set is full.
    pub fn push(&mut self, effect: ActiveEffect) -> Result<(), TooManyEffects> {
        let slot = self.active.get_mut(self.count).ok_or(TooManyEffects)?;
        *slot = Some(effect);
        let component = effect.descriptor().component;
        let places = &mut self.of_component[component as usize];
        places.among_all[places.count] = self.count as u8;
        places.count += 1;
        self.transmission_varies |= component == Component::Transmission && !effect.effect.is_constant();
        self.count += 1;
        Ok(())
    }

    /// The set of all given effects.
    ///
    /// # Errors
    /// [`TooManyEffects`] when there are too many.
    pub fn from_slice(effects: &[ActiveEffect]) -> Result<Self, TooManyEffects> {
        let mut set = Self::EMPTY;
        for effect in effects {
            set.push(*effect)?;
        }
        Ok(set)
    }

    /// The effects in the order in which they were added.
    pub fn iter(&self) -> impl Iterator<Item = &ActiveEffect> {
        self.active[..self.count].iter().flatten()
    }

    /// Whether any effect belongs to `component`.
    #[must_use]
    pub const fn touches(&self, component: Component) -> bool {
        self.of_component[component as usize].count > 0
    }

    /// Whether any effect changes from step to step what it says of the transmission.
    pub(crate) const fn transmission_varies(&self) -> bool {
        self.transmission_varies
    }

    /// The effects of one component and their places in the set, in the order in which they act.
    fn of(&self, component: Component) -> impl Iterator<Item = (usize, &ActiveEffect)> {
        let places = self.of_component[component as usize].iter();
        places.filter_map(|place| Some((place, self.active[place].as_ref()?)))
    }

    /// The effects on the sensors of `channel` and their places in the set.
    fn places_on(&self, channel: Channel) -> impl Iterator<Item = (usize, &ActiveEffect)> {
        self.of(Component::Sensors).filter(move |(_, active)| active.target.includes(channel))
    }

    /// The effects on the sensors of `channel`, in the order in which they act.
    pub fn on(&self, channel: Channel) -> impl Iterator<Item = &ActiveEffect> {
        self.places_on(channel).map(|(_, active)| active)
    }

    /// Law of sheath friction with these effects, for a rig that says `nominal`; the last effect that has one decides.
    #[must_use]
    pub fn friction_law(&self, nominal: FrictionLaw) -> FrictionLaw {
        self.iter().filter_map(|active| active.effect.friction_law()).last().unwrap_or(nominal)
    }

    /// Places between which the sheaths are bent, by the last effect that says so.
    #[must_use]
    pub fn bent_between(&self) -> [f64; 2] {
        let stated = self.iter().filter_map(|active| active.effect.bent_between(&active.parameters));
        stated.last().unwrap_or([0.0, 1.0])
    }

    fn for_each(
        &self,
        component: Component,
        states: &mut EffectStates,
        mut hook: impl FnMut(&'static dyn Effect, &[f64; MAX_PARAMETERS], &mut EffectState),
    ) {
        for (place, active) in self.of(component) {
            hook(active.effect, &active.parameters, &mut states[place]);
        }
    }

    pub(crate) fn drive(&self, states: &mut EffectStates, port: &mut DrivePort) {
        self.for_each(Component::Motor, states, |effect, p, s| effect.drive(p, s, port));
    }

    pub(crate) fn motor(&self, states: &mut EffectStates, port: &mut MotorPort) {
        self.for_each(Component::Motor, states, |effect, p, s| effect.motor(p, s, port));
    }

    pub(crate) fn transmission(&self, states: &mut EffectStates, port: &mut TransmissionPort) {
        self.for_each(Component::Transmission, states, |effect, p, s| effect.transmission(p, s, port));
    }

    pub(crate) fn joint(&self, states: &mut EffectStates, port: &mut JointPort) {
        self.for_each(Component::Joint, states, |effect, p, s| effect.joint(p, s, port));
    }

    /// What the sensors of `channel` show for a true value, before quantisation and noise.
    ///
    /// `states` are the sensors' own: one array a channel, because a filter keeps its memory per channel.
    pub fn measure(&self, channel: Channel, states: &mut EffectStates, port: &mut SensorPort) {
        for (place, active) in self.places_on(channel) {
            active.effect.measure(&active.parameters, &mut states[place], port);
        }
    }

    /// True value behind what the sensors of `channel` showed, as far as they allow.
    pub fn correct(&self, channel: Channel, states: &mut EffectStates, port: &mut SensorPort) {
        for (place, active) in self.places_on(channel) {
            active.effect.correct(&active.parameters, &mut states[place], port);
        }
    }
}
