//! Imports point one way: between the crates, and between the rooms of the program, which are the folders of `src/`.
//! Every `use` and every path in the code is resolved and held against a table; tests in `src/` are code like any other.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use proc_macro2::{TokenStream, TokenTree};
use serde_json::Value;
use syn::visit::{self, Visit};
use syn::{Attribute, ItemExternCrate, ItemMod, ItemUse, Macro, Meta, UseTree, Visibility};

use crate::common::source;

/// A room, and what it may use besides itself: only rooms that stand above it, so that there is no circle.
const ROOMS: [(&str, &[&str]); 9] = [
    ("lib", &[]),
    ("text", &[]),
    ("engine", &["text"]),
    ("run", &["text", "engine"]),
    ("why", &["text", "engine", "run"]),
    ("campaigns", &["text", "engine", "run", "why"]),
    ("report", &["text", "engine", "run", "why", "campaigns"]),
    (
        "cli",
        &["text", "engine", "run", "why", "campaigns", "report"],
    ),
    ("main", &["cli"]),
];

/// Our crates, and which of ours each may name. Above all: the judge never imports the judged.
const CRATES: [(&str, &[&str]); 6] = [
    ("faceoff-mesh", &[]),
    ("faceoff-judge", &["faceoff-mesh"]),
    ("faceoff-fem", &["faceoff-mesh"]),
    ("faceoff-form", &["faceoff-fem", "faceoff-mesh"]),
    ("faceoff-sentence", &[]),
    (
        "faceoff-python",
        &["faceoff", "faceoff-judge", "faceoff-mesh"],
    ),
];

/// What one file uses of its own crate.
#[derive(Default)]
struct Reader {
    /// The module that is being read, from the root of the crate on.
    module: Vec<String>,
    /// Names that begin with no root are those of the module, and tests and what is only handed on count for nothing.
    within: bool,
    /// Names that stand for others, with their paths.
    named: BTreeMap<String, Vec<String>>,
    /// Paths from the root on. An empty one is the root itself, under which every room can be reached.
    used: BTreeSet<Vec<String>>,
}

impl Reader {
    /// What `text`, a file that is `module`, uses.
    fn read(text: &str, module: &[String]) -> BTreeSet<Vec<String>> {
        let mut reader = Reader {
            module: module.to_vec(),
            ..Reader::default()
        };
        reader.visit_file(&syn::parse_file(text).expect("it compiles"));
        reader.used
    }

    /// The path from the root on; none where it begins with a name that is a crate, or known in the module already.
    fn resolve(&self, path: &[String]) -> Option<Vec<String>> {
        let mut found = self.module.clone();
        let mut rest = path;
        match path.first()?.as_str() {
            "crate" | "faceoff" => {
                found.clear();
                rest = &path[1..];
            }
            "self" | "super" => {
                rest = rest.strip_prefix(&["self".to_owned()]).unwrap_or(rest);
                while let Some(further) = rest.strip_prefix(&["super".to_owned()]) {
                    found.pop();
                    rest = further;
                }
            }
            // In the root, rooms are known without `crate`.
            _ if found.is_empty() || self.within => {}
            _ => return None,
        }
        found.extend_from_slice(rest);
        Some(found)
    }

    fn uses(&mut self, path: &[String]) {
        self.used.extend(self.resolve(path));
    }

    /// All paths of a tree of names; a glob is what it is of.
    fn tree(&mut self, tree: &UseTree, mut before: Vec<String>) {
        match tree {
            UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.tree(&path.tree, before);
            }
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.tree(tree, before.clone());
                }
            }
            UseTree::Glob(_) => self.uses(&before),
            UseTree::Name(syn::UseName { ident })
            | UseTree::Rename(syn::UseRename { ident, .. }) => {
                if before.is_empty() || ident != "self" {
                    before.push(ident.to_string());
                }
                let name = match tree {
                    UseTree::Rename(renamed) => Some(renamed.rename.to_string()),
                    _ => before.last().cloned(),
                };
                self.named.extend(name.zip(self.resolve(&before)));
                self.uses(&before);
            }
        }
    }

    /// Nobody has parsed what macros and attributes are given: names joined by `::`, also in strings.
    fn tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = Vec::new();
        let mut colons = 0;
        for token in tokens {
            match &token {
                TokenTree::Punct(point) if point.as_char() == ':' => {
                    colons += 1;
                    continue;
                }
                TokenTree::Ident(name) if colons == 2 && !path.is_empty() => {
                    path.push(name.to_string());
                    colons = 0;
                    continue;
                }
                // `crate::{a, b}` inside a macro
                TokenTree::Group(group) if colons == 2 && !path.is_empty() => {
                    if let Ok(tree) = syn::parse_str(&group.to_string()) {
                        self.tree(&tree, path.clone());
                    }
                }
                _ => {}
            }
            self.written(&path);
            path.clear();
            colons = 0;
            match token {
                TokenTree::Ident(name) => path.push(name.to_string()),
                TokenTree::Group(group) => self.tokens(group.stream()),
                TokenTree::Literal(literal) => {
                    let text = syn::parse_str::<syn::LitStr>(&literal.to_string());
                    let inside = text.ok().and_then(|t| t.parse::<syn::Path>().ok());
                    if let Some(inside) = inside {
                        self.written(&names(&inside));
                    }
                }
                TokenTree::Punct(_) => {}
            }
        }
        self.written(&path);
    }

    /// A path that nobody has parsed: a lone word is none.
    fn written(&mut self, path: &[String]) {
        if path.len() > 1 {
            self.uses(path);
        }
    }
}

fn names(path: &syn::Path) -> Vec<String> {
    path.segments.iter().map(|s| s.ident.to_string()).collect()
}

impl<'ast> Visit<'ast> for Reader {
    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        let is_elsewhere = item.attrs.iter().any(|a| a.path().is_ident("path"));
        assert!(
            !is_elsewhere,
            "{}: its file must stand where its name says",
            item.ident
        );
        if self.within && is_test(&item.attrs) {
            return;
        }
        self.module.push(item.ident.to_string());
        visit::visit_item_mod(self, item);
        self.module.pop();
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        if self.within && !matches!(item.vis, Visibility::Inherited) {
            return;
        }
        item.attrs.iter().for_each(|a| self.visit_attribute(a));
        self.tree(&item.tree, Vec::new());
    }

    fn visit_item_extern_crate(&mut self, item: &'ast ItemExternCrate) {
        assert!(item.ident != "self", "the crate is given another name");
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.segments.len() > 1 {
            self.uses(&names(path));
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, called: &'ast Macro) {
        self.visit_path(&called.path);
        self.tokens(called.tokens.clone());
    }

    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        if let Meta::List(list) = &attribute.meta {
            self.tokens(list.tokens.clone());
        }
    }
}

fn is_test(attributes: &[Attribute]) -> bool {
    let mut lists = attributes.iter().filter_map(|a| a.meta.require_list().ok());
    lists.any(|list| list.path.is_ident("cfg") && list.tokens.to_string() == "test")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let of = |path: PathBuf| {
        if path.is_dir() {
            files(&path)
        } else {
            vec![path]
        }
    };
    let all = paths.into_iter().flat_map(of);
    all.filter(|path| path.extension().is_some_and(|e| e == "rs"))
        .collect()
}

/// The module of a file below `src`: `verify/cross.rs` is verify::cross, `engine/mod.rs` is engine, `lib.rs` the root.
fn module(file: &Path) -> Vec<String> {
    let file = file.with_extension("");
    let parts = file.iter().map(|part| part.to_string_lossy().into_owned());
    parts
        .filter(|part| part != "mod" && part != "lib")
        .collect()
}

#[test]
fn imports_between_rooms_point_one_way() {
    let home = source("src");
    let mut faults = Vec::new();
    let mut seen = BTreeSet::new();
    for path in files(&home) {
        let file = path.strip_prefix(&home).unwrap();
        let module = module(file);
        let room = module.first().map_or("lib", String::as_str);
        seen.insert(room.to_owned());
        let Some((_, allowed)) = ROOMS.iter().find(|(name, _)| *name == room) else {
            faults.push(format!("{room} is not in the table"));
            continue;
        };
        for used in Reader::read(&std::fs::read_to_string(&path).unwrap(), &module) {
            let name = used.first().map_or("the whole crate", String::as_str);
            if name != room && !allowed.contains(&name) {
                faults.push(format!(
                    "{}: {room} may not use {name}: {}",
                    file.display(),
                    used.join("::")
                ));
            }
        }
    }
    for (k, (room, allowed)) in ROOMS.iter().enumerate() {
        if !seen.contains(*room) {
            faults.push(format!("there is no room {room}"));
        }
        let above: Vec<_> = ROOMS[..k].iter().map(|(name, _)| *name).collect();
        let below = allowed.iter().filter(|name| !above.contains(name));
        faults.extend(below.map(|name| format!("{name} does not stand above {room}")));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The files of a crate by module, and which uses which. A module that contains the file is not counted: it declares the file.
struct Files {
    names: BTreeMap<Vec<String>, String>,
    handed: BTreeMap<Vec<String>, BTreeMap<String, Vec<String>>>,
    uses: BTreeMap<Vec<String>, BTreeSet<Vec<String>>>,
}

impl Files {
    fn new(texts: &BTreeMap<PathBuf, String>) -> Self {
        let mut all = Files {
            names: BTreeMap::new(),
            handed: BTreeMap::new(),
            uses: BTreeMap::new(),
        };
        let mut used = BTreeMap::new();
        for (file, text) in texts {
            let module = module(file);
            let mut reader = Reader {
                module: module.clone(),
                within: true,
                ..Reader::default()
            };
            let parsed = syn::parse_file(text).expect("it compiles");
            let handed = parsed.items.iter().filter_map(|item| match item {
                syn::Item::Use(item) => Some(item),
                _ => None,
            });
            handed.for_each(|item| reader.tree(&item.tree, Vec::new()));
            let by_name = std::mem::take(&mut reader.named);
            reader.used.clear();
            reader.visit_file(&parsed);
            used.insert(module.clone(), reader.used);
            all.handed.insert(module.clone(), by_name);
            all.names.insert(module, file.display().to_string());
        }
        for (module, used) in used {
            let owners = used.iter().filter_map(|path| all.owner(path));
            let others = owners.filter(|owner| !module.starts_with(owner)).collect();
            all.uses.insert(module, others);
        }
        all
    }

    /// The module that defines what a path names, wherever it is handed on.
    fn owner(&self, path: &[String]) -> Option<Vec<String>> {
        let mut path = path.to_vec();
        for _ in 0..10 {
            let depth = (0..=path.len()).rev();
            let depth = depth
                .into_iter()
                .find(|k| self.names.contains_key(&path[..*k]))?;
            let (module, rest) = path.split_at(depth);
            let next = self.handed[module].get(rest.first()?);
            match next.filter(|next| **next != path[..=depth]) {
                Some(next) => path = [next, &rest[1..]].concat(),
                None => return Some(module.to_vec()),
            }
        }
        None
    }

    /// What a file uses, at once or through others.
    fn reached<'f>(&'f self, from: &'f Vec<String>) -> BTreeSet<&'f Vec<String>> {
        let (mut seen, mut next) = (BTreeSet::new(), vec![from]);
        while let Some(module) = next.pop() {
            next.extend(self.uses[module].iter().filter(|used| seen.insert(*used)));
        }
        seen
    }

    /// Sets of files each of which uses all others of its set, if not at once then through others.
    fn circles(&self) -> Vec<Vec<&str>> {
        let reached: BTreeMap<_, _> = self.names.keys().map(|m| (m, self.reached(m))).collect();
        let circle = |module| {
            let around = reached[module].iter();
            let around = around.filter(|other| reached[**other].contains(module));
            around.map(|other| &*self.names[*other]).collect()
        };
        let circles: BTreeSet<Vec<&str>> = self.names.keys().map(circle).collect();
        circles.into_iter().filter(|c| !c.is_empty()).collect()
    }
}

/// Two files that use each other are one thought in two places; more are a knot.
#[test]
fn no_more_than_two_files_use_each_other() {
    for home in [
        "src",
        "crates/mesh/src",
        "crates/judge/src",
        "crates/fem/src",
        "crates/form/src",
    ] {
        let home = source(home);
        let texts = files(&home).into_iter().map(|path| {
            let text = std::fs::read_to_string(&path).unwrap();
            (path.strip_prefix(&home).unwrap().to_owned(), text)
        });
        let is_code = |file: &Path| {
            let name = file.file_stem().unwrap_or_default().to_string_lossy();
            name != "main" && !name.ends_with("tests")
        };
        let texts: BTreeMap<_, _> = texts.filter(|(file, _)| is_code(file)).collect();
        assert!(texts.len() > 20, "{home:?}");
        let files = Files::new(&texts);
        let knots: Vec<_> = files
            .circles()
            .into_iter()
            .filter(|c| c.len() > 2)
            .collect();
        assert!(knots.is_empty(), "{}: {knots:#?}", home.display());
    }
}

#[test]
fn knots_are_seen() {
    let file = |name: &str, text: &str| (PathBuf::from(name), text.to_owned());
    let mut texts = BTreeMap::from([
        file(
            "lib.rs",
            "mod a; mod b; pub mod c; pub use b::B as Other; fn f() { a::f() }",
        ),
        file("a.rs", "use crate::Other; pub fn f(_: Other) {}"),
        file("b.rs", "use crate::c::{self, d::D}; pub struct B(D, c::C);"),
        file("c/mod.rs", "pub mod d; pub use d::C; pub fn g() {}"),
        file("c/d.rs", "use super::g; pub struct C; pub struct D;"),
    ]);
    assert!(Files::new(&texts).circles().is_empty());
    let in_test = "#[cfg(test)] mod tests { use crate::a::f; }";
    texts
        .get_mut(Path::new("c/d.rs"))
        .unwrap()
        .push_str(in_test);
    assert!(Files::new(&texts).circles().is_empty());
    texts
        .get_mut(Path::new("c/d.rs"))
        .unwrap()
        .push_str("fn h() { crate::a::f(()) }");
    assert_eq!(Files::new(&texts).circles(), [["a.rs", "b.rs", "c/d.rs"]]);
}

#[test]
fn crates_name_no_other_of_ours_than_they_may() {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args([
        "metadata",
        "--no-deps",
        "--format-version",
        "1",
        "--offline",
    ]);
    let told = cargo.current_dir(source("")).output().unwrap();
    let told: Value = serde_json::from_slice(&told.stdout).unwrap();
    let packages = told["packages"].as_array().unwrap();
    let ours: Vec<_> = packages.iter().map(|package| &package["name"]).collect();
    assert_eq!(
        ours.len(),
        CRATES.len() + 1,
        "ours, and the program: {ours:?}"
    );
    for (name, allowed) in CRATES {
        let package = packages
            .iter()
            .find(|package| package["name"] == name)
            .unwrap();
        // For tests and for building as well, and under whatever name.
        let named = package["dependencies"].as_array().unwrap().iter();
        let named = named.map(|dependency| &dependency["name"]);
        let named: BTreeSet<_> = named
            .filter(|d| ours.contains(d))
            .filter_map(Value::as_str)
            .collect();
        assert_eq!(named, allowed.iter().copied().collect(), "{name}");
    }
}

/// What the text of a file in src/judge/inner.rs uses, without the paths that stay in the room.
fn uses(text: &str) -> Vec<String> {
    let used = Reader::read(text, &["judge".to_owned(), "inner".to_owned()]);
    let used = used.iter().map(|path| path.join("::"));
    used.filter(|path| !path.starts_with("judge")).collect()
}

#[test]
fn every_way_to_name_a_room_is_seen() {
    for (text, used) in [
        ("use crate::cli::x;", &["cli::x"][..]),
        ("use super::super::cli::x;", &["cli::x"]),
        ("use super::{own, super::cli};", &["cli"]),
        ("use self::super::super::cli;", &["cli"]),
        (
            "use crate::{a, b::{c, d as e}, f::*};",
            &["a", "b::c", "b::d", "f"],
        ),
        ("use crate::cli::{self, x};", &["cli", "cli::x"]),
        ("use {crate::a, std::fs};", &["a"]),
        ("pub use crate::cli::x as y;", &["cli::x"]),
        ("pub(crate) fn f() { crate::cli::x(); }", &["cli::x"]),
        (
            "fn f() -> Vec<super::super::cli::X> { vec![] }",
            &["cli::X"],
        ),
        (
            "fn f() { let x = <crate::a::A as crate::b::B>::c; }",
            &["a::A", "b::B::c"],
        ),
        (
            "fn f() { if let crate::cli::X { y: 1 } = z {} }",
            &["cli::X"],
        ),
        ("impl crate::cli::X for Own {}", &["cli::X"]),
        ("fn f() { use crate::cli::x; }", &["cli::x"]),
        // Inside modules of the file itself, and after one that is for tests.
        (
            "mod own { use super::super::x; use super::super::super::cli::y; }",
            &["cli::y"],
        ),
        ("#[cfg(test)] mod tests {} use crate::cli::x;", &["cli::x"]),
        ("#[cfg(test)] mod tests { use crate::cli::x; }", &["cli::x"]),
        // In what nobody has parsed.
        ("fn f() { println!(\"{}\", crate::cli::x()); }", &["cli::x"]),
        ("fn f() { vec![[super::super::cli::x; 2]]; }", &["cli::x"]),
        ("fn f() { crate::cli::tell!(1); }", &["cli::tell"]),
        ("macro_rules! m { () => { $crate::cli::x() } }", &["cli::x"]),
        (
            "macro_rules! m { () => { use crate::{cli::x, a}; } }",
            &["a", "cli::x"],
        ),
        (
            "#[arg(value_parser = crate::cli::x)] struct A;",
            &["cli::x"],
        ),
        (
            "struct A { #[serde(with = \"crate::cli\")] a: u8 }",
            &["cli"],
        ),
        ("fn f() { ::faceoff::cli::x(); }", &["cli::x"]),
        // The root, under which all rooms are.
        ("use crate::*;", &[""]),
        ("use super::super::*;", &[""]),
        ("use crate as c;", &[""]),
        ("use super::super::{self as c};", &[""]),
        // What is no room.
        (
            "use std::{fs, io::Read}; use super::own; use self::a::b; mod cli {} fn f() { cli::x() }",
            &[],
        ),
        (
            "/// See [`crate::cli::x`].\npub(in crate::judge) struct A;",
            &[],
        ),
        (
            "fn f() { println!(\"see crate::cli::x there\"); a::b::c::<u8>() }",
            &[],
        ),
    ] {
        assert_eq!(uses(text), used, "{text}");
    }
    // In the root rooms are known without `crate`, and the program names the library.
    let root = Reader::read("pub use cli::x;", &[]);
    assert_eq!(root, [vec!["cli".to_owned(), "x".to_owned()]].into());
}
