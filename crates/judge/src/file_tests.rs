//! Files compared as they are read: a mesh, an integer, a time or a separate body must not hide a difference.

use super::*;
use faceoff_mesh::error::Result;
use faceoff_mesh::field::Results;
use faceoff_mesh::io;

/// One array of numbers in the notation of VTU.
fn array(kind: &str, name: &str, values: &[impl ToString]) -> String {
    let values: Vec<String> = values.iter().map(ToString::to_string).collect();
    format!(
        r#"<DataArray type="{kind}" Name="{name}" NumberOfTuples="{}" format="ascii">{}</DataArray>"#,
        values.len(),
        values.join(" ")
    )
}

/// A planar mesh of triangles with data on points and on the whole.
fn vtu(name: &str, at: &[[f64; 2]], cells: &[[u32; 3]], on_points: &str, whole: &str) -> Results {
    let places: Vec<f64> = at.iter().flat_map(|p| [p[0], p[1], 0.0]).collect();
    let places = array("Float64", "Points", &places)
        .replace("NumberOfTuples", r#"NumberOfComponents="3" NumberOfTuples"#);
    let ends: Vec<usize> = (1..=cells.len()).map(|k| 3 * k).collect();
    let text = format!(
        r#"<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>
        <FieldData>{whole}</FieldData>
        <Piece NumberOfPoints="{}" NumberOfCells="{}">
        <PointData>{on_points}</PointData><CellData/><Points>{places}</Points>
        <Cells>{}{}{}</Cells></Piece></UnstructuredGrid></VTKFile>"#,
        at.len(),
        cells.len(),
        array("Int64", "connectivity", cells.as_flattened()),
        array("Int64", "offsets", &ends),
        array("UInt8", "types", &vec![5; cells.len()]),
    );
    read(name, &text)
}

fn read(name: &str, text: &str) -> Results {
    io::read_results(name.as_ref(), text.as_bytes(), None).expect("the file is sound")
}

fn compare(a: &Results, b: &Results) -> Result<Comparison> {
    compare_results(a, b, &Settings::default())
}

const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

#[test]
fn a_square_cut_along_the_other_diagonal_is_another_mesh() {
    let u = array("Float64", "u", &[1.0, 2.0, 3.0, 4.0]);
    let a = vtu("a.vtu", &SQUARE, &[[0, 1, 2], [0, 2, 3]], &u, "");
    let same = vtu("b.vtu", &SQUARE, &[[3, 0, 2], [1, 2, 0]], &u, "");
    assert_eq!(compare(&a, &same).unwrap().verdict, Verdict::Agree);
    let moved = [SQUARE[1], SQUARE[0], SQUARE[2], SQUARE[3]];
    let turned = array("Float64", "u", &[2.0, 1.0, 3.0, 4.0]);
    let other = [
        vtu("b.vtu", &SQUARE, &[[0, 1, 3], [1, 2, 3]], &u, ""),
        vtu("b.vtu", &moved, &[[1, 0, 3], [0, 2, 3]], &turned, ""),
    ];
    for b in other {
        for (one, two) in [(&a, &b), (&b, &a)] {
            let by = |map| Settings {
                map,
                ..Settings::default()
            };
            let error = compare_results(one, two, &by(Some(MatchBy::Coordinates)));
            let error = error.unwrap_err().to_string();
            assert!(error.contains("2 of 2 cells of"), "{error}");
            assert!(error.contains("the first is [0, 1, "), "{error}");
            // As functions they differ in the middle, where the diagonals cross.
            let compared = compare(one, two).unwrap();
            assert!(
                compared.notes[0].contains("2 of 2 cells of"),
                "{compared:?}"
            );
            let found = &compared.fields[0].field;
            assert_eq!((compared.verdict, found.max_abs), (Verdict::Disagree, 1.0));
            assert_eq!(found.worst.as_ref().unwrap().midpoint, [0.5, 0.5]);
        }
    }
    // An additional cell, or the same cell twice.
    let more = vtu("b.vtu", &SQUARE, &[[0, 1, 2]], &u, "");
    let twice = vtu("b.vtu", &SQUARE, &[[0, 1, 2], [0, 1, 2], [0, 2, 3]], &u, "");
    for turn in [false, true] {
        let order = |b| if turn { (b, &a) } else { (&a, b) };
        let (one, two) = order(&more);
        let compared = compare(one, two).unwrap();
        assert_eq!(compared.verdict, Verdict::Disagree);
        let domain = compared
            .fields
            .last()
            .unwrap()
            .field
            .reason
            .as_ref()
            .unwrap();
        assert!(
            domain.contains("1 of 2 cells of a.vtu are not covered"),
            "{domain}"
        );
        let (one, two) = order(&twice);
        let error = compare(one, two).unwrap_err().to_string();
        assert!(
            error.contains("cells 0 at") && error.contains("overlap"),
            "{error}"
        );
    }
}

#[test]
fn integers_that_round_to_one_float_differ() {
    let large = 1i64 << 53;
    let file = |kind: &str, ids: [i64; 4]| {
        let ids = array(kind, "GlobalNodeId", &ids);
        vtu("a.vtu", &SQUARE, &[[0, 1, 2], [0, 2, 3]], &ids, "")
    };
    for kind in ["Int64", "UInt64"] {
        let a = file(kind, [large, 1, 2, i64::MAX]);
        assert_eq!(compare(&a, &a.clone()).unwrap().verdict, Verdict::Agree);
        for ids in [[large + 1, 1, 2, i64::MAX], [large, 1, 2, i64::MAX - 1]] {
            let judged = compare(&a, &file(kind, ids)).unwrap();
            let field = &judged.fields[0].field;
            assert_eq!((field.verdict, field.max_abs), (Verdict::Disagree, 1.0));
            let (other, first) = (ids[0].max(ids[3]), ids.contains(&large));
            let said = field.reason.as_ref().expect("the numbers are named");
            let number = if first { other } else { ids[0] };
            assert!(said.contains(&number.to_string()), "{said}");
        }
    }
    // Labels are compared exactly as well, unless they have a separate tolerance.
    let (a, b) = (
        file("Int32", [2_000_000_000, 1, 2, 3]),
        file("Int32", [2_000_000_001, 1, 2, 3]),
    );
    assert_eq!(compare(&a, &b).unwrap().verdict, Verdict::Disagree);
    let own = Tolerance {
        rtol: 1e-9,
        atol: 0.0,
    };
    let tolerances = Tolerances {
        of_field: vec![("GlobalNodeId".into(), own)],
        ..Tolerances::default()
    };
    let judged = compare_results(&a, &b, &tolerances.into()).unwrap();
    assert_eq!(judged.verdict, Verdict::Agree);
}

#[test]
fn data_about_the_whole_are_compared() {
    let u = array("Float64", "u", &[1.0, 2.0, 3.0, 4.0]);
    let cells = [[0, 1, 2], [0, 2, 3]];
    let file = |name: &str, whole: &str| vtu(name, &SQUARE, &cells, &u, whole);
    let at = |time: f64| array("Float64", "TimeValue", &[time]);
    let a = file("a.vtu", &at(0.5));
    let same = compare(&a, &file("b.vtu", &at(0.5))).unwrap();
    assert_eq!((same.verdict, same.notes.len()), (Verdict::Agree, 0));
    let other = compare(&a, &file("b.vtu", &at(0.7))).unwrap();
    assert_eq!(other.verdict, Verdict::Disagree);
    let time = &other.fields.last().expect("judged").field;
    assert_eq!(
        (time.field.as_str(), time.verdict),
        ("TimeValue", Verdict::Disagree)
    );
    for (a, b) in [("", at(0.5)), (&at(0.5), String::new())] {
        let one = compare(&file("a.vtu", a), &file("b.vtu", &b)).unwrap();
        assert_eq!(one.verdict, Verdict::Agree);
        assert!(one.notes[0].contains("TimeValue"), "{:?}", one.notes);
    }
    let none = array("Float64", "TimeValue", &[0.0; 0]);
    let none = compare(&file("a.vtu", &none), &file("b.vtu", &none)).unwrap();
    assert_eq!(none.verdict, Verdict::Agree);
    let two = array("Float64", "TimeValue", &[0.5, 0.5]);
    assert_ne!(
        compare(&a, &file("b.vtu", &two)).unwrap().verdict,
        Verdict::Agree
    );
}

/// Two bodies; `broken` gives every cell separate points, so that cells share only positions.
fn bodies(name: &str, large: f64, small: f64, broken: bool) -> Results {
    let mut places = Vec::new();
    let mut cells = Vec::new();
    let mut u = Vec::new();
    for (shift, size) in [(0.0, large), (5.0, small)] {
        let first = places.len() as u32;
        let corners = if broken {
            vec![0, 1, 2, 0, 2, 3]
        } else {
            vec![0, 1, 2, 3]
        };
        for &corner in &corners {
            places.push([SQUARE[corner][0] + shift, SQUARE[corner][1]]);
            u.push(size * [1e-12, 0.5, 1.0, 0.7][corner]);
        }
        let of_body = if broken {
            [[0, 1, 2], [3, 4, 5]]
        } else {
            [[0, 1, 2], [0, 2, 3]]
        };
        cells.extend(of_body.map(|cell| cell.map(|v| v + first)));
    }
    vtu(name, &places, &cells, &array("Float64", "u", &u), "")
}

#[test]
fn a_small_body_beside_a_large_one_is_judged_on_its_own_scale() {
    for broken in [false, true] {
        let a = bodies("a.vtu", 1e13, 1.0, broken);
        let compared = |large, small| compare(&a, &bodies("b.vtu", large, small, broken)).unwrap();
        assert_eq!(compared(1e13, 1.0).verdict, Verdict::Agree);
        assert_eq!(compared(1e13, 1.0 + 1e-11).verdict, Verdict::Agree);
        let off = compared(1e13, 1.001);
        assert_eq!(
            (off.verdict, off.fields[0].scale),
            (Verdict::Disagree, Some(1e13))
        );
        // One part has one scale: the corner where u is 1e-12 of the largest value may have an error larger than that.
        let mut b = bodies("b.vtu", 1e13, 1.0, broken);
        b.on_points[0].values.to_mut()[0] += 1.0;
        assert_eq!(compare(&a, &b).unwrap().verdict, Verdict::Agree);
    }
    // The same two bodies, one file continuous and the other not.
    let (a, b) = (
        bodies("a.vtu", 1e13, 1.0, false),
        bodies("b.vtu", 1e13, 1.001, true),
    );
    for (one, two) in [(&a, &b), (&b, &a)] {
        assert_eq!(compare(one, two).unwrap().verdict, Verdict::Disagree);
    }
}

#[test]
fn no_two_kinds_of_keys_panic() {
    let u = array("Float64", "mean", &[1.0, 2.0, 3.0, 4.0]);
    let cells = [[0, 1, 2], [0, 2, 3]];
    let mut files = vec![
        read("vertex.csv", "vertex,mean\n0,1\n4294967294,2\n"),
        read("none.csv", "vertex,mean\n"),
        read("edges.csv", "v0,v1,mean\n0,1,1\n4,7,2\n"),
        read("triangles.csv", "v0,v1,v2,mean\n0,1,2,1\n0,2,3,2\n"),
        read("plane.csv", "x,y,mean\n0,0,1\n1,0,2\n"),
        read("space.csv", "x,y,z,mean\n0,0,0,1\n1,0,1,2\n"),
        read("both.csv", "vertex,x,y,mean\n1,0,0,1\n0,1,0,2\n"),
        vtu("square.vtu", &SQUARE, &cells, &u, ""),
        vtu("cloud.vtu", &SQUARE, &[], &u, ""),
        vtu("empty.vtu", &[], &[], "", ""),
    ];
    let mut on_cells = vtu("cells.vtu", &SQUARE, &cells, "", "");
    on_cells.on_cells = read("t.csv", "v0,v1,mean\n0,1,1\n4,7,2\n").on_cells;
    let nothing = Results {
        on_cells: read("t.csv", "v0,v1,mean\n").on_cells,
        ..files[8].clone()
    };
    files.extend([on_cells, nothing]);
    for a in &files {
        for b in &files {
            for map in [None, Some(MatchBy::Vertices), Some(MatchBy::Coordinates)] {
                let (mut a, mut b) = (a.clone(), b.clone());
                let compared = at_midpoints(&mut a, &mut b).and_then(|()| {
                    compare_results(
                        &a,
                        &b,
                        &Settings {
                            map,
                            ..Settings::default()
                        },
                    )
                });
                if a.source != b.source
                    && let Err(error) = compared
                {
                    let said = error.to_string();
                    assert!(
                        said.contains(&a.source) || said.contains(&b.source),
                        "{said}"
                    );
                }
            }
        }
    }
    let (mut edges, mut places) = (files[2].clone(), files[4].clone());
    let error = at_midpoints(&mut edges, &mut places)
        .unwrap_err()
        .to_string();
    assert!(error.contains("edges.csv has no coordinates"), "{error}");
}

#[test]
fn many_fields_are_judged_in_the_time_that_reading_them_takes() {
    let count = 100_000;
    let names: Vec<String> = (0..count).map(|k| format!("f{k}")).collect();
    let values = |last: &str| vec!["1"; count - 1].join(",") + "," + last;
    let table = |last: &str| format!("vertex,{}\n0,{}\n", names.join(","), values(last));
    let (a, b) = (read("a.csv", &table("1")), read("b.csv", &table("2")));
    let judged = compare(&a, &b).unwrap();
    let beyond = judged.fields.iter().filter(|f| f.field.beyond > 0);
    assert_eq!((judged.fields.len(), beyond.count()), (count, 1));
}
