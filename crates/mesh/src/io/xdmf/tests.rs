use crate::io;
use crate::mesh::Support;

fn read(text: &str) -> crate::Result<io::Content> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.xdmf");
    std::fs::write(folder.path().join("a.bin"), 1.5_f32.to_be_bytes().repeat(3)).expect("written");
    io::parse(
        &path,
        format!("<Xdmf Version=\"3.0\"><Domain>{text}</Domain></Xdmf>").as_bytes(),
        None,
    )
}

const MESH: &str = "<Grid Name=\"m\"><Topology TopologyType=\"Mixed\"><DataItem Dimensions=\"9\" NumberType=\"Int\">
    4 0 1 2  2 2 0 1  1</DataItem></Topology>
    <Geometry GeometryType=\"XY\"><DataItem Dimensions=\"3 2\">0 0 1 0 0 1</DataItem></Geometry></Grid>";

#[test]
fn grids_over_time_include_their_mesh() {
    let mesh = MESH.replace("9\"", "8\"").replace("0 1  1<", "0 1<");
    let at = |time: f64, value: f64| {
        format!(
            "<Grid><xi:include xpointer=\"xpointer(//Grid[@Name=&quot;m&quot;]/*[self::Topology or self::Geometry])\"/>
             <Time Value=\"{time}\"/><Attribute Name=\"u\" Center=\"Cell\"><DataItem Dimensions=\"2\">{value} 2</DataItem></Attribute></Grid>"
        )
    };
    let text = format!(
        "{mesh}<Grid GridType=\"Collection\" CollectionType=\"Temporal\">{}{}</Grid>",
        at(0.0, 1.0),
        at(2.5, 7.0)
    );
    let content = read(&text).unwrap();
    assert_eq!(
        (content.mesh.points.len(), content.mesh.cell_count()),
        (3, 2)
    );
    let found: Vec<_> = content
        .mesh
        .fields
        .iter()
        .map(|f| (f.on, f.time, f.values.to_f64()))
        .collect();
    let expected = |time, value| (Support::Cells, Some(time), vec![value, 2.0]);
    assert_eq!(found, [expected(0.0, 1.0), expected(2.5, 7.0)]);
}

#[test]
fn structured_grids_slabs_and_bytes_are_read() {
    let text = "<Grid><Topology TopologyType=\"3DCoRectMesh\" Dimensions=\"2 2 3\"/><Geometry GeometryType=\"ORIGIN_DXDYDZ\">
        <DataItem Dimensions=\"3\">5 0 0</DataItem><DataItem Dimensions=\"3\">2 1 1</DataItem></Geometry>
        <Attribute Name=\"h\" Center=\"Cell\"><DataItem ItemType=\"HyperSlab\" Dimensions=\"2\">
        <DataItem Dimensions=\"3 2\" NumberType=\"Int\">1 0 1 2 1 2</DataItem>
        <DataItem Dimensions=\"2 4\">0 1 2 3 4 5 6 7</DataItem></DataItem></Attribute></Grid>";
    let mesh = read(text).unwrap().mesh;
    assert_eq!(mesh.cell_count(), 2);
    assert_eq!(mesh.points[11], [2.0, 1.0, 7.0]);
    assert_eq!(mesh.fields[0].values.to_f64(), [4.0, 6.0]);
    let beyond = MESH.replace("9\"", "8\"").replace("0 1  1<", "0 3<");
    let error = read(&beyond).unwrap_err().to_string();
    assert!(error.contains("the node 3 of 3"), "{error}");
    for (from, to, part) in [
        ("Mixed", "Sphere", "\"sphere\" is not read"),
        ("Dimensions=\"9\"", "Dimensions=\"8\"", "has 9 values"),
        (
            "<DataItem Dimensions=\"3 2\">",
            "<DataItem Format=\"HDF\">../x.h5:/a",
            "not in the folder of this file",
        ),
        ("</Grid>", "", "not well-formed"),
    ] {
        let error = read(&MESH.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
}

/// As codes write a vector that have its components apart; other functions are refused.
#[test]
fn what_is_joined_is_a_vector() {
    let mesh = MESH.replace("9\"", "8\"").replace("0 1  1<", "0 1<");
    let joined = |function: &str, last: &str| {
        let list = |numbers: &str| {
            let count = numbers.split(' ').count();
            format!("<DataItem Dimensions=\"{count}\">{numbers}</DataItem>")
        };
        read(&mesh.replace(
            "</Grid>",
            &format!(
                "<Attribute Name=\"u\" AttributeType=\"Vector\" Center=\"Node\">
                 <DataItem ItemType=\"Function\" Function=\"{function}\" Dimensions=\"3 2\">{}{}</DataItem>
                 </Attribute></Grid>",
                list("1 2 3"),
                list(last)
            ),
        ))
    };
    let mesh = joined("JOIN($0 , $1)", "4 5 6").expect("read").mesh;
    let u = &mesh.fields[0];
    assert_eq!(u.components, 2);
    assert_eq!(u.values.to_f64(), [1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
    for (function, last, words) in [
        ("$0 + $1", "4 5 6", "the function"),
        ("JOIN($1, $0)", "4 5 6", "the function"),
        ("JOIN($0, $1)", "4 5", "not of one length"),
    ] {
        let error = joined(function, last).expect_err(words).to_string();
        assert!(error.contains(words), "{error}");
    }
}
