//! Truncated Taylor polynomials with interval coefficients: Σ_{|α| ≤ K} c_α (x-a)^α, where c_α holds ∂^α/α! at all points of
//! a box (R. E. Moore, Interval Analysis, 1966).

use std::sync::LazyLock;

use crate::interval::Interval;

/// The most derivatives that are taken.
pub const MOST: usize = 4;
/// Places for a value and a gradient in 3D.
pub const GRADIENT: usize = 4;
/// Places for [`MOST`] derivatives along one axis.
pub const ON_LINE: usize = 5;
/// Places for second derivatives in 2D and in 3D.
pub const SECOND_IN_PLANE: usize = 6;
/// See [`SECOND_IN_PLANE`].
pub const SECOND_IN_SPACE: usize = 10;
/// Places for [`MOST`] derivatives in 2D.
pub const IN_PLANE: usize = 15;
/// The same in 3D.
pub const IN_SPACE: usize = 35;

/// The coefficients, by degree, and for each degree up to the one wanted from then on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taylor<const N: usize> {
    /// c_α in the order of [`Monomials::exponents`].
    pub coefficients: [Interval; N],
    /// Whether it may jump inside the box.
    pub may_jump: bool,
}

/// The monomials of a given number of variables.
pub struct Monomials {
    /// By degree; in each degree, the powers of x come first, then y, then z.
    pub exponents: Vec<[u8; 3]>,
    /// How many are of no more than this degree.
    pub counts: [usize; MOST + 1],
    /// For each monomial, the positions of those with one power less of x, y, z.
    pub lower: Vec<[Option<u8>; 3]>,
    /// α! d!/(|α|+d)! by the dimension d of a simplex.
    pub shares: [Vec<Interval>; 4],
    /// |α|!/α!
    multinomials: Vec<f64>,
    /// x^α x^β = x^γ, α ≤ β in their order and neither of them 1, by the degree of γ.
    pairs: Vec<[u8; 3]>,
    /// How many have γ of no more than this degree.
    pair_counts: [usize; MOST + 1],
}

/// By the number of variables.
static MONOMIALS: LazyLock<[Monomials; 4]> = LazyLock::new(|| std::array::from_fn(Monomials::new));

impl Monomials {
    /// Those of `dim` variables.
    pub fn of(dim: usize) -> &'static Monomials {
        &MONOMIALS[dim]
    }

    fn new(dim: usize) -> Self {
        let most = MOST as u8;
        let mut exponents: Vec<[u8; 3]> = Vec::new();
        for degree in 0..=most {
            for x in (0..=degree).rev() {
                for y in (0..=degree - x).rev() {
                    let all = [x, y, degree - x - y];
                    if all[dim..].iter().all(|e| *e == 0) {
                        exponents.push(all);
                    }
                }
            }
        }
        let degree = |k: usize| exponents[k].iter().sum::<u8>();
        let mut pairs = Vec::new();
        for a in 1..exponents.len() {
            for b in a..exponents.len() {
                let sum: [u8; 3] = std::array::from_fn(|k| exponents[a][k] + exponents[b][k]);
                if let Some(c) = exponents.iter().position(|e| *e == sum) {
                    pairs.push([a as u8, b as u8, c as u8]);
                }
            }
        }
        pairs.sort_by_key(|pair| degree(pair[2] as usize));
        let up_to = |limit: usize, all: &mut dyn Iterator<Item = usize>| {
            all.filter(|k| usize::from(degree(*k)) <= limit).count()
        };
        let place = |of: [u8; 3]| exponents.iter().position(|e| *e == of).map(|n| n as u8);
        let lower = exponents.iter().map(|of| {
            std::array::from_fn(|k| {
                let mut lower = *of;
                lower[k] = lower[k].checked_sub(1)?;
                place(lower)
            })
        });
        let factorial = |n: usize| (1..=n as u64).product::<u64>() as f64;
        let multinomial = |of: &[u8; 3]| {
            let below = of.map(|e| factorial(e.into())).iter().product::<f64>();
            factorial(of.iter().sum::<u8>().into()) / below
        };
        let share = |of: &[u8; 3], d: usize| {
            let above = of.map(|e| factorial(e.into())).iter().product::<f64>() * factorial(d);
            let degree = of.iter().sum::<u8>() as usize;
            Interval::at(above) / Interval::at(factorial(degree + d))
        };
        Monomials {
            lower: lower.collect(),
            multinomials: exponents.iter().map(multinomial).collect(),
            shares: std::array::from_fn(|d| exponents.iter().map(|of| share(of, d)).collect()),
            counts: std::array::from_fn(|d| up_to(d, &mut (0..exponents.len()))),
            pair_counts: std::array::from_fn(|d| {
                up_to(d, &mut pairs.iter().map(|pair| pair[2] as usize))
            }),
            exponents,
            pairs,
        }
    }
}

/// How many variables there are, and how many derivatives are wanted.
#[derive(Clone, Copy)]
pub(super) struct Size {
    pub order: usize,
    pub count: usize,
    monomials: &'static Monomials,
    pairs: &'static [[u8; 3]],
    counts: &'static [usize; MOST + 1],
}

impl Size {
    pub fn new(dim: usize, order: usize) -> Self {
        let of = Monomials::of(dim);
        Size {
            order,
            count: of.counts[order],
            monomials: of,
            pairs: &of.pairs[..of.pair_counts[order]],
            counts: &of.counts,
        }
    }

    /// How many first derivatives there are.
    pub fn slopes(self) -> usize {
        self.counts[self.order.min(1)] - 1
    }

    /// Whether it is constant.
    pub fn is_constant<const N: usize>(self, a: &Taylor<N>) -> bool {
        let varies = a.coefficients[1..self.count].iter().any(|c| !c.is_zero());
        a.value().low == a.value().high && !varies
    }

    pub fn sum<const N: usize>(self, a: &Taylor<N>, b: &Taylor<N>) -> Taylor<N> {
        let mut of = *a;
        of.may_jump |= b.may_jump;
        for (a, b) in of.coefficients[..self.count]
            .iter_mut()
            .zip(&b.coefficients)
        {
            *a += *b;
        }
        of
    }

    pub fn product<const N: usize>(self, a: &Taylor<N>, b: &Taylor<N>) -> Taylor<N> {
        // Most products are by a number.
        for (number, other) in [(a, b), (b, a)] {
            if !number.may_jump && self.is_flat(&number.coefficients, 1) {
                let mut of = *other;
                for c in &mut of.coefficients[..self.count] {
                    *c = number.value() * *c;
                }
                return of;
            }
        }
        let (a, b, may_jump) = (&a.coefficients, &b.coefficients, a.may_jump || b.may_jump);
        let mut of = self.of_slopes(a, b);
        of[0] = a[0] * b[0];
        for k in 1..self.count {
            if !b[k].is_zero() {
                of[k] += a[0] * b[k];
            }
            if !a[k].is_zero() {
                of[k] += a[k] * b[0];
            }
        }
        Taylor {
            coefficients: of,
            may_jump,
        }
    }

    /// Whether all coefficients from the degree on are 0.
    fn is_flat<const N: usize>(self, a: &[Interval; N], degree: usize) -> bool {
        let from = self.counts[degree.min(self.order + 1) - 1];
        a[from..self.count].iter().all(|c| c.is_zero())
    }

    /// The product without both constants: most terms of products of functions of one variable each are 0.
    fn of_slopes<const N: usize>(self, a: &[Interval; N], b: &[Interval; N]) -> [Interval; N] {
        let mut of = [Interval::ZERO; N];
        for [i, j, k] in self.pairs {
            let (i, j) = (*i as usize, *j as usize);
            if !(a[i].is_zero() || b[j].is_zero()) {
                of[*k as usize] += a[i] * b[j];
            }
            if i != j && !(a[j].is_zero() || b[i].is_zero()) {
                of[*k as usize] += a[j] * b[i];
            }
        }
        of
    }

    /// The square without the constant: no square of an interval is negative.
    fn square_of_slopes<const N: usize>(self, a: &[Interval; N]) -> [Interval; N] {
        let mut of = [Interval::ZERO; N];
        for [i, j, k] in self.pairs {
            let (i, j) = (*i as usize, *j as usize);
            of[*k as usize] += if i == j {
                a[i].square()
            } else {
                2.0 * (a[i] * a[j])
            };
        }
        of
    }

    /// Σ_k g_k (a - a_0)^k, g_k of a function g at all values of a_0: g(a).
    pub fn chain<const N: usize>(self, a: &Taylor<N>, g: &[Interval; MOST + 1]) -> Taylor<N> {
        let mut of = Taylor::constant(g[0]);
        of.may_jump = a.may_jump;
        let a = &a.coefficients;
        let mut add = |k: usize, power: &[Interval; N]| {
            for n in self.counts[k - 1]..self.count {
                of.coefficients[n] += g[k] * power[n];
            }
        };
        // Most functions are of a linear one: (Σ a_i x_i)^k has the coefficients k!/α! Π a_i^α_i.
        if self.order >= 1 && self.is_flat(a, 2) {
            let mut powers = [[Interval::ONE; MOST + 1]; 3];
            for (powers, slope) in powers.iter_mut().zip(&a[1..=self.slopes()]) {
                for k in 1..=self.order {
                    powers[k] = if k % 2 == 0 {
                        powers[k / 2].square()
                    } else {
                        powers[k - 1] * *slope
                    };
                }
            }
            for n in 1..self.count {
                let exponents = self.monomials.exponents[n];
                let degree: u8 = exponents.iter().sum();
                let factors = exponents.iter().zip(&powers).filter(|(e, _)| **e > 0);
                let mut factors = factors.map(|(e, powers)| powers[usize::from(*e)]);
                if factors.clone().any(Interval::is_zero) {
                    continue;
                }
                let first = factors.next().unwrap_or(Interval::ONE);
                let product = factors.fold(first, |product, power| product * power);
                let weight = self.monomials.multinomials[n];
                of.coefficients[n] = weight * (g[usize::from(degree)] * product);
            }
            return of;
        }
        if self.order >= 1 {
            add(1, a);
        }
        if self.order >= 2 {
            let square = self.square_of_slopes(a);
            add(2, &square);
            if self.order >= 3 {
                add(3, &self.of_slopes(&square, a));
            }
            if self.order >= 4 {
                add(4, &self.square_of_slopes(&square));
            }
        }
        of
    }
}

impl<const N: usize> Taylor<N> {
    pub(super) fn constant(value: Interval) -> Self {
        let mut coefficients = [Interval::ZERO; N];
        coefficients[0] = value;
        Taylor {
            coefficients,
            may_jump: false,
        }
    }

    /// Holds the function at all points of the box.
    pub fn value(&self) -> Interval {
        self.coefficients[0]
    }

    /// ∂/∂x_k
    pub fn slope(&self, k: usize) -> Interval {
        self.coefficients[1 + k]
    }

    pub(super) fn negative(mut self) -> Self {
        self.coefficients = self.coefficients.map(|c| -c);
        self
    }

    /// Either of both, with a jump where one becomes the other.
    pub(super) fn or(&self, other: &Self) -> Self {
        let mut coefficients = [Interval::WHOLE; N];
        coefficients[0] = self.value().hull(other.value());
        Taylor {
            coefficients,
            may_jump: true,
        }
    }

    /// Either of both, with a kink where one becomes the other: the gradient is that of either (F. H. Clarke, Optimization and
    /// Nonsmooth Analysis, 1983).
    pub(super) fn or_kink(&self, other: &Self, value: Interval, slopes: usize) -> Self {
        let mut of = self.or(other);
        of.coefficients[0] = value;
        for k in 1..=slopes {
            of.coefficients[k] = self.coefficients[k].hull(other.coefficients[k]);
        }
        of.may_jump = self.may_jump || other.may_jump;
        of
    }
}
