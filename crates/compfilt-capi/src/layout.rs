//! The fields of C's structs are the core's: by name, by order, and by value.

use crate::border::Mirror;
use crate::calibrating::{Calibrating, CalibratingState};
use crate::gravity::{Gravity, GravityState};
use crate::linear::{Filter1, Filter2, Filter3};
use crate::mahony::{Mahony, MahonyState};
use crate::rate::RateState;
use core::mem::offset_of;
use std::fmt::Debug;
use std::format;
use std::string::String;
use std::vec::Vec;

/// The numbers of a struct, each with the name of its field; a `bool` or an `enum` counts as 0.
fn fields(debug: &str) -> Vec<String> {
    let mut name = "";
    let mut named = Vec::new();
    for word in debug.split(|c: char| c.is_whitespace() || "{}[](),".contains(c)) {
        if word.ends_with(':') {
            name = word;
        } else if let "false" | "Sample" | "Explicit" = word {
            named.push(format!("{name}0"));
        } else if let Ok(number) = word.parse::<f32>() {
            named.push(format!("{name}{number}"));
        }
    }
    named
}

/// Puts another number into every word of a struct of C but for `zeros`, and looks at it from both sides.
fn compare<M: Mirror + Debug>(zeros: &[usize], finish: impl FnOnce(&mut M))
where
    M::Core: Debug,
{
    // SAFETY: every struct of C is made of numbers, for which zero is one.
    let mut mirror: M = unsafe { core::mem::zeroed() };
    let words = core::ptr::from_mut(&mut mirror).cast::<f32>();
    for word in (0..size_of::<M>() / 4).filter(|word| !zeros.contains(&(4 * word))) {
        let number = f32::from(u16::try_from(word).unwrap_or_default()) + 1.0;
        // SAFETY: the word is one of the struct's, which has the alignment of a word at least.
        unsafe { words.add(word).write(number) };
    }
    finish(&mut mirror);
    let core = mirror.core().unwrap_or_else(|status| panic!("{status:?}"));
    let (of_c, of_core) = (fields(&format!("{mirror:?}")), fields(&format!("{core:?}")));
    assert!(of_c.len() > 4);
    assert_eq!(of_c, of_core);
}

#[test]
fn linear_filters() {
    compare::<Filter1>(&[offset_of!(Filter1, input)], |_| {});
    compare::<Filter2>(&[offset_of!(Filter2, input)], |_| {});
    compare::<Filter3>(&[offset_of!(Filter3, input)], |_| {});
    compare::<RateState>(&[], |_| {});
}

#[test]
fn attitude_filters() {
    compare::<Mahony>(&[offset_of!(Mahony, form)], |_| {});
    compare::<Calibrating>(&[], |_| {});
    let split = offset_of!(Gravity, filter.split);
    // On a host with 64 bits `split` has two words, and padding follows the settings.
    compare::<Gravity>(&[split, split + 4], |filter| filter.filter.split = 1);
}

#[test]
fn attitude_states() {
    compare::<MahonyState>(&[offset_of!(MahonyState, started)], |_| {});
    let zeros = [
        offset_of!(GravityState, rest.begun),
        offset_of!(GravityState, heading.known),
        offset_of!(GravityState, started),
    ];
    compare::<GravityState>(&zeros, |_| {});
    let zeros = [
        offset_of!(CalibratingState, rest.begun),
        offset_of!(CalibratingState, heading.known),
        offset_of!(CalibratingState, started),
    ];
    compare::<CalibratingState>(&zeros, |_| {});
}

#[test]
fn a_byte_that_is_no_bool_is_refused() {
    // SAFETY: as above.
    let mut state: MahonyState = unsafe { core::mem::zeroed() };
    assert!(state.core().is_ok());
    state.heading_known = 2;
    assert!(state.core().is_err() && state.core_mut().is_err());
}
