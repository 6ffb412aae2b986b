//! A tendon by brute force: springs between nodes, each node with friction, solved for all nodes at once.
//!
//! Unknown is the slip of every node during one load step, towards the input (`forward`) or towards the output
//! (`backward`), with the complementarity that a node slips only at its limit:
//!
//! `forward_i ≥ 0 ⊥ T_{i+1} - (e^{-a_i} T_i - o_i) ≥ 0`, `backward_i ≥ 0 ⊥ e^{a_i} (T_i + o_i) - T_{i+1} ≥ 0`.
//!
//! Projected Gauss-Seidel runs until nothing moves. Nothing is assumed about fronts or about the order of slipping, and
//! both ends move together.

/// Largest change of a tension in a sweep at which the iteration counts as settled, N.
const SETTLED_N: f64 = 1e-11;

/// Tendon with its friction; node i sits between segments i and i + 1.
pub struct Rope {
    /// Elongation per tension of every segment, m/N.
    pub compliance: Vec<f64>,
    /// Friction angle μ K w of every node.
    pub angle: Vec<f64>,
    /// Friction o of every node that does not scale with tension, N.
    pub offset: Vec<f64>,
    /// Tension of every segment, N.
    pub tension: Vec<f64>,
}

impl Rope {
    /// Stretches the input end by `input_m` and the output end by `output_m` in one load step.
    pub fn pull(&mut self, input_m: f64, output_m: f64) {
        let nodes = self.angle.len();
        self.tension[0] += input_m / self.compliance[0];
        self.tension[nodes] += output_m / self.compliance[nodes];
        let (mut forward, mut backward) = (vec![0.0; nodes], vec![0.0; nodes]);
        for _ in 0..200_000 {
            let mut largest: f64 = 0.0;
            for i in 0..nodes {
                let grow = self.angle[i].exp();
                let directions = [
                    (&mut forward[i], 1.0 / grow, -self.offset[i], 1.0),
                    (&mut backward[i], grow, grow * self.offset[i], -1.0),
                ];
                for (slip, grow, offset, sign) in directions {
                    let limit = grow * self.tension[i] + offset;
                    let (near, far) = (1.0 / self.compliance[i], 1.0 / self.compliance[i + 1]);
                    let wanted: f64 = *slip + sign * (limit - self.tension[i + 1]) / (far + grow * near);
                    let change = sign * (wanted.max(0.0) - *slip);
                    *slip = wanted.max(0.0);
                    self.tension[i] -= near * change;
                    self.tension[i + 1] += far * change;
                    largest = largest.max((near * change).abs());
                }
            }
            if largest < SETTLED_N {
                return;
            }
        }
        panic!("rope does not settle");
    }
}
