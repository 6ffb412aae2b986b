//! Pair with a memory by brute force: each tendon a chain of springs and nodes, each node a short bend with the capstan
//! condition. A node moves only when the tensions on its sides exceed the capstan ratio, and then just far enough.
//! Even curvature; discretisation error of the stretch is of order (mu K / nodes)².

use crate::bench::Bench;

/// Nodes a tendon.
pub const NODES: usize = 40;

/// Breach of the capstan ratio that does not yet count as slip, N.
const TENSION_TOLERANCE_N: f64 = 1e-8;
/// Motion against the friction that rounding may cause, m: 1e-13 m is 6e-7 N on the stiffest segment.
const MOTION_TOLERANCE_M: f64 = 1e-13;

pub struct Chain {
    bench: Bench,
    /// Displacement of the nodes of cables a and b towards the output, m; first and last belong to the pulleys.
    u: [[f64; NODES + 2]; 2],
    theta_in_rad: f64,
    theta_out_rad: f64,
}

impl Chain {
    /// Even pretension, both pulleys at 0.
    pub fn at_rest(bench: &Bench) -> Self {
        Self { bench: *bench, u: [[0.0; NODES + 2]; 2], theta_in_rad: 0.0, theta_out_rad: 0.0 }
    }

    /// Stiffness of segment i, N/m: the nodes sit in the middle of equal cells, so the end segments are half as long.
    fn stiffness(&self, segment: usize) -> f64 {
        let cell = self.bench.stiffness_n * NODES as f64 / self.bench.length_m;
        if segment == 0 || segment == NODES { 2.0 * cell } else { cell }
    }

    fn tension(&self, cable: usize, segment: usize) -> f64 {
        self.bench.pretension_n
            + self.stiffness(segment) * (self.u[cable][segment + 1] - self.u[cable][segment])
    }

    pub fn theta_out_rad(&self) -> f64 {
        self.theta_out_rad
    }

    /// F1, F2, F3, F4.
    pub fn end_tensions(&self) -> [f64; 4] {
        [self.tension(0, 0), self.tension(0, NODES), self.tension(1, 0), self.tension(1, NODES)]
    }

    pub fn torque_in_nm(&self) -> f64 {
        let f = self.end_tensions();
        (f[0] - f[2]) * self.bench.r1_m
    }

    /// Turns the input to `theta_in_rad` in small steps; the joint balances `load(theta_out)` (increasing, N·m).
    pub fn turn_input(&mut self, theta_in_rad: f64, load: &dyn Fn(f64) -> f64) {
        let travel = theta_in_rad - self.theta_in_rad;
        let steps = (travel.abs() / 1e-3).ceil().max(1.0) as usize;
        let start = self.theta_in_rad;
        for step in 1..=steps {
            self.theta_in_rad = start + travel * step as f64 / steps as f64;
            self.u[0][0] = -self.bench.r1_m * self.theta_in_rad;
            self.u[1][0] = self.bench.r1_m * self.theta_in_rad;
            self.relax(load);
        }
    }

    /// Finds which nodes slip, and where to, for the present input angle.
    ///
    /// Cable a from input to joint and cable b back form one line of unknowns, so each guess of the slipping set is a
    /// tridiagonal system. A node that breaks the capstan ratio joins the set; one that would move against its own
    /// friction leaves it.
    fn relax(&mut self, load: &dyn Fn(f64) -> f64) {
        let start = self.u;
        let mut slip = [[Slip::None; NODES + 2]; 2];
        let ratio = (self.bench.mu * self.bench.wrap_rad / NODES as f64).exp();
        for _ in 0..2000 {
            let residual_nm = self.solve(&start, &slip, ratio, load);
            let mut changed = false;
            for cable in 0..2 {
                for i in 1..=NODES {
                    let (before, after) = (self.tension(cable, i - 1), self.tension(cable, i));
                    let moved = self.u[cable][i] - start[cable][i];
                    let now = match slip[cable][i] {
                        Slip::None if before > after * ratio + TENSION_TOLERANCE_N => Slip::ToInput,
                        Slip::None if after > before * ratio + TENSION_TOLERANCE_N => Slip::ToOutput,
                        Slip::ToInput if moved > MOTION_TOLERANCE_M => Slip::None,
                        Slip::ToOutput if moved < -MOTION_TOLERANCE_M => Slip::None,
                        same => same,
                    };
                    changed |= now != slip[cable][i];
                    slip[cable][i] = now;
                }
            }
            if !changed && residual_nm < 1e-9 {
                return;
            }
        }
        panic!("chain does not settle at theta_in {}", self.theta_in_rad);
    }

    /// One Newton step for a given set of slipping nodes; returns the torque the joint is out of balance by, before it.
    fn solve(
        &mut self,
        start: &[[f64; NODES + 2]; 2],
        slip: &[[Slip; NODES + 2]; 2],
        ratio: f64,
        load: &dyn Fn(f64) -> f64,
    ) -> f64 {
        const UNKNOWNS: usize = 2 * NODES + 1;
        let (f0, r2) = (self.bench.pretension_n, self.bench.r2_m);
        let mut rows = [[0.0; 4]; UNKNOWNS]; // lower, diagonal, upper, right side
        for cable in 0..2 {
            for i in 1..=NODES {
                let row = if cable == 0 { i - 1 } else { UNKNOWNS - i };
                let q = match slip[cable][i] {
                    Slip::None => {
                        rows[row] = [0.0, 1.0, 0.0, start[cable][i]];
                        continue;
                    }
                    Slip::ToInput => ratio,
                    Slip::ToOutput => 1.0 / ratio,
                };
                // F0 + k_before (u_i - u_before) = q (F0 + k_after (u_after - u_i))
                let (k_before, k_after) = (self.stiffness(i - 1), self.stiffness(i));
                let mut right = (q - 1.0) * f0;
                let (mut before, mut after) = (-k_before, -q * k_after);
                if i == 1 {
                    right -= before * self.u[cable][0];
                    before = 0.0;
                }
                if i == NODES {
                    // The neighbour is the joint: u_after = -r2 theta for a, +r2 theta for b.
                    after *= if cable == 0 { -r2 } else { r2 };
                }
                let diagonal = k_before + q * k_after;
                rows[row] = if cable == 0 {
                    [before, diagonal, after, right]
                } else {
                    [after, diagonal, before, right]
                };
            }
        }
        // (F2 - F4) r2 = load: F2 - F4 = k (-2 r2 theta - u_aN + u_bN), load linearised about the present angle.
        let (theta, k) = (self.theta_out_rad, self.stiffness(NODES));
        let slope = (load(theta + 1e-6) - load(theta - 1e-6)) / 2e-6;
        rows[NODES] = [k * r2, 2.0 * k * r2 * r2 + slope, -k * r2, slope * theta - load(theta)];
        let solution = thomas(&mut rows);
        let residual_nm = (solution[NODES] - theta).abs() * (2.0 * k * r2 * r2 + slope);
        for i in 1..=NODES {
            self.u[0][i] = solution[i - 1];
            self.u[1][i] = solution[UNKNOWNS - i];
        }
        self.theta_out_rad = solution[NODES];
        self.u[0][NODES + 1] = -r2 * self.theta_out_rad;
        self.u[1][NODES + 1] = r2 * self.theta_out_rad;
        residual_nm
    }
}

/// Where a node moves during a step.
#[derive(Clone, Copy, PartialEq)]
enum Slip {
    None,
    ToInput,
    ToOutput,
}

/// Solves a tridiagonal system given as rows of lower, diagonal, upper and right side.
fn thomas<const N: usize>(rows: &mut [[f64; 4]; N]) -> [f64; N] {
    for i in 1..N {
        let factor = rows[i][0] / rows[i - 1][1];
        rows[i][1] -= factor * rows[i - 1][2];
        rows[i][3] -= factor * rows[i - 1][3];
    }
    let mut x = [0.0; N];
    x[N - 1] = rows[N - 1][3] / rows[N - 1][1];
    for i in (0..N - 1).rev() {
        x[i] = (rows[i][3] - rows[i][2] * x[i + 1]) / rows[i][1];
    }
    x
}
