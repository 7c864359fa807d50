//! Inconsistent files: each is rejected with a message, immediately, and before memory is allocated for what it declares.

use super::tests::{ENCODINGS, provenance, square};
use super::*;
use crate::io::out::Out;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;

/// A sound file of one triangle with one array on points, each part replaceable.
struct File {
    head: String,
    root: String,
    counts: String,
    points: String,
    connectivity: String,
    offsets: String,
    types: String,
    array: String,
    tail: String,
}

impl Default for File {
    fn default() -> Self {
        let ascii = |kind: &str, name: &str, text: &str| {
            format!(
                "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{text}</DataArray>"
            )
        };
        File {
            head: String::new(),
            root: "type=\"UnstructuredGrid\"".into(),
            counts: "NumberOfPoints=\" 3\" NumberOfCells=\"1 \"".into(),
            points: ascii("Float64", "Points", "0 0 0 1 0 0 0 1e0 0"),
            connectivity: ascii("Int32", "connectivity", "0 1 2"),
            offsets: ascii("Int16", "offsets", "3"),
            types: ascii("UInt8", "types", "69"),
            array: ascii("Float32", "u", " 1\r\n 2\t-inf "),
            tail: "</VTKFile>".into(),
        }
    }
}

impl File {
    fn read(&self) -> Result<Content> {
        let File {
            head,
            root,
            counts,
            points,
            connectivity,
            offsets,
            types,
            array,
            tail,
        } = self;
        let text = format!(
            "{head}<VTKFile {root}><UnstructuredGrid><Piece {counts}><PointData>{array}</PointData>\
             <Points>{points}</Points><Cells>{connectivity}{offsets}{types}</Cells></Piece>\
             </UnstructuredGrid>{tail}"
        );
        from_bytes(Path::new("test.vtu"), text.as_bytes())
    }

    /// The message that refuses this file.
    fn refusal(&self) -> String {
        self.read().expect_err("a broken file").to_string()
    }
}

fn file(change: impl FnOnce(&mut File)) -> File {
    let mut file = File::default();
    change(&mut file);
    file
}

/// An array of three Float32 on points from these bytes in base64.
fn binary(bytes: &[u8]) -> String {
    let text = BASE64_STANDARD.encode(bytes);
    format!("<DataArray type=\"Float32\" Name=\"u\" format=\"binary\">{text}</DataArray>")
}

fn words(words: &[u32]) -> Vec<u8> {
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

#[test]
fn blanks_and_missing_attributes_are_taken() {
    let vtu = File::default().read().expect("a sound file");
    assert_eq!(vtu.mesh.blocks[0].kind, crate::mesh::CellKind::Triangle);
    assert_eq!(vtu.mesh.points[2], [0.0, 1.0, 0.0]);
    assert_eq!(vtu.mesh.fields.len(), 1);
    let key = "<InformationKey name=\"K\"><Value>7</Value></InformationKey>";
    let with_key = file(|f| {
        f.array = f
            .array
            .replace("</DataArray>", &format!("{key}</DataArray>"))
    });
    assert_eq!(with_key.read().expect("a sound file").mesh, vtu.mesh);
}

#[test]
fn headers_may_be_padded_apart_and_lines_broken() {
    let values = words(&[1f32.to_bits(), 2f32.to_bits(), 3f32.to_bits()]);
    let (header, body) = (
        BASE64_STANDARD.encode(words(&[12])),
        BASE64_STANDARD.encode(&values),
    );
    let apart = format!(
        "<DataArray type=\"Float32\" Name=\"u\" format=\"binary\">\n{header}{}\n {}</DataArray>",
        &body[..5],
        &body[5..]
    );
    let together = binary(&[words(&[12]), values].concat());
    for array in [apart, together] {
        let vtu = file(|f| f.array = array).read().expect("a sound file");
        let expected = crate::mesh::Values::F32(vec![1.0, 2.0, 3.0].into());
        assert_eq!(vtu.mesh.fields[0].values, expected);
    }
}

#[test]
fn big_endian_is_read() {
    let bytes: Vec<u8> = [12, 1f32.to_bits(), 2f32.to_bits(), 3f32.to_bits()]
        .iter()
        .flat_map(|word: &u32| word.to_be_bytes())
        .collect();
    let mut big = file(|f| f.array = binary(&bytes));
    big.root += " byte_order=\"BigEndian\"";
    let expected = crate::mesh::Values::F32(vec![1.0, 2.0, 3.0].into());
    assert_eq!(
        big.read().expect("a sound file").mesh.fields[0].values,
        expected
    );
}

#[test]
fn more_values_than_points_are_not_read() {
    let more = file(|f| f.array = f.array.replace("-inf", "3 4"));
    let vtu = more.read().expect("read");
    let what = "the rest of the array \"u\", which has 4 numbers where the counts make 3";
    assert_eq!(vtu.unread, [what]);
    assert_eq!(vtu.mesh.fields[0].values.len(), 3);
}

#[test]
fn contradictions_are_refused_with_their_place() {
    let cases: Vec<(File, &str)> = vec![
        (file(|f| f.counts = f.counts.replace('3', "4")), "Points"),
        (file(|f| f.counts = f.counts.replace('1', "2")), "offsets"),
        (
            file(|f| f.counts = f.counts.replace('3', "1000000000000000000")),
            "Points",
        ),
        (
            file(|f| f.counts = f.counts.replace('3', "18446744073709551615")),
            "Points",
        ),
        (
            file(|f| f.counts = f.counts.replace('3', "-3")),
            "NumberOfPoints",
        ),
        (
            file(|f| f.counts = "NumberOfCells=\"1\"".into()),
            "NumberOfPoints",
        ),
        (
            file(|f| f.points = f.points.replace("1e0", "nan")),
            "point 2 is not finite",
        ),
        (
            file(|f| f.points = f.points.replace("1e0", "1e999")),
            "Points",
        ),
        (
            file(|f| f.points = f.points.replace("1e0", "1,0")),
            "Points",
        ),
        (
            file(|f| f.connectivity = f.connectivity.replace("1 2", "1 3")),
            "point 3",
        ),
        (
            file(|f| f.connectivity = f.connectivity.replace("0 1", "0 -1")),
            "connectivity",
        ),
        (
            file(|f| f.offsets = f.offsets.replace('3', "2")),
            "connectivity",
        ),
        (
            file(|f| f.types = f.types.replace("69", "42")),
            "faces of the polyhedron 0",
        ),
        (
            file(|f| f.types = f.types.replace("69", "10")),
            "type 10 with 3 points",
        ),
        (
            file(|f| f.types = f.types.replace("69", "200")),
            "type 200 with 3 points",
        ),
        (file(|f| f.array = f.array.replace("-inf", "")), "\"u\""),
        (
            file(|f| f.array = f.array.replace("ascii", "appended")),
            "no <AppendedData>",
        ),
        (file(|f| f.root += " byte_order=\"Middle\""), "byte order"),
        (file(|f| f.root += " compressor=\"vtkZstd\""), "compressor"),
        (file(|f| f.root = "type=\"PolyData\"".into()), "misplaced"),
        (
            file(|f| f.root = "type=\"Table\"".into()),
            "VTK's \"Table\"",
        ),
        (file(|f| f.tail = String::new()), "ends before"),
        (file(|f| f.tail += "<more/>"), "<more>"),
    ];
    for (file, word) in cases {
        let refusal = file.refusal();
        assert!(refusal.contains(word), "{word:?} is not in {refusal:?}");
    }
}

#[test]
fn what_the_mesh_has_no_place_for_is_told() {
    for kind in ["Bit", "String"] {
        let read = file(|f| f.array = f.array.replace("Float32", kind))
            .read()
            .expect("the rest is sound");
        let what = format!("the array \"u\" of {kind} on points");
        assert_eq!(read.unread, [&*what]);
    }
}

/// GetFEM writes the number of values as a float where their length in bytes belongs.
#[test]
fn a_length_beyond_the_file_gives_way_to_the_counts() {
    let values = [1f32, 2.0, 3.0].map(f32::to_bits);
    let lying = [&words(&[3f32.to_bits()])[..], &words(&values)].concat();
    let read = file(|f| f.array = binary(&lying))
        .read()
        .expect("read by the counts");
    assert_eq!(
        read.mesh.fields[0].values,
        crate::mesh::Values::F32(vec![1.0, 2.0, 3.0].into())
    );
    assert_eq!(read.warnings.len(), 1);
    let short = [&words(&[3f32.to_bits()])[..], &words(&values[..2])].concat();
    assert!(
        file(|f| f.array = binary(&short))
            .refusal()
            .contains("\"u\"")
    );
}

#[test]
fn lying_blocks_are_refused() {
    let zlib = |bytes: &[u8]| {
        let mut lying = file(|f| f.array = binary(bytes));
        lying.root += " compressor=\"vtkZLibDataCompressor\"";
        lying.refusal()
    };
    let cases: [(&[u32], &str); 8] = [
        (&[u32::MAX, 12, 0], "may unpack to"),
        (&[1 << 10, 12, 0], "declared"),
        (&[1, 12, 0, u32::MAX], "more bytes than there are"),
        (&[1, 12, 13, 0], "last block"),
        (&[1, 0, 0, 0], "last block"),
        (&[1, 1 << 20, 0, 0], "cannot unpack"),
        (&[1, 12], "declared"),
        (&[1, 12, 0, 4, 0], "block 0"),
    ];
    for (header, word) in cases {
        let refusal = zlib(&words(header));
        assert!(refusal.contains(word), "{word:?} is not in {refusal:?}");
    }
}

/// Blocks of zeros that unpack to 1 GB from 1 MB, as their headers declare.
#[test]
fn bombs_are_refused_before_they_unpack() {
    let block = pack::pack(1 << 16, |_, _| (), Compressor::Zlib).expect("packed");
    let block = block.blocks.concat();
    let blocks = 1 << 14;
    let lengths = std::iter::repeat_n(block.len() as u32, blocks);
    let header: Vec<u32> = [blocks as u32, 1 << 16, 0]
        .into_iter()
        .chain(lengths)
        .collect();
    let text =
        BASE64_STANDARD.encode(words(&header)) + &BASE64_STANDARD.encode(block.repeat(blocks));
    let array = |kind: &str, name: &str| {
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"binary\">{text}</DataArray>")
    };
    let compressor = " compressor=\"vtkZLibDataCompressor\"";

    let against_the_counts = file(|f| {
        f.root += compressor;
        f.points = binary(&words(&[1, 1 << 20, 0, 4, 0])).replace("\"Float32\"", "\"Float64\"");
    });
    let refusal = against_the_counts.refusal();
    assert!(refusal.contains("the counts make 72"), "{refusal}");

    let with_the_counts = file(|f| {
        f.root += compressor;
        f.counts = format!("NumberOfPoints=\"{}\" NumberOfCells=\"0\"", 1u64 << 30);
        f.points = array("Int8", "Points").replace("type", "NumberOfComponents=\"3\" type");
    });
    assert!(with_the_counts.refusal().contains("may unpack to"));

    let on_points = file(|f| {
        f.root += compressor;
        f.array = array("Int8", "u");
    });
    let refusal = on_points.refusal();
    assert!(refusal.contains("may unpack to"), "{refusal}");

    // No block needs to be sound: the sum of the lengths is too large, although each array might be unpacked.
    let array = |name: &str| binary(&words(&[1, 100 << 20, 0, 4, 0])).replace("\"u\"", name);
    let together = file(|f| {
        f.root += compressor;
        f.array = array("\"a\"") + &array("\"b\"");
    });
    let refusal = together.refusal();
    assert!(
        refusal.contains("\"b\"") && refusal.contains("may unpack to"),
        "{refusal}"
    );
}

#[test]
fn xml_tricks_are_refused() {
    let entities = "<!DOCTYPE x [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;&a;\">]>";
    assert!(
        file(|f| f.head = entities.into())
            .refusal()
            .contains("entities")
    );
    let reference = file(|f| f.array = f.array.replace("-inf", "&b;"));
    assert!(reference.refusal().contains("&b;"));
    let in_attribute = file(|f| f.array = f.array.replace("\"u\"", "\"&b;\""));
    assert!(in_attribute.refusal().contains("Name"));
    let deep = file(|f| f.array = "<a>".repeat(100_000));
    assert!(deep.refusal().contains("deep"));
    let many = file(|f| f.array = f.array.repeat(5000));
    assert!(many.refusal().contains("arrays"));
    let wide = file(|f| f.root += &(0..1000).map(|i| format!(" a{i}=\"\"")).collect::<String>());
    assert!(wide.refusal().contains("attributes"));
}

/// Every byte of sound files, changed, is either still read or refused, never a panic. `tests/run --all` changes each in two ways, else they
/// take turns.
#[test]
fn changed_bytes_never_panic() {
    let is_whole = std::env::var_os("FACEOFF_SCENES").is_some();
    for encoding in ENCODINGS {
        let bytes = write::encode(
            &square(),
            &[],
            &provenance(),
            encoding,
            layout::Topology::Cells,
            Out::default(),
        )
        .expect("sound")
        .bytes;
        for at in 0..bytes.len() {
            for (k, flip) in [0x01, 0x80].into_iter().enumerate() {
                if at % 2 == k || is_whole {
                    let mut changed = bytes.clone();
                    changed[at] ^= flip;
                    let _ = from_bytes(Path::new("test.vtu"), &changed);
                }
            }
        }
    }
}

#[test]
fn pieces_are_looked_for_beside_the_file_only() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("all.pvtu");
    let piece = folder.path().join("part.vtu");
    write(&piece, &square(), &[], &provenance(), ENCODINGS[0]).expect("written");
    let parallel = |sources: &[&str]| {
        let pieces: String = sources
            .iter()
            .map(|s| format!("<Piece Source=\"{s}\"/>"))
            .collect();
        let text = format!(
            "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid>{pieces}</PUnstructuredGrid></VTKFile>"
        );
        from_bytes(&path, text.as_bytes())
    };
    assert_eq!(
        parallel(&["./part.vtu"]).expect("read").mesh.points.len(),
        4
    );
    // Once for each kind of function, as dolfinx 0.5 lists it.
    let twice = parallel(&["part.vtu", "part.vtu"]).expect("read");
    assert_eq!(twice.mesh.points.len(), 4);
    assert!(twice.warnings.iter().any(|w| w.contains("read once")));
    for sources in [&["../part.vtu"][..], &["/part.vtu"], &[""], &["none.vtu"]] {
        assert!(parallel(sources).is_err(), "{sources:?}");
    }
}
