//! The paper's equations against routes that do not use them: integration of the capstan ODE, bisection of the
//! compatibility condition, and a chain of sliding nodes for everything that has a memory.

mod bench;
mod chain;
mod compensation;
mod curvature;
mod derivation_numbers;
mod displacement;
mod oracle;
mod pretension;
mod refusals;
mod statics;
mod torque_loop;
