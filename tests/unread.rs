//! What a reader did not read is undetermined: it never agrees, unless somebody leaves it out by name.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{assert_valid, folder, run, source, write};

/// Writes `a` and `b` of a text with `{u}` where the values are.
fn pair(folder: &Path, suffix: &str, text: &str, values: [&str; 2]) -> [String; 2] {
    ["a", "b"].map(|name| {
        let name = format!("{name}.{suffix}");
        let values = values[usize::from(name.starts_with('b'))];
        write(folder, &name, &text.replace("{u}", values));
        name
    })
}

fn code(folder: &Path, [a, b]: &[String; 2], more: &[&str]) -> Option<i32> {
    run(folder, &[&["compare", a, b, "--quiet"], more].concat()).code
}

const VTU: &str = r#"<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="3" NumberOfCells="1"><Points><DataArray type="Float64" NumberOfComponents="3">0 0 0 1 0 0 0 1 0</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity">0 1 2</DataArray><DataArray type="Int64" Name="offsets">3</DataArray>
<DataArray type="UInt8" Name="types">5</DataArray></Cells>
<PointData><DataArray type="Float64" Name="p">1 2 3</DataArray><DataArray type="TYPE" Name="u">{u}</DataArray></PointData>
</Piece></UnstructuredGrid></VTKFile>"#;

const XDMF: &str = r#"<Xdmf Version="3.0"><Domain><Grid>
<Geometry GeometryType="XY"><DataItem Dimensions="3 2" Format="XML">0 0 1 0 0 1</DataItem></Geometry>
<Topology TopologyType="Triangle" NumberOfElements="1"><DataItem Dimensions="1 3" NumberType="Int" Format="XML">0 1 2</DataItem></Topology>
<Attribute Name="p" Center="Node"><DataItem Dimensions="3" Format="XML">1 2 3</DataItem></Attribute>
<Attribute Name="u" KIND><DataItem Dimensions="3" Format="XML">{u}</DataItem></Attribute>
</Grid></Domain></Xdmf>"#;

const MSH: &str =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes
$Elements\n1\n1 2 2 1 1 1 2 3\n$EndElements
$NodeData\n1\n\"p\"\n0\n3\n0\n1\n3\n1 1\n2 2\n3 3\n$EndNodeData\n$Own\n{u}\n$EndOwn\n";

#[test]
fn arrays_of_another_spelling_are_read_and_of_another_kind_undetermined() {
    for kind in ["float64", "vtkIdType", "double"] {
        let folder = folder();
        let text = VTU.replace("TYPE", kind);
        let files = pair(folder.path(), "vtu", &text, ["1 2 3", "100 200 300"]);
        assert_eq!(code(folder.path(), &files, &[]), Some(1), "{kind}");
    }
    let kinds = [
        ("vtu", VTU.replace("TYPE", "Complex128"), "u"),
        ("msh", MSH.to_owned(), "$Own"),
        ("xdmf", XDMF.replace("KIND", "Center=\"Face\""), "u"),
        ("xdmf", XDMF.replace("KIND", "Center=\"Edge\""), "u"),
        ("xdmf", XDMF.replace("KIND", "Center=\"Other\""), "u"),
        (
            "xdmf",
            XDMF.replace("KIND", "ItemType=\"FiniteElementFunction\" ElementFamily=\"DG\" ElementDegree=\"1\" Center=\"Other\""),
            "u",
        ),
    ];
    for (suffix, text, name) in kinds {
        let folder = folder();
        let at = folder.path();
        let files = pair(at, suffix, &text, ["1 2 3", "100 200 300"]);
        let [a, b] = &files;
        let ran = run(at, &["compare", a, b, "--json", "-", "--junit", "j.xml"]);
        assert_eq!(ran.code, Some(2), "{suffix}: {}", ran.stdout);
        let json = ran.json();
        assert_eq!(json["verdict"], "undetermined");
        let rows = json["fields"].as_array().unwrap();
        let row = rows.iter().find(|row| row["on"] == "unread").unwrap();
        assert_eq!(
            (&row["field"], &row["verdict"]),
            (&name.into(), &"undetermined".into())
        );
        let reason = row["reason"].as_str().unwrap();
        assert!(reason.contains("not read in a"), "{reason}");
        let junit = fs::read_to_string(at.join("j.xml")).unwrap();
        assert!(
            junit.contains(&format!("{name} on unread").to_lowercase()),
            "{junit}"
        );
        assert_eq!(code(at, &files, &["--except", name]), Some(0), "{suffix}");
        assert_eq!(code(at, &files, &["--only", "p"]), Some(0), "{suffix}");
        let check = run(at, &["mesh", "check", a]);
        assert_eq!(check.code, Some(1), "{}", check.stdout);
        assert!(check.stdout.contains("not read"), "{}", check.stdout);
        // Equal bytes are equal whatever they mean.
        fs::copy(at.join(a), at.join(b)).unwrap();
        let copied = code(at, &files, &[]);
        let expected = if suffix == "xdmf" { 2 } else { 0 };
        assert_eq!(copied, Some(expected), "{suffix}");
    }
}

#[test]
fn rows_beyond_their_number_are_a_finding_of_the_check() {
    let folder = folder();
    let at = folder.path();
    let text = fs::read_to_string(source("tests/data/square-2.2.msh")).unwrap();
    let (before, after) = text.split_once("$EndElements").unwrap();
    let (_, last) = before.trim_end().rsplit_once('\n').unwrap();
    let last = last.split_once(' ').unwrap().1;
    write(
        at,
        "more.msh",
        &format!("{before}99 {last}\n$EndElements{after}"),
    );
    let check = run(at, &["mesh", "check", "more.msh", "--json", "o.json"]);
    assert_eq!(check.code, Some(1), "{}", check.stdout);
    assert!(
        check.stdout.contains("1 part that was not read"),
        "{}",
        check.stdout
    );
    assert_valid(
        "json",
        "src/report/schema/mesh-check-1.json",
        &at.join("o.json"),
    );
    // An oddity that leaves nothing out is told, and no fault.
    write(at, "odd.msh", &text.replace("$EndNodes", "$EndNode"));
    let check = run(at, &["mesh", "check", "odd.msh", "--json", "o.json"]);
    assert_eq!(check.code, Some(0), "{}", check.stdout);
    assert!(
        check.stdout.contains("$EndNodes is written $EndNode"),
        "{}",
        check.stdout
    );
    assert_valid(
        "json",
        "src/report/schema/mesh-check-1.json",
        &at.join("o.json"),
    );
}

#[test]
fn a_header_that_declares_what_is_not_there_is_found() {
    let folder = folder();
    let at = folder.path();
    let text = VTU.replace("TYPE", "Float64").replace("{u}", "1 2 3");
    write(at, "a.vtu", &text);
    let made = run(at, &["mesh", "convert", "a.vtu", "a.exo"]);
    assert_eq!(made.code, Some(0), "{}", made.stderr);
    let check = run(at, &["mesh", "info", "a.exo"]).stdout;
    assert!(!check.contains("not read"), "{check}");
    // The variables are there, and nobody knows them by these names.
    let mut bytes = fs::read(at.join("a.exo")).unwrap();
    let names: Vec<usize> = (0..bytes.len())
        .filter(|&k| bytes[k..].starts_with(b"coordx"))
        .collect();
    names.iter().for_each(|&k| bytes[k] = b'k');
    let names: Vec<usize> = (0..bytes.len())
        .filter(|&k| bytes[k..].starts_with(b"coordy"))
        .collect();
    names.iter().for_each(|&k| bytes[k] = b'k');
    let names: Vec<usize> = (0..bytes.len())
        .filter(|&k| bytes[k..].starts_with(b"connect"))
        .collect();
    names.iter().for_each(|&k| bytes[k] = b'k');
    fs::write(at.join("b.exo"), bytes).unwrap();
    let check = run(at, &["mesh", "check", "b.exo"]);
    assert_eq!(check.code, Some(1), "{}{}", check.stdout, check.stderr);
    assert!(
        check.stdout.contains("nodes, which are not in the file"),
        "{}",
        check.stdout
    );
}

/// Moves a data set of each file into another file, behind a link.
const LINKS: &str = r#"
import h5py, sys
for name, path, scale in [(f"{n}.{s}", p, k) for s, p in [
    ("med", None), ("vtkhdf", "/VTKHDF/PointData/u"), ("cgns", None)
] for n, k in [("a", 1), ("b", 1000)]]:
    with h5py.File(name, "r+") as file:
        if path is None:
            found = []
            def see(at, thing):
                wanted = at.endswith("/CO") and "/u/" in at if name.endswith("med") else at.endswith("/u/ data")
                if isinstance(thing, h5py.Dataset) and wanted:
                    found.append(at)
            file.visititems(see)
            path = found[0]
        with h5py.File(name + "-data.h5", "w") as other:
            other["u"] = scale * file[path][()]
        del file[path]
        kind = sys.argv[1]
        file[path] = h5py.ExternalLink(name + "-data.h5", "/u") if kind == "external" else h5py.SoftLink("/nowhere")
"#;

#[test]
fn links_out_of_a_file_are_unread_and_name_their_targets() {
    let python = source("target/python/bin/python3");
    for (kind, target) in [("external", "-data.h5"), ("soft", "/nowhere")] {
        let folder = folder();
        let at = folder.path();
        let text = VTU.replace("TYPE", "Float64");
        write(at, "a.vtu", &text.replace("{u}", "1 2 3"));
        for suffix in ["med", "vtkhdf", "cgns"] {
            for name in ["a", "b"] {
                let name = format!("{name}.{suffix}");
                let made = run(at, &["mesh", "convert", "a.vtu", &name]);
                assert_eq!(made.code, Some(0), "{}", made.stderr);
            }
        }
        let ran = Command::new(&python)
            .args(["-c", LINKS, kind])
            .current_dir(at)
            .output();
        let ran = ran.unwrap();
        assert!(
            ran.status.success(),
            "{}",
            String::from_utf8_lossy(&ran.stderr)
        );
        for suffix in ["med", "vtkhdf", "cgns"] {
            let files = ["a", "b"].map(|name| format!("{name}.{suffix}"));
            let ran = run(at, &["compare", &files[0], &files[1]]);
            assert_eq!(ran.code, Some(2), "{suffix}: {}{}", ran.stdout, ran.stderr);
            assert!(ran.stdout.contains(target), "{suffix}: {}", ran.stdout);
            let info = run(at, &["mesh", "info", &files[0]]);
            assert!(info.stdout.contains(target), "{suffix}: {}", info.stdout);
            assert_eq!(code(at, &files, &["--only", "p"]), Some(0), "{suffix}");
        }
    }
}
