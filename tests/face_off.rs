//! Face-off files: codes of one's own on any problem, and folders that `new` begins.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::common::{Ran, assert_valid, folder, run, source, times, write};

/// A copy of an example.
fn example(folder: &Path, name: &str) -> PathBuf {
    let to = folder.join(name);
    fs::create_dir(&to).unwrap();
    for entry in fs::read_dir(source("examples").join(name)).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
    }
    to
}

/// Puts `to` in place of `from`, which is there once at least.
fn plant(folder: &Path, file: &str, from: &str, to: &str) {
    let path = folder.join(file);
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{file} has no {from}");
    fs::write(path, text.replacen(from, to, 1)).unwrap();
}

/// Runs a face-off; the JSON follows its schema.
fn verify(folder: &Path, file: &str, words: &[&str]) -> (Ran, Value) {
    let ran = run(
        folder,
        &[&["verify", "--run", file, "--json", "o.json"], words].concat(),
    );
    assert_valid(
        "json",
        "src/report/schema/face-off-1.json",
        &folder.join("o.json"),
    );
    let told = fs::read_to_string(folder.join("o.json")).unwrap();
    (ran, serde_json::from_str(&told).unwrap())
}

fn field<'a>(told: &'a Value, name: &str) -> &'a Value {
    let fields = told["fields"].as_array().unwrap();
    fields.iter().find(|f| f["field"] == name).unwrap()
}

/// The examples, each with the answer that it has from outside, on all its levels that are judged; and on the coarsest mesh a fault in
/// FreeFEM's script, which only the comparison of all values shows: another obstacle, another h.
macro_rules! examples_agree {
    ($($test:ident: $folder:literal $name:literal at $n:literal, by $codes:literal $faults:expr;)*) => {
        $(#[test]
        fn $test() {
            agrees_and_its_faults_are_found($folder, $name, $n, $codes, &$faults);
        })*
    };
}

examples_agree! {
    the_obstacle: "obstacle" "obstacle" at "1,8", by "freefem,dolfinx" [("a^2/sqrt(1 - a^2)", "1.001*a^2/sqrt(1 - a^2)")];
    the_cylinder: "hertz" "hertz" at "1,2", by "freefem,getfem" [("gamma0*hTriangle/E", "gamma0*lenEdge/E")];
    the_ball: "hertz" "ball" at "1", by "dolfinx,getfem" [];
}

/// Hertz's cylinder as a form: force, half-width and peak, and the pressure along the arc; and not those of a stiffer one.
#[test]
fn the_cylinder_as_a_form() {
    let folder = folder();
    let at = folder.path();
    let from = |name: &str| source("examples/hertz").join(name);
    fs::copy(from("hertz.msh"), at.join("hertz.msh")).unwrap();
    let text = fs::read_to_string(from("line.toml")).unwrap();
    let mu = "mu = \"E/(2*(1 + nu))\"";
    assert!(text.contains(mu));
    for (word, code) in [("E", 0), ("1.2*E", 1)] {
        fs::write(
            at.join("line.toml"),
            text.replace(mu, &mu.replace('E', word)),
        )
        .unwrap();
        let (ran, told) = verify(at, "line.toml", &["--engines", "rust,freefem", "--n", "1"]);
        assert_eq!(ran.code, Some(code), "{}{}", ran.stdout, ran.stderr);
        assert_eq!(field(&told, "u")["verdict"], "agree");
    }
}

fn agrees_and_its_faults_are_found(
    example_name: &str,
    name: &str,
    n: &str,
    codes: &str,
    faults: &[(&str, &str)],
) {
    let folder = folder();
    let at = example(folder.path(), example_name);
    let file = format!("{name}.toml");
    let mut words = vec!["--n", n];
    // FreeFEM takes longer for the ball than all others together: it joins with `tests/run --all`.
    if faults.is_empty() && times() == 1 {
        words.extend(["--engines", codes]);
    }
    let (ran, told) = verify(&at, &file, &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(field(&told, "u")["verdict"], "agree");
    let mut numbers = told["numbers"].as_array().unwrap().iter();
    assert!(
        numbers.any(|number| !number["exact"].is_null()),
        "{name} has an answer from outside"
    );
    for (from, to) in faults {
        plant(&at, &format!("{name}.edp"), from, to);
        let (ran, told) = verify(&at, &file, &["--n", "1", "--engines", codes]);
        assert_eq!(ran.code, Some(1), "{to}: {}{}", ran.stdout, ran.stderr);
        assert_eq!(field(&told, "u")["verdict"], "disagree", "{to}");
    }
}

/// Codes that do not do what their file says, and files that say what cannot be: exit code 2 and a sentence with the code.
#[test]
fn what_cannot_be_judged_is_told_in_a_sentence() {
    let folder = folder();
    let at = folder.path();
    write(at, "u.csv", "vertex,u\n0,1\n1,2\n");
    write(at, "w.csv", "vertex,u\n0,1\n1,nan\n");
    write(at, "half.csv", "vertex,u\n0,1\n1,");
    let file = |second: &str, more: &str| {
        format!(
            "name = \"x\"\n[codes.a]\ncommand = [\"cp\", \"u.csv\", \"{{out}}/u.csv\"]\nresult = \"u.csv\"\n\
             [codes.b]\ncommand = {second}\nresult = \"u.csv\"\n[fields.u]\nsame = \"discretisation\"\n{more}"
        )
    };
    let copy = |of: &str| format!("[\"cp\", \"--\", \"{of}\", \"{{out}}/u.csv\"]");
    write(at, "x.toml", &file(&copy("u.csv"), ""));
    let (ran, _) = verify(at, "x.toml", &[]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let refused = |text: &str, part: &str| {
        write(at, "x.toml", text);
        let ran = run(at, &["verify", "--run", "x.toml"]);
        assert_eq!(ran.code, Some(2), "{text}: {}{}", ran.stdout, ran.stderr);
        let told = format!("{}{}", ran.stdout, ran.stderr);
        assert!(told.contains(part), "{part}: {told}");
    };
    // What the code does.
    refused(&file("[\"true\"]", ""), "does not say where its results go");
    refused(
        &file("[\"cp\", \"u.csv\", \"{{out}/u.csv\"]", ""),
        "does not say where its results go",
    );
    refused(
        &file("[\"true\", \"{out}\"]", ""),
        "it ended well and has not written u.csv, nor anything else",
    );
    refused(
        &file("[\"touch\", \"{out}/v.csv\"]", ""),
        "has not written u.csv, but v.csv",
    );
    refused(
        &file("[\"false\", \"{out}\"]", ""),
        "engine b: `false` failed",
    );
    refused(
        &file("[\"no-such-program\", \"{out}\"]", ""),
        "`no-such-program` cannot be started",
    );
    refused(
        &file(&copy("w.csv"), ""),
        "`u` of b has a value that is not a finite number",
    );
    refused(&file(&copy("half.csv"), ""), "one side has it on 2 points");
    refused(
        &file(&copy("u.csv"), "names = { b = \"w\" }"),
        "b has no field `w`; it has u",
    );
    refused(&file(&copy("u.csv"), "components = 2"), "has 1 components");
    refused(&file(&copy("u.csv"), "on = \"cells\""), "is on points");
    // What the file says.
    refused(
        &file("[\"cp\", \"u.csv\", \"{out}/u.csv\"]", ""),
        "a and b have one command",
    );
    refused(
        &file("[\"cp\", \"{E}\", \"{out}\"]", ""),
        "`{E}` in `{E}` is not known",
    );
    refused(&file("[\"cp\", \"{mesh}\"]", ""), "`{mesh}`");
    refused(&file("[]", ""), "its command is empty");
    refused(&file(&copy("u.csv"), "rtol = -1"), "-1 is not a tolerance");
    let of_number = "exact = \"x\"\nexact_rtol = 1e-3";
    refused(
        &file(&copy("u.csv"), of_number),
        "fields have no exact_rtol",
    );
    refused(&file(&copy("u.csv"), "rotl = 1"), "rotl");
    refused(
        &file(&copy("u.csv"), "exact = \"sin(\""),
        "exact, character",
    );
    refused(
        &file(&copy("u.csv"), "names = { c = \"w\" }"),
        "there is no code `c`",
    );
    let problem = file(&copy("u.csv"), "").replace("\"discretisation\"", "\"problem\"");
    refused(&problem, "nothing says how far apart");
    let with_mesh = file("[\"cp\", \"{mesh}\"]\nmesh = \"msh\"", "");
    refused(&with_mesh, "there is no mesh for it");
    let form = format!("[mesh]\ngenerator = \"union-jack\"\n{}", "");
    let text = file("[\"cp\", \"{mesh}\"]\nmesh = \"mhs\"", "").replacen(
        "[codes.a]",
        &format!("{form}[codes.a]"),
        1,
    );
    refused(&text, "there is no form of meshes `mhs`");
    let ran = run(at, &["verify", "x.toml", "one-zone"]);
    assert!(
        ran.stderr
            .contains("a face-off file cannot be verified together with others"),
        "{}",
        ran.stderr
    );
    let ran = run(at, &["verify", "x.toml", "--ranks", "2"]);
    assert!(
        ran.stderr.contains("--ranks is for scenes"),
        "{}",
        ran.stderr
    );
}

/// A linear function on quadratic cells is the same function; on a mesh of its own it is another one.
#[test]
fn the_same_function_on_other_cells_agrees() {
    let folder = folder();
    let at = folder.path();
    let msh = |points: &str, kind: u8, cell: &str, values: [f64; 6]| {
        let count = points.lines().count();
        let values: String = (1..)
            .zip(&values[..count])
            .map(|(k, u)| format!("{k} {u}\n"))
            .collect();
        format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{count}\n{points}$EndNodes\n$Elements\n1\n1 {kind} 2 1 1 {cell}\n$EndElements\n\
             $NodeData\n1\n\"u\"\n1\n0\n3\n0\n1\n{count}\n{values}$EndNodeData\n"
        )
    };
    let linear = "1 0 0 0\n2 1 0 0\n3 0 1 0\n";
    let quadratic = format!("{linear}4 0.5 0 0\n5 0.5 0.5 0\n6 0 0.5 0\n");
    write(
        at,
        "a.msh",
        &msh(linear, 2, "1 2 3", [1.0, 2.0, 4.0, 0.0, 0.0, 0.0]),
    );
    write(
        at,
        "b.msh",
        &msh(&quadratic, 9, "1 2 3 4 5 6", [1.0, 2.0, 4.0, 1.5, 3.0, 2.5]),
    );
    write(
        at,
        "c.msh",
        &msh(
            &quadratic,
            9,
            "1 2 3 4 5 6",
            [1.0, 2.0, 4.0, 1.5, 3.01, 2.5],
        ),
    );
    for (second, code) in [("b.msh", 0), ("c.msh", 1)] {
        let file = format!(
            "name = \"x\"\n[codes.a]\ncommand = [\"cp\", \"a.msh\", \"{{out}}/u.msh\"]\nresult = \"u.msh\"\n\
             [codes.b]\ncommand = [\"cp\", \"{second}\", \"{{out}}/u.msh\"]\nresult = \"u.msh\"\n[fields.u]\nsame = \"discretisation\"\n"
        );
        write(at, "x.toml", &file);
        let (ran, _) = verify(at, "x.toml", &[]);
        assert_eq!(ran.code, Some(code), "{}{}", ran.stdout, ran.stderr);
        assert!(
            ran.stdout
                .contains("as functions, since the files have other cells"),
            "{}",
            ran.stdout
        );
    }
}

/// A job that is kept can be run again by the line beside it.
#[test]
fn a_kept_job_runs_by_hand() {
    let folder = folder();
    let at = example(folder.path(), "blank");
    let words = ["--n", "4", "--keep", "runs"];
    let (ran, _) = verify(&at, "blank.toml", &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let kept = at.join("runs/blank-freefem-n4");
    let result = kept.join("out/u.vtu");
    let before = fs::read(&result).unwrap();
    fs::remove_file(&result).unwrap();
    let line = fs::read_to_string(kept.join("command.txt")).unwrap();
    let status = std::process::Command::new("sh")
        .args(["-c", &line])
        .status()
        .unwrap();
    assert!(status.success(), "{line}");
    assert_eq!(fs::read(&result).unwrap(), before);
}

/// What `new` writes runs at once and agrees; it says which groups a mesh of one's own has, and overwrites nothing.
#[test]
fn a_new_face_off_runs_at_once() {
    let folder = folder();
    let at = folder.path();
    let ran = run(at, &["new", "mine"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(
        ran.stdout.contains("faceoff verify --run mine/mine.toml"),
        "{}",
        ran.stdout
    );
    let (ran, told) = verify(at, "mine/mine.toml", &["--n", "4"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(
        (&told["name"], &told["numbers"][0]["verdict"]),
        (&"mine".into(), &"agree".into())
    );
    let ran = run(at, &["new", "mine"]);
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("already exists"), "{}", ran.stderr);
    let plate = source("meshes/plate.msh");
    let words = [
        "new",
        "sub/own",
        "--from",
        "obstacle",
        "--mesh",
        plate.to_str().unwrap(),
    ];
    let ran = run(at, &words);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(ran.stderr.contains("plate.msh has "), "{}", ran.stderr);
    let text = fs::read_to_string(at.join("sub/own/own.toml")).unwrap();
    assert!(
        text.contains("file = \"plate.msh\"\n# ") && text.contains("name = \"own\""),
        "{text}"
    );
    assert!(at.join("sub/own/plate.msh").is_file());
    for (name, part) in [
        ("a b", "cannot name a face-off"),
        ("../.x", "cannot name a face-off"),
    ] {
        let ran = run(at, &["new", name]);
        assert!(
            ran.code == Some(2) && ran.stderr.contains(part),
            "{}",
            ran.stderr
        );
    }
    // What was an example once is a form.
    for name in ["poisson", "elasticity", "stokes"] {
        let ran = run(at, &["new", "other", "--from", name]);
        let way = format!("give --form {name} instead of --from");
        assert_eq!(ran.code, Some(2));
        assert!(ran.stderr.contains(&way), "{}", ran.stderr);
    }
    let ran = run(at, &["new", "other", "--from", "nothing"]);
    assert!(
        ran.stderr.contains("blank, obstacle, hertz"),
        "{}",
        ran.stderr
    );
    let ran = run(at, &["new", "other", "--mesh", "none.msh"]);
    assert!(
        ran.code == Some(2) && !at.join("other").exists(),
        "{}",
        ran.stderr
    );
    let left = fs::read_dir(at)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap());
    assert!(left.into_iter().all(|name| !name.starts_with(".faceoff")));
}

/// Two codes that copy a table, one of which says when it ran.
fn copies(at: &Path) {
    write(at, "u.csv", "vertex,u\n0,1\n1,2\n");
    write(at, "w.csv", "vertex,u\n0,1\n1,2\n");
    let of = |name: &str, command: &str| {
        format!("[codes.{name}]\ncommand = {command}\nresult = \"u.csv\"\n")
    };
    let a = of("a", "[\"cp\", \"u.csv\", \"{out}/u.csv\"]");
    let b = of(
        "b",
        "[\"sh\", \"-c\", \"cp w.csv {out}/u.csv; echo {E} {n} >> ran\"]",
    );
    let text = format!(
        "name = \"x\"\n[mesh]\ngenerator = \"union-jack\"\nn = [1, 2]\n[parameters]\nE = 1.5\n{a}{b}[fields.u]\nsame = \"discretisation\"\n"
    );
    write(at, "x.toml", &text);
}

/// What codes answered when they agreed stands in for them, until the problem, or a file of the record, is another one.
#[test]
fn codes_are_judged_against_their_record() {
    let folder = folder();
    let at = folder.path();
    copies(at);
    let (ran, _) = verify(at, "x.toml", &["--record", "record"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let text = fs::read_to_string(at.join("record/baseline.json")).unwrap();
    let record: Value = serde_json::from_str(&text).unwrap();
    assert!(
        record["recipe"]
            .as_str()
            .unwrap()
            .contains("--record record"),
        "{text}"
    );
    // Recorded again, it is the same.
    let (ran, _) = verify(at, "x.toml", &["--record", "record"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert_eq!(
        fs::read_to_string(at.join("record/baseline.json")).unwrap(),
        text
    );

    let against =
        |words: &[&str]| verify(at, "x.toml", &[&["--against", "record"], words].concat());
    let (ran, told) = against(&["--engines", "b"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let pairs: Vec<[&str; 2]> = field(&told, "u")["pairs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| [p["a"].as_str().unwrap(), p["b"].as_str().unwrap()])
        .collect();
    assert_eq!(&pairs[..2], [["b", "a (recorded)"], ["b", "b (recorded)"]]);
    write(at, "w.csv", "vertex,u\n0,1\n1,2.001\n");
    let (ran, told) = against(&["--engines", "b"]);
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    assert_eq!(field(&told, "u")["verdict"], "disagree");
    let (ran, _) = verify(at, "x.toml", &["--record", "other"]);
    assert_eq!(ran.code, Some(2));
    assert!(
        ran.stderr.contains("nothing was recorded") && ran.stdout.contains("disagree"),
        "{}",
        ran.stderr
    );
    assert!(!at.join("other").exists());
    write(at, "w.csv", "vertex,u\n0,1\n1,2\n");

    let refused = |words: &[&str], part: &str| {
        let ran = run(
            at,
            &[&["verify", "--run", "x.toml", "--against", "record"], words].concat(),
        );
        assert_eq!(ran.code, Some(2), "{part}: {}{}", ran.stdout, ran.stderr);
        let told = format!("{}{}", ran.stdout, ran.stderr);
        assert!(told.contains(part), "{part}: {told}");
    };
    refused(&["--n", "4"], "n = 4 was not recorded");
    refused(&["--engines", "c"], "there is no code `c`");
    let toml = fs::read_to_string(at.join("x.toml")).unwrap();
    write(at, "x.toml", &toml.replace("1.5", "2.5"));
    refused(&[], "another problem: E was \"1.5\" and is \"2.5\"");
    write(
        at,
        "x.toml",
        &toml.replace("union-jack\"", "union-jack\"\nsize = [1.0, 2.0]"),
    );
    refused(&[], "another problem: mesh digest was");
    write(at, "x.toml", &toml.replace("[codes.b]", "[codes.c]"));
    refused(&[], "b was recorded, and is no code");
    write(at, "x.toml", &toml);
    write(at, "record/a-n1/u.csv", "vertex,u\n0,1\n1,2.001\n");
    refused(&[], "files in a-n1 have changed since");
    fs::remove_dir_all(at.join("record/a-n1")).unwrap();
    refused(&[], "record/a-n1: cannot read");
    write(
        at,
        "x.toml",
        &toml.replace("\"cp\", \"u.csv\", \"{out}/u.csv\"", "\"touch\", \"u.csv\""),
    );
    let ran = run(at, &["verify", "--run", "x.toml", "--record", "third"]);
    assert!(
        ran.stderr.contains("does not say where its results go"),
        "{}",
        ran.stderr
    );
}

/// What was run is not run again, unless its files are not what they were; another command is refused.
#[test]
fn a_face_off_goes_on_where_it_was() {
    let folder = folder();
    let at = folder.path();
    copies(at);
    let ran = |n: &str| {
        let (done, _) = verify(at, "x.toml", &["--resume", "kept", "--n", n]);
        assert_eq!(done.code, Some(0), "{}{}", done.stdout, done.stderr);
        let times = fs::read_to_string(at.join("ran")).unwrap();
        times.lines().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(ran("1"), ["1.5 1"]);
    assert_eq!(ran("1,2"), ["1.5 1", "1.5 2"]);
    // Cut short while it wrote, and the journal's last line with it.
    let journal = at.join("kept/journal.jsonl");
    let text = fs::read_to_string(&journal).unwrap();
    fs::write(&journal, &text[..text.len() - 9]).unwrap();
    write(at, "kept/b-n1/u.csv", "vertex,u\n0,");
    assert_eq!(ran("1,2"), ["1.5 1", "1.5 2", "1.5 1", "1.5 2"]);
    let toml = fs::read_to_string(at.join("x.toml")).unwrap();
    write(at, "x.toml", &toml.replace("1.5", "2.5"));
    let refused = run(at, &["verify", "--run", "x.toml", "--resume", "kept"]);
    assert_eq!(refused.code, Some(2));
    assert!(
        refused.stderr.contains("E was \"1.5\" and is \"2.5\""),
        "{}",
        refused.stderr
    );
}

/// A code that hangs on the order of vertices, one that another's order does not touch, and a problem that rounding decides.
#[test]
fn what_moves_an_answer_is_told() {
    let folder = folder();
    let at = example(folder.path(), "blank");
    let toml = fs::read_to_string(at.join("blank.toml")).unwrap();
    plant(
        &at,
        "blank.edp",
        "writeVtu(",
        "values(0, 0) += 1e-3;\nwriteVtu(",
    );
    let (ran, told) = verify(&at, "blank.toml", &["--n", "4", "--diagnose"]);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    let findings = told["diagnosis"]["findings"].as_array().unwrap();
    let finding = findings[0].as_str().unwrap();
    assert!(
        findings.len() == 1 && finding.contains("`u`: freefem moves by"),
        "{finding}"
    );
    assert!(finding.contains("look for the fault there"), "{finding}");
    assert!(ran.stderr.contains(finding), "{}", ran.stderr);
    let moved = told["diagnosis"]["moved"].as_array().unwrap();
    let by = |code: &str, change: &str| {
        let of = |m: &&Value| m["code"] == code && m["change"] == change;
        moved.iter().find(of).unwrap()["relative"].as_f64().unwrap()
    };
    assert!(by("freefem", "vertices in reverse order") > 1e-4);
    assert!(by("dolfinx", "vertices in reverse order") < 1e-13);
    assert_eq!(by("freefem", "run once more"), 0.0);

    // Both codes' answers hang on the last digits of a parameter.
    let of = |name: &str, last: &str| {
        format!(
            "[codes.{name}]\ncommand = [\"/usr/bin/python3\", \"-c\", \"{PROGRAM}\", \"{{E}}\", \"{{out}}/n.csv\", \"{last}\"]\nnumbers = \"n.csv\"\n"
        )
    };
    const PROGRAM: &str = "import sys; e, out, last = sys.argv[1:]; open(out, 'w').write('d,%r' % ((float(e) - 0.1)*1e16 + float(last)))";
    let text = format!(
        "name = \"y\"\n[parameters]\nE = 0.1\n{}{}[numbers.d]\nsame = \"discretisation\"\n",
        of("a", "1"),
        of("b", "2")
    );
    write(&at, "y.toml", &text);
    let (ran, told) = verify(&at, "y.toml", &["--diagnose"]);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    let finding = told["diagnosis"]["findings"][0].as_str().unwrap();
    assert!(finding.contains("rounding decides"), "{finding}");
    assert_eq!(toml, fs::read_to_string(at.join("blank.toml")).unwrap());
}

/// A code that speaks the protocol of engines, beside a program that knows nothing of it, on one mesh.
#[test]
fn engines_stand_beside_scripts() {
    let folder = folder();
    let at = folder.path();
    for part in ["paper.edp", "nitsche.idp", "options.idp", "vtu.idp"] {
        fs::copy(source("freefem").join(part), at.join(part)).unwrap();
    }
    let engine = |name: &str, method: &str| {
        format!(
            "[codes.{name}]\nengine = \"{name}\"\nscene = \"one-zone\"\nmethod = \"{method}\"\n"
        )
    };
    for (method, of_paper) in [("cr", "CR"), ("p2", "P2")] {
        let paper = format!(
            "[codes.paper]\ncommand = [\"FreeFem++-nw\", \"-v\", \"0\", \"paper.edp\", \"-mesh\", \"{{mesh}}\", \"-contact\", \"1\", \
             \"-dirichlet\", \"3\", \"-method\", \"{of_paper}\", \"-fine\", \"1\", \"-out\", \"{{out}}/u\"]\nmesh = \"freefem\"\nresult = \"u.vtu\"\n"
        );
        let text = format!(
            "name = \"signorini\"\n[mesh]\ngenerator = \"union-jack\"\nn = [8]\n{paper}{}{}[fields.u]\nsame = \"discretisation\"\n",
            engine("rust", method),
            engine("fenicsx", method)
        );
        write(at, "s.toml", &text);
        let (ran, told) = verify(at, "s.toml", &[]);
        assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
        let pairs = field(&told, "u")["pairs"].as_array().unwrap();
        assert_eq!(pairs.len(), 3);
        assert!(
            pairs.iter().all(|p| p["max_rel"].as_f64().unwrap() < 1e-12),
            "{pairs:?}"
        );
        write(
            at,
            "s.toml",
            &text.replacen(&format!("\"{method}\"\n"), "\"p1\"\n", 1),
        );
        let (ran, _) = verify(at, "s.toml", &["--n", "4", "--engines", "rust,paper"]);
        assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    }
    let refused = |from: &str, to: &str, part: &str| {
        let text = fs::read_to_string(at.join("s.toml")).unwrap();
        write(at, "t.toml", &text.replacen(from, to, 1));
        let ran = run(at, &["verify", "--run", "t.toml"]);
        let told = format!("{}{}", ran.stdout, ran.stderr);
        assert!(ran.code == Some(2) && told.contains(part), "{part}: {told}");
    };
    refused(
        "engine = \"rust\"",
        "engine = \"rast\"",
        "there is no engine `rast`",
    );
    refused(
        "scene = \"one-zone\"\n",
        "",
        "does not say which scene rust solves",
    );
    refused("method = \"p1\"", "method = \"p9\"", "p9");
    refused(
        "engine = \"rust\"\n",
        "",
        "scene and method are of an engine",
    );
    refused(
        "engine = \"rust\"\n",
        "engine = \"rust\"\ncommand = [\"x\"]\n",
        "it has an engine and command",
    );
    refused(
        "scene = \"one-zone\"",
        "scene = \"plate\"",
        "has no boundary group",
    );
}

/// A code that writes one number on each level, by a formula of Python in n.
fn counting(name: &str, formula: &str) -> String {
    format!(
        "[codes.{name}]\ncommand = [\"/usr/bin/python3\", \"-c\", \"import sys; n = int(sys.argv[1]); open(sys.argv[2] + '/n.csv', \
         'w').write('d,%r\\\\nsame,1.0' % ({formula}))\", \"{{n}}\", \"{{out}}\"]\nnumbers = \"n.csv\"\n"
    )
}

/// Of three codes the one that differs is named, and not the two that agree; nobody is said to solve another problem.
#[test]
fn the_odd_one_is_named_and_no_other() {
    let folder = folder();
    let at = folder.path();
    let text = format!(
        "name = \"z\"\n[mesh]\ngenerator = \"union-jack\"\nn = [1]\n{}{}{}[numbers.d]\nsame = \"discretisation\"\nrtol = 1e-9\n\
         [numbers.same]\nsame = \"discretisation\"\n",
        counting("a", "1.0"),
        counting("b", "1.0 + 4e-13"),
        counting("c", "1.01")
    );
    write(at, "z.toml", &text);
    let (ran, told) = verify(at, "z.toml", &["--diagnose"]);
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    let outcomes = told["diagnosis"]["outcomes"].as_array().unwrap();
    let kinds: Vec<&str> = outcomes
        .iter()
        .map(|o| o["outcome"].as_str().unwrap())
        .collect();
    assert_eq!(kinds, ["odd", "unexplained", "unexplained"], "{outcomes:?}");
    assert_eq!(outcomes[0]["code"], "c");
    assert!(
        ran.stderr.contains("`d`: a and b agree; c differs"),
        "{}",
        ran.stderr
    );
    assert!(!ran.stderr.contains("different problems"), "{}", ran.stderr);
}
