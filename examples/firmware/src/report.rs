//! Runs a filter over the recording and writes down all that came out and what it cost.

use crate::host::File;
use crate::meter::{Meter, Stack};
use crate::recording::SAMPLES;

/// The report as a file of the host: for every filter a head, then its outputs sample by sample; little-endian.
pub struct Report {
    file: File,
    meter: Meter,
}

/// The last samples, over which the mean is taken: by then every filter's start is over.
const SETTLED: usize = 4096;

/// What the head says of a filter.
struct Head {
    name: [u8; 32],
    /// How many outputs a sample has, bytes of state, bytes of stack, the most instructions of a sample, and those of the last samples.
    numbers: [u32; 5],
}

impl Report {
    pub fn new(name: &[u8]) -> Option<Self> {
        Some(Self { file: File::create(name)?, meter: Meter::start() })
    }

    /// One filter: the function that is its step, its state at the start, the input of a sample, the call of the step, and what
    /// is to be compared. Only the function counts.
    #[inline(never)]
    pub fn run<F: Copy, S: Copy, I, O, const N: usize>(
        &self,
        name: &str,
        function: F,
        start: S,
        input: impl Fn(usize) -> I,
        step: impl Fn(F, &mut S, &I) -> O,
        outputs: impl Fn(&S, O) -> [f32; N],
    ) -> Option<()> {
        let (mut stack, mut most, mut settled) = (Stack::painted(), 0, 0);
        let mut state = start;
        for n in 0..SAMPLES {
            let (input, mut copy) = (input(n), state);
            stack.measure(|| {
                step(function, &mut copy, &input);
            });
            let (_, count) =
                self.meter.instructions(function, |timed| step(timed, &mut state, &input));
            most = most.max(count);
            if n + SETTLED >= SAMPLES {
                settled += count;
            }
        }
        let mut head = Head { name: [0; 32], numbers: [0; 5] };
        for (place, letter) in head.name.iter_mut().zip(name.bytes()) {
            *place = letter;
        }
        head.numbers = [N as u32, size_of::<S>() as u32, stack.bytes(), most, settled];
        self.write(&head)?;
        // The same once more, for the outputs.
        let mut state = start;
        for n in 0..SAMPLES {
            let output = step(function, &mut state, &input(n));
            self.bytes(outputs(&state, output).map(f32::to_le_bytes).as_flattened())?;
        }
        Some(())
    }

    fn write(&self, head: &Head) -> Option<()> {
        self.bytes(&head.name)?;
        head.numbers.iter().try_for_each(|number| self.bytes(&number.to_le_bytes()))
    }

    fn bytes(&self, bytes: &[u8]) -> Option<()> {
        self.file.write(bytes).then_some(())
    }
}
