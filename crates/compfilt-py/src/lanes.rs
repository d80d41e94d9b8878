//! Eight sequences of samples side by side in tiles of sixteen rows: turning them, and the filter's own step on them.

use crate::arrays::Scalar;
use crate::simd::{Level, Simd, WIDTH, Wide, dispatch};
use compfilt_core::nalgebra::ComplexField;
use compfilt_core::{Recurrence, State};

/// Rows of a tile. More would let memory wait while the tile is filtered.
pub(crate) const TILE: usize = 16;

/// One sample of each sequence, aligned for the widest registers.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Row<T>(pub(crate) [T; WIDTH]);

/// The samples of a tile, row by row.
pub(crate) type Rows<T> = [Row<T>; TILE];

/// The samples of a tile, sequence by sequence.
pub(crate) type Columns<T> = [[T; TILE]; WIDTH];

/// A tile of zeros.
fn zeros<T: Scalar>() -> Rows<T> {
    [Row([T::zero(); WIDTH]); TILE]
}

/// Both signals of a tile and the levels that come of them.
pub(crate) struct Tile<T, const N: usize> {
    pub(crate) measurement: Rows<T>,
    pub(crate) derivative: Rows<T>,
    pub(crate) levels: [Rows<T>; N],
}

impl<T: Scalar, const N: usize> Tile<T, N> {
    pub(crate) fn new() -> Self {
        Self { measurement: zeros(), derivative: zeros(), levels: [zeros(); N] }
    }

    /// Steps through the first `rows` of the tile from the states in `lanes`, with one set of gains for all rows or one for
    /// each. Level 0 is kept of every row, the others if `all` are wanted.
    pub(crate) fn filter<G: Recurrence<T, N>>(
        &mut self,
        level: Level,
        gains: &[G],
        lanes: &mut [Row<T>; N],
        rows: usize,
        all: bool,
    ) {
        dispatch!(level, simd => steps(simd, self, gains, lanes, rows, all));
    }
}

#[inline(always)]
pub(crate) fn steps<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    _: S,
    tile: &mut Tile<T, N>,
    gains: &[G],
    lanes: &mut [Row<T>; N],
    rows: usize,
    all: bool,
) {
    let mut state = states::<S, T, N>(lanes);
    // Gains that never change are read at every row: the processor waits for the step before, not for them.
    let stride = usize::from(gains.len() > 1);
    for row in 0..rows.min(TILE) {
        let y = T::Wide::<S>::from_array(tile.measurement[row].0);
        let u = T::Wide::<S>::from_array(tile.derivative[row].0);
        gains[row * stride].step(&mut state, y, u);
        tile.levels[0][row] = Row(state.levels[0].to_array());
        if all {
            for level in 1..N {
                tile.levels[level][row] = Row(state.levels[level].to_array());
            }
        }
    }
    keep::<S, T, N>(&state, lanes);
}

/// The states of eight sequences, as the steps take them.
#[inline(always)]
pub(crate) fn states<S: Simd, T: Scalar, const N: usize>(
    lanes: &[Row<T>; N],
) -> State<T::Wide<S>, N> {
    let mut state = State { levels: [T::Wide::<S>::from_array([T::zero(); WIDTH]); N] };
    for (x, lane) in state.levels.iter_mut().zip(lanes) {
        *x = T::Wide::<S>::from_array(lane.0);
    }
    state
}

/// Steps through a sample of each.
#[inline(always)]
pub(crate) fn stepped<S: Simd, T: Scalar, G: Recurrence<T, N>, const N: usize>(
    gains: &G,
    state: &mut State<T::Wide<S>, N>,
    (y, u): (&[T; WIDTH], &[T; WIDTH]),
) -> [T; WIDTH] {
    gains.step(state, T::Wide::<S>::from_array(*y), T::Wide::<S>::from_array(*u)).to_array()
}

/// Keeps the states.
#[inline(always)]
pub(crate) fn keep<S: Simd, T: Scalar, const N: usize>(
    state: &State<T::Wide<S>, N>,
    lanes: &mut [Row<T>; N],
) {
    for (x, lane) in state.levels.iter().zip(lanes) {
        *lane = Row(x.to_array());
    }
}

/// Lays sequences side by side.
pub(crate) fn to_rows<T: Scalar>(level: Level, columns: [&[T; TILE]; WIDTH], rows: &mut Rows<T>) {
    dispatch!(level, simd => turn_in(simd, columns, rows));
}

/// Takes them apart again.
pub(crate) fn to_columns<T: Scalar>(
    level: Level,
    rows: &Rows<T>,
    columns: [&mut [T; TILE]; WIDTH],
) {
    dispatch!(level, simd => turn_out(simd, rows, columns));
}

/// Both halves of each sequence are read before the next one: memory comes in order.
#[inline(always)]
#[allow(clippy::needless_range_loop)] // Several arrays go along with one index.
fn turn_in<S: Simd, T: Scalar>(_: S, columns: [&[T; TILE]; WIDTH], rows: &mut Rows<T>) {
    let mut halves = [[T::Wide::<S>::from_array([T::zero(); WIDTH]); WIDTH]; 2];
    for column in 0..WIDTH {
        for half in 0..2 {
            halves[half][column] = eight::<S, T>(columns[column], half * WIDTH);
        }
    }
    for half in 0..2 {
        let square = transposed::<S, T>(halves[half]);
        for (wide, row) in square.iter().zip(&mut rows[half * WIDTH..]) {
            row.0 = wide.to_array();
        }
    }
}

#[inline(always)]
fn turn_out<S: Simd, T: Scalar>(_: S, rows: &Rows<T>, columns: [&mut [T; TILE]; WIDTH]) {
    let mut halves = [[T::Wide::<S>::from_array([T::zero(); WIDTH]); WIDTH]; 2];
    for half in 0..2 {
        let mut square = halves[half];
        for (wide, row) in square.iter_mut().zip(&rows[half * WIDTH..]) {
            *wide = T::Wide::<S>::from_array(row.0);
        }
        halves[half] = transposed::<S, T>(square);
    }
    for (column, to) in columns.into_iter().enumerate() {
        for half in 0..2 {
            to[half * WIDTH..][..WIDTH].copy_from_slice(&halves[half][column].to_array());
        }
    }
}

/// Eight numbers of a sequence from `start` on.
#[inline(always)]
fn eight<S: Simd, T: Scalar>(sequence: &[T; TILE], start: usize) -> T::Wide<S> {
    let mut values = [T::zero(); WIDTH];
    values.copy_from_slice(&sequence[start..start + WIDTH]);
    T::Wide::<S>::from_array(values)
}

/// Eight rows of eight, turned: three times the perfect shuffle of rows that are four apart.
#[inline(always)]
pub(crate) fn transposed<S: Simd, T: Scalar>(square: [T::Wide<S>; WIDTH]) -> [T::Wide<S>; WIDTH] {
    shuffled::<S, T>(shuffled::<S, T>(shuffled::<S, T>(square)))
}

#[inline(always)]
fn shuffled<S: Simd, T: Scalar>(x: [T::Wide<S>; WIDTH]) -> [T::Wide<S>; WIDTH] {
    [
        x[0].zip_low(x[4]),
        x[0].zip_high(x[4]),
        x[1].zip_low(x[5]),
        x[1].zip_high(x[5]),
        x[2].zip_low(x[6]),
        x[2].zip_high(x[6]),
        x[3].zip_low(x[7]),
        x[3].zip_high(x[7]),
    ]
}

/// Eight rows of eight sequences.
#[inline(always)]
pub(crate) fn square<S: Simd, T: Scalar>(
    columns: &[&[T]; WIDTH],
    start: usize,
) -> [T::Wide<S>; WIDTH] {
    let mut square = [T::Wide::<S>::from_array([T::zero(); WIDTH]); WIDTH];
    for (wide, column) in square.iter_mut().zip(columns) {
        let mut values = [T::zero(); WIDTH];
        values.copy_from_slice(&column[start..start + WIDTH]);
        *wide = T::Wide::<S>::from_array(values);
    }
    transposed::<S, T>(square)
}

/// Columns of zeros.
pub(crate) fn columns_of_zeros<T: Scalar>() -> Columns<T> {
    [[T::zero(); TILE]; WIDTH]
}

/// Whether no number is missing or has overflowed.
pub(crate) fn are_finite<T: Scalar>(numbers: &[T]) -> bool {
    numbers.iter().all(ComplexField::is_finite)
}
