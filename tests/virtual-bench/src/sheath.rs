//! Path of the sheath: how the wrap angle K is spread over the nodes of the tendon mesh.

use crate::config::Bend;

/// Share of K that each of `nodes` masses carries: curvature integrated over the mass's cell.
///
/// Mass i sits at arc length (i + 1) h, h = L/(nodes + 1); its cell reaches h/2 to either side, and the outermost two
/// reach the ends. The shares of all nodes add up to the shares of all bends.
pub(crate) fn node_bends(nodes: usize, bends: &[Bend]) -> Vec<f64> {
    (0..nodes).map(|node| bends.iter().map(|bend| share_in_cell(node, nodes, bend)).sum()).collect()
}

/// As [`node_bends`] for one bend, scaled so that the shares add up to 1.
pub(crate) fn single_bend(nodes: usize, bend: &Bend) -> Vec<f64> {
    let whole = Bend { share: 1.0, ..*bend };
    (0..nodes).map(|node| share_in_cell(node, nodes, &whole)).collect()
}

fn share_in_cell(node: usize, nodes: usize, bend: &Bend) -> f64 {
    let cell = 1.0 / (nodes as f64 + 1.0);
    let from = if node == 0 { 0.0 } else { (node as f64 + 0.5) * cell };
    let to = if node + 1 == nodes { 1.0 } else { (node as f64 + 1.5) * cell };
    let overlap = (to.min(bend.to) - from.max(bend.from)).max(0.0);
    bend.share * overlap / (bend.to - bend.from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_of_the_wrap_angle_is_placed_and_straight_parts_get_none() {
        let bends = [Bend { from: 0.2, to: 0.4, share: 0.6 }, Bend { from: 0.7, to: 0.8, share: 0.4 }];
        for nodes in [2, 7, 10, 41] {
            let shares = node_bends(nodes, &bends);
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{nodes} nodes: {shares:?}");
        }
        // Ten nodes: cells are 1/11 wide; node 5's cell is 0.500..0.591, inside the straight part 0.4..0.7.
        let shares = node_bends(10, &bends);
        assert_eq!(shares[5], 0.0);
        assert_eq!(shares[0], 0.0);
        assert_eq!(shares[9], 0.0);
        // Node 2's cell 0.227..0.318 lies inside the first bend: its share is 0.6·(1/11)/0.2.
        assert!((shares[2] - 0.6 / 11.0 / 0.2).abs() < 1e-12);
    }
}
