//! Up to eight channels of an array at any strides, to and from tiles.

use crate::arrays::Scalar;
use crate::lanes::{Rows, TILE, columns_of_zeros, to_columns, to_rows};
use crate::simd::{Level, WIDTH};
use numpy::ndarray::{ArrayView2, ArrayViewMut2, Axis, Slice};
use std::ops::Range;

/// Rows of a turn where channels lie in one piece each.
const PIECE: usize = 2048;

/// Most rows of a turn where they do not: a sample that is missing sends its channel's turn the careful way.
const MOST: usize = 1024;

/// Bytes of each array in a turn where memory comes in order.
const IN_ORDER: usize = 1 << 20;

/// Bytes of each array in a turn where every eight channels go through all rows: they fit into the second cache.
const BY_EIGHT: usize = 1 << 16;

/// Rows of a turn.
pub(crate) fn turn_of<T: Scalar>(view: ArrayView2<'_, T>, all: bool) -> usize {
    if view.strides()[0] == 1 {
        return PIECE;
    }
    let bytes = if view.strides()[1] == 1 && !all { IN_ORDER } else { BY_EIGHT };
    let row = view.ncols().max(1) * size_of::<T>();
    (bytes / row / TILE * TILE).clamp(TILE, MOST)
}

/// What a tile is read from. What lies beyond its rows and channels keeps its numbers.
pub(crate) enum Source<'a, T> {
    /// Eight channels, each in one piece: every one is its own stream of memory.
    Columns([&'a [T]; WIDTH]),
    /// The channels of a sample side by side.
    Rows(ArrayView2<'a, T>),
    /// Any other strides.
    Strided(ArrayView2<'a, T>),
}

impl<'a, T: Scalar> Source<'a, T> {
    pub(crate) fn of(view: ArrayView2<'a, T>) -> Self {
        if view.strides()[1] == 1 {
            return Self::Rows(view);
        }
        if view.ncols() == WIDTH && view.strides()[0] == 1 {
            let column = |c| view.index_axis_move(Axis(1), c).to_slice().unwrap_or_default();
            return Self::Columns(std::array::from_fn(column));
        }
        Self::Strided(view)
    }

    pub(crate) fn read(&self, level: Level, rows: Range<usize>, tile: &mut Rows<T>) {
        match self {
            Self::Columns(columns) => {
                let mut short = columns_of_zeros();
                let mut chunks = short.each_ref();
                if rows.len() == TILE {
                    for (chunk, column) in chunks.iter_mut().zip(columns) {
                        let Some(whole) = column[rows.start..].first_chunk() else { return };
                        *chunk = whole;
                    }
                } else {
                    for (short, column) in short.iter_mut().zip(columns) {
                        short[..rows.len()].copy_from_slice(&column[rows.clone()]);
                    }
                    chunks = short.each_ref();
                }
                to_rows(level, chunks, tile);
            }
            Self::Rows(view) => {
                let view = view.slice_axis(Axis(0), Slice::from(rows));
                for (row, source) in tile.iter_mut().zip(view.outer_iter()) {
                    let source = source.to_slice().unwrap_or_default();
                    match source.first_chunk() {
                        Some(whole) => row.0 = *whole,
                        None => row.0[..source.len()].copy_from_slice(source),
                    }
                }
            }
            Self::Strided(view) => {
                let view = view.slice_axis(Axis(0), Slice::from(rows));
                for (row, source) in tile.iter_mut().zip(view.outer_iter()) {
                    for (to, from) in row.0.iter_mut().zip(source) {
                        *to = *from;
                    }
                }
            }
        }
    }
}

/// What a tile is written to.
pub(crate) enum Target<'a, T> {
    /// Eight channels, each in one piece.
    Columns([&'a mut [T]; WIDTH]),
    /// The channels of a sample side by side.
    Rows(ArrayViewMut2<'a, T>),
    /// Any other strides.
    Strided(ArrayViewMut2<'a, T>),
}

impl<'a, T: Scalar> Target<'a, T> {
    pub(crate) fn of(view: ArrayViewMut2<'a, T>) -> Self {
        if view.strides()[1] == 1 {
            return Self::Rows(view);
        }
        if view.ncols() == WIDTH && view.strides()[0] == 1 {
            return Self::Columns(slices(view));
        }
        Self::Strided(view)
    }

    pub(crate) fn write(&mut self, level: Level, rows: Range<usize>, tile: &Rows<T>) {
        match self {
            Self::Columns(columns) => {
                if rows.len() == TILE {
                    let chunks = columns
                        .each_mut()
                        .map(|column| column[rows.start..].first_chunk_mut::<TILE>());
                    let [Some(a), Some(b), Some(c), Some(d), Some(e), Some(f), Some(g), Some(h)] =
                        chunks
                    else {
                        return;
                    };
                    to_columns(level, tile, [a, b, c, d, e, f, g, h]);
                } else {
                    let mut short = columns_of_zeros();
                    to_columns(level, tile, short.each_mut());
                    for (column, short) in columns.iter_mut().zip(&short) {
                        column[rows.clone()].copy_from_slice(&short[..rows.len()]);
                    }
                }
            }
            Self::Rows(view) => {
                let mut view = view.slice_axis_mut(Axis(0), Slice::from(rows));
                for (row, mut target) in tile.iter().zip(view.outer_iter_mut()) {
                    let target = target.as_slice_mut().unwrap_or_default();
                    match target.first_chunk_mut() {
                        Some(whole) => *whole = row.0,
                        None => target.copy_from_slice(&row.0[..target.len()]),
                    }
                }
            }
            Self::Strided(view) => {
                let mut view = view.slice_axis_mut(Axis(0), Slice::from(rows));
                for (row, target) in tile.iter().zip(view.outer_iter_mut()) {
                    for (to, from) in target.into_iter().zip(&row.0) {
                        *to = *from;
                    }
                }
            }
        }
    }
}

/// The columns of a view, each as a slice of its own.
fn slices<T>(view: ArrayViewMut2<'_, T>) -> [&mut [T]; WIDTH] {
    let mut rest = Some(view);
    std::array::from_fn(|_| {
        let Some(view) = rest.take().filter(|view| view.ncols() > 0) else {
            return Default::default();
        };
        let (column, later) = view.split_at(Axis(1), 1);
        rest = Some(later);
        column.index_axis_move(Axis(1), 0).into_slice().unwrap_or_default()
    })
}
