//! Bytes of one array as VTU packs them: a header of lengths, then the bytes, perhaps in compressed blocks.

use super::Compressor;
use crate::parallel;
use std::io::Read;

/// Bytes that are compressed together.
const BLOCK: usize = 1 << 16;
/// Within a few percent of the highest level for meshes, in half of the time; level 1 takes twice the bytes.
const ZLIB_LEVEL: u32 = 2;
const LZMA_LEVEL: u32 = 3;

/// An array's header and its body, ready to be written in either encoding.
pub(super) struct Packed {
    /// Lengths, as little-endian 64-bit words.
    pub header: Vec<u8>,
    /// One after the other, the body.
    pub blocks: Vec<Vec<u8>>,
}

impl Packed {
    pub fn len(&self) -> usize {
        self.header.len() + self.blocks.iter().map(Vec::len).sum::<usize>()
    }
}

/// Packs the bytes of one array with 64-bit headers; `fill` makes them from an offset on. Blocks are packed separately,
/// so that the number of threads does not matter.
pub(super) fn pack(
    length: usize,
    fill: impl Fn(usize, &mut [u8]) + Sync,
    compressor: Compressor,
) -> std::io::Result<Packed> {
    if compressor == Compressor::None {
        let mut bytes = vec![0; length];
        fill(0, &mut bytes);
        return Ok(Packed {
            header: (length as u64).to_le_bytes().to_vec(),
            blocks: vec![bytes],
        });
    }
    let level = flate2::Compression::new(ZLIB_LEVEL);
    let scratch = || (flate2::Compress::new(level, true), vec![0; BLOCK]);
    let places = (0..length).step_by(BLOCK);
    let blocks = parallel::map_with(scratch, places, |(zlib, bytes), place| {
        let bytes = bytes.split_at_mut(BLOCK.min(length - place)).0;
        fill(place, bytes);
        compress(bytes, compressor, zlib)
    });
    let blocks = blocks.into_iter().collect::<std::io::Result<Vec<_>>>()?;
    let words = [blocks.len(), BLOCK, length % BLOCK];
    let lengths = blocks.iter().map(Vec::len);
    Ok(Packed {
        header: words
            .into_iter()
            .chain(lengths)
            .flat_map(|word| (word as u64).to_le_bytes())
            .collect(),
        blocks,
    })
}

/// `zlib` is reused, as its tables take longer to make than a block to compress.
fn compress(
    block: &[u8],
    compressor: Compressor,
    zlib: &mut flate2::Compress,
) -> std::io::Result<Vec<u8>> {
    match compressor {
        Compressor::None => Ok(block.to_vec()),
        Compressor::Lz4 => Ok(lz4_flex::block::compress(block)),
        Compressor::Zlib => {
            zlib.reset();
            // Incompressible data grow by less than this.
            let mut packed = Vec::with_capacity(block.len() + block.len() / 8 + 128);
            let status = zlib.compress_vec(block, &mut packed, flate2::FlushCompress::Finish)?;
            if status != flate2::Status::StreamEnd {
                return Err(std::io::Error::other("zlib did not finish a block"));
            }
            packed.shrink_to_fit();
            Ok(packed)
        }
        Compressor::Lzma => {
            let mut packed = Vec::new();
            liblzma::read::XzEncoder::new(block, LZMA_LEVEL).read_to_end(&mut packed)?;
            Ok(packed)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::stream::Stream;
    use super::super::unpack::Packing;
    use super::*;

    fn pack_bytes(bytes: &[u8], compressor: Compressor) -> Packed {
        let fill = |place: usize, to: &mut [u8]| to.copy_from_slice(&bytes[place..][..to.len()]);
        pack(bytes.len(), fill, compressor).expect("packed")
    }

    #[test]
    fn every_length_around_a_block_comes_back() {
        for length in [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK] {
            let bytes: Vec<u8> = (0..length).map(|i| (i * i / 7) as u8).collect();
            for compressor in [
                Compressor::None,
                Compressor::Zlib,
                Compressor::Lz4,
                Compressor::Lzma,
            ] {
                let Packed { header, blocks } = pack_bytes(&bytes, compressor);
                let body = blocks.concat();
                let packing = Packing {
                    big_endian: false,
                    wide_headers: true,
                    compressor,
                };
                let file = [header, body].concat();
                let expected = Some(length as u64);
                assert_eq!(packing.declared(Stream::Raw(&file)).ok(), expected);
                let back = packing.unpack(Stream::Raw(&file), expected);
                assert!(*back.expect("sound") == *bytes, "{compressor:?} {length}");
            }
        }
    }

    /// The bytes of a file do not depend on the machine that writes it.
    #[test]
    fn threads_change_nothing() {
        let bytes: Vec<u8> = (0..20 * BLOCK).map(|i| (i * i / 977) as u8).collect();
        let packed = |threads, compressor| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().expect("threads");
            pool.install(|| pack_bytes(&bytes, compressor).blocks)
        };
        for compressor in [Compressor::Zlib, Compressor::Lz4] {
            let alone = packed(1, compressor);
            assert!(packed(7, compressor) == alone);
            // Nor do they depend on what was packed before.
            let last = pack_bytes(&bytes[19 * BLOCK..], compressor);
            assert!(last.blocks == alone[19..]);
        }
    }
}
