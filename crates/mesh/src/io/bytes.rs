//! Large amounts of memory: for a whole file, or for one of its arrays.

use std::fs::File;
use std::io::{self, Read};
use std::ops::{Deref, DerefMut, Range};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use bytemuck::Pod;
use memmap2::MmapMut;

use crate::file;
use crate::mesh::Array;
use crate::parallel;

/// Bytes, in pages of 2 MB if there are many and the system has such pages: allocating the size of a file in small
/// pages takes longer than reading the file.
pub enum Bytes {
    Small(Vec<u8>),
    Large(Pages),
}

/// The first bytes of large pages, which the next file may get.
pub struct Pages {
    /// None once it is dropped.
    pages: Option<MmapMut>,
    length: usize,
}

/// From this many bytes on, large pages are used.
const LARGE: u64 = 4 << 20;
/// The most memory that is kept for the next file: a page that the system has to make first takes longer than to read it.
const KEPT: usize = 64 << 20;
/// Pages of a file that is no longer needed.
static SPARE: Mutex<Option<MmapMut>> = Mutex::new(None);
/// Bytes that one thread reads at a time.
#[cfg(unix)]
const SHARE: usize = 2 << 20;

impl Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Bytes::Small(bytes) => bytes,
            Bytes::Large(Pages { pages, length }) => pages
                .as_deref()
                .and_then(|pages| pages.get(..*length))
                .unwrap_or_default(),
        }
    }
}

impl AsRef<[u8]> for Bytes {
    fn as_ref(&self) -> &[u8] {
        self
    }
}

impl DerefMut for Bytes {
    fn deref_mut(&mut self) -> &mut [u8] {
        match self {
            Bytes::Small(bytes) => bytes,
            Bytes::Large(Pages { pages, length }) => pages
                .as_deref_mut()
                .and_then(|pages| pages.get_mut(..*length))
                .unwrap_or_default(),
        }
    }
}

impl Pages {
    fn new(pages: MmapMut, length: usize) -> Self {
        let pages = Some(pages);
        Pages { pages, length }
    }
}

impl Drop for Pages {
    fn drop(&mut self) {
        let mut spare = SPARE.lock().unwrap_or_else(PoisonError::into_inner);
        let length = |pages: &Option<MmapMut>| pages.as_ref().map_or(0, |pages| pages.len());
        if (length(&spare) + 1..=KEPT).contains(&length(&self.pages)) {
            *spare = self.pages.take();
        }
    }
}

/// `length` zeros.
pub fn zeros(length: usize) -> Bytes {
    let large = (length as u64 >= LARGE).then(|| large(length));
    match large {
        Some(Ok(pages)) => Bytes::Large(Pages::new(pages, length)),
        _ => Bytes::Small(vec![0; length]),
    }
}

fn large(length: usize) -> io::Result<MmapMut> {
    let bytes = MmapMut::map_anon(length)?;
    // Large pages only save time.
    #[cfg(target_os = "linux")]
    let _ = bytes.advise(memmap2::Advice::HugePage);
    Ok(bytes)
}

/// The large files that are in memory now.
static HELD: Mutex<Vec<Weak<Bytes>>> = Mutex::new(Vec::new());

/// Reads a regular file to its end.
///
/// # Errors
/// The errors of [`file::open`].
pub fn read(path: &Path) -> io::Result<Arc<Bytes>> {
    let mut file = file::open(path)?;
    let found = file.metadata()?;
    if found.len() >= LARGE
        && let Ok(large) = read_large(&file, found.len())
    {
        let bytes = Arc::new(Bytes::Large(large));
        let mut held = HELD.lock().unwrap_or_else(PoisonError::into_inner);
        held.retain(|held| held.strong_count() > 0);
        held.push(Arc::downgrade(&bytes));
        return Ok(bytes);
    }
    // This also reads a file that grows or shrinks meanwhile.
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    Ok(Arc::new(Bytes::Small(bytes)))
}

/// The owner of these bytes, if they are a large file from [`read`], or else of a copy: the library of HDF5 keeps what it
/// reads from, and copying a file takes longer than reading it.
pub fn owner(bytes: &[u8]) -> Arc<Bytes> {
    let held = holder(bytes).map(|(file, _)| file);
    held.filter(|file| file.len() == bytes.len())
        .unwrap_or_else(|| Arc::new(Bytes::Small(bytes.to_vec())))
}

/// The large file that these bytes are a part of, and where.
fn holder(bytes: &[u8]) -> Option<(Arc<Bytes>, Range<usize>)> {
    let held = HELD.lock().unwrap_or_else(PoisonError::into_inner);
    held.iter().filter_map(Weak::upgrade).find_map(|file| {
        let start = bytes.as_ptr().addr().checked_sub(file.as_ptr().addr())?;
        let part = start..start.checked_add(bytes.len())?;
        (part.end <= file.len()).then_some((file, part))
    })
}

/// Numbers of a file where they lie.
struct Lender(Arc<Bytes>, Range<usize>);

impl<T: Pod> AsRef<[T]> for Lender {
    fn as_ref(&self) -> &[T] {
        let Lender(file, part) = self;
        let bytes = file.get(part.clone()).unwrap_or_default();
        bytemuck::try_cast_slice(bytes).unwrap_or_default()
    }
}

/// The little-endian numbers that these bytes are, without copying them: if they are part of a large file and lie in it as in
/// memory. They keep all of it, so they are to be no less than a quarter.
pub fn lent<T: Pod>(bytes: &[u8]) -> Option<Array<T>> {
    bytemuck::try_cast_slice::<u8, T>(bytes).ok()?;
    let (file, part) = holder(bytes)?;
    let sparing = part.len() >= file.len() / 4 && cfg!(target_endian = "little");
    sparing.then(|| Array::lent(Arc::new(Lender(file, part))))
}

/// Reads a file of `length` bytes.
#[cfg(unix)]
fn read_large(file: &File, length: u64) -> io::Result<Pages> {
    use std::os::unix::fs::FileExt;
    let length = usize::try_from(length).map_err(io::Error::other)?;
    keep_memory();
    let spare = SPARE
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .take_if(|spare| spare.len() >= length);
    // A copy, as others may change the file itself while we use it.
    let mut pages = match spare {
        Some(spare) => spare,
        None => large(length)?,
    };
    let bytes = pages.get_mut(..length).unwrap_or_default();
    let shares = bytes.chunks_mut(SHARE).enumerate();
    let read =
        |(index, share): (usize, &mut [u8])| file.read_exact_at(share, (index * SHARE) as u64);
    parallel::map(shares, read)
        .into_iter()
        .collect::<io::Result<()>>()?;
    if file.read_at(&mut [0], length as u64)? > 0 {
        return Err(io::Error::other("the file has grown"));
    }
    Ok(Pages::new(pages, length))
}

/// Lets the allocator keep what the arrays of a file took for those of the next one: glibc gives back what is more than
/// twice the largest block that was ever freed, if that has 32 MB or less.
#[cfg(unix)]
fn keep_memory() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| drop(std::hint::black_box(Vec::<u8>::with_capacity(31 << 20))));
}

/// Elsewhere threads that read one file move its cursor.
#[cfg(not(unix))]
fn read_large(_: &File, _: u64) -> io::Result<Pages> {
    Err(io::ErrorKind::Unsupported.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_any_size_are_read_whole() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        for length in [0, 1, LARGE - 1, LARGE, LARGE + 4097] {
            let written: Vec<u8> = (0..length).map(|i| (i * 31 / 4096 + i) as u8).collect();
            std::fs::write(&path, &written).expect("written");
            let read = read(&path).expect("read");
            assert_eq!(matches!(*read, Bytes::Large(_)), length >= LARGE);
            assert!(**read == *written);
            // The same memory, if it is large and the whole of it.
            assert_eq!(Arc::ptr_eq(&owner(&read), &read), length >= LARGE);
            assert!(**owner(&read) == *written);
            assert!(!Arc::ptr_eq(&owner(&read[..read.len() / 2]), &read));
        }
        // A smaller file in the pages of a larger one.
        let small = folder.path().join("small");
        for fill in [7, 8] {
            std::fs::write(&small, vec![fill; LARGE as usize]).expect("written");
            let read = read(&small).expect("read");
            assert!(read.len() == LARGE as usize && read.iter().all(|&byte| byte == fill));
        }
        assert!(read(folder.path()).is_err());
        assert!(read(&folder.path().join("none")).is_err());
        // A file of another length than was assumed.
        let file = File::open(&path).expect("there");
        for wrong in [LARGE, LARGE + 4096, LARGE + 4098] {
            assert!(read_large(&file, wrong).is_err(), "{wrong}");
        }
    }
}
