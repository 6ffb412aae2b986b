//! Progress of long work, and the wish to end it early.

use crate::outcome::Failure;

/// Receives the progress of long work; may be called from several threads.
pub trait Progress: Sync {
    /// A stage begins that consists of so many steps; 0 if the number is not known.
    fn stage(&self, name: &str, steps: u64);

    /// So many steps of the stage are done.
    fn advance(&self, steps: u64);

    /// Whether the user wants the work to end with what there is.
    fn interrupted(&self) -> bool {
        false
    }
}

/// Why work without a partial result ended early.
pub(crate) fn ended_early(what: &str) -> Failure {
    Failure::failed(format!("{what}: ended early as requested; run it again"))
}

/// Shows nothing.
#[derive(Clone, Copy, Debug)]
pub struct Quiet;

impl Progress for Quiet {
    fn stage(&self, _name: &str, _steps: u64) {}
    fn advance(&self, _steps: u64) {}
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use bowden_model::channel::Channel;

    use super::*;
    use crate::fit::recalibrate::recalibrate;
    use crate::replay::{predict, predict_watched};
    use crate::simulate::{Motion, Reference, RunOptions, run, run_watched};
    use crate::study::Study;
    use crate::test_bench;

    /// Asks for an early end from the look of this number on, and counts all looks.
    struct EndAt {
        look: u64,
        looks: AtomicU64,
    }

    impl EndAt {
        const fn look(look: u64) -> Self {
            Self { look, looks: AtomicU64::new(0) }
        }

        fn looks(&self) -> u64 {
            self.looks.load(Ordering::Relaxed)
        }
    }

    impl Progress for EndAt {
        fn stage(&self, _name: &str, _steps: u64) {}

        fn advance(&self, _steps: u64) {}

        fn interrupted(&self) -> bool {
            self.looks.fetch_add(1, Ordering::Relaxed) + 1 >= self.look
        }
    }

    const OPTIONS: RunOptions = RunOptions { seconds: 4.0, rate_hz: 250.0, seed: 3 };

    fn reference() -> Reference {
        Reference::of_motion(Motion::Multisine, OPTIONS.seconds, OPTIONS.seed)
    }

    #[test]
    fn a_simulation_ends_at_the_sample_at_which_it_is_asked_to() {
        let end = EndAt::look(100);
        let failure = run_watched(&test_bench::rig(), &reference(), OPTIONS, &end).unwrap_err();
        assert!(failure.message().contains("ended early as requested"), "{failure}");
        assert_eq!(end.looks(), 100);
    }

    #[test]
    fn a_replay_ends_in_either_pass_when_it_is_asked_to() {
        let mut recording = test_bench::swung(1000);
        recording.set(Channel::Duty, vec![0.1; 1000]);
        recording.set(Channel::BusVoltage, vec![24.0; 1000]);
        for look in [100, 1100] {
            let end = EndAt::look(look);
            let failure = predict_watched(&test_bench::rig(), &recording, &end).unwrap_err();
            assert!(failure.message().contains("ended early as requested"), "{failure}");
            assert!(end.looks() <= look + 2, "{} looks", end.looks());
        }
        let never = EndAt::look(u64::MAX);
        let watched = predict_watched(&test_bench::rig(), &recording, &never).unwrap();
        let plain = predict(&test_bench::rig(), &recording).unwrap();
        assert!(never.looks() > 2000, "{} looks", never.looks());
        assert_eq!(watched.channel(Channel::ThetaOut), plain.channel(Channel::ThetaOut));
    }

    #[test]
    fn a_fit_ends_at_the_simulation_at_which_it_is_asked_to() {
        let recording = run(&test_bench::rig(), &reference(), OPTIONS).unwrap();
        let study = Study::of_bench(test_bench::rig(), vec![recording], Vec::new());
        let never = EndAt::look(u64::MAX);
        recalibrate(&study, &never).unwrap();
        let end = EndAt::look(10);
        let failure = recalibrate(&study, &end).unwrap_err();
        assert!(failure.message().contains("ended early as requested"), "{failure}");
        // The simulations of one set of slopes run side by side; each looks once more.
        assert!(2 * end.looks() < never.looks(), "{} of {} looks", end.looks(), never.looks());
    }
}
