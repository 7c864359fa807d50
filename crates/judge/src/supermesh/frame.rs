//! Where the places of a piece are measured from: a point, and on a surface in space the plane of the piece.

use super::clip::{cross, dot, subtract};

/// A point, and on a surface in space the axes of a plane through it, of which the third is its normal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    origin: [f64; 3],
    axes: Option<[[f64; 3]; 3]>,
}

impl Frame {
    /// That of a mesh in the plane or of solid cells.
    pub fn at(origin: [f64; 3]) -> Self {
        Frame { origin, axes: None }
    }

    /// The plane of a triangle, which turns left about the normal. Not finite where it has no area.
    pub fn of_triangle([a, b, c]: [[f64; 3]; 3]) -> Self {
        let unit = |v: [f64; 3]| v.map(|x| x / dot(&v, &v).sqrt());
        let along = unit(subtract(&b, &a));
        let normal = unit(cross(&along, &subtract(&c, &a)));
        Frame {
            origin: a,
            axes: Some([along, cross(&normal, &along), normal]),
        }
    }

    /// The coordinates of a point here; the third is its height above the plane.
    pub fn coordinates(&self, point: &[f64; 3]) -> [f64; 3] {
        let offset = subtract(point, &self.origin);
        match &self.axes {
            None => offset,
            Some(axes) => axes.map(|axis| dot(&axis, &offset)),
        }
    }

    /// The point with these coordinates.
    pub fn point(&self, coordinates: &[f64; 3]) -> [f64; 3] {
        let offset = self.vector(coordinates);
        [0, 1, 2].map(|k| self.origin[k] + offset[k])
    }

    /// The vector with these components along the axes.
    pub fn vector(&self, components: &[f64; 3]) -> [f64; 3] {
        match &self.axes {
            None => *components,
            Some(axes) => [0, 1, 2].map(|k| (0..3).map(|i| components[i] * axes[i][k]).sum()),
        }
    }

    /// The part of a vector along the plane; all of it where there is none.
    pub fn tangential(&self, vector: [f64; 3]) -> [f64; 3] {
        match &self.axes {
            None => vector,
            Some([.., normal]) => {
                let out = dot(normal, &vector);
                [0, 1, 2].map(|k| vector[k] - out * normal[k])
            }
        }
    }

    /// The cosine of the angle between two planes, negative where they turn the other way.
    pub fn cosine(&self, other: &Frame) -> f64 {
        match (&self.axes, &other.axes) {
            (Some([.., a]), Some([.., b])) => dot(a, b),
            _ => 1.0,
        }
    }
}
