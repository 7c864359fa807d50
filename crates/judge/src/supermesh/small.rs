//! Small spaces of functions on a mesh, and what of a field lies in them: means, rigid motions, products.

use nalgebra::{Matrix3, Vector3};

use super::clip::{cross, dot, measure, subtract};
use super::domain::{BLOCK, Domain, Piece};
use super::function::Function;
use super::map::Local;
use super::norms::{combine, is_exact};
use super::rule::Rule;
use crate::open::{Over, UpTo};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;
use faceoff_mesh::parallel;

/// What adds up over cells.
pub(super) trait Sum: Clone + Send + Sync {
    /// Adds another sum.
    fn merge(&mut self, other: &Self);
}

/// Integrals of a field v and of what rigid motions are projected with.
#[derive(Debug, Clone)]
pub(super) struct Moments {
    measure: f64,
    /// ∫ x, ∫ x xᵀ.
    first: [f64; 3],
    second: [[f64; 3]; 3],
    /// ∫ v_c, ∫ v_c x.
    values: Vec<f64>,
    turned: Vec<[f64; 3]>,
}

impl Moments {
    pub fn new(components: usize) -> Self {
        Moments {
            measure: 0.0,
            first: [0.0; 3],
            second: [[0.0; 3]; 3],
            values: vec![0.0; components],
            turned: vec![[0.0; 3]; components],
        }
    }

    pub fn add(&mut self, weight: f64, at: &[f64; 3], values: impl Iterator<Item = f64>) {
        self.measure += weight;
        for i in 0..3 {
            self.first[i] += weight * at[i];
            (0..3).for_each(|k| self.second[i][k] += weight * at[i] * at[k]);
        }
        for ((sum, turned), value) in self.values.iter_mut().zip(&mut self.turned).zip(values) {
            *sum += weight * value;
            (0..3).for_each(|k| turned[k] += weight * value * at[k]);
        }
    }

    /// The projection to constants, or to rigid motions u = c + ω × (x - x̄), x̄ the centre. Translations and rotations about the
    /// centre are orthogonal: c is the mean, and (∫ |r|² I - r rᵀ) ω = ∫ r × v with r = x - x̄.
    pub fn fit(&self, up_to: UpTo, dim: usize, components: usize, over: Over) -> Linear {
        let mut fit = Linear {
            measure: self.measure,
            over: Some(over),
            constant: vec![0.0; components],
            slope: vec![[0.0; 3]; components],
            ..Linear::default()
        };
        if !(self.measure > 0.0) {
            return fit;
        }
        let mean = self.first.map(|x| x / self.measure);
        fit.about = mean;
        let of_values = self.values.iter().map(|v| v / self.measure);
        fit.constant = of_values.collect();
        let central = |i: usize, k: usize| self.second[i][k] - self.measure * mean[i] * mean[k];
        fit.square = self.measure * fit.constant.iter().map(|c| c * c).sum::<f64>();
        fit.told.clone_from(&fit.constant);
        fit.spread = [0, 1, 2].map(|i| [0, 1, 2].map(|k| central(i, k) / self.measure));
        if up_to != UpTo::Rigid {
            return fit;
        }
        // In the plane the third component of a vector is 0.
        fit.told.truncate(dim);
        let turned = |c: usize, k: usize| match self.turned.get(c) {
            Some(of) => of[k] - mean[k] * self.values[c],
            None => 0.0,
        };
        let moment = |i: usize, k: usize| turned(k, i) - turned(i, k);
        let trace: f64 = (0..3).map(|k| central(k, k)).sum();
        let inertia = Matrix3::from_fn(|i, k| f64::from(u8::from(i == k)) * trace - central(i, k));
        let load = Vector3::new(moment(1, 2), moment(2, 0), moment(0, 1));
        let spin: [f64; 3] = match dim {
            2 => [0.0, 0.0, load[2] / inertia[(2, 2)]],
            _ => {
                let solved = inertia.try_inverse().map(|inverse| inverse * load);
                solved.unwrap_or_default().into()
            }
        };
        let spin = spin.map(|s| if s.is_finite() { s } else { 0.0 });
        let columns = [0, 1, 2].map(|k| {
            let mut axis = [0.0; 3];
            axis[k] = 1.0;
            cross(&spin, &axis)
        });
        for (c, slope) in fit.slope.iter_mut().enumerate().take(3) {
            *slope = columns.map(|column| column[c]);
        }
        fit.square += (0..3).map(|k| spin[k] * load[k]).sum::<f64>().max(0.0);
        fit.told
            .extend(if dim == 2 { &spin[2..] } else { &spin[..] });
        fit
    }
}

impl Sum for Moments {
    fn merge(&mut self, other: &Self) {
        self.measure += other.measure;
        for i in 0..3 {
            self.first[i] += other.first[i];
            (0..3).for_each(|k| self.second[i][k] += other.second[i][k]);
        }
        for (sum, of) in self.values.iter_mut().zip(&other.values) {
            *sum += of;
        }
        for (sum, of) in self.turned.iter_mut().zip(&other.turned) {
            (0..3).for_each(|k| sum[k] += of[k]);
        }
    }
}

/// What was found of a field on a connected part: v_c = constant_c + slope_c · (x - about), or the size of a gradient.
#[derive(Debug, Clone, Default)]
pub(crate) struct Linear {
    pub measure: f64,
    pub over: Option<Over>,
    pub about: [f64; 3],
    pub constant: Vec<f64>,
    pub slope: Vec<[f64; 3]>,
    /// The integral of its square.
    pub square: f64,
    /// The mean of (x - about) (x - about)ᵀ.
    pub spread: [[f64; 3]; 3],
    /// As reports have it: constants, then the rotation.
    pub told: Vec<f64>,
}

impl Linear {
    /// The value of a component.
    pub fn at(&self, place: &[f64; 3], component: usize) -> f64 {
        let of = self.constant.get(component).zip(self.slope.get(component));
        of.map_or(0.0, |(c, slope)| {
            c + dot(slope, &subtract(place, &self.about))
        })
    }

    /// The root of the mean square of this less another, on this part of the mesh.
    pub fn apart(&self, other: &Linear) -> f64 {
        let square = |c: usize| {
            let constant = self.constant[c] - other.at(&self.about, c);
            let of = other.slope.get(c).copied().unwrap_or_default();
            let slope = subtract(&self.slope[c], &of);
            let spread = self.spread.map(|row| dot(&row, &slope));
            constant * constant + dot(&slope, &spread).max(0.0)
        };
        (0..self.constant.len()).map(square).sum::<f64>().sqrt()
    }

    /// How little two parts of meshes are the same: of their centres, sizes and measures.
    pub fn unlike(&self, other: &Linear) -> f64 {
        let radius = |of: &Linear| (0..3).map(|k| of.spread[k][k]).sum::<f64>().max(0.0).sqrt();
        let [p, q] = [radius(self), radius(other)];
        let shift = subtract(&self.about, &other.about);
        let share = (self.measure - other.measure) / self.measure.max(other.measure);
        dot(&shift, &shift) + (p - q).powi(2) + (share * p.max(q)).powi(2)
    }
}

/// Integrals of products of two fields; components are real and imaginary parts in turn where a phase is asked for.
#[derive(Debug, Clone, Default)]
pub(crate) struct Products {
    aa: f64,
    bb: f64,
    /// Σ a b̄
    re: f64,
    im: f64,
}

impl Products {
    pub fn add(&mut self, weight: f64, pairs: impl Iterator<Item = [f64; 2]>) {
        let mut before: Option<[f64; 2]> = None;
        for [a, b] in pairs {
            self.aa += weight * a * a;
            self.bb += weight * b * b;
            self.re += weight * a * b;
            before = match before.take() {
                None => Some([a, b]),
                Some([x, y]) => {
                    self.im += weight * (a * y - x * b);
                    None
                }
            };
        }
    }

    /// What makes b most like a; 1 where nothing does.
    pub fn factor(&self, up_to: UpTo) -> [f64; 2] {
        // Of orthogonal fields it is rounding.
        let least = 1e-8 * (self.aa * self.bb).sqrt();
        match up_to {
            UpTo::Sign if self.re < -least => [-1.0, 0.0],
            UpTo::Scale if self.re.abs() > least => [self.re / self.bb, 0.0],
            UpTo::Phase if self.re.hypot(self.im) > least => {
                let modulus = self.re.hypot(self.im);
                [self.re / modulus, self.im / modulus]
            }
            _ => [1.0, 0.0],
        }
    }

    /// ‖(f - 1) b‖²
    pub fn changed(&self, [re, im]: [f64; 2]) -> f64 {
        ((re - 1.0).powi(2) + im * im) * self.bb
    }
}

impl Sum for Products {
    fn merge(&mut self, other: &Self) {
        self.aa += other.aa;
        self.bb += other.bb;
        self.re += other.re;
        self.im += other.im;
    }
}

/// The cells of a result on which fields are functions; none where it has none.
///
/// # Errors
/// [`Error::Ended`].
pub(super) fn domain(side: &Results) -> Result<Option<Domain<'_>>> {
    match Domain::divided(side, 0.0) {
        Err(Error::Ended(cause)) => Err(Error::Ended(cause)),
        found => Ok(found.ok()),
    }
}

/// Visits the points of a rule on all cells on all cores: the cell, weight, place and the values of functions there. Each block of
/// cells has a sum of its own, in the order of the cells.
///
/// # Errors
/// [`Error::Ended`].
pub(super) fn integrate<T: Send>(
    domain: &Domain,
    functions: &[Function],
    degree: usize,
    new: impl Fn() -> T + Sync,
    visit: impl Fn(&mut T, u32, f64, &[f64; 3], &[[f64; 4]]) + Sync,
) -> Result<Vec<T>> {
    let more = if is_exact(domain) { 0 } else { 4 };
    let rule = Rule::new(domain.dim, degree + more);
    let block = |pieces: &[Piece]| -> Result<T> {
        let mut local = Local::new(domain, functions);
        let mut sum = new();
        for piece in pieces {
            cancel::check()?;
            let frame = domain.frame(piece);
            let simplex = domain.simplex(piece, &frame);
            let size = measure(domain.dim, &simplex);
            local.turn_to(piece.cell, &frame);
            for (lambda, weight) in &rule.points {
                let place = combine(&simplex, lambda);
                local.evaluate(&place);
                let at = frame.point(&place);
                visit(&mut sum, piece.cell, weight * size, &at, &local.values);
            }
        }
        Ok(sum)
    };
    let blocks = parallel::map(domain.pieces.chunks(BLOCK), block);
    blocks.into_iter().collect()
}
