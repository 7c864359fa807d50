//! Arithmetic of 60 digits and more, for tests.

use astro_float_num::{BigFloat, Consts, RoundingMode};
use std::ops::{Add, Div, Mul, Neg, Sub};

const BITS: usize = 256;
const NEAREST: RoundingMode = RoundingMode::ToEven;

/// A number with 77 digits.
#[derive(Debug, Clone)]
pub struct Big(BigFloat);

impl Big {
    pub fn of(value: f64) -> Big {
        Big(BigFloat::from_f64(value, BITS))
    }

    pub fn sqrt(&self) -> Big {
        Big(self.0.sqrt(BITS, NEAREST))
    }

    /// One of the elementary functions.
    pub fn function(&self, name: &str) -> Big {
        let mut constants = Consts::new().expect("memory for constants");
        let (x, c) = (&self.0, &mut constants);
        Big(match name {
            "sin" => x.sin(BITS, NEAREST, c),
            "cos" => x.cos(BITS, NEAREST, c),
            "tan" => x.tan(BITS, NEAREST, c),
            "exp" => x.exp(BITS, NEAREST, c),
            "ln" => x.ln(BITS, NEAREST, c),
            "sinh" => x.sinh(BITS, NEAREST, c),
            "cosh" => x.cosh(BITS, NEAREST, c),
            "tanh" => x.tanh(BITS, NEAREST, c),
            "atan" => x.atan(BITS, NEAREST, c),
            "asin" => x.asin(BITS, NEAREST, c),
            "acos" => x.acos(BITS, NEAREST, c),
            other => panic!("{other} is no function"),
        })
    }

    pub fn is_nan(&self) -> bool {
        self.0.is_nan()
    }

    pub fn at_most(&self, other: f64) -> bool {
        self.0
            .cmp(&BigFloat::from_f64(other, BITS))
            .is_some_and(|order| order <= 0)
    }

    pub fn at_least(&self, other: f64) -> bool {
        self.0
            .cmp(&BigFloat::from_f64(other, BITS))
            .is_some_and(|order| order >= 0)
    }

    pub fn abs(&self) -> Big {
        if self.at_least(0.0) {
            self.clone()
        } else {
            -self.clone()
        }
    }
}

impl Neg for Big {
    type Output = Big;
    fn neg(self) -> Big {
        Big(self.0.neg())
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident) => {
        impl $trait for Big {
            type Output = Big;
            fn $method(self, other: Big) -> Big {
                Big(self.0.$method(&other.0, BITS, NEAREST))
            }
        }
        impl $trait for &Big {
            type Output = Big;
            fn $method(self, other: &Big) -> Big {
                Big(self.0.$method(&other.0, BITS, NEAREST))
            }
        }
    };
}

operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl std::iter::Sum for Big {
    fn sum<I: Iterator<Item = Big>>(all: I) -> Big {
        all.fold(Big::of(0.0), |sum, next| sum + next)
    }
}
