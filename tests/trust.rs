//! What comes from a stranger runs no code, reads nothing outside its own folder, and writes nothing outside its output.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;

use crate::common::{faceoff, folder, run, scene, source, told, write};

/// All files and folders below, as they are named from there.
fn tree(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    let mut todo = vec![folder.to_owned()];
    while let Some(next) = todo.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            names.push(
                path.strip_prefix(folder)
                    .unwrap()
                    .to_string_lossy()
                    .into_owned(),
            );
            if path.is_dir() && !path.is_symlink() {
                todo.push(path);
            }
        }
    }
    names.sort();
    names
}

fn refused(folder: &Path, words: &[&str], said: &str) {
    let before = tree(folder);
    let ran = run(folder, words);
    assert_eq!(ran.code, Some(2), "{words:?}: {}", ran.stdout);
    assert!(ran.stderr.contains(said), "`{said}` in: {}", ran.stderr);
    assert_eq!(tree(folder), before, "{words:?} left something");
}

#[test]
fn a_scene_names_no_mesh_outside_its_folder() {
    let folder = folder();
    let home = folder.path();
    fs::create_dir(home.join("theirs")).unwrap();
    fs::create_dir(home.join("theirs/below")).unwrap();
    let mesh = source("meshes/plate.msh");
    fs::copy(&mesh, home.join("ours.msh")).unwrap();
    fs::copy(&mesh, home.join("theirs/below/plate.msh")).unwrap();
    symlink("../ours.msh", home.join("theirs/link.msh")).unwrap();
    symlink("..", home.join("theirs/up")).unwrap();
    symlink("below/plate.msh", home.join("theirs/fine.msh")).unwrap();
    let absolute = home.join("ours.msh").to_string_lossy().into_owned();
    for (file, is_outside) in [
        ("../ours.msh", true),
        ("below/../../ours.msh", true),
        (absolute.as_str(), true),
        ("link.msh", true),
        ("up/ours.msh", true),
        ("below/plate.msh", false),
        ("./below/plate.msh", false),
        ("fine.msh", false),
    ] {
        scene(home, "plate", "plate.msh", file);
        fs::rename(home.join("scene.toml"), home.join("theirs/scene.toml")).unwrap();
        let scene = "theirs/scene.toml";
        for words in [
            &["solve", scene][..],
            &[
                "verify",
                scene,
                "--engines",
                "rust,freefem",
                "--methods",
                "cr",
            ],
            &["mesh", "make", scene, "/dev/null", "--format", "msh"],
        ] {
            if is_outside {
                refused(home, words, "outside the scene's folder");
                refused(home, words, "--allow-outside");
            }
            let trusted = [
                words,
                if is_outside {
                    &["--allow-outside"][..]
                } else {
                    &[]
                },
            ]
            .concat();
            let ran = run(home, &trusted);
            assert_eq!(ran.code, Some(0), "{file}: {trusted:?}: {}", ran.stderr);
        }
    }
    // Nor by a scene beside which one stands.
    let here = home.join("theirs");
    refused(&here, &["orders", "scene.toml", "--n", "4"], "");
    scene(&here, "plate", "plate.msh", "../ours.msh");
    refused(
        &here,
        &["solve", "scene.toml"],
        "outside the scene's folder",
    );
}

/// A known solution, contact nowhere, and a mesh that lies outside.
const OUTSIDE: &str = r#"
name = "theirs"

[mesh]
file = "../ours.msh"
n = 16

[boundary]
dirichlet = ["clamp", "edge", "hole"]
contact = ["base"]

[data]
g = "-1 - 0.1*x"

[exact]
u = "-1 - 0.1*x"

[compare]
rtol = 1e-9
"#;

#[test]
fn every_command_with_a_scene_asks_for_trust() {
    let folder = folder();
    let home = folder.path();
    fs::copy(source("meshes/plate.msh"), home.join("ours.msh")).unwrap();
    write(home, "theirs/scene.toml", OUTSIDE);
    write(home, "a.csv", "vertex,u\n0,1\n");
    write(home, "b.csv", "vertex,u\n0,1.0\n");
    let scene = "theirs/scene.toml";
    for words in [
        &[
            "verify",
            scene,
            "--engines",
            "rust,freefem",
            "--methods",
            "cr",
        ][..],
        &["compare", "a.csv", "b.csv", "--scene", scene],
        &["solve", scene],
        &["orders", scene, "--methods", "cr", "--n", "16,32"],
        &[
            "study",
            scene,
            "--methods",
            "cr",
            "--budget",
            "1s",
            "--finest",
            "16",
        ],
        &["stress", scene, "--methods", "cr", "--families", "gamma0"],
        &["mesh", "make", scene, "/dev/null", "--format", "msh"],
    ] {
        refused(home, words, "--allow-outside");
        let trusted = [words, &["--allow-outside", "--quiet"]].concat();
        let ran = run(home, &trusted);
        assert_eq!(ran.code, Some(0), "{trusted:?}: {}", ran.stderr);
    }
    // What is advised can be typed.
    let words = [
        "study",
        scene,
        "--methods",
        "cr",
        "--budget",
        "5s",
        "--finest",
        "16",
    ];
    let ran = run(
        home,
        &[&words[..], &["--allow-outside", "--json", "-"]].concat(),
    );
    for advice in ran.json()["advice"].as_array().unwrap() {
        assert!(
            advice["command"]
                .as_str()
                .unwrap()
                .ends_with(" --allow-outside")
        );
    }
}

#[test]
fn nothing_is_written_outside_what_is_named() {
    let folder = folder();
    for name in ["../evil", "a/b", ".evil", "", "/tmp/evil", "a\\nb"] {
        let text = format!("name = \"{name}\"");
        let scene = scene(folder.path(), "one-zone", "name = \"one-zone\"", &text);
        refused(
            folder.path(),
            &["solve", &scene],
            "cannot name output files",
        );
    }
    for name in ["../evil", "a/b", ".", "", "a b"] {
        let text = format!("name = \"{name}\"\ncommand = [\"true\"]\n");
        write(folder.path(), "engine.toml", &text);
        let words = [
            "verify",
            "one-zone",
            "--engines",
            "rust,engine.toml",
            "--keep",
            "jobs",
        ];
        refused(folder.path(), &words, "cannot name an engine");
    }
}

#[test]
fn names_in_a_mesh_run_nothing_in_any_engine() {
    let folder = folder();
    let text = fs::read_to_string(source("meshes/plate.msh")).unwrap();
    for attack in [
        "base; exec(touch x)",
        "base'); import os; os.system('touch x'); ('",
        "$(touch x)",
        "`touch x`",
        "../../x",
    ] {
        assert!(text.contains("\"base\""));
        let mesh = text.replace("\"base\"", &format!("\"{attack}\""));
        write(folder.path(), "plate.msh", &mesh);
        let scene = scene(
            folder.path(),
            "plate",
            "[\"base\"]",
            &format!("[\"{attack}\"]"),
        );
        let words = [
            "verify",
            &scene,
            "--methods",
            "cr",
            "--report",
            "report",
            "--json",
            "out.json",
        ];
        let ran = run(folder.path(), &words);
        assert_eq!(ran.code, Some(0), "{attack}: {}", ran.stderr);
        let mut names = tree(folder.path());
        names.retain(|name| !name.starts_with("report"));
        assert_eq!(names, ["out.json", "plate.msh", "scene.toml"], "{attack}");
    }
}

#[test]
fn results_name_no_file_outside_their_folder() {
    let folder = folder();
    let words = ["solve", "one-zone", "--n", "4", "--out", "u.vtu"];
    assert_eq!(run(folder.path(), &words).code, Some(0));
    for piece in ["../u.vtu", "/etc/passwd", "below/../../u.vtu"] {
        let text = format!(
            "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid><Piece Source=\"{piece}\"/></PUnstructuredGrid></VTKFile>"
        );
        write(folder.path(), "theirs/u.pvtu", &text);
        refused(
            folder.path(),
            &["compare", "u.vtu", "theirs/u.pvtu"],
            "not in the folder of this file",
        );
        refused(
            folder.path(),
            &["mesh", "info", "theirs/u.pvtu"],
            "not in the folder of this file",
        );
    }
}

#[test]
fn messages_send_no_commands_to_the_terminal() {
    let folder = folder();
    let red = "name = \"\\u001b[31mred\\u202e\"";
    let scene = scene(folder.path(), "one-zone", "name = \"one-zone\"", red);
    let ran = run(folder.path(), &["solve", &scene]);
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("[31mred"), "{}", ran.stderr);
    assert!(
        !ran.stderr.contains(['\u{1b}', '\u{202e}']),
        "{:?}",
        ran.stderr
    );
    // What an engine says is quoted as well.
    let script = "print('error \\x1b]0;title\\x07 stumbles'); raise SystemExit(1)";
    write(folder.path(), "solve.py", script);
    let text = "name = \"theirs\"\ncommand = [\"python3\", \"solve.py\"]\n";
    write(folder.path(), "theirs.toml", text);
    let ran = run(
        folder.path(),
        &["verify", "one-zone", "--engines", "rust,theirs.toml"],
    );
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("stumbles"), "{}", ran.stderr);
    assert!(
        !ran.stderr.contains(['\u{1b}', '\u{7}']),
        "{:?}",
        ran.stderr
    );
}

/// Python takes modules from where it is started.
#[test]
fn no_module_beside_the_user_is_run() {
    let folder = folder();
    let home = folder.path();
    let trap = "open('sprung', 'w').write('')\n";
    let modules = [
        "contextlib",
        "types",
        "functools",
        "importlib",
        "numpy",
        "dolfinx",
        "meshio",
        "json",
    ];
    for module in modules {
        write(home, &format!("{module}.py"), trap);
    }
    write(home, "mesh.mdpa", "Begin Nodes\nEnd Nodes\n");
    for words in [
        &["engines"][..],
        &[
            "verify",
            "one-zone",
            "--n",
            "4",
            "--engines",
            "rust,fenicsx",
            "--methods",
            "cr",
        ],
        &["mesh", "info", "mesh.mdpa"],
    ] {
        run(home, words);
        assert!(
            !home.join("sprung").exists(),
            "{words:?} ran a module of the folder"
        );
    }
}

/// A baseline is a file in its folder, and nothing that a link, a pipe or a device gives.
#[test]
fn a_baseline_reads_no_other_file() {
    let folder = folder();
    let home = folder.path();
    fs::create_dir(home.join("kept")).unwrap();
    let baseline = home.join("kept/baseline.json");
    let words = [
        "verify",
        "one-zone",
        "--n",
        "4",
        "--against",
        "kept",
        "--junit",
        "j.xml",
    ];
    let check = |said: &str| {
        let ran = told(
            faceoff(home)
                .args(words)
                .env("SECRET", "do-not-tell")
                .output()
                .unwrap(),
        );
        assert_eq!(ran.code, Some(2), "{}", ran.stdout);
        assert!(ran.stderr.contains(said), "`{said}` in: {}", ran.stderr);
        let junit = fs::read_to_string(home.join("j.xml")).unwrap();
        for text in [ran.stdout, ran.stderr, junit] {
            assert!(!text.contains("do-not-tell"), "{text}");
        }
        fs::remove_file(&baseline).unwrap();
    };
    symlink("/proc/self/environ", &baseline).unwrap();
    check("a link to a file outside");
    symlink("/dev/zero", &baseline).unwrap();
    check("a link to a file outside");
    let made = std::process::Command::new("mkfifo").arg(&baseline).status();
    assert!(made.unwrap().success());
    check("not a regular file");
}

/// What is quoted of a stranger's names reaches neither a terminal nor a CI server as a command.
#[test]
fn what_strangers_wrote_is_printed_as_words() {
    let folder = folder();
    let home = folder.path();
    let forged = "x\\n::error file=src/main.rs::forged\\u001b[2J";
    write(home, "named.toml", &format!("name = \"{forged}\"\n"));
    write(
        home,
        "engine.toml",
        &format!("name = \"{forged}\"\ncommand = [\"true\"]\n"),
    );
    write(
        home,
        "a.csv",
        "vertex,\"x\n::error file=src/main.rs::forged\u{1b}[2J\"\n0,1\n",
    );
    write(
        home,
        "b.csv",
        "vertex,\"x\n::error file=src/main.rs::forged\u{1b}[2J\"\n0,2\n",
    );
    for words in [
        &["solve", "named.toml"][..],
        &["verify", "one-zone", "--engines", "rust,engine.toml"],
        &["compare", "a.csv", "b.csv"],
        &["solve", "x\n::error::forged"],
        &["mesh", "info", "\u{1b}[2J"],
    ] {
        let ran = told(
            faceoff(home)
                .args(words)
                .env("GITHUB_ACTIONS", "true")
                .output()
                .unwrap(),
        );
        assert_ne!(ran.code, Some(0));
        for text in [&ran.stdout, &ran.stderr] {
            assert!(!text.contains('\u{1b}'), "{words:?}: {text}");
            let mut lines = text
                .lines()
                .filter(|line| line.trim_start().starts_with("::error"));
            let is_forged = |line: &&str| {
                line.trim_start().starts_with("::error file")
                    || line.trim_start().starts_with("::error::")
            };
            assert_eq!(lines.find(is_forged), None, "{words:?}: {text}");
        }
    }
}

/// Job folders in the folder for temporary files are for their owner alone.
#[test]
fn nobody_else_looks_into_a_job() {
    let folder = folder();
    let home = folder.path();
    let script = "stat -c %a . > \"$1\"; exit 1";
    write(home, "look.sh", script);
    let told = home.join("mode");
    let engine = format!("name = \"mine\"\ncommand = [\"sh\", \"look.sh\", {told:?}]\n");
    write(home, "mine.toml", &engine);
    run(
        home,
        &[
            "verify",
            "one-zone",
            "--n",
            "4",
            "--engines",
            "rust,mine.toml",
        ],
    );
    assert_eq!(fs::read_to_string(told).unwrap().trim(), "700");
}

/// It sees no secret of the user, reaches no network, and writes in its job folder alone; and it answers all the same.
#[test]
fn an_engine_in_a_sandbox_has_its_job_and_nothing_else() {
    let folder = folder();
    let home = folder.path();
    write(home, "secret", "do-not-tell");
    fs::create_dir(home.join("engine")).unwrap();
    let script = r#"
import os, pathlib, socket
told = [os.environ.get("SECRET", "no variable")]
for place in SECRETS:
    try:
        told.append(pathlib.Path(place).read_text())
    except OSError:
        told.append("no file")
try:
    pathlib.Path(SECRETS[0] + ".mine").write_text("")
    told.append("written")
except OSError:
    pass
try:
    socket.create_connection(("127.0.0.1", PORT), timeout=5)
    told.append("connected")
except OSError:
    pass
raise SystemExit("error " + ", ".join(told))
"#;
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let secrets = format!("[{:?}]", home.join("secret"));
    let script = script
        .replace("SECRETS", &secrets)
        .replace("PORT", &port.to_string());
    write(home, "engine/look.py", &script);
    write(
        home,
        "engine/mine.toml",
        "name = \"mine\"\ncommand = [\"/usr/bin/python3\", \"look.py\"]\n",
    );
    let words = [
        "verify",
        "one-zone",
        "--n",
        "4",
        "--engines",
        "rust,engine/mine.toml",
    ];
    let look = |sandbox: &[&str]| {
        let words = [&words[..], sandbox].concat();
        told(
            faceoff(home)
                .args(words)
                .env("SECRET", "do-not-tell")
                .output()
                .unwrap(),
        )
        .stderr
    };
    let seen = look(&[]);
    assert!(
        seen.contains("do-not-tell, do-not-tell, written, connected"),
        "{seen}"
    );
    // In a chroot the system makes no namespaces: then nothing is run, rather than without a sandbox.
    let mut probe = std::process::Command::new("bwrap");
    let probe = probe.args(["--unshare-all", "--ro-bind", "/", "/", "true"]);
    if !probe.status().is_ok_and(|status| status.success()) {
        let seen = look(&["--sandbox"]);
        assert!(
            seen.contains("bwrap") && !seen.contains("do-not-tell"),
            "{seen}"
        );
        return;
    }
    let written = home.join("secret.mine");
    fs::remove_file(&written).unwrap();
    let seen = look(&["--sandbox"]);
    assert!(seen.contains("no variable, no file"), "{seen}");
    assert!(
        !seen.contains("do-not-tell") && !seen.contains("connected"),
        "{seen}"
    );
    // What it wrote went with the sandbox.
    assert!(!written.exists(), "{seen}");
    // A name without a folder is that of a file here.
    let ran = run(
        &home.join("engine"),
        &[
            "verify",
            "one-zone",
            "--n",
            "4",
            "--engines",
            "rust,mine.toml",
            "--sandbox",
        ],
    );
    assert!(
        ran.stderr.contains("no variable, no file"),
        "{}",
        ran.stderr
    );
    let words = ["verify", "one-zone", "--n", "4", "--sandbox"];
    let ran = run(home, &words);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let skfem = source("tests/engines/skfem.toml")
        .to_string_lossy()
        .into_owned();
    let engines = format!("rust,{skfem}");
    let ran = run(home, &[&words[..], &["--engines", &engines]].concat());
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
}

/// Ways out that we know, tried by programs that want out; tests/run tries those that take long as well, and as another user.
#[test]
fn no_program_leaves_the_sandbox() {
    let mut tried = std::process::Command::new("/usr/bin/python3");
    tried
        .arg(source("tests/sandbox.py"))
        .arg(env!("CARGO_BIN_EXE_faceoff"))
        .args(["looks", "links", "commands", "refusals"]);
    let ran = told(tried.output().unwrap());
    // 3: there is no sandbox here, and nothing ran.
    assert!(
        matches!(ran.code, Some(0 | 3)),
        "{}{}",
        ran.stdout,
        ran.stderr
    );
}
