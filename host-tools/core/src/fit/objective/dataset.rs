//! One recording, prepared for comparison: what goes into its replays, what they are compared with, and over which blocks.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use bowden_model::channel::Channel;

use super::block::{Block, Moments, moments_of};
use super::blockwise::Blockwise;
use super::memory::{Memory, Seen};
use super::{Part, Series};
use crate::fit::variation::Variation;
use crate::joint_model::{Drive, JointModel};
use crate::outcome::Failure;
use crate::recording::Recording;
use crate::simulation::{Passes, Prediction, ReplayInput, replay_of, replay_passes_into};

/// Length of a block of means, s.
const BLOCK_S: f64 = 0.05;

/// Length of a block of flutter, s.
const FLUTTER_S: f64 = 0.5;

/// Time at the start of each recording, and after a gap in it, that is not compared, s: how it came there is not known.
const LEAD_IN_S: f64 = 0.3;

/// Travel of the input after a gap from which on its history no longer matters, in dead zones: one turns all friction round where the load stays.
const DEAD_ZONES_AFTER_GAP: f64 = 2.0;

/// The same as a part of the range of the recording, where that is less: in a motion within the dead zone no friction turns round as a whole, and the
/// recording would end with its first gap.
const RANGE_AFTER_GAP: f64 = 0.5;

/// Length of the stretches that are held out, or confirm, in turn, s.
const STRETCH_S: f64 = 1.0;

/// Samples on zero from which on an amplifier of tension is taken to have stood at its end.
const SAMPLES_AT_ZERO: usize = 20;

/// The recording.
#[derive(Clone, Debug)]
pub(super) struct Dataset {
    /// Index of its bench.
    pub(super) bench: u16,
    /// What is different in it; `None` where its joint is the shared one.
    variation: Option<Variation>,
    /// Outputs whose zero is arbitrary.
    pub(super) free_offsets: Vec<Channel>,
    pub(super) input: ReplayInput,
    /// What replays predict: the measured channels, and the current of the motor, which heats it.
    pub(super) outputs: Vec<Channel>,
    pub(super) measured: Vec<(Series, Arc<Vec<f64>>)>,
    /// Moments of every series of `measured` over every block: a fit compares with them thousands of times.
    pub(super) moments: Vec<Vec<Moments>>,
    pub(super) blocks: Vec<Block>,
    /// Groups of consecutive blocks, as ranges into `blocks`.
    flutter: Vec<Range<usize>>,
    /// Tensions that stood at the lower end of their amplifier.
    pub(super) cut_at_zero: Vec<Channel>,
    /// What is not compared because it follows a gap, in one line.
    pub(super) note: Option<String>,
    /// Whether nothing guides its replays but what its inputs name.
    runs_freely: bool,
    /// Of these inputs, outputs and blocks, of which only the use may change after the first replay.
    memory: Memory,
}

impl Dataset {
    /// The joint of this recording, where all recordings share `model`.
    pub(super) fn joint<'m>(&self, model: &'m JointModel) -> Cow<'m, JointModel> {
        let joint = match &self.variation {
            Some(variation) => Cow::Owned(variation.apply(model)),
            None => Cow::Borrowed(model),
        };
        if self.runs_freely && joint.guided_by.is_some() {
            return Cow::Owned(JointModel { guided_by: None, ..joint.into_owned() });
        }
        joint
    }

    /// The same recording, with replays that nothing guides but what its inputs name.
    pub(super) fn freely(&self) -> Self {
        let mut free = Self { runs_freely: true, ..self.clone() };
        if let Some(place) = free.measured.iter().position(|(series, _)| *series == Series::Guide) {
            free.measured.remove(place);
            free.moments.remove(place);
        }
        free
    }

    /// Groups of blocks over which the flutter of a series is compared. Of what guides a joint without tendons it is the answer to single counts
    /// of the encoder, and says nothing of the joint.
    pub(super) fn flutter_of(&self, series: Series) -> &[Range<usize>] {
        let says_nothing = series == Series::Guide && self.input.driven_nm().is_some();
        if says_nothing { &[] } else { &self.flutter }
    }

    /// Whether anything is fitted to it.
    pub(super) fn is_fitted(&self) -> bool {
        self.blocks.iter().any(|block| block.part == Part::Training)
    }

    /// Whether something was different in this recording.
    pub(super) fn states_conditions(&self) -> bool {
        self.variation.as_ref().is_some_and(Variation::states_conditions)
    }

    /// Whether the bench stood at `time_s` of its clock during this recording.
    pub(super) fn runs_through(&self, time_s: f64) -> bool {
        let [start_s, end_s] = self.input.clock_s();
        (start_s..end_s).contains(&time_s)
    }

    /// Moments of what the sensors of this recording would have shown of `model`, in every series of `measured`, by some passes of a
    /// replay.
    pub(super) fn seen(&self, model: &JointModel, passes: Passes) -> Result<Arc<Seen>, Failure> {
        let joint = self.joint(model);
        if let Some(seen) = self.memory.recall(&joint, passes) {
            return Ok(seen);
        }
        let mut seen = Blockwise::new(self);
        replay_passes_into(passes, &joint, &self.input, &self.outputs, &mut seen)?;
        let seen = Arc::new(seen.simulated);
        self.memory.keep(joint.into_owned(), passes, &seen);
        Ok(seen)
    }

    /// What the sensors of this recording would have shown of `model`.
    pub(super) fn replay(&self, model: &JointModel) -> Result<Prediction, Failure> {
        let mut prediction = replay_of(&self.joint(model), &self.input, &self.outputs)?;
        for (channel, values) in prediction.channels_mut() {
            self.cut(channel, values);
        }
        Ok(prediction)
    }

    /// The same without a guide; `None` where nothing guides it but what its inputs name.
    pub(super) fn replay_freely(&self, model: &JointModel) -> Result<Option<Prediction>, Failure> {
        let joint = self.joint(model);
        if joint.guided_by.is_none() {
            return Ok(None);
        }
        let free = JointModel { guided_by: None, ..joint.into_owned() };
        replay_of(&free, &self.input, &self.outputs).map(Some)
    }

    /// What an amplifier shows that stands at its end.
    pub(super) fn cut(&self, channel: Channel, values: &mut [f64]) {
        if self.cut_at_zero.contains(&channel) {
            for value in values {
                *value = value.max(0.0);
            }
        }
    }

    /// Moments of a series as predicted.
    pub(super) fn moments_in(&self, prediction: &Prediction, series: Series) -> Vec<Moments> {
        moments_of(series.of(prediction).unwrap_or_default(), &self.blocks)
    }

    /// Prepares a recording; `shared` is the joint that all recordings share.
    pub(super) fn new(
        shared: &JointModel,
        recording: &Recording,
        variation: Option<Variation>,
        part: Part,
        split: bool,
    ) -> Result<Self, Failure> {
        let model = variation.as_ref().map_or(shared, Variation::base);
        let mut input = ReplayInput::new(model, recording)?;
        if input.motion().is_none()
            && let Some(theta) = recording.channel(Channel::ThetaIn).or(recording.channel(Channel::ThetaOut))
        {
            input.start_at(theta[0], 0.0);
        }
        let mut measured: Vec<(Series, Arc<Vec<f64>>)> = model
            .outputs
            .iter()
            .filter_map(|channel| recording.shared(*channel).map(|v| (Series::Channel(*channel), v)))
            .collect();
        let is_kept =
            |channel: &&Channel| **channel == Channel::MotorCurrent || recording.channel(**channel).is_some();
        let outputs = model.outputs.iter().filter(is_kept).copied().collect();
        if model.drive()? == Drive::GuidedMotor {
            measured.push((Series::Guide, Arc::new(vec![0.0; recording.len()])));
        }
        let t_s = input.t_s();
        let mut blocks: Vec<Block> = Vec::new();
        let mut start =
            t_s.partition_point(|t| t - t_s[0] < LEAD_IN_S.min(0.1 * (t_s[t_s.len() - 1] - t_s[0])));
        // What happened in a gap is not known, as at the start; within a block it is as good as none.
        let gap_s = recording.gap_s().map_or(f64::INFINITY, |gap_s| gap_s.max(BLOCK_S));
        let follows_gap = |sample: usize| sample > 0 && t_s[sample] - t_s[sample - 1] > gap_s;
        // A joint that stands behind a gap keeps what friction held there, until it has travelled.
        let travel_rad = input.motion().map_or(0.0, |motion| {
            let [lowest, highest] = motion.range_rad();
            (DEAD_ZONES_AFTER_GAP * model.dead_zone_rad()).min(RANGE_AFTER_GAP * (highest - lowest))
        });
        let angle_rad = |sample: usize| input.motion().map_or(0.0, |motion| motion.theta_rad[sample]);
        let resumes = |gap: usize| {
            let (mut behind, mut has_travelled) = (gap, false);
            (gap..t_s.len()).find(|&sample| {
                // Another gap begins the wait anew.
                if follows_gap(sample) {
                    (behind, has_travelled) = (sample, false);
                }
                has_travelled |= (angle_rad(sample) - angle_rad(behind)).abs() >= travel_rad;
                has_travelled && t_s[sample] - t_s[behind] >= LEAD_IN_S
            })
        };
        let mut behind_gaps_s = 0.0;
        while start < t_s.len() {
            if follows_gap(start) {
                let resumed = resumes(start);
                behind_gaps_s += t_s[resumed.unwrap_or(t_s.len() - 1)] - t_s[start];
                let Some(resumed) = resumed else { break };
                start = resumed;
            }
            let end = (start + 1).max(t_s.partition_point(|t| t - t_s[start] < BLOCK_S - 1e-9));
            let stretch = ((t_s[start] - t_s[0]) / STRETCH_S) as usize;
            let held = split && stretch % 3 == 2;
            let stretch = match (split, held) {
                (false, _) => stretch,
                (true, false) => 2 * (stretch / 3) + stretch % 3,
                (true, true) => stretch / 3,
            };
            let part = if held { Part::HeldOut } else { part };
            blocks.push(Block { start, end, part, stretch });
            start = end;
        }
        let mut flutter: Vec<Range<usize>> = Vec::new();
        for (index, block) in blocks.iter().enumerate() {
            match flutter.last_mut() {
                Some(group)
                    if blocks[group.start].part == block.part
                        && t_s[block.end - 1] - t_s[blocks[group.start].start] < FLUTTER_S =>
                {
                    group.end = index + 1;
                }
                _ => flutter.push(index..index + 1),
            }
        }
        let moments = measured.iter().map(|(_, values)| moments_of(values, &blocks)).collect();
        let cut_at_zero = Channel::TENSIONS
            .into_iter()
            .filter(|channel| recording.channel(*channel).is_some_and(stood_at_zero))
            .collect();
        let free_offsets = model.free_offsets.clone();
        Ok(Self {
            bench: 0,
            variation,
            free_offsets,
            input,
            outputs,
            measured,
            moments,
            blocks,
            flutter,
            cut_at_zero,
            note: (behind_gaps_s > 0.0).then(|| {
                format!(
                    "{}: {behind_gaps_s:.2} of {:.2} s follow gaps and are not compared: what friction held there is not known until \
                     {LEAD_IN_S} s have passed and the input has turned by {travel_rad:.4} rad",
                    recording.source(),
                    recording.duration_s()
                )
            }),
            runs_freely: false,
            memory: Memory::default(),
        })
    }
}

/// Whether a sensor that reads from zero stood there: often exactly zero and never less.
fn stood_at_zero(values: &[f64]) -> bool {
    values.iter().all(|value| *value >= 0.0)
        && values.iter().filter(|value| **value == 0.0).count() >= SAMPLES_AT_ZERO
}
