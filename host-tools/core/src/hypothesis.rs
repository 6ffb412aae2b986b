//! Hypotheses: physics that a user states as a function of one or two variables at a port of the joint.
//!
//! A hypothesis is an [`Effect`] like any other. Its function may be slow, as one of Python is: it is asked once for each set of
//! coefficients, at all knots of a grid, and the simulation interpolates between them. A rig file states a fitted one by its points, which
//! need the function no more.
//!
//! The grid covers what the variables do in a replay of the rig as it is stated, and half of that range beyond at either end; farther out
//! the value at the end holds.

mod asked;
mod effect;
mod knots;
mod registry;
mod statement;
mod table;

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Descriptor, MAX_PARAMETERS, Target};
use bowden_model::law::{Port, Variable};

use crate::outcome::Failure;
use asked::{Asked, Curve, checked_values};
pub use registry::of;
pub use statement::{Coefficient, MOST_STARTS, Statement};
use statement::{check_name, check_variables, columns_of, few_points, spec_of, starts_of};
pub use table::{Axis, Table};

/// Sets of coefficients whose values a thread keeps.
const KEPT: usize = 8;

/// Largest error of the points that a rig file gets, over the largest value.
const THINNING: f64 = 1e-4;

/// A function of a port's variables.
pub trait Function: Send + Sync {
    /// Its values at points, of which `columns` holds each variable's values, for given coefficients.
    ///
    /// # Errors
    /// Why it has none.
    fn values(&self, columns: &[Vec<f64>], coefficients: &[f64]) -> Result<Vec<f64>, String>;
}

/// A function at a port, as an effect.
pub struct Hypothesis {
    port: Port,
    variables: Vec<Variable>,
    descriptor: &'static Descriptor,
    starts: Vec<[f64; MAX_PARAMETERS]>,
    source: Source,
}

enum Source {
    Points(Table),
    Function(Asked),
}

/// Address of a hypothesis, coefficients, and its values for them.
type Kept = (usize, [f64; MAX_PARAMETERS], Rc<Table>);

thread_local! {
    static TABLES: RefCell<Vec<Kept>> = const { RefCell::new(Vec::new()) };
}

impl Hypothesis {
    /// Checks what a user states, and asks the function at a few points.
    ///
    /// It lives as long as the program: a simulation refers to its effects by address.
    ///
    /// # Errors
    /// A name that is taken or none, variables that the port does not have, coefficients without a range, and what the function says.
    pub fn new(statement: Statement) -> Result<&'static Self, Failure> {
        let name = statement.name.clone();
        Self::checked(statement)
            .map_err(|reason| Failure::bad_input(format!("hypothesis `{name}`: {reason}")))
    }

    fn checked(statement: Statement) -> Result<&'static Self, String> {
        let Statement { name, port, channel, variables, coefficients, ranges, function } = statement;
        check_name(&name)?;
        check_variables(port, &variables)?;
        match (port, channel) {
            (Port::InputRadius | Port::OutputRadius, _) => {
                return Err(format!(
                    "port {} takes the laws of the catalogue only; state it at another port",
                    port.name()
                ));
            }
            (Port::Reading, None) => return Err("a reading needs a channel; name it".to_owned()),
            (Port::Reading, Some(_)) | (_, None) => {}
            (_, Some(channel)) => {
                return Err(format!("port {} has no channel {}; drop it", port.name(), channel.role()));
            }
        }
        let specs = coefficients.iter().map(spec_of).collect::<Result<Vec<_>, _>>()?;
        if specs.is_empty() || specs.len() > MAX_PARAMETERS {
            return Err(format!("{} coefficients; state 1 to {MAX_PARAMETERS}", specs.len()));
        }
        let starts = starts_of(&coefficients)?;
        let asked = Asked {
            function,
            ranges,
            seen: Mutex::new(None),
            axes: OnceLock::new(),
            failure: Mutex::new(None),
            failed: AtomicBool::new(false),
        };
        let mut nothing = starts[0];
        let count = specs.len();
        let points = few_points(&variables, &asked.ranges);
        checked_values(&asked, &variables, &specs, &points, &starts[0])?;
        nothing[0] = 0.0;
        let may_vanish = specs[0].lower <= 0.0 && specs[0].upper >= 0.0;
        let vanishes = may_vanish
            && asked
                .function
                .values(&points, &nothing[..count])
                .is_ok_and(|values| values.iter().all(|value| *value == 0.0));
        let descriptor =
            registry::descriptor(&name, port, &specs, vanishes.then_some(0.0), channel.as_slice());
        Ok(registry::keep(Self { port, variables, descriptor, starts, source: Source::Function(asked) }))
    }

    /// The law that a rig file states by points; the same for the same points.
    ///
    /// # Errors
    /// Variables that the port does not have.
    pub fn of_points(
        name: &str,
        port: Port,
        channel: Option<Channel>,
        variables: Vec<Variable>,
        table: Table,
    ) -> Result<&'static Self, String> {
        check_name(name)?;
        check_variables(port, &variables)?;
        if table.axes().len() != variables.len() {
            return Err(format!("{} variables, points of {}", variables.len(), table.axes().len()));
        }
        let alike = |other: &&Self| {
            matches!(&other.source, Source::Points(points) if *points == table)
                && (other.port, &other.variables) == (port, &variables)
                && other.name() == name
                && other.descriptor.channels == channel.as_slice()
        };
        if let Some(known) = registry::find(alike) {
            return Ok(known);
        }
        let id = registry::id_of_points(name, &table);
        let descriptor = registry::descriptor(&id, port, &[], None, channel.as_slice());
        let starts = vec![[0.0; MAX_PARAMETERS]];
        Ok(registry::keep(Self { port, variables, descriptor, starts, source: Source::Points(table) }))
    }

    /// A curve through six values over one of the variables of `self`, at its port, from what `fitted` says there: what any function of that
    /// variable may come to. `None` before [`Self::settle`].
    #[must_use]
    pub fn free_curve(&self, variable: usize, fitted: &ActiveEffect) -> Option<&'static Self> {
        let Source::Function(asked) = &self.source else { return None };
        let of = *self.variables.get(variable)?;
        let ends = |index: usize| -> Option<[f64; 2]> {
            let knots = asked.axes.get()?.get(index)?.knots();
            let seen = asked.seen.lock().unwrap_or_else(PoisonError::into_inner).map(|seen| seen[index]);
            asked.ranges[index].or(seen).or(Some([*knots.first()?, *knots.last()?]))
        };
        let [low, high] = ends(variable)?;
        let knots = knots::of_curve([low, high], of)?;
        let middle = ends(1 - variable).map_or(0.0, |[low, high]| 0.5 * (low + high));
        let table = self.table(&fitted.parameters)?;
        let largest = 3.0 * table.largest();
        let size = if largest > 0.0 { largest } else { 1.0 };
        let coefficients = knots.knots().iter().enumerate().map(|(knot, x)| {
            let mut point = [middle; 2];
            point[variable] = *x;
            Coefficient {
                name: format!("y{}", knot + 1),
                unit: self.port.unit().to_owned(),
                range: [-size, size],
                starts: vec![table.at(point)],
            }
        });
        Self::checked(Statement {
            name: format!("free_curve_{}", self.name()),
            port: self.port,
            channel: self.descriptor.channels.first().copied(),
            variables: vec![of],
            coefficients: coefficients.collect(),
            ranges: vec![Some([low, high])],
            function: Box::new(Curve(knots)),
        })
        .ok()
    }

    /// Name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.descriptor.id.split('@').next().unwrap_or(self.descriptor.id)
    }

    /// Where it acts.
    #[must_use]
    pub const fn port(&self) -> Port {
        self.port
    }

    /// On what it depends.
    #[must_use]
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// Whether it is the function that a user stated, and not points of a rig file.
    #[must_use]
    pub const fn is_function(&self) -> bool {
        matches!(self.source, Source::Function(_))
    }

    /// `name(variables, coefficients)`, for a sentence.
    #[must_use]
    pub fn formula(&self) -> String {
        let variables = self.variables.iter().map(|variable| variable.name());
        let coefficients = self.descriptor.parameters.iter().map(|spec| spec.name);
        format!("{}({})", self.name(), variables.chain(coefficients).collect::<Vec<_>>().join(", "))
    }

    /// Where a search starts.
    #[must_use]
    pub fn starts(&'static self) -> Vec<ActiveEffect> {
        let effect = |parameters: &[f64; MAX_PARAMETERS]| ActiveEffect {
            effect: self,
            parameters: *parameters,
            target: self.target(),
            bench: None,
        };
        self.starts.iter().map(effect).collect()
    }

    fn target(&self) -> Target {
        self.descriptor.channels.first().map_or(Target::None, |channel| Target::One(*channel))
    }

    /// Fixes the grid by what the variables have done since the hypothesis was made, in simulations that contained it: until then it adds
    /// nothing.
    ///
    /// # Errors
    /// When it was in none: the rig lacks the part.
    pub fn settle(&self) -> Result<(), Failure> {
        let Source::Function(asked) = &self.source else { return Ok(()) };
        let seen = *asked.seen.lock().unwrap_or_else(PoisonError::into_inner);
        let refuse = |reason: String| Failure::bad_input(format!("hypothesis `{}`: {reason}", self.name()));
        if asked.axes.get().is_some() {
            return Ok(());
        }
        let axes = self.variables.iter().enumerate().map(|(index, variable)| {
            let range = asked.ranges[index].or_else(|| Some(knots::widened(seen?[index], *variable)));
            let range = range.ok_or_else(|| {
                refuse(format!("nothing of the rig acts at port {}; state it at another", self.port.name()))
            })?;
            knots::axis(range, *variable, self.variables.len()).ok_or_else(|| {
                refuse(format!(
                    "{} ranges from {} to {}; state its range",
                    variable.name(),
                    range[0],
                    range[1]
                ))
            })
        });
        let axes = axes.collect::<Result<Vec<_>, _>>()?;
        asked.axes.get_or_init(|| axes);
        Ok(())
    }

    /// What the function said when it failed.
    #[must_use]
    pub fn failure(&self) -> Option<Failure> {
        let Source::Function(asked) = &self.source else { return None };
        let failure = asked.failure.lock().unwrap_or_else(PoisonError::into_inner);
        failure.as_ref().map(|reason| Failure::bad_input(format!("hypothesis `{}`: {reason}", self.name())))
    }

    /// Its points for these coefficients, without those that straight lines replace.
    #[must_use]
    pub fn points(&self, coefficients: &[f64; MAX_PARAMETERS]) -> Option<Table> {
        let table = self.table(coefficients)?;
        Some(table.thinned(THINNING * table.largest()))
    }

    /// Values at all knots; `None` while there are no knots, or once the function has failed.
    fn table(&self, coefficients: &[f64; MAX_PARAMETERS]) -> Option<Rc<Table>> {
        let asked = match &self.source {
            Source::Points(table) => return Some(Rc::new(table.clone())),
            Source::Function(asked) => asked,
        };
        let axes = asked.axes.get()?;
        if asked.failed.load(Ordering::Relaxed) {
            return None;
        }
        let address = std::ptr::from_ref(self).addr();
        let known = TABLES.with_borrow(|tables| {
            let known = tables.iter().find(|(of, at, _)| *of == address && at == coefficients);
            known.map(|(.., table)| Rc::clone(table))
        });
        if known.is_some() {
            return known;
        }
        let specs = self.descriptor.parameters;
        let columns = columns_of(axes);
        match checked_values(asked, &self.variables, specs, &columns, coefficients) {
            Ok(values) => {
                let table = Rc::new(Table::new(axes.clone(), values)?);
                TABLES.with_borrow_mut(|tables| {
                    tables.truncate(KEPT - 1);
                    tables.insert(0, (address, *coefficients, Rc::clone(&table)));
                });
                Some(table)
            }
            Err(reason) => {
                asked.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(reason);
                asked.failed.store(true, Ordering::Relaxed);
                None
            }
        }
    }
}
