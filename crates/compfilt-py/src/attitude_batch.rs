//! The loops of the attitude filters.

use crate::arrays::Scalar;
use crate::batch::Steps;
use crate::state::Numbers;
use crate::tilt::vector;
use compfilt_core::Dt;
use compfilt_core::attitude::Rotation;
use compfilt_core::linear::Flags;
use compfilt_core::nalgebra::{Matrix3, Vector3};
use numpy::ndarray::{ArrayView2, ArrayViewMut1, ArrayViewMut2};

/// A block of samples of an attitude filter, and where the results go.
pub(crate) struct Block<'a, T> {
    pub(crate) gyr: ArrayView2<'a, T>,
    pub(crate) acc: ArrayView2<'a, T>,
    pub(crate) mag: Option<ArrayView2<'a, T>>,
    pub(crate) steps: Steps<'a, T>,
    pub(crate) quaternion: ArrayViewMut2<'a, T>,
    pub(crate) up: ArrayViewMut2<'a, T>,
    pub(crate) bias: ArrayViewMut2<'a, T>,
    pub(crate) at_rest: ArrayViewMut1<'a, bool>,
    pub(crate) flags: ArrayViewMut1<'a, u8>,
}

/// What a filter knows after a sample.
pub(crate) struct Output<T> {
    pub(crate) rotation: Rotation<T>,
    pub(crate) up: Vector3<T>,
    pub(crate) bias: Vector3<T>,
    pub(crate) at_rest: bool,
}

/// An attitude filter bound to its state.
pub(crate) trait Filter<T: Scalar>: Send + Sync {
    /// Takes the gains of a time step, or those of the sample period.
    fn follow(&mut self, dt: Option<Dt<T>>);
    fn sample(&mut self, gyr: &Vector3<T>, acc: &Vector3<T>, mag: Option<&Vector3<T>>) -> Flags;
    /// `None` before the start.
    fn output(&self) -> Option<Output<T>>;
    /// The gyro's sensitivity errors, where the filter learns them.
    fn calibration(&self) -> Option<Matrix3<T>> {
        None
    }

    /// The delay that it works with in s, where it learns that.
    fn delay(&self) -> Option<T> {
        None
    }

    fn store(&self) -> Numbers;
    fn restore(&mut self, numbers: &Numbers) -> bool;
    fn reset(&mut self, attitude: Option<Rotation<T>>);
}

/// The same for any filter behind one pointer.
pub(crate) trait Runner<T: Scalar>: Filter<T> {
    fn block(&mut self, block: Block<'_, T>);
}

impl<T: Scalar, F: Filter<T>> Runner<T> for F {
    fn block(&mut self, mut block: Block<'_, T>) {
        if let Steps::Uniform = block.steps {
            self.follow(None);
        }
        for row in 0..block.gyr.nrows() {
            let mut flags = Flags::default();
            if let Steps::Each(steps) = block.steps {
                if !steps[row].is_finite() {
                    self.reset(None);
                    flags |= Flags::RESTARTED;
                }
                self.follow(Dt::new(steps[row].finite_or(T::zero())).ok());
            }
            let mag = block.mag.as_ref().map(|mag| vector(mag.row(row)));
            flags |=
                self.sample(&vector(block.gyr.row(row)), &vector(block.acc.row(row)), mag.as_ref());
            block.flags[row] = flags.bits();
            block.write(row, self.output());
        }
    }
}

impl<T: Scalar> Block<'_, T> {
    /// The same block for another pass.
    pub(crate) fn reborrow(&mut self) -> Block<'_, T> {
        Block {
            gyr: self.gyr.reborrow(),
            acc: self.acc.reborrow(),
            mag: self.mag.as_ref().map(|mag| mag.reborrow()),
            steps: self.steps,
            quaternion: self.quaternion.view_mut(),
            up: self.up.view_mut(),
            bias: self.bias.view_mut(),
            at_rest: self.at_rest.view_mut(),
            flags: self.flags.view_mut(),
        }
    }

    pub(crate) fn write_attitude(&mut self, row: usize, rotation: &Rotation<T>, up: &Vector3<T>) {
        self.quaternion[(row, 0)] = rotation.w;
        for axis in 0..3 {
            self.quaternion[(row, axis + 1)] = rotation.v[axis];
            self.up[(row, axis)] = up[axis];
        }
    }

    pub(crate) fn write_bias(&mut self, row: usize, bias: &Vector3<T>) {
        for axis in 0..3 {
            self.bias[(row, axis)] = bias[axis];
        }
    }

    fn write(&mut self, row: usize, output: Option<Output<T>>) {
        let nothing = Vector3::from_element(T::NAN);
        let unknown = Rotation { w: T::NAN, v: nothing };
        match output {
            Some(Output { rotation, up, bias, at_rest }) => {
                self.write_attitude(row, &rotation, &up);
                self.write_bias(row, &bias);
                self.at_rest[row] = at_rest;
            }
            None => self.write_attitude(row, &unknown, &nothing),
        }
    }
}
