//! Bytes of one array as VTU packs them, unpacked: a header of lengths, then the bytes, perhaps in compressed blocks.

use super::Compressor;
use super::stream::Stream;
use crate::io::bytes::{self, Bytes};
use crate::io::scalar::Scalar;
use crate::parallel;
use std::borrow::Cow;
use std::ops::{Deref, Range};
use std::sync::Arc;

/// Memory that arrays may take: this for a file of any size, and [`PER_BYTE`] for each of its bytes. A file whose arrays
/// declare more in sum is refused before any is unpacked.
const ALLOWANCE: u64 = 128 << 20;
/// Well-packed meshes decode to five times their bytes or less.
const PER_BYTE: u64 = 8;

/// The remaining memory that the arrays of one file may take.
pub(crate) struct Budget(u64);

impl Budget {
    pub fn of_file(bytes: usize) -> Self {
        Budget(ALLOWANCE.saturating_add(PER_BYTE.saturating_mul(bytes as u64)))
    }

    /// Takes `bytes`; an error if the file is too small for this number.
    pub fn take(&mut self, bytes: u64) -> Result<(), String> {
        self.0 = self.0.checked_sub(bytes).ok_or_else(|| {
            format!(
                "its {bytes} bytes are more than a file of this size may unpack to; store it uncompressed"
            )
        })?;
        Ok(())
    }
}

/// The bytes of an array, in the file or unpacked.
pub(crate) enum Unpacked<'a> {
    Borrowed(&'a [u8]),
    Owned(Bytes),
    /// A part of a file.
    Part(Arc<Bytes>, Range<usize>),
}

impl Deref for Unpacked<'_> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Unpacked::Borrowed(bytes) => bytes,
            Unpacked::Owned(bytes) => bytes,
            Unpacked::Part(file, range) => file.get(range.clone()).unwrap_or_default(),
        }
    }
}

impl<'a> From<&'a [u8]> for Unpacked<'a> {
    fn from(bytes: &'a [u8]) -> Self {
        Unpacked::Borrowed(bytes)
    }
}

impl From<Vec<u8>> for Unpacked<'_> {
    fn from(bytes: Vec<u8>) -> Self {
        Unpacked::Owned(Bytes::Small(bytes))
    }
}

impl<'a> From<Cow<'a, [u8]>> for Unpacked<'a> {
    fn from(bytes: Cow<'a, [u8]>) -> Self {
        match bytes {
            Cow::Borrowed(bytes) => Unpacked::Borrowed(bytes),
            Cow::Owned(bytes) => bytes.into(),
        }
    }
}

/// How the arrays of a file are packed.
#[derive(Clone, Copy)]
pub(super) struct Packing {
    pub big_endian: bool,
    pub wide_headers: bool,
    pub compressor: Compressor,
}

/// Number of blocks, bytes of each but the last, and bytes of the whole array; no blocks if it is not compressed.
#[derive(Default)]
struct Extent {
    blocks: u64,
    block: u64,
    length: u64,
}

impl Packing {
    /// The bytes of one array, `expected` many if that is known.
    ///
    /// `vtkio` loses the last block of an array whose length is a multiple of the block length, and trusts the
    /// number of blocks; here each declared length is checked against the bytes that exist before memory is
    /// allocated.
    pub fn unpack<'a>(
        self,
        mut stream: Stream<'a>,
        expected: Option<u64>,
    ) -> Result<Unpacked<'a>, String> {
        let check = |length: u64| match expected {
            Some(expected) if expected != length => Err(format!(
                "{length} bytes are declared where its type and the counts make {expected}"
            )),
            _ => Ok(()),
        };
        let Extent {
            blocks,
            block,
            length,
        } = self.extent(&mut stream)?;
        check(length)?;
        if length == 0 {
            return Ok(Unpacked::Borrowed(&[]));
        }
        if self.compressor == Compressor::None {
            return stream.take(length).map(Unpacked::from);
        }
        let packed = self.words(&mut stream, blocks)?;
        self.plausible(&packed, &stream, length)?;
        let blocks = packed.iter().map(|&size| stream.take(size));
        let blocks = blocks.collect::<Result<Vec<_>, _>>()?;
        let mut out = bytes::zeros(length as usize);
        self.unpack_blocks(
            &blocks,
            &mut out,
            usize::try_from(block).unwrap_or(usize::MAX),
        )?;
        Ok(Unpacked::Owned(out))
    }

    /// The declared number of unpacked bytes of an array; for a plain one at most the number that there are.
    pub fn declared(self, mut stream: Stream) -> Result<u64, String> {
        let length = self.extent(&mut stream)?.length;
        Ok(match self.compressor {
            Compressor::None => length.min(stream.remaining()),
            _ => length,
        })
    }

    /// Whether a plain array declares more bytes than there are; the stream is then after its header.
    pub fn lies(self, stream: &mut Stream) -> Result<bool, String> {
        Ok(self.compressor == Compressor::None && self.extent(stream)?.length > stream.remaining())
    }

    /// The header up to the lengths of the blocks.
    fn extent(self, stream: &mut Stream) -> Result<Extent, String> {
        if stream.remaining() == 0 {
            return Ok(Extent::default());
        }
        let cut_off = "its header is cut off";
        let [first] = self.words(stream, 1)?.try_into().map_err(|_| cut_off)?;
        if self.compressor == Compressor::None || first == 0 {
            return Ok(Extent {
                length: first,
                ..Extent::default()
            });
        }
        let [block, last] = self.words(stream, 2)?.try_into().map_err(|_| cut_off)?;
        if last > block || block == 0 {
            return Err(format!(
                "a last block of {last} bytes after blocks of {block} bytes"
            ));
        }
        let whole_blocks = if last == 0 { first } else { first - 1 };
        let length = whole_blocks
            .checked_mul(block)
            .and_then(|length| length.checked_add(last))
            .ok_or("its blocks add up to more than any memory")?;
        Ok(Extent {
            blocks: first,
            block,
            length,
        })
    }

    /// Fills `out` with the blocks, each of `size` bytes but the last, which may be shorter.
    fn unpack_blocks(
        self,
        blocks: &[Cow<[u8]>],
        out: &mut [u8],
        size: usize,
    ) -> Result<(), String> {
        if out.len().div_ceil(size) != blocks.len() {
            return Err("it has more blocks than bytes".into());
        }
        let unpack = |zlib: &mut flate2::Decompress, index: usize, slot: &mut [u8]| {
            let unpacked = decompress(&blocks[index], slot, self.compressor, zlib);
            unpacked.map_err(|what| format!("block {index}: {what}"))
        };
        let zlib = || flate2::Decompress::new(true);
        let mut slots = out.chunks_mut(size).enumerate();
        if self.compressor == Compressor::Lzma {
            // It needs much memory for each block: one at a time.
            let mut unused = zlib();
            return slots.try_for_each(|(index, slot)| unpack(&mut unused, index, slot));
        }
        let unpacked =
            parallel::map_with(zlib, slots, |zlib, (index, slot)| unpack(zlib, index, slot));
        unpacked.into_iter().collect()
    }

    /// Refuses blocks that do not exist, and lengths that no compressor achieves.
    fn plausible(self, packed: &[u64], stream: &Stream, length: u64) -> Result<(), String> {
        let total = packed
            .iter()
            .try_fold(0u64, |sum, &size| sum.checked_add(size));
        let total = total.filter(|&total| total <= stream.remaining());
        let total = total.ok_or("its blocks take more bytes than there are")?;
        let ratio = match self.compressor {
            Compressor::None => 1,
            Compressor::Lz4 => 256,
            Compressor::Zlib => 1040,
            Compressor::Lzma => 8192,
        };
        if length > total.saturating_mul(ratio) {
            return Err(format!("{total} bytes cannot unpack to {length}"));
        }
        Ok(())
    }

    fn words(self, stream: &mut Stream, count: u64) -> Result<Vec<u64>, String> {
        let width = if self.wide_headers { 8 } else { 4 };
        let bytes = stream.take(count.saturating_mul(width))?;
        Ok(if self.wide_headers {
            u64::from_bytes(&bytes, self.big_endian)
        } else {
            let words = u32::from_bytes(&bytes, self.big_endian);
            words.into_iter().map(u64::from).collect()
        })
    }
}

/// Fills `slot` exactly. `zlib` is reused.
fn decompress(
    bytes: &[u8],
    slot: &mut [u8],
    compressor: Compressor,
    zlib: &mut flate2::Decompress,
) -> Result<(), String> {
    /// The largest dictionary of an LZMA block; VTK and meshio use 8 MB.
    const LZMA_MEMORY: u64 = 100 << 20;
    let filled = match compressor {
        Compressor::None => return Err("it is not compressed".into()),
        Compressor::Lz4 => {
            lz4_flex::block::decompress_into(bytes, slot).map_err(|error| error.to_string())?
        }
        Compressor::Zlib => {
            zlib.reset(true);
            let status = zlib
                .decompress(bytes, slot, flate2::FlushDecompress::Finish)
                .map_err(|error| error.to_string())?;
            if status != flate2::Status::StreamEnd {
                return Err("it unpacks to more than is declared, or is cut off".into());
            }
            zlib.total_out() as usize
        }
        Compressor::Lzma => {
            let mut decoder = liblzma::stream::Stream::new_stream_decoder(LZMA_MEMORY, 0)
                .map_err(|error| error.to_string())?;
            let status = decoder
                .process(bytes, slot, liblzma::stream::Action::Finish)
                .map_err(|error| error.to_string())?;
            if status != liblzma::stream::Status::StreamEnd {
                return Err("it unpacks to more than is declared, or is cut off".into());
            }
            decoder.total_out() as usize
        }
    };
    if filled != slot.len() {
        return Err(format!("it unpacks to {filled} bytes, not {}", slot.len()));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::pack::{Packed, pack};
    use super::*;

    /// One byte of zlib's end missing, or one byte of data more than declared.
    #[test]
    fn blocks_end_where_they_say() {
        let Packed { blocks, .. } =
            pack(100, |_, bytes| bytes.fill(7), Compressor::Zlib).expect("packed");
        let block = &blocks[0];
        let mut zlib = flate2::Decompress::new(true);
        let mut unpack = |bytes: &[u8], length: usize| {
            decompress(bytes, &mut vec![0; length], Compressor::Zlib, &mut zlib).is_ok()
        };
        assert!(unpack(block, 100));
        assert!(!unpack(&block[..block.len() - 1], 100));
        assert!(!unpack(block, 99));
        assert!(!unpack(block, 101));
    }
}
