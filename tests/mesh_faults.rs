//! Mesh files that lie, break off or contradict themselves, given to the program: exit code 2, one sentence that
//! says where, in little memory and without counting to the end, and nothing written.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::common::{folder, run, source, told, write};
use crate::faults::is_running;
use ::faceoff_mesh::io;
use ::faceoff_mesh::mesh::{CellBlock, CellKind, Mesh};

/// Memory that a refusal may take beyond the size of the file, in kB, and seconds of a core, whatever else runs.
const LIMITS: [usize; 2] = [256 << 10, 60];

/// The program says no to these bytes, in one sentence with these words.
fn refused(folder: &Path, name: &str, bytes: &[u8], words: &[&str]) {
    std::fs::write(folder.join(name), bytes).unwrap();
    for action in [
        &["info", name, "--json", "-"][..],
        &["check", name, "--json", "-"],
        &["convert", name, "out.vtu", "--lossy"],
    ] {
        let mut shell = Command::new("sh");
        let [memory, seconds] = LIMITS;
        let memory = memory + bytes.len() / 1024;
        let limited = format!("ulimit -d {memory}; ulimit -t {seconds}; exec \"$@\"");
        shell
            .args(["-c", &limited, "sh", env!("CARGO_BIN_EXE_faceoff"), "mesh"])
            .args(action)
            .current_dir(folder)
            // Stacks of threads count, and no machine's number of cores is to decide.
            .env("RAYON_NUM_THREADS", "2");
        let ran = told(shell.output().unwrap());
        let shown = String::from_utf8_lossy(&bytes[..bytes.len().min(300)]);
        assert_eq!(
            ran.code,
            Some(2),
            "{name}, {action:?}: {shown}\n{}",
            ran.stderr
        );
        let sentence = ran.stderr.trim_end();
        // Nothing but the same in JSON.
        if action.contains(&"--json") {
            let error = format!("faceoff: {}", ran.json()["error"].as_str().unwrap());
            let plain = |text: &str| text.replace(|c: char| c.is_control() || c == '\u{fffd}', "");
            assert_eq!(plain(&error), plain(sentence), "{shown}");
        } else {
            assert_eq!(ran.stdout, "", "{shown}");
        }
        assert_eq!(sentence.lines().count(), 1, "{sentence}");
        assert!(
            sentence.starts_with(&format!("faceoff: {name}")),
            "{sentence}"
        );
        for word in words {
            assert!(sentence.contains(word), "{word:?} is not in {sentence:?}");
        }
        assert!(!folder.join("out.vtu").exists(), "{shown}");
    }
}

const HUGE: &str = "1000000000000000000";
const V22: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
const V41: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
const NODES: &str = "$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n";
const BLOCKS: &str = "$Nodes\n1 3 1 3\n2 1 0 3\n1\n2\n3\n0 0 0\n1 0 0\n0 1 0\n$EndNodes\n";

#[test]
fn counts_that_the_file_cannot_hold() {
    let folder = folder();
    let cases = [
        (format!("$NOD\n{HUGE}\n1 0 0 0\n$ENDNOD\n"), ":2, $NOD"),
        (
            format!("{V22}$Nodes\n{HUGE}\n1 0 0 0\n$EndNodes\n"),
            ":5, $Nodes",
        ),
        (
            format!("{V22}{NODES}$Elements\n{HUGE}\n1 2 0 1 2 3\n$EndElements\n"),
            "$Elements",
        ),
        (
            format!("{V22}{NODES}$Elements\n1\n1 2 {HUGE} 1 2 3\n$EndElements\n"),
            "$Elements",
        ),
        (
            format!("{V22}$PhysicalNames\n{HUGE}\n1 1 \"a\"\n$EndPhysicalNames\n"),
            "$PhysicalNames",
        ),
        (
            format!("{V41}$Entities\n0 {HUGE} 0 0\n$EndEntities\n"),
            "$Entities",
        ),
        (
            format!("{V41}$Entities\n1 0 0 0\n1 0 0 0 {HUGE} 1\n$EndEntities\n"),
            "$Entities",
        ),
        (
            format!("{V41}$Nodes\n{HUGE} 1 1 1\n2 1 0 1\n1\n0 0 0\n$EndNodes\n"),
            "$Nodes",
        ),
        (
            format!("{V41}$Nodes\n1 {HUGE} 1 1\n2 1 0 1\n1\n0 0 0\n$EndNodes\n"),
            "$Nodes",
        ),
        (
            format!("{V41}$Nodes\n1 1 1 1\n2 1 0 {HUGE}\n1\n0 0 0\n$EndNodes\n"),
            "$Nodes",
        ),
        (
            format!("{V41}{BLOCKS}$Elements\n1 1 1 1\n2 1 2 {HUGE}\n1 1 2 3\n$EndElements\n"),
            "$Elements",
        ),
        (
            format!("{V41}{BLOCKS}$Elements\n{HUGE} 1 1 1\n2 1 2 1\n1 1 2 3\n$EndElements\n"),
            "$Elements",
        ),
        (
            format!(
                "{V22}{NODES}$Elements\n1\n1 2 0 1 2 3\n$EndElements\n$NodeData\n1\n\"u\"\n1\n0\n3\n0\n1\n{HUGE}\n1 0\n$EndNodeData\n"
            ),
            "$NodeData",
        ),
        (
            format!(
                "{V22}{NODES}$Elements\n1\n1 2 0 1 2 3\n$EndElements\n$NodeData\n1\n\"u\"\n1\n0\n3\n0\n1000000000\n1\n1 0\n$EndNodeData\n"
            ),
            "$NodeData",
        ),
        (
            format!(
                "{V22}{NODES}$Elements\n1\n1 2 0 1 2 3\n$EndElements\n$Periodic\n{HUGE}\n1 2 4\n0\n$EndPeriodic\n"
            ),
            "$Periodic",
        ),
    ];
    for (text, place) in &cases {
        refused(folder.path(), "a.msh", text.as_bytes(), &[place]);
    }
    let free = format!("3 {HUGE} 0\n0 0 1\n1 0 1\n0 1 1\n1 2 3 0\n");
    refused(folder.path(), "a.msh", free.as_bytes(), &[]);
    let medit = format!("MeshVersionFormatted 2\nDimension 3\nVertices\n{HUGE}\n0 0 0 0\nEnd\n");
    refused(folder.path(), "a.mesh", medit.as_bytes(), &[":4"]);
}

#[test]
fn values_that_no_mesh_has() {
    let folder = folder();
    let element = "$Elements\n1\n1 2 2 1 1 1 2 3\n$EndElements\n";
    let cases = [
        (
            format!("{V22}{}{element}", NODES.replace("2 1 0 0", "2 nan 0 0")),
            ":7, $Nodes",
        ),
        (
            format!("{V22}{}{element}", NODES.replace("2 1 0 0", "2 inf 0 0")),
            ":7, $Nodes",
        ),
        (
            format!("{V22}{}{element}", NODES.replace("2 1 0 0", "2 1e999 0 0")),
            ":7, $Nodes",
        ),
        (
            format!("{V22}{}{element}", NODES.replace("2 1 0 0", "1 1 0 0")),
            "node 1 appears twice",
        ),
        (
            format!("{V22}{}{element}", NODES.replace("2 1 0 0", "-2 1 0 0")),
            "$Nodes",
        ),
        (
            format!("{V22}{NODES}$Elements\n1\n1 2 2 1 1 1 2 4\n$EndElements\n"),
            "node 4",
        ),
        (
            format!("{V22}{NODES}$Elements\n1\n1 77777 2 1 1 1 2 3\n$EndElements\n"),
            "77777",
        ),
        (
            format!("{V22}{NODES}$Elements\n2\n1 2 0 1 2 3\n1 2 0 2 3 1\n$EndElements\n"),
            "element 1 appears twice",
        ),
        (
            format!("{V22}{NODES}$Elements\n1\n1 2 0 1 2 3\n"),
            "expected $EndElements",
        ),
        (format!("{V22}{NODES}"), "no elements"),
        (format!("{V22}{element}{NODES}"), "before the nodes"),
        (format!("{V22}{NODES}{NODES}{element}"), "twice"),
        (V22.replace("2.2 0 8", "7.5 0 8") + NODES, "7.5"),
        (V22.replace("2.2 0 8", "2.2 3 8") + NODES, "not 3"),
        (V22.replace("2.2 0 8", "2.2 1 8") + NODES, "byte order"),
    ];
    for (text, word) in &cases {
        refused(folder.path(), "a.msh", text.as_bytes(), &[word]);
    }
}

#[test]
fn binary_blocks_that_lie() {
    let folder = folder();
    let sound = std::fs::read(source("tests/data/square-4.1-binary.msh")).unwrap();
    let nodes = sound.windows(7).position(|w| w == b"$Nodes\n").unwrap() + 7;
    // Number of blocks, number of nodes, and the number of nodes of the first block.
    for at in [nodes, nodes + 8, nodes + 32 + 12] {
        for value in [u64::MAX, 1 << 60, 1 << 33] {
            let mut bytes = sound.clone();
            bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
            refused(folder.path(), "a.msh", &bytes, &["$Nodes"]);
        }
    }
    let mut bytes = sound;
    let first_tag = nodes + 32 + 20;
    let nan = first_tag + 8;
    bytes[nan..nan + 8].copy_from_slice(&f64::NAN.to_le_bytes());
    refused(folder.path(), "a.msh", &bytes, &["finite"]);
}

#[test]
fn files_that_break_off() {
    let folder = folder();
    for name in [
        "square-2.2.msh",
        "square-4.1-binary.msh",
        "square-1.0.msh",
        "big-endian-4.1.msh",
    ] {
        let bytes = std::fs::read(source("tests/data").join(name)).unwrap();
        for tenth in 0..10 {
            refused(
                folder.path(),
                "a.msh",
                &bytes[..bytes.len() * tenth / 10],
                &[],
            );
        }
    }
    let square = source("tests/data/square-4.1.msh");
    let square = square.to_str().unwrap();
    for encoding in ["ascii", "base64-zlib", "raw", "raw-lz4", "raw-lzma"] {
        let words = [
            "mesh",
            "convert",
            square,
            "whole.vtu",
            "--encoding",
            encoding,
        ];
        assert_eq!(run(folder.path(), &words).code, Some(0));
        let bytes = std::fs::read(folder.path().join("whole.vtu")).unwrap();
        for tenth in 0..10 {
            refused(
                folder.path(),
                "a.vtu",
                &bytes[..bytes.len() * tenth / 10],
                &[],
            );
        }
    }
}

/// One triangle as VTU; `root` and `array` go where their names say.
fn vtu(head: &str, root: &str, points: &str, array: &str) -> String {
    format!(
        "{head}<VTKFile type=\"UnstructuredGrid\" {root}><UnstructuredGrid>\
         <Piece NumberOfPoints=\"{points}\" NumberOfCells=\"1\"><PointData>{array}</PointData><Points>\
         <DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0</DataArray></Points>\
         <Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray>\
         <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">3</DataArray>\
         <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">5</DataArray></Cells></Piece>\
         </UnstructuredGrid></VTKFile>"
    )
}

#[test]
fn bombs() {
    use base64::Engine as _;
    let folder = folder();
    let sound = vtu("", "", "3", "");
    std::fs::write(folder.path().join("sound.vtu"), &sound).unwrap();
    assert_eq!(
        run(folder.path(), &["mesh", "info", "sound.vtu"]).code,
        Some(0)
    );

    refused(
        folder.path(),
        "a.vtu",
        vtu("", "", HUGE, "").as_bytes(),
        &["Points"],
    );
    // Each entity ten of the one before: a billion laughs.
    let mut entities = String::from("<!DOCTYPE x [<!ENTITY e0 \"ha\">");
    for i in 1..10 {
        entities += &format!("<!ENTITY e{i} \"{}\">", format!("&e{};", i - 1).repeat(10));
    }
    entities += "]>";
    let array = "<DataArray type=\"Float64\" Name=\"u\" format=\"ascii\">&e9;</DataArray>";
    refused(
        folder.path(),
        "a.vtu",
        vtu(&entities, "", "3", array).as_bytes(),
        &[],
    );
    refused(
        folder.path(),
        "a.vtu",
        vtu("", "", "3", &"<a>".repeat(1_000_000)).as_bytes(),
        &[],
    );

    // Blocks of zeros, 1 GB of them from 1 MB, as the header says.
    let mut block = Vec::new();
    let zeros = vec![0u8; 1 << 18];
    std::io::Read::read_to_end(
        &mut flate2::read::ZlibEncoder::new(&zeros[..], flate2::Compression::best()),
        &mut block,
    )
    .unwrap();
    let blocks = 4096u32;
    let header = [blocks, 1 << 18, 0].into_iter();
    let header = header.chain(std::iter::repeat_n(block.len() as u32, blocks as usize));
    let header: Vec<u8> = header.flat_map(u32::to_le_bytes).collect();
    let base64 = base64::prelude::BASE64_STANDARD;
    let text = base64.encode(header) + &base64.encode(block.repeat(blocks as usize));
    let array =
        format!("<DataArray type=\"UInt8\" Name=\"u\" format=\"binary\">{text}</DataArray>");
    let root = "compressor=\"vtkZLibDataCompressor\"";
    refused(
        folder.path(),
        "a.vtu",
        vtu("", root, "3", &array).as_bytes(),
        &["\"u\""],
    );

    // One block that says it holds 24 bytes and unpacks to 64 MB.
    let mut bomb = Vec::new();
    let zeros = vec![0u8; 64 << 20];
    std::io::Read::read_to_end(
        &mut flate2::read::ZlibEncoder::new(&zeros[..], flate2::Compression::best()),
        &mut bomb,
    )
    .unwrap();
    let header: Vec<u8> = [1u32, 24, 0, bomb.len() as u32]
        .into_iter()
        .flat_map(u32::to_le_bytes)
        .collect();
    let text = base64.encode(header) + &base64.encode(&bomb);
    let array =
        format!("<DataArray type=\"Float64\" Name=\"u\" format=\"binary\">{text}</DataArray>");
    refused(
        folder.path(),
        "a.vtu",
        vtu("", root, "3", &array).as_bytes(),
        &["\"u\""],
    );
}

#[test]
fn what_is_no_mesh_is_named() {
    let folder = folder();
    let cases: [(&str, &[u8], &str); 6] = [
        ("a.msh", b"", "empty"),
        ("a.msh", b"PK\x03\x04", "compressed"),
        ("a.msh", b"\x7fELF\x02\x01", "starts with"),
        ("a.msh", b"0.5 0.5\n1 2\n", "table of numbers"),
        ("a.vtu", b"<?xml version=\"1.0\"?><html></html>", "XML"),
        ("a.mesh", b"hello\n", "hello"),
    ];
    for (name, bytes, word) in cases {
        refused(folder.path(), name, bytes, &[word]);
    }
}

/// Words for an encoding go with the format they are of.
#[test]
fn encodings_of_another_format() {
    let folder = folder();
    let square = source("tests/data/square-4.1.msh");
    let square = square.to_str().unwrap();
    let cases = [
        (
            "out.msh",
            "raw",
            "Gmsh's MSH has no encoding `raw`; use ascii or binary",
        ),
        (
            "out.msh",
            "base64-zlib",
            "Gmsh's MSH has no encoding `base64-zlib`",
        ),
        ("out.mesh", "raw-lz4", "Medit has no encoding `raw-lz4`"),
        ("out.su2", "binary", "SU2's mesh is written as text only"),
        ("out.vtu", "raw-gzip", "there is no encoding `raw-gzip`"),
        ("out.msh", "raw-gzip", "there is no encoding `raw-gzip`"),
    ];
    for (out, encoding, words) in cases {
        let ran = run(
            folder.path(),
            &[
                "mesh",
                "convert",
                square,
                out,
                "--encoding",
                encoding,
                "--lossy",
            ],
        );
        assert_eq!(ran.code, Some(2), "{encoding}: {}", ran.stderr);
        assert!(ran.stderr.contains(words), "{}", ran.stderr);
        let left = std::fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(left, 0, "{out} {encoding}");
    }
}

/// Whenever a conversion is interrupted, even by force, the target is the old file or the new one, never a part.
#[test]
fn interrupted_conversions() {
    let folder = folder();
    let lines: Vec<u32> = (0..400_000).flat_map(|i| [i, i + 1]).collect();
    let mesh = Mesh {
        points: (0..=400_000)
            .map(|i| [f64::from(i).sin(), 0.0, 0.0])
            .collect(),
        blocks: vec![CellBlock::new(CellKind::Line, lines)],
        ..Mesh::default()
    };
    io::write(
        &folder.path().join("in.vtu"),
        &mesh,
        &io::Options::default(),
    )
    .unwrap();
    for out in ["out.msh", "out.vtu"] {
        let words = ["mesh", "convert", "in.vtu", out];
        let begun = Instant::now();
        assert_eq!(run(folder.path(), &words).code, Some(0));
        let all = begun.elapsed();
        let target = folder.path().join(out);
        let whole = std::fs::read(&target).unwrap();
        let mut old = 0;
        for signal in ["-INT", "-TERM", "-KILL"] {
            // Moments are parts of the time that it takes here and now; the first ones are early anywhere.
            for part in [0.0, 0.1, 0.3, 0.5, 0.9] {
                std::fs::write(&target, "old").unwrap();
                let mut child = crate::common::faceoff(folder.path())
                    .args(words)
                    .spawn()
                    .unwrap();
                std::thread::sleep(all.mul_f64(part));
                // Twice, as the first one is a wish and the second an order.
                for _ in 0..2 {
                    let pid = child.id().to_string();
                    Command::new("kill").args([signal, &pid]).status().unwrap();
                }
                child.wait().unwrap();
                let found = std::fs::read(&target).unwrap();
                assert!(found == b"old" || found == whole, "{out} {signal} {part}");
                old += usize::from(found == b"old");
            }
        }
        assert!(old > 0, "nothing was interrupted");
    }
}

/// meshio is a process of its own, here one that only sleeps: it ends with the program, which leaves nothing.
#[test]
fn an_interruption_ends_meshio() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let python = write(
        folder.path(),
        "python",
        "#!/bin/sh\n[ \"$1\" = -c ] && echo /meshio.py && exit 0 # asked where it has meshio\nexec sleep 120.25\n",
    );
    std::fs::set_permissions(&python, PermissionsExt::from_mode(0o755)).unwrap();
    write(folder.path(), "in.msh", "(0 \"Fluent\")\n"); // a format of meshio's
    for signal in ["-INT", "-TERM"] {
        let child = crate::common::faceoff(folder.path())
            .args(["mesh", "convert", "in.msh", "out.msh"])
            .env("FACEOFF_MESHIO_PYTHON", &python)
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        let clock = Instant::now();
        while !is_running("sleep 120.25") {
            assert!(clock.elapsed().as_secs() < 60, "it never started");
            std::thread::sleep(Duration::from_millis(20));
        }
        let started = Instant::now();
        let pid = child.id().to_string();
        Command::new("kill").args([signal, &pid]).status().unwrap();
        let ran = told(child.wait_with_output().unwrap());
        assert!(started.elapsed().as_secs() < 60, "{signal}");
        assert_eq!(ran.code, Some(2), "{}", ran.stderr);
        assert!(ran.stderr.contains("interrupted"), "{}", ran.stderr);
        assert!(!is_running("sleep 120.25"));
        assert!(!folder.path().join("out.msh").exists());
    }
}
