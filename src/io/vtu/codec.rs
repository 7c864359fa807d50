//! Bytes of one array as VTU packs them: a header of lengths, then the bytes, perhaps in compressed blocks.

use super::Compressor;
use std::io::Read;

/// Bytes that are compressed together. VTK's own default is 32 kB; larger blocks pack better and read as well.
const BLOCK: usize = 1 << 18;

/// An array's header and its body, ready to be written in either encoding.
pub(super) struct Packed {
    /// Lengths, as little-endian 64-bit words.
    pub header: Vec<u8>,
    pub body: Vec<u8>,
}

/// Packs the bytes of one array with 64-bit headers.
pub(super) fn pack(bytes: Vec<u8>, compressor: Compressor) -> std::io::Result<Packed> {
    if compressor == Compressor::None {
        return Ok(Packed {
            header: (bytes.len() as u64).to_le_bytes().to_vec(),
            body: bytes,
        });
    }
    let blocks = bytes
        .chunks(BLOCK)
        .map(|block| compress(block, compressor))
        .collect::<std::io::Result<Vec<_>>>()?;
    let words = [blocks.len(), BLOCK, bytes.len() % BLOCK];
    let lengths = blocks.iter().map(Vec::len);
    Ok(Packed {
        header: words
            .into_iter()
            .chain(lengths)
            .flat_map(|word| (word as u64).to_le_bytes())
            .collect(),
        body: blocks.concat(),
    })
}

fn compress(block: &[u8], compressor: Compressor) -> std::io::Result<Vec<u8>> {
    let mut packed = Vec::new();
    match compressor {
        Compressor::None => packed.extend_from_slice(block),
        Compressor::Lz4 => packed = lz4_flex::block::compress(block),
        Compressor::Zlib => {
            flate2::read::ZlibEncoder::new(block, flate2::Compression::new(4))
                .read_to_end(&mut packed)?;
        }
        Compressor::Lzma => {
            liblzma::read::XzEncoder::new(block, 3).read_to_end(&mut packed)?;
        }
    }
    Ok(packed)
}
