//! A run that was asked to end does: alone in its process, as there is no way back.

use faceoff_judge::{Settings, align, compare_results};
use faceoff_mesh::cancel::{self, Cause};
use faceoff_mesh::mesh::check::check;
use faceoff_mesh::mesh::generate::union_jack;
use faceoff_mesh::{Error, Result, Triangulation, field::FaceFields, io};

#[test]
fn nothing_is_judged_after_the_end() {
    let table = |name: &str| {
        let text = b"x,y,u\n0,0,1\n1,0,2\n";
        io::read_results(name.as_ref(), text, None).expect("a table")
    };
    let (a, b) = (table("a.csv"), table("b.csv"));
    let faces = FaceFields {
        source: "a".into(),
        dim: 2,
        space: 2,
        vertices: vec![0, 1, 1, 2],
        midpoints: Vec::new(),
        measures: Vec::new(),
        columns: Vec::new(),
    };
    let mesh = union_jack(4, [1.0, 1.0]);
    let all = || -> [(&str, Result<()>); 4] {
        [
            ("align", align(&faces, &faces).map(drop)),
            (
                "compare",
                compare_results(&a, &b, &Settings::default()).map(drop),
            ),
            ("check", check(&mesh).map(drop)),
            ("triangulation", Triangulation::new("m", &mesh).map(drop)),
        ]
    };
    for (what, done) in all() {
        assert!(done.is_ok(), "{what}");
    }
    cancel::end(Cause::Signal);
    for (what, done) in all() {
        assert!(matches!(done, Err(Error::Ended(_))), "{what}: {done:?}");
    }
}
