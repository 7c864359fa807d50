//! The error of a field against a function that is known everywhere.

use super::clip::measure;
use super::domain::{BLOCK, Domain, Piece};
use super::element::Element;
use super::function::Function;
use super::map::Local;
use super::norms::{Sums, combine};
use super::rule::Rule;
use crate::{Norms, On};
use faceoff_mesh::cancel;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::field::Results;
use faceoff_mesh::parallel;

/// Value and gradient of a component at a place.
pub type Exact<'a> = &'a (dyn Fn([f64; 3], usize) -> (f64, [f64; 3]) + Sync);

/// Beyond the degree of the field, this degree of the function is integrated as well; of hexahedra, whose functions have that degree in all coordinates together, less.
const MORE: [usize; 2] = [8, 4];

/// The mesh of a result, in numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Cells of the highest dimension.
    pub cells: usize,
    /// Area or volume.
    pub measure: f64,
    /// (measure / cells)^(1/d): the edge of a cube of the mean size.
    pub h: f64,
}

impl Size {
    /// # Errors
    /// No mesh of triangles, quadrangles, tetrahedra or hexahedra.
    pub fn of(side: &Results) -> Result<Self> {
        let domain = Domain::divided(side, 0.0)?;
        let (cells, measure) = (domain.cell_count(), domain.measure);
        Ok(Size {
            cells,
            measure,
            h: (measure / cells as f64).powf(1.0 / domain.dim as f64),
        })
    }
}

/// ‖u_h - u‖ of the field of this name, with ‖u‖ as scale, by a rule exact for u of degree 8 beyond that of u_h. The third
/// component of a vector in the plane is 0.
///
/// # Errors
/// No such field, several, or one of other components; cells on which functions are not known.
pub fn error_against(
    side: &Results,
    field: &str,
    components: usize,
    exact: Exact,
) -> Result<Norms> {
    let refuse = |what: String| Error::Compare {
        a: side.source.clone(),
        b: "the formula".into(),
        what,
        remedy: "name one field of floats, with a formula for each component".into(),
    };
    let on = [
        (On::Points, &side.on_points),
        (On::Cells, &side.on_cells),
        (On::Corners, &side.on_corners),
    ];
    let found = on.into_iter().flat_map(|(on, fields)| {
        let named = fields.iter().filter(|f| f.name == field);
        named.map(move |f| Function::new(f, on))
    });
    let functions: Vec<Function> = found.collect();
    match &functions[..] {
        [one] if one.field.rest.is_some() => {
            return Err(refuse(format!("`{field}` is no field of floats")));
        }
        [one] => match (components, one.components) {
            (p, q) if p == q => {}
            (2, 3) if side.space == 2 => {}
            (p, q) => {
                let what = format!("`{field}` has {q} components, and there are {p} formulas");
                return Err(refuse(what));
            }
        },
        several => return Err(refuse(format!("it has {} fields `{field}`", several.len()))),
    }
    let domain = Domain::divided(side, 0.0)?;
    let has_hexahedra = domain.dim == 3 && domain.elements.iter().any(Element::is_product);
    let more = MORE[usize::from(has_hexahedra)];
    let rule = Rule::new(domain.dim, 2 * functions[0].degree(&domain) + more);
    let block = |pieces: &[Piece]| -> Result<Sums> {
        let mut local = Local::new(&domain, &functions);
        let mut sums = Sums::default();
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
                for (component, of) in local.values.iter().enumerate() {
                    let (u, gradient) = match component < components {
                        true => exact(at, component),
                        false => Default::default(),
                    };
                    let [x, y, z] = frame.tangential(gradient);
                    let u = [u, x, y, z];
                    let difference = [0, 1, 2, 3].map(|k| of[k] - u[k]);
                    sums.add_squares(weight * size, &difference, &u, &u);
                }
            }
        }
        Ok(sums)
    };
    let blocks = parallel::map(domain.pieces.chunks(BLOCK), block);
    let blocks: Vec<Sums> = blocks.into_iter().collect::<Result<_>>()?;
    let mut all = Sums::default();
    blocks.into_iter().for_each(|sums| all.add(sums));
    let norms = all.norms(functions[0].is_constant());
    match norms.l2.is_finite() {
        true => Ok(norms),
        false => Err(refuse(format!(
            "`{field}` or the formula is not finite everywhere"
        ))),
    }
}
