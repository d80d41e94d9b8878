//! A recording of an attitude filter's signals, and where its results go.

use crate::arrays::Scalar;
use crate::attitude_family::{Output, Sample};
use crate::batch::Steps;
use compfilt_core::attitude::Rotation;
use compfilt_core::linear::Flags;
use compfilt_core::nalgebra::Vector3;
use numpy::ndarray::{ArrayView2, s};
use std::ops::Range;

/// Rows of three numbers at any stride. Those that do not lie side by side are copied as they are needed, a few at a time.
pub(crate) struct Rows<'a, T> {
    view: ArrayView2<'a, T>,
    copy: Vec<[T; 3]>,
}

impl<'a, T: Scalar> Rows<'a, T> {
    pub(crate) fn new(view: ArrayView2<'a, T>) -> Self {
        Self { view, copy: Vec::new() }
    }

    fn get(&mut self, rows: Range<usize>) -> &[[T; 3]] {
        if let Some(numbers) = self.view.as_slice() {
            return &numbers.as_chunks().0[rows];
        }
        let part = self.view.slice(s![rows, ..]);
        self.copy.clear();
        self.copy.extend(part.rows().into_iter().map(|row| [row[0], row[1], row[2]]));
        &self.copy
    }
}

/// A recording, and where the results go.
pub(crate) struct Log<'a, T> {
    pub(crate) gyr: Rows<'a, T>,
    pub(crate) acc: Rows<'a, T>,
    pub(crate) mag: Option<Rows<'a, T>>,
    pub(crate) steps: Steps<'a, T>,
    pub(crate) quaternion: &'a mut [[T; 4]],
    pub(crate) up: &'a mut [[T; 3]],
    pub(crate) bias: &'a mut [[T; 3]],
    pub(crate) at_rest: &'a mut [bool],
    pub(crate) flags: &'a mut [u8],
}

/// Some rows of a recording.
pub(crate) struct Part<'a, T> {
    pub(crate) gyr: &'a [[T; 3]],
    pub(crate) acc: &'a [[T; 3]],
    pub(crate) mag: Option<&'a [[T; 3]]>,
    pub(crate) steps: Option<&'a [T]>,
    pub(crate) quaternion: &'a mut [[T; 4]],
    pub(crate) up: &'a mut [[T; 3]],
    pub(crate) bias: &'a mut [[T; 3]],
    pub(crate) at_rest: &'a mut [bool],
    pub(crate) flags: &'a mut [u8],
    /// Nobody's: to fill a lane.
    pub(crate) is_spare: bool,
}

impl<T: Scalar> Log<'_, T> {
    /// The number of samples.
    pub(crate) fn len(&self) -> usize {
        self.flags.len()
    }

    pub(crate) fn part(&mut self, rows: Range<usize>) -> Part<'_, T> {
        let steps = match self.steps {
            Steps::Uniform => None,
            Steps::Each(steps) => Some(&steps[rows.clone()]),
        };
        Part {
            gyr: self.gyr.get(rows.clone()),
            acc: self.acc.get(rows.clone()),
            mag: self.mag.as_mut().map(|mag| mag.get(rows.clone())),
            steps,
            quaternion: &mut self.quaternion[rows.clone()],
            up: &mut self.up[rows.clone()],
            bias: &mut self.bias[rows.clone()],
            at_rest: &mut self.at_rest[rows.clone()],
            flags: &mut self.flags[rows],
            is_spare: false,
        }
    }
}

impl<T: Scalar> Part<'_, T> {
    pub(crate) fn len(&self) -> usize {
        self.flags.len()
    }

    pub(crate) fn sample(&self, row: usize) -> Sample<T> {
        let mag = self.mag.map(|mag| Vector3::from(mag[row]));
        Sample { gyr: self.gyr[row].into(), acc: self.acc[row].into(), mag }
    }

    pub(crate) fn write_attitude(&mut self, row: usize, rotation: &Rotation<T>, up: &Vector3<T>) {
        let (w, v) = (rotation.w, rotation.v);
        self.quaternion[row] = [w, v.x, v.y, v.z];
        self.up[row] = (*up).into();
    }

    pub(crate) fn write(&mut self, row: usize, flags: Flags, output: &Output<T>) {
        self.flags[row] = flags.bits();
        if output.started {
            self.write_attitude(row, &output.rotation, &output.up);
            self.bias[row] = output.bias.into();
            self.at_rest[row] = output.at_rest;
        } else {
            (self.quaternion[row], self.up[row]) = ([T::NAN; 4], [T::NAN; 3]);
            (self.bias[row], self.at_rest[row]) = ([T::zero(); 3], false);
        }
    }
}
