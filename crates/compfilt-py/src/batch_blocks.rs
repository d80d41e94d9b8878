use crate::arrays::Scalar;
use crate::batch::{Block, Channel, Filter};
use compfilt_core::Discretise;
use std::num::NonZeroUsize;
pub(crate) fn pays<T: Scalar>(_: &Block<'_, T>) -> bool { false }
pub(crate) fn run_blocks<T: Scalar, D: Discretise<T, N>, const N: usize>(_: &Filter<T, D>, _: &D::Gains, _: &mut [Channel<T, N>], _: Block<'_, T>, _: NonZeroUsize) {}
