//! Instructions and cycles of functions, interrupts that preempt them left out, and what of them comes from the flash.

use std::collections::BTreeSet;

use crate::accesses::Accesses;

/// Smallest, largest and mean of a count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Smallest.
    pub min: u64,
    /// Largest.
    pub max: u64,
    /// Mean.
    pub mean: f64,
}

/// What calls of a function took, from its first instruction to the one it returns to.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// Demangled name.
    pub function: String,
    /// Address.
    pub address: u32,
    /// Complete calls.
    pub calls: u64,
    /// Instructions of a call.
    pub instructions: Spread,
    /// Cycles of a call: a lower bound, see the crate's documentation.
    pub cycles: Spread,
    /// The call with the largest upper bound of its cycles, where accesses are counted.
    pub worst: Option<WorstCall>,
    /// Items that DMA moved in a call, at most, where accesses are counted.
    pub dma_items: u64,
}

/// The call of a function with the largest upper bound of its cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorstCall {
    /// Instructions.
    pub instructions: u64,
    /// Lower bound of its cycles.
    pub least_cycles: u64,
    /// Upper bound of its cycles: [`Accesses::most_cycles`].
    pub most_cycles: u64,
    /// What the upper bound is made of.
    pub accesses: Accesses,
}

#[derive(Debug, Clone)]
struct Watch {
    address: u32,
    name: String,
    calls: u64,
    /// Minimum, maximum, sum of instructions and of cycles.
    instructions: [u64; 3],
    cycles: [u64; 3],
    worst: Option<WorstCall>,
    dma_items: u64,
}

/// Minimum, maximum and sum before the first call.
const NOTHING: [u64; 3] = [u64::MAX, 0, 0];

/// Counters at a moment.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Moment {
    /// Instructions executed.
    pub instructions: u64,
    /// Cycles passed.
    pub cycles: u64,
    /// Accesses made, where they are counted.
    pub accesses: Option<Accesses>,
}

impl Moment {
    /// Counts from `start` to this moment.
    fn since(self, start: Self) -> Self {
        Self {
            instructions: self.instructions - start.instructions,
            cycles: self.cycles - start.cycles,
            accesses: self.accesses.map(|accesses| accesses - start.accesses.unwrap_or_default()),
        }
    }

    /// Counts of two stretches together.
    fn plus(self, other: Self) -> Self {
        Self {
            instructions: self.instructions + other.instructions,
            cycles: self.cycles + other.cycles,
            accesses: match (self.accesses, other.accesses) {
                (Some(one), Some(two)) => Some(one + two),
                (one, two) => one.or(two),
            },
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Call {
    watch: usize,
    return_address: u32,
    stack_pointer: u32,
    depth: usize,
    start: Moment,
    excluded: Moment,
}

/// Watched functions and calls under way.
#[derive(Debug, Clone, Default)]
pub(crate) struct Measure {
    watches: Vec<Watch>,
    calls: Vec<Call>,
    preempted: Vec<Moment>,
    /// Beginnings of the blocks that calls of watched functions fetched from the flash.
    flash_blocks: BTreeSet<u32>,
    /// What they read from the flash, and the block that read it.
    flash_reads: BTreeSet<(u32, u32)>,
    /// Items that DMA moves at most during a call.
    pub dma_items: u64,
}

impl Measure {
    /// Watches the function `name` at `address`.
    pub(crate) fn watch(&mut self, name: &str, address: u32) {
        if self.watches.iter().all(|watch| watch.address != address) {
            self.watches.push(Watch {
                address,
                name: name.to_owned(),
                calls: 0,
                instructions: NOTHING,
                cycles: NOTHING,
                worst: None,
                dma_items: 0,
            });
        }
    }

    /// Forgets all complete calls.
    pub(crate) fn start_over(&mut self) {
        for watch in &mut self.watches {
            watch.calls = 0;
            (watch.instructions, watch.cycles) = (NOTHING, NOTHING);
            (watch.worst, watch.dma_items) = (None, 0);
        }
        self.flash_blocks.clear();
        self.flash_reads.clear();
    }

    /// Whether anything is watched.
    pub(crate) fn active(&self) -> bool {
        !self.watches.is_empty()
    }

    /// Whether [`Self::block`] wants to hear of a block at `address`.
    pub(crate) fn concerns(&self, address: u32) -> bool {
        self.calls.last().is_some_and(|call| call.return_address == address)
            || self.watches.iter().any(|watch| watch.address == address)
    }

    /// A block begins at `address`, `depth` exceptions deep.
    pub(crate) fn block(&mut self, address: u32, stack_pointer: u32, link: u32, depth: usize, now: Moment) {
        while let Some(call) = self.calls.last().copied() {
            if call.depth != depth || call.return_address != address || stack_pointer < call.stack_pointer {
                break;
            }
            self.calls.pop();
            self.record(call, now);
        }
        if let Some(watch) = self.watches.iter().position(|watch| watch.address == address) {
            let again = self.calls.last().is_some_and(|call| {
                call.watch == watch && call.depth == depth && call.stack_pointer == stack_pointer
            });
            // A loop back to the first instruction is no new call.
            if !again {
                self.calls.push(Call {
                    watch,
                    return_address: link & !1,
                    stack_pointer,
                    depth,
                    start: now,
                    excluded: Moment::default(),
                });
            }
        }
    }

    /// A block at `address` of the flash runs, `depth` exceptions deep.
    pub(crate) fn flash_block(&mut self, address: u32, depth: usize) {
        if self.calls.last().is_some_and(|call| call.depth == depth) {
            self.flash_blocks.insert(address);
        }
    }

    /// What calls of watched functions fetched from the flash: first addresses of the blocks.
    pub(crate) fn flash_blocks(&self) -> impl Iterator<Item = u32> {
        self.flash_blocks.iter().copied()
    }

    /// The block at `block` reads `address` of the flash, `depth` exceptions deep.
    pub(crate) fn flash_read(&mut self, address: u32, block: u32, depth: usize) {
        if self.calls.last().is_some_and(|call| call.depth == depth) {
            self.flash_reads.insert((address, block));
        }
    }

    /// What calls of watched functions read from the flash: addresses, each with the block that read it.
    pub(crate) fn flash_reads(&self) -> impl Iterator<Item = (u32, u32)> {
        self.flash_reads.iter().copied()
    }

    fn record(&mut self, call: Call, now: Moment) {
        let watch = &mut self.watches[call.watch];
        watch.calls += 1;
        let took = now.since(call.start).since(call.excluded);
        let spreads = [(&mut watch.instructions, took.instructions), (&mut watch.cycles, took.cycles)];
        for (spread, took) in spreads {
            *spread = [spread[0].min(took), spread[1].max(took), spread[2] + took];
        }
        if let Some(accesses) = took.accesses {
            let most_cycles = accesses.most_cycles(self.dma_items);
            watch.dma_items = watch.dma_items.max(accesses.dma_items);
            if watch.worst.is_none_or(|worst| worst.most_cycles < most_cycles) {
                let (instructions, least_cycles) = (took.instructions, took.cycles);
                watch.worst = Some(WorstCall { instructions, least_cycles, most_cycles, accesses });
            }
        }
    }

    /// An exception is taken.
    pub(crate) fn enter(&mut self, now: Moment) {
        if self.active() {
            self.preempted.push(now);
        }
    }

    /// The exception at `depth` (1 the outermost) has returned.
    pub(crate) fn leave(&mut self, depth: usize, now: Moment) {
        while let Some(call) = self.calls.last().copied().filter(|call| call.depth >= depth) {
            self.calls.pop();
            self.record(call, now);
        }
        if let Some(start) = self.preempted.pop() {
            for call in self.calls.iter_mut().filter(|call| call.depth + 1 == depth) {
                call.excluded = call.excluded.plus(now.since(start));
            }
        }
    }

    /// Forgets calls under way: the part was reset.
    pub(crate) fn abandon(&mut self) {
        self.calls.clear();
        self.preempted.clear();
    }

    /// Results of all watched functions that were called.
    pub(crate) fn results(&self) -> Vec<Measurement> {
        let spread =
            |[min, max, sum]: [u64; 3], calls: u64| Spread { min, max, mean: sum as f64 / calls as f64 };
        self.watches
            .iter()
            .filter(|watch| watch.calls > 0)
            .map(|watch| Measurement {
                function: watch.name.clone(),
                address: watch.address,
                calls: watch.calls,
                instructions: spread(watch.instructions, watch.calls),
                cycles: spread(watch.cycles, watch.calls),
                worst: watch.worst,
                dma_items: watch.dma_items,
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(instructions: u64, cycles: u64) -> Moment {
        Moment { instructions, cycles, accesses: None }
    }

    #[test]
    fn an_interrupt_inside_a_call_is_left_out() {
        let mut measure = Measure::default();
        measure.watch("f", 0x100);
        measure.block(0x100, 0x2000_1000, 0x201, 0, at(10, 100));
        measure.enter(at(15, 110));
        // The same function in the interrupt has a call of its own.
        measure.block(0x100, 0x2000_0f00, 0x301, 1, at(16, 123));
        measure.block(0x300, 0x2000_0f00, 0, 1, at(20, 130));
        measure.leave(1, at(25, 150));
        measure.block(0x200, 0x2000_1000, 0, 0, at(30, 160));
        let result = &measure.results()[0];
        // In the interrupt 4 instructions and 7 cycles; outside 20 - 10 and 60 - 40.
        assert_eq!(result.calls, 2);
        assert_eq!(result.instructions, Spread { min: 4, max: 10, mean: 7.0 });
        assert_eq!(result.cycles, Spread { min: 7, max: 20, mean: 13.5 });
        measure.start_over();
        assert!(measure.results().is_empty());
        // Outside of a call, inside, and in an interrupt that preempts it.
        measure.flash_block(0x500, 0);
        measure.block(0x100, 0x2000_1000, 0x201, 0, at(40, 200));
        measure.flash_block(0x104, 0);
        measure.flash_block(0x600, 1);
        measure.block(0x200, 0x2000_1000, 0, 0, at(45, 208));
        measure.flash_block(0x200, 0);
        assert!(measure.flash_blocks().eq([0x104]));
        measure.start_over();
        assert_eq!(measure.flash_blocks().count(), 0);
        measure.block(0x100, 0x2000_1000, 0x201, 0, at(40, 200));
        measure.block(0x200, 0x2000_1000, 0, 0, at(45, 208));
        let result = &measure.results()[0];
        assert_eq!((result.calls, result.instructions.min, result.cycles.max), (1, 5, 8));
    }

    #[test]
    fn a_handler_ends_with_its_exception() {
        let mut measure = Measure::default();
        measure.watch("handler", 0x400);
        measure.enter(at(0, 0));
        measure.block(0x400, 0x2000_1000, 0xffff_fff9, 1, at(0, 12));
        measure.leave(1, at(50, 92));
        assert_eq!(measure.results()[0].cycles.max, 80);
    }
}
