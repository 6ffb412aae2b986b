//! Simulated seconds a second, one core: `cargo bench -p virtual-bench --bench realtime`.
//!
//! The item count is the simulated time in milliseconds, so 20 Kitem/s are 20 times real time.

use divan::counter::ItemsCount;
use virtual_bench::{BenchConfig, ConcealedEffect, Motion, MotionKind, record};

const SECONDS: f64 = 2.0;

fn main() {
    divan::main();
}

#[divan::bench(args = ["none", "sheath_stribeck_friction", "wrap_angle_varies_with_pose", "joint_backlash"])]
fn record_two_seconds(bencher: divan::Bencher, id: &str) {
    let bench = BenchConfig::default();
    let effects: Vec<_> = ConcealedEffect::drawn(id, 1.0, 1).into_iter().collect();
    let motion = Motion::new(MotionKind::Multisine, SECONDS, 1);
    let simulated_ms = (SECONDS * 1e3) as usize;
    bencher.counter(ItemsCount::new(simulated_ms)).bench(|| {
        let recording = record(&bench, &effects, &motion, 1).expect("the nominal bench can be recorded");
        assert_eq!(recording.len(), simulated_ms);
        recording
    });
}
