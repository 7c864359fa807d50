//! A journal of finished work, one entry per line, written as it is done, so that an interrupted run can be resumed.

use std::collections::{BTreeSet, HashMap};
use std::fs::{self, File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{Entry, first_difference, name};
use crate::engine::lock;
use faceoff_mesh::error::{Error, Place, Result};
use faceoff_mesh::file;

/// The start of the file, in every version.
const JOURNAL: &str = "faceoff/journal/";
/// The current version.
const SCHEMA: &str = "faceoff/journal/2";

/// A file that only one run at a time appends to.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    /// Locked until it is dropped.
    file: Mutex<File>,
    /// By engine and case.
    known: HashMap<[String; 2], Entry>,
    /// The state of a program when it was last queried, by the name of its engine.
    programs: Mutex<HashMap<String, Value>>,
}

#[derive(Serialize, Deserialize)]
struct Header {
    schema: String,
    /// Everything that all entries depend on.
    of: Value,
}

impl Journal {
    /// Opens or begins a journal: the file itself, or `journal.jsonl` in a folder. A last line that was cut off is dropped.
    ///
    /// # Errors
    /// A file that is not a journal, was begun with something other than `of`, or is in use by another run; the file is
    /// unchanged then.
    pub fn open(path: &Path, of: &Value) -> Result<Self> {
        let is_file = path.is_file() || path.extension().is_some_and(|e| e == "jsonl");
        let path = if is_file {
            path.to_owned()
        } else {
            // The folder is created, but not its parents: a missing parent is probably a typing error.
            if !path.is_dir() {
                fs::create_dir(path).map_err(Error::io(path, "make"))?;
            }
            path.join("journal.jsonl")
        };
        let mut options = OpenOptions::new();
        let mut file = options
            .append(true)
            .create(true)
            .open(&path)
            .map_err(Error::io(&path, "write"))?;
        if file.try_lock().is_err() {
            return Err(refuse(&path, "is in use by another run".into()));
        }
        let text = file::text(&path)?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let fault = |line: usize, what: String, remedy: &str| {
            Error::file(&path, Place::Line(line + 1), what, remedy)
        };
        let no_journal = || {
            let remedy = "name another file; nothing was touched";
            fault(0, "it is not a journal of a run".into(), remedy)
        };
        let truncate = |length: usize| {
            let done = file.set_len(length as u64);
            done.map_err(Error::io(&path, "write"))
        };
        let mut lines = text[..whole].lines().enumerate();
        match lines.next() {
            // The file is not empty, but has no complete line.
            None if !text.is_empty() && !text.starts_with('{') => return Err(no_journal()),
            None => {
                truncate(0)?;
                let header = Header {
                    schema: SCHEMA.into(),
                    of: of.clone(),
                };
                append(&mut file, &path, &header)?;
            }
            Some((_, first)) => {
                let header: Header = serde_json::from_str(first).map_err(|_| no_journal())?;
                if header.schema != SCHEMA {
                    if !header.schema.starts_with(JOURNAL) {
                        return Err(no_journal());
                    }
                    let what = "is of another version of faceoff, whose answers cannot be used";
                    return Err(refuse(&path, what.into()));
                }
                if let Some(what) = first_difference("", &header.of, of) {
                    return Err(refuse(
                        &path,
                        format!("was begun with something else: {what}"),
                    ));
                }
                truncate(whole)?;
            }
        }
        let mut known = HashMap::new();
        for (line, text) in lines {
            let entry: Entry = serde_json::from_str(text)
                .map_err(|e| fault(line, format!("it is not an entry: {e}"), "remove the line"))?;
            known.insert([entry.by.clone(), entry.at.clone()], entry);
        }
        Ok(Journal {
            path,
            file: Mutex::new(file),
            known,
            programs: Mutex::default(),
        })
    }

    /// The answer to a problem: the stored one, if it is `usable`, or the new one that is `found`, which is stored. `program` returns the further inputs of the
    /// answer; that may take a second, and is repeated only after a run, in which a program may write files to its folder.
    ///
    /// # Errors
    /// The stored inputs differ; a file that cannot be written. Inner error: why the answer cannot be requested or found.
    pub fn once<K: Serialize + DeserializeOwned, T>(
        &self,
        of: [&str; 2],
        program: impl Fn() -> Result<Value>,
        problem: &Value,
        usable: impl FnOnce(K) -> Option<T>,
        found: impl FnOnce() -> Result<(T, K)>,
    ) -> Result<Result<T>> {
        let asked = |is_after: bool| {
            let known = lock(&self.programs).get(of[0]).cloned();
            let program = match known.filter(|_| !is_after) {
                Some(known) => known,
                None => program()?,
            };
            lock(&self.programs).insert(of[0].to_owned(), program.clone());
            Ok(json!({ "program": program, "problem": problem }))
        };
        let before = match asked(false) {
            Ok(before) => before,
            Err(error) => return Ok(Err(error)),
        };
        if let Some(known) = self.find(of, &before)?.and_then(usable) {
            return Ok(Ok(known));
        }
        match found().and_then(|found| Ok((found, asked(true)?))) {
            Err(error) => Ok(Err(error)),
            Ok(((answer, kept), after)) => {
                self.keep(of, [&before, &after], &kept)?;
                Ok(Ok(answer))
            }
        }
    }

    /// The stored answer, if its inputs equal the current ones.
    fn find<T: DeserializeOwned>(&self, of: [&str; 2], asked: &Value) -> Result<Option<T>> {
        let Some(entry) = self.known.get(&of.map(str::to_owned)) else {
            return Ok(None);
        };
        let wrote: BTreeSet<&String> = self.known.values().flat_map(|of| &of.wrote).collect();
        let [was, is] = [&entry.asked, asked].map(|asked| without(asked, &wrote));
        if let Some(what) = first_difference("", &was, &is) {
            let what = format!("was begun with something else: of {}, {what}", name(of));
            return Err(refuse(&self.path, what));
        }
        // An unreadable answer is computed again.
        Ok(serde_json::from_value(entry.found.clone()).ok())
    }

    /// Stores an answer with its inputs before and after the run.
    fn keep(&self, [by, at]: [&str; 2], asked: [&Value; 2], found: &impl Serialize) -> Result<()> {
        let mut wrote = BTreeSet::new();
        changed(asked[0], asked[1], &mut wrote);
        let entry = Entry {
            by: by.to_owned(),
            at: at.to_owned(),
            asked: asked[0].clone(),
            found: serde_json::to_value(found).unwrap_or_default(),
            wrote,
        };
        append(&mut lock(&self.file), &self.path, &entry)
    }
}

/// The object under this key contains the digests of data in the folder of a program, by their names.
const BESIDE: &str = "beside";

/// Data whose digests differ, or that only one of them has.
fn changed(before: &Value, after: &Value, names: &mut BTreeSet<String>) {
    let (Value::Object(before), Value::Object(after)) = (before, after) else {
        return;
    };
    for (key, was) in before {
        let Some(is) = after.get(key) else { continue };
        match (key == BESIDE, was, is) {
            (true, Value::Object(was), Value::Object(is)) => {
                let all = was.keys().chain(is.keys());
                names.extend(all.filter(|name| was.get(*name) != is.get(*name)).cloned());
            }
            _ => changed(was, is, names),
        }
    }
}

/// A value without the data of these names.
fn without(of: &Value, names: &BTreeSet<&String>) -> Value {
    let Value::Object(all) = of else {
        return of.clone();
    };
    let of = |(key, value): (&String, &Value)| {
        let value = match value {
            Value::Object(data) if key == BESIDE => data
                .iter()
                .filter(|(name, _)| !names.contains(name))
                .map(|(name, digest)| (name.clone(), digest.clone()))
                .collect(),
            other => without(other, names),
        };
        (key.clone(), value)
    };
    Value::Object(all.iter().map(of).collect())
}

fn refuse(path: &Path, what: String) -> Error {
    Error::usage(
        format!("{} {what}", path.display()),
        "resume what was begun there as it was begun, or name another place with --resume",
    )
}

fn append(file: &mut File, path: &Path, value: &impl Serialize) -> Result<()> {
    let mut line = serde_json::to_string(value).map_err(|e| {
        let what = format!("no JSON can be made: {e}");
        Error::file(path, Place::Whole, what, "report this")
    })?;
    line.push('\n');
    file.write_all(line.as_bytes())
        .map_err(Error::io(path, "write"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_was_kept_is_found_again_and_what_was_cut_off_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("j.jsonl");
        let (of, asked) = (json!({"machine": "A"}), json!({"n": 8}));
        let journal = Journal::open(&path, &of).unwrap();
        journal.keep(["a", ""], [&asked; 2], &2.5).unwrap();
        journal.keep(["b", ""], [&asked; 2], &f64::NAN).unwrap();
        drop(journal);
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(text.lines().count(), 3);
        // The process was killed while it wrote.
        fs::write(&path, format!("{text}{{\"key\":\"c\",\"as")).unwrap();
        let again = Journal::open(&path, &of).unwrap();
        assert_eq!(again.find(["a", ""], &asked).unwrap(), Some(2.5));
        // JSON has no NaN: an entry that cannot be read back is computed again.
        assert_eq!(again.find::<f64>(["b", ""], &asked).unwrap(), None);
        assert_eq!(again.find::<f64>(["c", ""], &asked).unwrap(), None);
        again.keep(["c", ""], [&asked; 2], &0.0).unwrap();
        // If an entry was unusable and computed again, the later one counts.
        again.keep(["a", ""], [&asked; 2], &3.5).unwrap();
        drop(again);
        let again = Journal::open(&path, &of).unwrap();
        assert_eq!(again.find(["c", ""], &asked).unwrap(), Some(0.0));
        assert_eq!(again.find(["a", ""], &asked).unwrap(), Some(3.5));
        let other = again.find::<f64>(["a", ""], &json!({"n": 16})).unwrap_err();
        assert!(
            other.to_string().contains("of a, n was 8 and is 16"),
            "{other}"
        );
        drop(again);
        // The process was killed while it began the file.
        fs::write(&path, "{\"schema\":\"faceoff/jou").unwrap();
        let again = Journal::open(&path, &of).unwrap();
        again.keep(["a", ""], [&asked; 2], &2.5).unwrap();
        drop(again);
        let again = Journal::open(&path, &of).unwrap();
        assert_eq!(again.find(["a", ""], &asked).unwrap(), Some(2.5));
    }

    #[test]
    fn what_a_program_writes_beside_itself_is_not_what_it_depends_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("j.jsonl");
        let asked =
            |log: &str, data: &str| json!({ "code": { "beside": { "log": log, "data": data } } });
        let journal = Journal::open(&path, &json!({})).unwrap();
        journal
            .keep(["a", ""], [&asked("1", "x"), &asked("2", "x")], &2.5)
            .unwrap();
        journal
            .keep(["b", ""], [&asked("2", "x"); 2], &3.5)
            .unwrap();
        // A script that was changed in the meantime is not mistaken for output of the program.
        let script = |text: &str| json!({ "code": { "files": { "log": text } } });
        journal
            .keep(["c", ""], [&script("1"), &script("2")], &4.5)
            .unwrap();
        drop(journal);
        let again = Journal::open(&path, &json!({})).unwrap();
        assert_eq!(again.find(["c", ""], &script("1")).unwrap(), Some(4.5));
        assert!(again.find::<f64>(["c", ""], &script("2")).is_err());
        for (key, found) in [("a", 2.5), ("b", 3.5)] {
            assert_eq!(
                again.find([key, ""], &asked("3", "x")).unwrap(),
                Some(found)
            );
            assert!(again.find::<f64>([key, ""], &asked("3", "y")).is_err());
        }
    }

    #[test]
    fn other_files_are_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("j.jsonl");
        let foreign = r#"{"schema":"faceoff/journal/2","of":{"machine":"B"}}"#.to_owned() + "\n";
        let earlier = r#"{"schema":"faceoff/journal/1","of":{"machine":"A"}}"#.to_owned() + "\n";
        let of = json!({"machine": "A"});
        for (text, sentence) in [
            ("mine", "not a journal"),
            ("mine\nand mine", "not a journal"),
            (&earlier, "another version"),
            (&foreign, "machine was \"B\" and is \"A\""),
        ] {
            fs::write(&path, text).unwrap();
            let refused = Journal::open(&path, &of).unwrap_err().to_string();
            assert!(refused.contains(sentence), "{refused}");
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        // The file is created in an existing folder, or in a new folder of an existing one.
        assert!(Journal::open(&folder.path().join("no/such"), &of).is_err());
        assert!(!folder.path().join("no").exists());
        drop(Journal::open(&folder.path().join("new"), &of).unwrap());
        let mut text = fs::read_to_string(folder.path().join("new/journal.jsonl")).unwrap();
        text += "{\"at\":\"a\"}\n";
        fs::write(&path, text).unwrap();
        let refused = Journal::open(&path, &of).unwrap_err().to_string();
        assert!(refused.contains(":2: "), "{refused}");
    }

    #[test]
    fn one_run_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("j.jsonl");
        let first = Journal::open(&path, &json!({})).unwrap();
        let refused = Journal::open(&path, &json!({})).unwrap_err().to_string();
        assert!(refused.contains("in use by another run"), "{refused}");
        drop(first);
        Journal::open(&path, &json!({})).unwrap();
    }
}
