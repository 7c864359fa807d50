//! The output of a program while it runs: its lines, a log of bounded size, and the part that a message quotes.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Longer lines are read in parts.
const LONGEST_LINE: usize = 1 << 16;

/// The log contains the first and the last bytes of the output.
const HEAD: u64 = 32 << 20;
const TAIL: usize = 1 << 20;

/// Lines that a message quotes, and the bytes that it has of them.
const QUOTED: usize = 6;
const QUOTED_BYTES: usize = 900;

/// Where a program speaks.
#[derive(Debug, Clone, Copy)]
enum Stream {
    Output,
    Errors,
}

/// Both streams of a program, read by threads that nothing waits for: a process that left the program's group may hold a
/// stream open for as long as it lives.
pub(crate) struct Said {
    parts: Receiver<(Stream, Vec<u8>)>,
    /// For each stream, the line that is not complete yet.
    begun: [Vec<u8>; 2],
    log: File,
    logged: u64,
    tail: VecDeque<u8>,
    left_out: u64,
    last: VecDeque<String>,
    errors: VecDeque<String>,
    /// Whether the last line begins with `error `.
    is_error: bool,
}

impl Said {
    /// The output of a program with these streams; the log is kept in `log`.
    ///
    /// # Errors
    /// A system that starts no further thread.
    pub fn new(
        output: impl Read + Send + 'static,
        errors: impl Read + Send + 'static,
        log: File,
    ) -> std::io::Result<Self> {
        // A program that prints faster than it is read waits, so that its output does not fill the memory.
        let (sender, parts) = sync_channel(16);
        read(output, Stream::Output, sender.clone())?;
        read(errors, Stream::Errors, sender)?;
        Ok(Said {
            parts,
            begun: [Vec::new(), Vec::new()],
            log,
            logged: 0,
            tail: VecDeque::new(),
            left_out: 0,
            last: VecDeque::new(),
            errors: VecDeque::new(),
            is_error: false,
        })
    }

    /// Reads the output within this time; `line` gets each line. False once the output is closed.
    pub fn hear(&mut self, time: Duration, line: &mut impl FnMut(&str)) -> bool {
        match self.parts.recv_timeout(time) {
            Ok((stream, bytes)) => {
                self.keep(&bytes);
                self.split(stream, &bytes, line);
                true
            }
            Err(RecvTimeoutError::Timeout) => true,
            Err(RecvTimeoutError::Disconnected) => false,
        }
    }

    /// Reads the rest of the output after the end of the program, until nothing more comes, but at most for this time.
    pub fn end(&mut self, quiet: Duration, most: Duration, line: &mut impl FnMut(&str)) {
        let end = Instant::now() + most;
        while Instant::now() < end {
            match self.parts.recv_timeout(quiet) {
                Ok((stream, bytes)) => {
                    self.keep(&bytes);
                    self.split(stream, &bytes, line);
                }
                Err(_) => break,
            }
        }
        for stream in [Stream::Output, Stream::Errors] {
            self.complete(stream, line);
        }
        // The log is for people; a full disk must not stop the program's answer.
        if self.left_out > 0 {
            let _ = writeln!(self.log, "\n[{} bytes are left out here]", self.left_out);
        }
        let (first, second) = self.tail.as_slices();
        let _ = self.log.write_all(first);
        let _ = self.log.write_all(second);
    }

    fn keep(&mut self, bytes: &[u8]) {
        let room = usize::try_from(HEAD - self.logged).unwrap_or(usize::MAX);
        let (head, rest) = bytes.split_at(room.min(bytes.len()));
        let _ = self.log.write_all(head);
        self.logged += head.len() as u64;
        self.tail.extend(rest);
        let surplus = self.tail.len().saturating_sub(TAIL);
        self.tail.drain(..surplus);
        self.left_out += surplus as u64;
    }

    fn split(&mut self, stream: Stream, bytes: &[u8], line: &mut impl FnMut(&str)) {
        for part in bytes.split_inclusive(|byte| *byte == b'\n') {
            let mut part = part;
            while !part.is_empty() {
                let begun = &mut self.begun[stream as usize];
                let (now, later) = part.split_at(part.len().min(LONGEST_LINE - begun.len()));
                begun.extend_from_slice(now);
                if now.ends_with(b"\n") || begun.len() == LONGEST_LINE {
                    self.complete(stream, line);
                }
                part = later;
            }
        }
    }

    fn complete(&mut self, stream: Stream, line: &mut impl FnMut(&str)) {
        let bytes = std::mem::take(&mut self.begun[stream as usize]);
        if bytes.is_empty() {
            return;
        }
        let text = String::from_utf8_lossy(&bytes);
        if matches!(stream, Stream::Output) {
            line(text.trim_end());
        }
        let text = text.trim();
        // Horizontal rules of mpirun, and Python's markers below a line.
        if text.trim_matches(['-', '^', '~']).is_empty() || text.starts_with("progress ") {
            return;
        }
        // FreeFEM prints the place in a separate line.
        let is_place = self.is_error && text.starts_with("line number");
        let error = text.strip_prefix("error ");
        self.is_error = error.is_some();
        let (of_kind, text) = match error.or(Some(text).filter(|_| is_place)) {
            Some(text) => (&mut self.errors, text),
            None => (&mut self.last, text),
        };
        if of_kind.len() == QUOTED {
            of_kind.pop_front();
        }
        of_kind.push_back(ending(text, QUOTED_BYTES));
    }

    /// What a message quotes of a failure: the lines that begin with `error `, or else the last ones.
    pub fn quote(&self) -> String {
        let lines = match self.errors.is_empty() {
            true => &self.last,
            false => &self.errors,
        };
        if lines.is_empty() {
            return ", and it said nothing".into();
        }
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        format!(": {}", ending(&lines.join(" | "), QUOTED_BYTES))
    }
}

/// A text, or the end of a longer one.
fn ending(text: &str, most: usize) -> String {
    if text.len() <= most {
        return text.to_owned();
    }
    let start = (text.len() - most..text.len()).find(|&k| text.is_char_boundary(k));
    format!("…{}", &text[start.unwrap_or(0)..])
}

fn read(
    mut from: impl Read + Send + 'static,
    stream: Stream,
    to: SyncSender<(Stream, Vec<u8>)>,
) -> std::io::Result<()> {
    let work = move || {
        let mut buffer = vec![0; 1 << 16];
        loop {
            match from.read(&mut buffer) {
                Ok(0) => break,
                Ok(count) => {
                    if to.send((stream, buffer[..count].to_vec())).is_err() {
                        break;
                    }
                }
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(_) => break,
            }
        }
    };
    std::thread::Builder::new().spawn(work).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Cursor, Seek};

    fn said(output: Vec<u8>, errors: &str) -> (Vec<String>, Said, Vec<u8>) {
        let mut file = tempfile::tempfile().unwrap();
        let log = file.try_clone().unwrap();
        let errors = Cursor::new(errors.as_bytes().to_vec());
        let mut said = Said::new(Cursor::new(output), errors, log).unwrap();
        let mut lines = Vec::new();
        let time = Duration::from_secs(5);
        said.end(time, time, &mut |line: &str| lines.push(line.to_owned()));
        let mut logged = Vec::new();
        file.rewind().unwrap();
        file.read_to_end(&mut logged).unwrap();
        (lines, said, logged)
    }

    #[test]
    fn errors_are_quoted_and_else_the_last_lines() {
        let output = b"one\nprogress case-0 1 0.5\n-----\nerror it \xff broke\ntwo".to_vec();
        let (lines, of_both, logged) = said(output.clone(), "three\n^^^\n");
        assert_eq!(lines.len(), 5);
        assert_eq!((&*lines[0], &*lines[4]), ("one", "two"));
        assert_eq!(of_both.quote(), ": it \u{fffd} broke");
        assert_eq!(logged.len(), output.len() + 10);
        let (_, of_both, _) = said(b"a\nb\n".to_vec(), "");
        assert_eq!(of_both.quote(), ": a | b");
        let (_, nothing, _) = said(Vec::new(), "\n");
        assert_eq!(nothing.quote(), ", and it said nothing");
        let (_, long, _) = said("é".repeat(LONGEST_LINE).into_bytes(), "");
        assert!(long.quote().len() < QUOTED_BYTES + 9, "{}", long.quote());
    }

    #[test]
    fn a_log_has_the_first_and_the_last_words() {
        let line = format!("{}\n", "x".repeat(99));
        let output = format!(
            "first\n{}last\n",
            line.repeat((HEAD as usize + 2 * TAIL) / 100)
        );
        let length = output.len();
        let (_, _, logged) = said(output.into_bytes(), "");
        assert!(logged.len() < HEAD as usize + TAIL + 100 && logged.len() < length);
        assert!(logged.starts_with(b"first\n") && logged.ends_with(b"last\n"));
        let text = String::from_utf8(logged).unwrap();
        assert!(text.contains("bytes are left out here]"));
    }
}
