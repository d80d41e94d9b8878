//! What the steps are written in: the two scalar types as numbers.

mod common;

use common::bits;
use compfilt_core::{FlagSet, Flags, Mask, Number, Real};
use proptest::prelude::{ProptestConfig, any};
use proptest::{prop_assert, prop_assert_eq, proptest};

/// Of every sign and size, subnormal ones too, and what is no number.
fn catalogue<T: Real>() -> Vec<T> {
    let sizes = [0.0, 5e-324, 1e-45, 1e-40, 1e-30, 0.1, 1.0, 3.0, 1e30, 3e38, 1e308, f64::INFINITY];
    let mut numbers: Vec<T> =
        sizes.into_iter().flat_map(|size| [T::literal(size), T::literal(-size)]).collect();
    numbers.push(T::NAN);
    numbers
}

/// How far `root` is from `1/√x`, as a share of it. The products' rounding errors are counted, so that it is exact enough.
fn root_error(x: f64, root: f64) -> f64 {
    let square = root * root;
    let square_error = root.mul_add(root, -square);
    let product = x * square;
    let product_error = x.mul_add(square, -product);
    (((1.0 - product) - product_error) - x * square_error).abs() / 2.0
}

fn check_root_single(x: f32) {
    let root = x.reciprocal_root();
    let unit = f64::from(root.next_up()) - f64::from(root);
    let error = root_error(f64::from(x), f64::from(root)) * f64::from(root) / unit;
    assert!(error <= 2.0, "1/√{x:e} is off by {error} units");
}

fn check_root_double(x: f64) {
    let root = x.reciprocal_root();
    let error = root_error(x, root) * root / (root.next_up() - root);
    assert!(error <= 2.0, "1/√{x:e} is off by {error} units");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn the_reciprocal_root_is_good_to_two_units(exponent in -30.0..30.0) {
        let x = 10_f64.powf(exponent);
        check_root_double(x);
        #[allow(clippy::cast_possible_truncation)] // Any number near it will do.
        check_root_single(x as f32);
    }

    #[test]
    fn comparisons_of_any_bits_are_the_types_own(a in any::<u64>(), b in any::<u64>()) {
        let (x, y) = (f64::from_bits(a), f64::from_bits(b));
        prop_assert_eq!(x.less(y), x < y);
        prop_assert_eq!(x.at_most(y), x <= y);
        prop_assert_eq!(x.is_number(), x.is_finite());
        #[allow(clippy::cast_possible_truncation)] // Half of the bits are any bits too.
        let (x, y) = (f32::from_bits(a as u32), f32::from_bits(b as u32));
        prop_assert_eq!(x.less(y), x < y);
        prop_assert_eq!(x.at_most(y), x <= y);
        prop_assert_eq!(x.is_number(), x.is_finite());
    }

    #[test]
    fn literals_are_the_nearest_numbers(value in any::<f64>()) {
        prop_assert_eq!(<f64 as Number>::literal(value).to_bits(), value.to_bits());
        let single = f64::from(<f32 as Number>::literal(value));
        if single.is_finite() {
            let below = f64::from(f32::literal(value).next_down());
            let above = f64::from(f32::literal(value).next_up());
            prop_assert!((value - single).abs() <= (value - below).abs());
            prop_assert!((value - single).abs() <= (value - above).abs());
        } else {
            prop_assert!(value.abs() > f64::from(f32::MAX));
        }
    }
}

#[test]
fn the_reciprocal_root_is_good_over_two_octaves() {
    // The error repeats with every factor of four: a fine grid over one period, at both ends of the range.
    for n in 0..40_000_u32 {
        let mantissa = 1.0 + f64::from(n) * 7.5e-5;
        for scale in [0.0, 96.0, -96.0] {
            let x = mantissa * 2_f64.powf(scale);
            check_root_double(x);
            #[allow(clippy::cast_possible_truncation)] // Any number near it will do.
            check_root_single(x as f32);
        }
    }
}

fn check_selection<T: Real>() {
    for x in catalogue::<T>() {
        assert_eq!(x.is_number(), x.to_f64().is_finite(), "{x:?}");
        assert_eq!(bits(x.magnitude()), bits(x) & !(1 << 63), "{x:?}");
        for y in catalogue::<T>() {
            assert_eq!(bits(T::choose(true, x, y)), bits(x));
            assert_eq!(bits(T::choose(false, x, y)), bits(y));
            // Where nothing can be said, the bound stands: of two zeros, and with NaN on either side.
            let (less, more) = (x.or_less(y), x.or_more(y));
            assert_eq!(bits(less), bits(if x < y { x } else { y }), "{x:?} {y:?}");
            assert_eq!(bits(more), bits(if x > y { x } else { y }), "{x:?} {y:?}");
        }
    }
    // What is not there gives way to a bound.
    assert!(T::NAN.or_less(T::one()) == T::one() && T::NAN.or_more(T::one()) == T::one());
}

#[test]
fn the_smaller_the_larger_and_the_chosen() {
    check_selection::<f32>();
    check_selection::<f64>();
}

#[test]
fn one_answer_is_any_and_all() {
    for answer in [false, true] {
        let mask = <bool as Mask>::same(answer);
        assert!(mask == answer && mask.any() == answer && mask.all() == answer);
    }
}

#[test]
fn flags_are_raised_where_the_mask_is_true_and_stay() {
    let mut flags = <f64 as Number>::Flags::default();
    flags.raise(Flags::AMBIGUOUS, false);
    assert_eq!(flags, Flags::default());
    flags.raise(Flags::DERIVATIVE_HELD, true);
    flags.raise(Flags::NOT_STARTED, true);
    flags.raise(Flags::DERIVATIVE_HELD, false);
    assert_eq!(flags, Flags::DERIVATIVE_HELD | Flags::NOT_STARTED);
}
