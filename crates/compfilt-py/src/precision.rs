//! The same thing in one of the two scalar types.

/// A filter at work in float32 or in float64.
pub(crate) enum InPrecision<S, D> {
    Single(S),
    Double(D),
}

/// Does the same in either precision.
macro_rules! with_precision {
    ($any:expr, $session:ident => $body:expr) => {
        match $any {
            $crate::precision::InPrecision::Single($session) => $body,
            $crate::precision::InPrecision::Double($session) => $body,
        }
    };
}
pub(crate) use with_precision;
