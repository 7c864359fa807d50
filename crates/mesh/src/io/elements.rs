//! The cells of order 1 and 2 in the formats that have a number or a name for each kind.

use crate::mesh::CellKind;

/// A kind of cells in each format: 0, or no name, where the format lacks it.
pub struct Element {
    pub kind: CellKind,
    pub vtk: u8,
    pub cgns: i64,
    pub med: &'static str,
    /// The descriptor that is written; further ones are read.
    pub unv: u64,
    /// The keyword, and its number in binary files.
    pub medit: (&'static str, i32),
    pub xdmf: i64,
    /// The first is spelled as XDMF's own reader takes it.
    pub xdmf_names: &'static [&'static str],
    /// The types that are written in 2D and in 3D; further ones are read.
    pub abaqus: [&'static str; 2],
}

macro_rules! elements {
    ($($kind:ident $vtk:literal $cgns:literal $med:literal $unv:literal $medit:tt $xdmf:literal $names:tt $abaqus:tt;)*) => {
        /// All kinds, in the order of Gmsh's numbers.
        pub static ELEMENTS: [Element; 19] = [$(Element {
            kind: CellKind::$kind,
            vtk: $vtk,
            cgns: $cgns,
            med: $med,
            unv: $unv,
            medit: $medit,
            xdmf: $xdmf,
            xdmf_names: &$names,
            abaqus: $abaqus,
        }),*];
    };
}

// kind       VTK CGNS MED UNV  Medit                    XDMF                            Abaqus
elements! {
    Line           3  3 "SE2"  21 ("Edges", 5)            2 ["Polyline", "interval"]     ["T2D2", "T3D2"];
    Triangle       5  5 "TR3"  41 ("Triangles", 6)        4 ["Triangle"]                 ["CPS3", "S3"];
    Quadrangle     9  7 "QU4"  44 ("Quadrilaterals", 7)   5 ["Quadrilateral", "quad"]    ["CPS4", "S4"];
    Tetrahedron   10 10 "TE4" 111 ("Tetrahedra", 8)       6 ["Tetrahedron"]              ["C3D4", "C3D4"];
    Hexahedron    12 17 "HE8" 115 ("Hexahedra", 10)       9 ["Hexahedron"]               ["C3D8", "C3D8"];
    Prism         13 14 "PE6" 112 ("Prisms", 9)           8 ["Wedge"]                    ["C3D6", "C3D6"];
    Pyramid       14 12 "PY5" 312 ("Pyramids", 49)        7 ["Pyramid"]                  ["C3D5", "C3D5"];
    Line3         21  4 "SE3"  24 ("EdgesP2", 25)        34 ["Edge_3", "interval_3"]     ["T2D3", "T3D3"];
    Triangle6     22  6 "TR6"  42 ("TrianglesP2", 24)    36 ["Triangle_6", "tri_6"]      ["CPS6", "STRI65"];
    Quadrangle9   28  9 "QU9"   0 ("QuadrilateralsQ2", 27) 35 ["Quadrilateral_9", "quad_9"] ["M3D9", "M3D9"];
    Tetrahedron10 24 11 "T10" 118 ("TetrahedraP2", 30)   38 ["Tetrahedron_10", "tet_10"] ["C3D10", "C3D10"];
    Hexahedron27  29 19 "H27"   0 ("", 0)                50 ["Hexahedron_27", "hex_27"]  ["C3D27", "C3D27"];
    Prism18       32 16 "P18"   0 ("", 0)                41 ["Wedge_18"]                 ["", ""];
    Pyramid14      0 13 ""      0 ("", 0)                 0 []                           ["", ""];
    Vertex         1  2 "PO1" 161 ("", 0)                 1 ["Polyvertex"]               ["MASS", "MASS"];
    Quadrangle8   23  8 "QU8"  45 ("", 0)                37 ["Quadrilateral_8", "quad_8"] ["CPS8", "S8R"];
    Hexahedron20  25 18 "H20" 116 ("", 0)                48 ["Hexahedron_20", "hex_20"]  ["C3D20", "C3D20"];
    Prism15       26 15 "P15" 113 ("", 0)                40 ["Wedge_15"]                 ["C3D15", "C3D15"];
    Pyramid13     27 21 "P13" 114 ("", 0)                39 ["Pyramid_13"]               ["C3D13", "C3D13"];
}

/// The kind for which a format has this number or name.
pub fn kind<T: PartialEq + Default>(
    column: fn(&'static Element) -> T,
    wanted: T,
) -> Option<CellKind> {
    let found = ELEMENTS.iter().find(|element| column(element) == wanted)?;
    (wanted != T::default()).then_some(found.kind)
}

/// The number or name that a format has for a kind.
pub fn name<T: PartialEq + Default>(
    column: fn(&'static Element) -> T,
    kind: CellKind,
) -> Option<T> {
    let element = ELEMENTS.iter().find(|element| element.kind == kind)?;
    Some(column(element)).filter(|name| *name != T::default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Debug;

    /// Each number and name is that of one kind, and leads back to it; how many there are.
    fn one_to_one<T: PartialEq + Default + Debug>(column: fn(&'static Element) -> T) -> usize {
        let found = ELEMENTS.iter().filter_map(|of| name(column, of.kind));
        let back = found.map(|name| {
            let text = format!("{name:?}");
            let kind = kind(column, name).expect(&text);
            assert_eq!(
                format!("{:?}", self::name(column, kind).expect(&text)),
                text
            );
            kind
        });
        let back: std::collections::BTreeSet<CellKind> = back.collect();
        assert!(kind(column, T::default()).is_none());
        back.len()
    }

    #[test]
    fn every_number_and_name_is_that_of_one_kind() {
        // As many as the manuals have of these kinds.
        assert_eq!(one_to_one(|e| e.vtk), 18);
        assert_eq!(one_to_one(|e| e.cgns), 19);
        assert_eq!(one_to_one(|e| e.med), 18);
        assert_eq!(one_to_one(|e| e.unv), 15);
        assert_eq!(one_to_one(|e| e.medit), 11);
        assert_eq!(one_to_one(|e| e.xdmf), 18);
        assert_eq!(one_to_one(|e| e.abaqus[0]), 17);
        assert_eq!(one_to_one(|e| e.abaqus[1]), 17);
        let numbers = ELEMENTS.iter().map(|element| element.kind.gmsh());
        assert!(numbers.eq(1..=19));
        // MED's names end in the number of nodes.
        let med = ELEMENTS.iter().filter(|element| !element.med.is_empty());
        assert!(
            med.clone()
                .all(|of| of.med.ends_with(&of.kind.points().to_string()))
        );
    }
}
